# SPDX-License-Identifier: MIT
"""Finds uses of POSIX functions, listed in posix_only.toml, that Windows does not have."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

POSIX = tomllib.loads((Path(__file__).parent / "posix_only.toml").read_text(encoding="utf-8"))
# Function -> position of its argument `encoding`, counted from 0.
ENCODING_AT = {"open": 3, "read_text": 0, "write_text": 1}


def _imports(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and not node.level:
        yield node.module or ""
        yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _opens_text(node: ast.Call, name: str) -> bool:
    """Whether a call opens text without an encoding, which on Windows may not be UTF-8."""
    if name not in ENCODING_AT or (name == "open" and isinstance(node.func, ast.Attribute)):
        return False  # os.open, zipfile.open and others, which may read no text
    given = {keyword.arg: keyword.value for keyword in node.keywords}
    mode = (
        [*node.args[1:2], *(v for k, v in given.items() if k == "mode")] if name == "open" else []
    )
    if any("b" in str(value.value) for value in mode if isinstance(value, ast.Constant)):
        return False
    return not {"encoding", None} & set(given) and len(node.args) <= ENCODING_AT[name]


def _call(node: ast.Call) -> Iterator[str]:
    rules = POSIX["python"]
    yield from sorted({k.arg for k in node.keywords} & set(rules["arguments"]))
    function = node.func
    name = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    if _opens_text(node, name):
        yield f"{name} without an encoding"
    if isinstance(function, ast.Attribute) and name in rules["methods"]:
        yield f".{name}"


def of_python(text: str) -> list[str]:
    """`line: name` for each use in Python of functions that Windows lacks."""
    rules = POSIX["python"]
    modules, names = set(rules["modules"]), set(rules["names"])
    path = re.compile(rules["paths"])
    found: list[tuple[int, str]] = []
    for node in ast.walk(ast.parse(text)):
        what: list[str] = []
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            what = [n for n in _imports(node) if n.partition(".")[0] in modules or n in names]
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            what = [n for n in [f"{node.value.id}.{node.attr}"] if n in names]
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and path.match(node.value)
        ):
            what = [node.value]
        elif isinstance(node, ast.Call):
            what = list(_call(node))
        found += [(node.lineno, name) for name in what]
    return [f"{line}: {name}" for line, name in sorted(set(found))]


def of_cpp(text: str) -> list[str]:
    """`line: name` of each use of a POSIX function in C++; comments do not count."""
    rules = [re.compile(rule) for rule in POSIX["cpp"].values()]
    lines = enumerate((re.sub(r"//.*", "", line) for line in text.splitlines()), 1)
    return [
        f"{number}: {match[0].strip()}"
        for number, line in lines
        for rule in rules
        for match in rule.finditer(line)
    ]


def of_file(path: str, text: str) -> list[str]:
    if path.endswith((".h", ".cpp")):
        return of_cpp(text)
    return of_python(text) if path.endswith(".py") else []


def unmarked(files: Mapping[str, str]) -> list[str]:
    """`path:line: name` of each use in a file that posix_only.toml does not list.

    Also a sentence for each listed file without such uses.
    """
    used = {path: of_file(path, text) for path, text in files.items()}
    marked = POSIX["marked"]
    loose = [f"{path}:{use}" for path, uses in used.items() if path not in marked for use in uses]
    return loose + [f"{path}: marked, and uses nothing" for path in marked if not used.get(path)]
