# SPDX-License-Identifier: MIT
"""Finds phrases that phrases.toml forbids in comments and docstrings."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

_TABLE = tomllib.loads((Path(__file__).parent / "phrases.toml").read_text(encoding="utf-8"))
PHRASES: dict[str, dict[str, str]] = _TABLE["phrases"]
TO_REWRITE: list[str] = _TABLE["rooms_to_rewrite"]
FOLDERS = {
    "native": (".h", ".cpp", ".py", ".pyi", ".js", ".toml", ".md"),
    "tests": (".h", ".cpp", ".md"),
}
_MARKS = re.compile(r"(?:^|\s)(?:///?|/\*\*?|^ +\*)\s(.*)")
_HASH = re.compile(r"(?:^|\s)#\s(.*)")
_PATTERNS = {
    name: re.compile(phrase["is"].replace(" ", r"\s+"), re.IGNORECASE)
    for name, phrase in PHRASES.items()
}


def files(root: Path) -> dict[str, str]:
    """Path below root -> text of each file in FOLDERS with one of their endings."""
    return {
        path.relative_to(root).as_posix(): path.read_text(encoding="utf-8")
        for folder, kinds in FOLDERS.items()
        for path in sorted((root / folder).rglob("*"))
        if path.suffix in kinds
    }


def prose(path: str, text: str) -> Iterator[tuple[int, str]]:
    """(first line, text) of each comment, consecutive lines joined, and of each docstring.

    A Markdown file is one text.
    """
    suffix = Path(path).suffix
    if suffix == ".md":
        yield 1, text
        return
    note = _HASH if suffix in (".py", ".pyi", ".toml") else _MARKS
    begin, block, last = 0, [], -1
    for number, line in enumerate(text.splitlines(), 1):
        found = note.search(line)
        if found is None:
            continue
        if number != last + 1 and block:
            yield begin, "\n".join(block)
            block = []
        begin = begin if block else number
        block.append(found[1])
        last = number
    if block:
        yield begin, "\n".join(block)
    if suffix in (".py", ".pyi"):
        yield from _docstrings(text)


def _docstrings(text: str) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(text)):
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            yield value.lineno, value.value


def found(path: str, text: str) -> list[str]:
    """A sentence for each forbidden phrase of a file, with its line and a better phrase."""
    out = []
    for first, block in prose(path, text):
        for name, pattern in _PATTERNS.items():
            for match in pattern.finditer(block):
                line = first + block.count("\n", 0, match.start())
                words = " ".join(match[0].split())
                out.append(f"{path}:{line}: {words!r}: {PHRASES[name]['better']}")
    return out


def room(path: str) -> str | None:
    """The entry of rooms_to_rewrite that contains a file; None: phrases are forbidden in it."""
    return next((entry for entry in TO_REWRITE if path.startswith(entry)), None)


def findings(texts: Mapping[str, str]) -> tuple[list[str], set[str]]:
    """(phrases found outside rooms_to_rewrite, entries of that list with phrases found)."""
    out, open_rooms = [], set()
    for path, text in texts.items():
        entry = room(path)
        if entry is None:
            out += found(path, text)
        elif entry not in open_rooms and found(path, text):
            open_rooms.add(entry)
    return out, open_rooms
