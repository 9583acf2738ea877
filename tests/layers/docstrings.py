# SPDX-License-Identifier: MIT
"""Finds public functions whose docstring does not explain their arguments and errors."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

# Methods of an add-on's classes that Blender calls, always with the same arguments.
BLENDERS = {"poll", "execute", "invoke", "modal", "draw", "draw_item", "filter_items"}

Function = ast.FunctionDef | ast.AsyncFunctionDef


def public_functions(tree: ast.Module) -> Iterator[tuple[str, Function]]:
    """(dotted name, definition) of the public functions and methods of a module.

    Names that begin with an underscore, and members of such classes, are not public. Overloads are
    skipped, because their definition has the docstring. Methods that Blender calls are skipped,
    because Blender's manual explains them.
    """
    for node in tree.body:
        if isinstance(node, Function) and _shown(node):
            yield node.name, node
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            for inner in node.body:
                if not (isinstance(inner, Function) and _shown(inner)):
                    continue
                if not (node.name.startswith("RISORIUS_") and inner.name in BLENDERS):
                    yield f"{node.name}.{inner.name}", inner


def _shown(node: Function) -> bool:
    overload = any(ast.unparse(mark).endswith("overload") for mark in node.decorator_list)
    return not node.name.startswith("_") and not overload


def arguments(node: Function) -> list[str]:
    """Names of a function's arguments, without self and cls."""
    given = node.args
    plain = [*given.posonlyargs, *given.args]
    stars = [star for star in (given.vararg, given.kwarg) if star]
    names = [argument.arg for argument in (*plain, *given.kwonlyargs, *stars)]
    return [name for name in names if name not in ("self", "cls")]


def unsaid(node: Function) -> list[str]:
    """Names of arguments that a docstring does not mention, and "Raises" if it omits errors.

    Only functions with at least two arguments are checked. The docstring must mention each
    argument, and errors if the function itself raises some, in Args and Raises or in sentences.
    """
    names = arguments(node)
    if len(names) < 2:
        return []
    text = ast.get_docstring(node) or ""
    words = set(re.findall(r"\w+", text))
    raises = any(isinstance(inner, ast.Raise) and inner.exc for inner in ast.walk(node))
    errors = ["Raises"] if raises and "raises" not in text.lower() else []
    return [name for name in names if name not in words] + errors
