# SPDX-License-Identifier: MIT
"""Finds the package's error messages that the add-on shows, for comparison with a table."""

import ast
import re
from pathlib import Path

# Rooms whose errors the add-on shows in Blender. Errors of other rooms appear only on the command
# line.
ROOMS = (
    *("anim", "anyhead", "author", "base", "controls", "expressions", "files", "gameface"),
    *("importing", "lightening", "live", "mixing", "ranges", "rigs", "solving", "speech", "web"),
)


def messages(package: Path) -> dict[str, str]:
    """Error message with {} for each value -> the file that raises it.

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
    """Messages with three words or more in the `raise` statements of a source text."""
    texts = (
        _template(node.exc.args[-1])
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args
    )
    return [text for text in texts if len(text.split()) > 2]


def without_names(text: str) -> str:
    """An English message of the table, with {} for each {name}."""
    return re.sub(r"\{\w+\}", "{}", text)


def _template(node: ast.expr) -> str:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) else "{}" for v in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return (_template(node.left) or "{}") + (_template(node.right) or "{}")
    return ""
