# SPDX-License-Identifier: MIT
"""Draw comments and sentences at random, for readers who judge whether they are clear.

    draw.py SEED OUT    writes OUT/comments.tsv and OUT/sentences.tsv, 100 rows each

A comment is a docstring or a block of comment lines of C++ or Python. A sentence is one of a
Markdown page, an interface text or an error message. Each row has a number, the place in the
project, the name that the text describes, and the text. A reader gets the rows without the code.
"""

import ast
import random
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
COUNT = 100
Row = tuple[str, str, str]  # place, name, text


def files(*patterns: str) -> list[Path]:
    """The committed files that match any of the patterns of git."""
    listed = subprocess.check_output(["git", "ls-files", "-z", *patterns], cwd=PROJECT, text=True)
    return [PROJECT / name for name in listed.split("\0") if name]


def one_line(text: str) -> str:
    """The text with each run of white space as one blank."""
    return " ".join(text.split())


def python_comments(path: Path) -> Iterator[Row]:
    """Docstrings and comment blocks of a Python file."""
    source = path.read_text(encoding="utf-8")
    place = path.relative_to(PROJECT).as_posix()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Module):
            text = ast.get_docstring(node)
            if text:
                yield f"{place}:{getattr(node, 'lineno', 1)}", getattr(node, "name", "module"), text
    lines = source.splitlines()
    yield from blocks(place, lines, "#")


def blocks(place: str, lines: list[str], mark: str) -> Iterator[Row]:
    """Blocks of lines that begin with a comment mark, each with the first line of code after it.

    Args:
        place: path of the file in the project.
        lines: of the file.
        mark: "#" or "//".
    """
    start = None
    for number, line in enumerate([*lines, ""]):
        is_comment = line.strip().startswith(mark)
        if is_comment and start is None:
            start = number
        if not is_comment and start is not None:
            text = one_line(" ".join(part.strip().lstrip("/#!<").strip() for part in lines[start:number]))
            if len(text.split()) > 3 and not re.match(r"SPDX|noqa|type:|NOLINT|clang-format|-{4}", text):
                yield f"{place}:{start + 1}", one_line(line)[:120], text
            start = None


def cpp_comments(path: Path) -> Iterator[Row]:
    """Comment blocks of a C++ file."""
    place = path.relative_to(PROJECT).as_posix()
    yield from blocks(place, path.read_text(encoding="utf-8").splitlines(), "//")


def markdown_sentences(path: Path) -> Iterator[Row]:
    """Sentences of a Markdown page without code blocks, tables and headings."""
    place = path.relative_to(PROJECT).as_posix()
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.S)
    heading = path.stem
    for paragraph in re.split(r"\n\s*\n|\n(?=\s*[-*\d]+\.? )", text):
        if paragraph.lstrip().startswith("#"):
            heading = paragraph.strip().splitlines()[0].lstrip("# ")
            continue
        if "|" in paragraph:
            continue
        for sentence in re.split(r"(?<=[.!?])\s+(?=[A-Z*`\[])", one_line(paragraph)):
            if len(sentence.split()) > 3 and not sentence.startswith("!["):
                yield place, heading, sentence


def interface_sentences() -> Iterator[Row]:
    """Tooltips and labels, which the German table lists, and error messages of both packages."""
    table = PROJECT / "addon/risorius/language/interface_de.toml"
    for text in _texts(tomllib.loads(table.read_text(encoding="utf-8"))):
        if len(text.split()) > 3:
            yield "interface", "tooltip, label or report in Blender", one_line(text)
    for path in files("addon/*.py", "native/python/*.py", "people/*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
                text = _literal(node.exc.args[-1])
                if len(text.split()) > 3:
                    place = f"{path.relative_to(PROJECT).as_posix()}:{node.lineno}"
                    yield place, "error message", one_line(text)


def _texts(table: dict[str, object]) -> Iterator[str]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _texts(value)
        else:
            yield key


def _literal(node: ast.expr) -> str:
    """The text of a message; a value that is filled in stands as its expression in braces."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        parts = [_literal(v) if isinstance(v, ast.Constant) else "{" + ast.unparse(v.value) + "}" for v in node.values]
        return "".join(parts)
    return ""


def write(path: Path, rows: list[Row], chosen: random.Random) -> None:
    """Write the drawn rows as a table with tabs between the columns."""
    drawn = chosen.sample(sorted(set(rows)), COUNT)
    lines = [f"{number}\t{place}\t{one_line(name)}\t{one_line(text)}" for number, (place, name, text) in enumerate(drawn, 1)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print(f"{path}: {COUNT} of {len(set(rows))}")


def main() -> int:
    """Draw with the seed of the command line."""
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    chosen, out = random.Random(int(sys.argv[1])), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    comments = [row for path in files("*.py") for row in python_comments(path)]
    comments += [row for path in files("*.h", "*.cpp") for row in cpp_comments(path)]
    sentences = [row for path in files("*.md") for row in markdown_sentences(path)]
    sentences += list(interface_sentences())
    write(out / "comments.tsv", comments, chosen)
    write(out / "sentences.tsv", sentences, chosen)
    return 0


if __name__ == "__main__":
    sys.exit(main())
