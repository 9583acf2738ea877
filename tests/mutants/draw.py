# SPDX-License-Identifier: MIT
"""Draws mutants, source lines changed by the rules of universalmutator, by a seed."""

from __future__ import annotations

import ast
import contextlib
import io
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

RULES = {
    ".py": ["universal.rules", "python.rules"],
    ".cpp": ["universal.rules", "c_like.rules", "cpp.rules"],
}
RULES[".h"] = RULES[".cpp"]
NO_CODE = ("#", "using ", "namespace ", "struct ", "class ", "template")
SIGNATURE = re.compile(r"[\w:<>,&*\s]+[ *&][\w:]+\((const |bool |float |double |std::)")
OPERATORS = "+-*/%<>=&|!"
STATEMENT = re.compile(r"\*?[\w:.>\[\]()-]+(\s*[-+|&*/^]?=|\().*;$")
# Words that a mutant may replace by another word.
WORDS = {"min", "max", "begin", "end", "any_of", "all_of", "none_of", "front_inserter",
         "back_inserter", "min_element", "max_element", "break", "continue"}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A source line with a change."""

    path: str  # from the root of the project
    line: int  # counted from 1
    before: str
    after: str

    def applied(self, source: str) -> str:
        """The source text with the changed line.

        Raises:
            ValueError: the line of the source is not `before`.
        """
        lines = source.splitlines(keepends=True)
        if lines[self.line - 1] != self.before:
            raise ValueError(f"{self.path}:{self.line} is no longer {self.before.strip()!r}")
        lines[self.line - 1] = self.after
        return "".join(lines)


def drawn(root: Path, paths: list[str], seed: int) -> Iterator[Mutant]:
    """Yields one mutant for each line that has mutants, in random order.

    Args:
        root: The project's folder.
        paths: Source files, relative to the root.
        seed: Seed of the order and of the choice.
    """
    choose = random.Random(seed)
    lines = []
    for path in sorted(paths):
        source = (root / path).read_text(encoding="utf-8").splitlines(keepends=True)
        lines += [(path, number) for number, line in enumerate(source, 1) if line.strip()]
    choose.shuffle(lines)
    tables: dict[str, dict[int, list[str]]] = {}
    for path, number in lines:
        text = (root / path).read_text(encoding="utf-8")
        source = text.splitlines(keepends=True)
        if path not in tables:
            tables[path] = _mutants(source, RULES[Path(path).suffix])
        found = sorted(tables[path].get(number, []))
        choose.shuffle(found)
        for after in found:
            mutant = Mutant(path, number, source[number - 1], after)
            if not _whole_words(source[number - 1], after):
                continue
            if not path.endswith(".py") and not _may_build(source, number, after):
                continue
            if _differs(path, text, mutant.applied(text)):
                yield mutant
                break


def _mutants(source: list[str], rules: list[str]) -> dict[int, list[str]]:
    from universalmutator import mutator

    with contextlib.redirect_stdout(io.StringIO()):  # universalmutator prints its rules
        found = mutator.mutants_regexp(source, ruleFiles=rules, ignorePatterns=[])
    table: dict[int, list[str]] = {}
    for number, after, *_ in found:
        table.setdefault(number, []).append(after)
    return table


def _differs(path: str, before: str, after: str) -> bool:
    """Whether a mutant changes the program, not only a comment, docstring or annotation."""
    if not path.endswith(".py"):
        return _bare(before) != _bare(after)
    try:
        compile(after, path, "exec", dont_inherit=True)  # also detects `continue` outside of loops
        return _tree(after) != _tree(before)
    except (SyntaxError, ValueError):
        return False


def _same(before: str, after: str) -> int:
    """The number of equal characters at the beginning of two lines."""
    pairs = enumerate(zip(before, after, strict=False))
    return next((i for i, (a, b) in pairs if a != b), min(len(before), len(after)))


def _whole_words(before: str, after: str) -> bool:
    """Whether a mutant changes no part of a word, apart from words that may be replaced.

    The rules also match `end` in `blend`, but an unknown name would fail at once.
    """
    same = _same(before, after)
    words = [w for w in re.finditer(r"[A-Za-z_]\w*", before) if w.start() < same < w.end()]
    return not words or words[0].group() in WORDS


def _may_build(lines: list[str], number: int, after: str) -> bool:
    """Whether a changed line of C++ may compile; the rules know neither words nor types.

    Operators must have spaces around them, as clang-format writes them. Statements must be removed
    as a whole. `break` and `continue` must be inside a loop.

    Args:
        lines: The lines of the source.
        number: Number of the line, from 1.
        after: The mutated line.
    """
    before = lines[number - 1]
    code = before.split("//")[0].strip()
    if not code or code.startswith(NO_CODE) or SIGNATURE.match(code):
        return False
    if after.lstrip().startswith("/*"):
        return bool(STATEMENT.match(code)) and _brackets(code) == 0
    if after.startswith(before) and after.strip().endswith(("break;", "continue;")):
        return code.endswith(";") and _brackets(code) == 0 and _in_loop(lines, number)
    same = next(i for i, (a, b) in enumerate(zip(before, after, strict=False)) if a != b)
    word = next(
        (w for w in re.finditer(r"[A-Za-z_]\w*", before) if w.start() < same < w.end()), None
    )
    if word is not None and word.group() not in WORDS:
        return False
    if _brackets(before) != _brackets(after):
        return False
    start = same
    while before[start - 1] in OPERATORS:
        start -= 1
    operator = re.match(r"[-+*/%<>=&|!]*", before[start:]).group()
    spaced = before[start - 1] == " " == before[start + len(operator)]
    stepped = operator in ("++", "--") and after[start : start + 2] in ("++", "--")
    return not operator or operator == "!" or spaced or stepped


def _in_loop(lines: list[str], number: int) -> bool:
    """Whether a line is inside a loop, judged by indentation."""
    inner = len(lines[number - 1]) - len(lines[number - 1].lstrip())
    for line in reversed(lines[: number - 1]):
        indent = len(line) - len(line.lstrip())
        if line.strip() and indent < inner:
            inner = indent
            if re.match(r"(for|while|do)\b", line.strip()):
                return True
    return False


def _brackets(code: str) -> int:
    return sum(code.count(c) for c in "([{") - sum(code.count(c) for c in ")]}")


def _bare(source: str) -> str:
    """C++ source text without comments and white space."""
    return re.sub(r"\s+", "", re.sub(r"//[^\n]*|/\*.*?\*/", "", source, flags=re.DOTALL))


def _tree(source: str) -> str:
    tree = ast.parse(source)
    for node in ast.walk(tree):
        for part in ("body", "orelse", "finalbody"):
            if isinstance(getattr(node, part, None), list):
                setattr(node, part, [n for n in getattr(node, part) if not _says_nothing(n)])
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        if isinstance(node, ast.arg):
            node.annotation = None
        if isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(None)
    return ast.dump(tree)


def _says_nothing(node: ast.AST) -> bool:
    """Whether a statement has no effect: a string, `pass`, `__future__`, or imports for types."""
    text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    future = isinstance(node, ast.ImportFrom) and node.module == "__future__"
    types = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    return text or future or types or isinstance(node, ast.Pass)
