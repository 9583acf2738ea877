# SPDX-License-Identifier: MIT
"""Finds the error messages of the package that the add-on shows, to compare them with a table."""

import ast
import re
from pathlib import Path

# Folders whose errors reach Blender's interface. Only the command line shows all other errors.
ROOMS = (
    *("anim", "anyhead", "author", "base", "controls", "expressions", "files", "gameface"),
    *("importing", "lightening", "live", "mixing", "ranges", "rigs", "solving", "speech", "web"),
)


def messages(package: Path) -> dict[str, str]:
    """Message with {} for each value -> the file that raises it.

    Args:
        package: folder of the package `risorius`.
    """
    found = {}
    for room in ROOMS:
        for path in sorted((package / room).rglob("*.py")):
            for text in raised(path.read_text(encoding="utf-8")):
                found.setdefault(text, path.relative_to(package).as_posix())
    return found


def raised(source: str) -> list[str]:
    """The messages of three words or more in the `raise` statements of a source text."""
    texts = (
        _template(node.exc.args[-1])
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args
    )
    return [text for text in texts if len(text.split()) > 2]


def without_names(text: str) -> str:
    """A row of the table with {} for each {name}."""
    return re.sub(r"\{\w+\}", "{}", text)


def _template(node: ast.expr) -> str:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) else "{}" for v in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return (_template(node.left) or "{}") + (_template(node.right) or "{}")
    return ""
