# SPDX-License-Identifier: MIT
"""Draw comments and sentences at random, for readers who judge whether they are clear.

    draw.py SEED OUT    writes OUT/comments.md and OUT/sentences.md, 100 items each

A comment is a docstring or a block of comment lines of C++ or Python. A sentence comes from a
Markdown page, an interface text or an error message. Each item shows the place in the project and
the text as its readers see it: a comment with its signature, the docstring of its file, and the
class or function around it with the first sentence of its docstring; a sentence of a page with its
paragraph and headings, in a list also with the sentence before the list; an interface text with the
labels around it; an error message after its place, with the function that raises it. {...} stands
for a value that a user sees. The code itself is not shown.
"""

import ast
import random
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import interface_uses

PROJECT = Path(__file__).resolve().parents[2]
COUNT = 100
Item = tuple[str, str, str, str]  # place, context, name of the described thing, text
Described = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
_DESCRIBED = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
_NOT_DECLARED = re.compile(r"\s*(\}|if|for|while|else|switch|case|do|try|namespace|extern)\b")
_CONTINUES = re.compile(r"[^;{}:]$")  # a line of C++ whose statement goes on in the next line
_NOT_PROSE = re.compile(r"SPDX|noqa|type:|NOLINT|clang-format|-{4}")


def files(*patterns: str) -> list[Path]:
    """The committed files that match any of the patterns of git."""
    listed = subprocess.check_output(["git", "ls-files", "-z", *patterns], cwd=PROJECT, text=True)
    return [PROJECT / name for name in listed.split("\0") if name]


def one_line(text: str) -> str:
    """The text with each run of white space as one blank."""
    return " ".join(text.split())


def place_of(path: Path) -> str:
    """The path of a file in the project, with slashes."""
    return path.relative_to(PROJECT).as_posix()


def python_comments(path: Path) -> Iterator[Item]:
    """Docstrings and comment blocks of a Python file."""
    source = path.read_text(encoding="utf-8")
    lines, tree = source.splitlines(), ast.parse(source)
    about = one_line(ast.get_docstring(tree) or "")
    nodes = [node for node in ast.walk(tree) if isinstance(node, _DESCRIBED)]
    for node in nodes:
        text = ast.get_docstring(node)
        if text:
            number, context = node.lineno, about + around(nodes, node.lineno, lines)
            yield f"{place_of(path)}:{number}", context, signature(node, lines), text
    if about:
        yield place_of(path), "", "the file", ast.get_docstring(tree) or ""
    for place, _, name, text in blocks(path, lines, about, "#"):
        number = int(place.rpartition(":")[2])
        yield place, about + around(nodes, number, lines), name, text


def signature(node: Described, lines: list[str]) -> str:
    """The lines of a definition before its docstring, as one line."""
    return one_line(" ".join(lines[node.lineno - 1 : node.body[0].lineno - 1]))


def around(nodes: list[Described], number: int, lines: list[str]) -> str:
    """The definitions around a line: signature and first sentence of the docstring of each.

    Args:
        nodes: all definitions of the file.
        number: number of the line, from 1; a definition that begins there is not one of them.
        lines: lines of the file.
    """
    out = ""
    for node in nodes:
        if node.lineno < number <= (node.end_lineno or node.lineno):
            said = one_line(ast.get_docstring(node) or "").partition(". ")[0]
            out += f" | inside: {signature(node, lines)} {said}"
    return out


def cpp_comments(path: Path) -> Iterator[Item]:
    """Comment blocks of a C++ file; one about the file is part of the context of the others."""
    lines = path.read_text(encoding="utf-8").splitlines()
    found = list(blocks(path, lines, "", "//"))
    of_file = [text for _, _, name, text in found[:1] if not name or name.startswith("#")]
    for place, _, name, text in found:
        about = "".join(one_line(first) for first in of_file if first != text)
        number = int(place.rpartition(":")[2])
        code = next((k for k in range(number, len(lines)) if lines[k].strip() == name), None)
        shown = name if code is None else declaration(lines, code)
        yield place, about + cpp_around(lines, number), shown, text


