# SPDX-License-Identifier: MIT
"""Finds Any in the public types of a module: of arguments, results, members and aliases."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from contextlib import suppress


def shown_any(tree: ast.Module) -> list[str]:
    """Dotted names of a module's public functions, members and variables whose types contain Any.

    Variables inside functions are not public, nor are names with a leading underscore, except
    __init__.
    """
    return [name for name, types in _shown(tree.body, "") if any(map(_has_any, types))]


def _shown(body: list[ast.stmt], owner: str) -> Iterator[tuple[str, list[ast.AST | None]]]:
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and _public(node.name):
            given = ast.walk(node.args)
            kinds = [argument.annotation for argument in given if isinstance(argument, ast.arg)]
            yield owner + node.name, [*kinds, node.returns]
        elif isinstance(node, ast.ClassDef) and _public(node.name):
            yield from _shown(node.body, f"{owner}{node.name}.")
        elif isinstance(node, ast.AnnAssign) and _public(ast.unparse(node.target)):
            yield owner + ast.unparse(node.target), [node.annotation, node.value]
        elif isinstance(node, ast.Assign):
            names = filter(_public, map(ast.unparse, node.targets))
            yield from ((owner + name, [node.value]) for name in names)
        elif isinstance(node, ast.If):
            yield from _shown([*node.body, *node.orelse], owner)


def _public(name: str) -> bool:
    return not name.startswith("_") or name == "__init__"


def _has_any(kind: ast.AST | None) -> bool:
    """Whether a type expression contains Any, also inside a string annotation."""
    if kind is None:
        return False
    parts = list(ast.walk(kind))
    for text in [node.value for node in parts if isinstance(node, ast.Constant)]:
        if (isinstance(text, str) and "[" in text) or text == "Any":
            with suppress(SyntaxError):
                parts.extend(ast.walk(ast.parse(text, mode="eval")))
    names = [getattr(node, "id", getattr(node, "attr", None)) for node in parts]
    return "Any" in names
