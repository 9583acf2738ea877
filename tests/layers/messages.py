# SPDX-License-Identifier: MIT
"""Finds the errors and notes of the package that the add-on shows, for comparison with their
translations.
"""

import ast
import re
from pathlib import Path

# Rooms whose errors the add-on shows in Blender. Errors of other rooms appear only on the command
# line.
ROOMS = (
    *("anim", "anyhead", "author", "base", "controls", "expressions", "files", "gameface"),
    *("importing", "lightening", "live", "mixing", "ranges", "rigs", "solving", "speech", "web"),
)
# Lists of notes, which are sentences for the user that are no errors.
LISTS = ("notes", "note", "odd", "_pair_notes")
# Functions that return a note, a list of notes, or a part of a note.
AUTHORS = (
    *("_about", "_lowered", "_own_shapes", "_too_large", "_twice", "_what_is_wrong", "lists"),
    *("about_library", "away", "find_unit", "into_own_space", "said_of"),
)


def messages(package: Path) -> dict[str, str]:
    """Error or note with {} for each value -> the file that raises or writes it.

    Args:
        package: folder of the package `risorius`.
    """
    found = {}
    for room in ROOMS:
        for path in sorted((package / room).rglob("*.py")):
            source = path.read_text(encoding="utf-8")
            for text in raised(source) + noted(source):
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


def noted(source: str) -> list[str]:
    """The notes of three words or more in a source text.

    A note is a text that is appended to, added to or listed in a variable, an attribute or an
    argument whose name is in LISTS, or any text in the body of a function whose name is in
    AUTHORS. Texts inside the values of a note, such as ", ".join(...), are no notes.
    """
    texts: list[str] = []
    for node in ast.walk(ast.parse(source)):
        texts += [_template(text) for part in _writing(node) for text in _whole_texts(part)]
    return [text for text in dict.fromkeys(texts) if len(text.split()) > 2]


def without_names(text: str) -> str:
    """An English message of the table of translations, with {} for each {name}."""
    return re.sub(r"\{\w+\}", "{}", text)


def _writing(node: ast.AST) -> list[ast.AST]:
    """The parts of a statement or call that become notes."""
    if isinstance(node, ast.FunctionDef) and node.name in AUTHORS:
        return [part for part in node.body if not _is_docstring(part)]
    if isinstance(node, ast.Call):
        called = node.func
        if isinstance(called, ast.Attribute) and called.attr in ("append", "extend"):
            return [*node.args] if _is_list(called.value) else []
        return [word.value for word in node.keywords if word.arg in LISTS]
    if isinstance(node, ast.AugAssign | ast.AnnAssign):
        return [node.value] if node.value is not None and _is_list(node.target) else []
    if isinstance(node, ast.Assign):
        return [node.value] if any(map(_is_list, node.targets)) else []
    return []


def _is_list(node: ast.expr) -> bool:
    name = node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")
    return name in LISTS


def _is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _whole_texts(node: ast.AST) -> list[ast.expr]:
    """The texts in a syntax node.

    Texts inside the inserted values of another text, and texts in `raise` statements, are left out.
    """
    if isinstance(node, ast.Constant | ast.JoinedStr):
        return [node]
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add) and _template(node):
        return [node]
    if isinstance(node, ast.Raise):
        return []
    return [text for part in ast.iter_child_nodes(node) for text in _whole_texts(part)]


def _template(node: ast.expr) -> str:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) else "{}" for v in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return (_template(node.left) or "{}") + (_template(node.right) or "{}")
    return ""