def declaration(lines: list[str], number: int) -> str:
    """The code from a line to the end of its brackets, at most eight lines, as one line.

    Args:
        lines: lines of a C++ file.
        number: index of the first line.
    """
    out = ""
    for line in lines[number : number + 8]:
        out += " " + line.partition(" //")[0]
        if out.count("(") <= out.count(")") and not line.strip().startswith("template"):
            break
    return one_line(out)


def cpp_around(lines: list[str], number: int) -> str:
    """Classes and functions around a line of C++: declaration and first sentence of the comment.

    Args:
        lines: lines of the file, with the indentation of clang-format.
        number: number of the line, from 1.
    """
    out, indent = "", _indent(lines[number - 1])
    for k in range(number - 2, -1, -1):
        line = lines[k]
        if not line.strip() or _indent(line) >= indent or line.startswith("#"):
            continue
        indent = _indent(line)
        if not line.endswith("{") or _NOT_DECLARED.match(line):
            continue
        first = k
        while first and _goes_on(lines[first - 1], indent):
            first -= 1
        above = first
        while above and lines[above - 1].strip().startswith("//"):
            above -= 1
        said = one_line(" ".join(part.strip().lstrip("/! ") for part in lines[above:first]))
        shown = one_line(" ".join(lines[first : k + 1]))
        out = f" | inside: {shown} {said.partition('. ')[0]}{out}"
    return out


def _goes_on(line: str, indent: int) -> bool:
    """Whether a line has the indentation `indent` and its declaration goes on in the next line."""
    return _indent(line) == indent and bool(_CONTINUES.search(line)) and "//" not in line


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def blocks(path: Path, lines: list[str], about: str, mark: str) -> Iterator[Item]:
    """Blocks of lines that begin with a comment mark, each with the line of code after it.

    Args:
        path: file in the project.
        lines: lines of the file.
        about: docstring of the file, or "".
        mark: "#" or "//".
    """
    start = None
    for number, line in enumerate([*lines, ""]):
        is_comment = line.strip().startswith(mark)
        if is_comment and start is None:
            start = number
        if not is_comment and start is not None:
            prose = [part for part in lines[start:number] if "SPDX" not in part]
            text = "\n".join(part.strip().lstrip("/#!<").rstrip() for part in prose)
            if len(text.split()) > 3 and not _NOT_PROSE.match(text.strip()):
                yield f"{place_of(path)}:{start + 1}", about, line.strip(), text
            start = None


def page_sentences(path: Path) -> Iterator[Item]:
    """Sentences of a Markdown page without its code blocks, tables and headings."""
    text = re.sub(r"```\w*\n(.*?)```", _indented, path.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"^(#+ .*)$", r"\n\1\n", text, flags=re.M)
    headings: list[str] = []
    lead = ""
    paragraphs = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )", text)
    for paragraph, after in zip(paragraphs, [*paragraphs[1:], ""], strict=True):
        whole, is_item = one_line(paragraph), re.match(r"\s*(?:[-*]|\d+\.) ", paragraph)
        if not is_item and paragraph.startswith("    "):  # code
            continue
        if whole.startswith("#"):
            headings, lead = [*headings[:1], whole.lstrip("# ")], ""
        elif "|" in paragraph:
            lead = ""
        else:
            lead = lead if is_item else whole
            context = f"{lead} {whole}" if is_item and lead.endswith(":") else whole
            if whole.endswith(":"):
                context += f" {one_line(after)[:300]}"
            for sentence in re.split(r"(?<=[.!?])\s+(?=[A-Z*`\[])", whole):
                if len(sentence.split()) > 3 and not sentence.startswith("!["):
                    yield place_of(path), context, " > ".join(headings) or path.stem, sentence


def _indented(block: re.Match[str]) -> str:
    """A fenced code block as an indented one, so that a sentence before it shows it as context."""
    return "\n" + "".join(f"    {line}\n" for line in block[1].splitlines()) + "\n"


def interface_sentences() -> Iterator[Item]:
    """Labels, tooltips and messages of the extension. The German translation lists all of them."""
    table = PROJECT / "addon/risorius/language/interface_de.toml"
    listed = tomllib.loads(table.read_text(encoding="utf-8")).values()
    texts = {text for some in listed for text in some if len(text.split()) > 3}
    uses = interface_uses.uses_in(files("addon/*.py"), texts)
    for path in files("native/python/*.toml"):
        source = path.read_text(encoding="utf-8")
        about = one_line(source.partition("\n\n")[0].replace("#", "").partition("MIT\n")[2])
        for text in texts - uses.keys():
            if f'"{text}"' in source or f'"{text.replace("right", "left")}"' in source:
                uses[text] = [("label", about)]
    for text in texts:
        kinds = " / ".join(dict.fromkeys(kind for kind, _ in uses.get(text, [])))
        contexts = " // ".join(dict.fromkeys(names for _, names in uses.get(text, [])[:3]))
        yield "interface", contexts, kinds or "label in Blender", text


def error_messages() -> Iterator[Item]:
    """Messages of raise statements, with the functions and classes around them."""
    for path in files("addon/*.py", "native/python/*.py"):
        source = path.read_text(encoding="utf-8")
        lines, tree = source.splitlines(), ast.parse(source)
        about = one_line(ast.get_docstring(tree) or "")
        nodes = [node for node in ast.walk(tree) if isinstance(node, _DESCRIBED)]
        for node in ast.walk(tree):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args:
                text = _message(node.exc)
                if text:
                    context = f"raised by: {about}{around(nodes, node.lineno, lines)}"
                    yield f"{place_of(path)}:{node.lineno}", context, "error message", text


def _message(call: ast.Call) -> str:
    """The message of an error, after its place; "" if the text comes from another function.

    Args:
        call: the error, or a call such as `document.fail(place, message)` that makes it.
    """
    texts = [_literal(arg) for arg in call.args]
    found = next((at for at in (-1, 0) if len(texts[at].split()) > 3), None)
    if found is None:
        return ""
    text = texts.pop(found)
    rest = [arg for arg in call.args if arg is not call.args[found]]
    places = [said or f"{{{ast.unparse(arg)}}}" for said, arg in zip(texts, rest, strict=True)]
    name = ast.unparse(call.func)
    if name.endswith(("fail", "error")):
        places.insert(0, "{file}")
    elif name == "GivenError":
        places.insert(0, "{file and field}")
    places += [f"{k.arg} {{{k.arg}}}" for k in call.keywords if k.arg in ("line", "column")]
    return ": ".join([*places, text])


def _literal(node: ast.expr) -> str:
    """The text of a message; a value that is filled in appears as its expression in braces."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if not isinstance(node, ast.JoinedStr):
        return ""
    return "".join(
        "{" + ast.unparse(part.value) + "}"
        if isinstance(part, ast.FormattedValue)
        else _literal(part)
        for part in node.values
    )


def write(path: Path, items: list[Item], chosen: random.Random) -> None:
    """Write the drawn items as a Markdown list."""
    every = sorted(set(items))
    parts = []
    for number, (place, context, name, text) in enumerate(chosen.sample(every, COUNT), 1):
        shown = [f"## {number}. {place}", f"describes: {name}"]
        if context and context != text:
            shown.append(f"context: {context}")
        parts.append("\n".join([*shown, "", text.strip(), ""]))
    path.write_text("\n".join(parts), encoding="utf-8")
    print(f"{path}: {COUNT} of {len(every)}")


def main() -> int:
    """Draw with the seed of the command line."""
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    chosen, out = random.Random(int(sys.argv[1])), Path(sys.argv[2])
    out.mkdir(parents=True, exist_ok=True)
    comments = [item for path in files("*.py") for item in python_comments(path)]
    comments += [item for path in files("*.h", "*.cpp") for item in cpp_comments(path)]
    sentences = [item for path in files("*.md") for item in page_sentences(path)]
    sentences += [*interface_sentences(), *error_messages()]
    write(out / "comments.md", comments, chosen)
    write(out / "sentences.md", sentences, chosen)
    return 0


if __name__ == "__main__":
    sys.exit(main())
