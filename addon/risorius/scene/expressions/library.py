# SPDX-License-Identifier: GPL-3.0-or-later
"""Where expressions come from: Risorius, a folder shared between files, and this file.

A library is a folder with a TOML file for each expression, in the form of risorius.expressions, and
its picture beside it. Those of this file are pose assets that bear the same text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base.blender_types import Context

RISORIUS, LIBRARY, FILE = "RISORIUS", "LIBRARY", "FILE"
MARK = "risorius_expression"  # on an action and its asset: the text of the expression
_FAVOURITES = "favourites.txt"
_MOST = 2000  # files of a library that are read


class LibraryError(FaceError):
    """A library or an expression that cannot be used; the text is one sentence for users."""


@dataclass(frozen=True)
class Item:
    """An expression of the grid.

    Attributes:
        expression: risorius.expressions.Expression.
        source: RISORIUS, LIBRARY or FILE.
        path: of the file in the library, where it is there.
        action: name of the pose asset in this file, where it is there.
    """

    expression: native.Expression
    source: str
    path: Path | None = None
    action: str = ""


def own_folder(part: str) -> Path:
    """A folder of the extension's own, which stays when it is updated; made when needed.

    Args:
        part: "expressions" or "thumbnails".
    """
    return Path(bpy.utils.extension_path_user(native.ADDON, path=part, create=True))


def folder(context: Context) -> Path:
    """The library of the preferences, else the extension's own."""
    addon = context.preferences.addons.get(native.ADDON)
    chosen = getattr(addon.preferences, "expression_library", "") if addon is not None else ""
    return Path(bpy.path.abspath(chosen)) if chosen else own_folder("expressions")


def all_items(where: Path) -> tuple[dict[str, Item], list[str]]:
    """The expressions by name, Risorius' own first, and a sentence for each that cannot be used.

    Args:
        where: the folder of the library.
    """
    found = {
        name: Item(expression, RISORIUS)
        for name, expression in native.part("expressions").load().items()
    }
    shared, troubles = of_folder(where)
    for path, expression in shared:
        if expression.name not in found:
            found[expression.name] = Item(expression, LIBRARY, path)
    for action in bpy.data.actions:
        expression = of_action(action)
        if expression is None:
            continue
        known = found.get(expression.name)
        if known is None:
            found[expression.name] = Item(expression, FILE, action=action.name)
        elif known.source == LIBRARY:
            found[expression.name] = replace(known, action=action.name)
    return found, troubles


def of_folder(where: Path) -> tuple[list[tuple[Path, native.Expression]], list[str]]:
    """The expressions of a library, and a sentence for each file that cannot be used.

    Args:
        where: the folder; one that is not there has none, and a sentence.
    """
    try:
        files = sorted(p for p in where.iterdir() if p.suffix == ".toml" and p.name[0] != ".")
        states = [(path, path.stat()) for path in files[:_MOST]]
    except OSError as error:
        reason = error.strerror or type(error).__name__
        return [], [
            told("{folder}: no library of expressions: {reason}.", folder=str(where), reason=reason)
        ]
    found, troubles = [], []
    for path, state in states:
        read = _read(path, state.st_mtime_ns, state.st_size)
        if isinstance(read, str):
            troubles.append(read)
        else:
            found += [(path, expression) for expression in read]
    return found, troubles


@lru_cache(maxsize=4096)
def _read(path: Path, _changed: int, _size: int) -> tuple[native.Expression, ...] | str:
    """The expressions of one file, or what is wrong with it; read again when it has changed."""
    try:
        return tuple(native.part("expressions").load(path).values())
    except native.user_errors() as error:
        text = str(error).replace(str(path), path.name).rstrip(".")
        return f"{text}."


@lru_cache(maxsize=1024)
def of_text(text: str) -> native.Expression | None:
    """The expression of a text that an asset bears, or None where it is none."""
    part = native.part("expressions")
    try:
        found = part.of_text(text)
    except native.user_errors():
        return None
    return next(iter(found.values()), None)


def of_action(action: bpy.types.Action) -> native.Expression | None:
    """The expression that a pose asset of this file is of, or None where it is another asset."""
    text = action.get(MARK) if action.asset_data is not None else None
    return of_text(text) if isinstance(text, str) else None


def find(items: dict[str, Item], name: str) -> Item:
    """The expression of a name.

    Args:
        items: of all_items.
        name: of the expression.

    Raises:
        LibraryError: there is none.
    """
    if name not in items:
        raise LibraryError(told("There is no expression {name}.", name=name))
    return items[name]


def name_for(label: str) -> str:
    """The name of an expression, which is that of its file, from what it is called."""
    return re.sub(r"\W+", "_", label.strip().lower()).strip("_")


def free_label(items: dict[str, Item], label: str) -> str:
    """A label that no expression has: with a number behind it, where one is needed.

    Args:
        items: of all_items.
        label: what it should be called.
    """
    taken, number, tried = {*items, ""}, 1, label
    while name_for(tried) in taken:
        number += 1
        tried = f"{label} {number}"
    return tried


def write(where: Path, expression: native.Expression, picture: bytes = b"") -> Path:
    """Put an expression into a library; one of its name is written over, whole at all times.

    Args:
        where: the folder; made where it is not there.
        expression: its name is that of the file.
        picture: a PNG file that goes beside it; none leaves what is there.

    Returns:
        The path of its file.

    Raises:
        ValueError: it cannot be written in this form. OSError.
    """
    text = native.part("expressions").text_of(expression)
    path = where / f"{expression.name}.toml"
    files = {path: text.encode()}
    if picture:
        files[path.with_suffix(".png")] = picture
    native.part("files.fileio").write_all(files)
    return path


def check_own(item: Item) -> None:
    """Whether an expression may be changed.

    Args:
        item: of the grid.

    Raises:
        LibraryError: it came with Risorius, or its file holds others too.
    """
    if item.source == RISORIUS:
        raise LibraryError(
            told(
                "{label} came with Risorius: only expressions of your own can be changed.",
                label=item.expression.label,
            )
        )
    if item.path is not None and len(native.part("expressions").load(item.path)) > 1:
        raise LibraryError(
            told("{file} holds several expressions: edit it as a text.", file=item.path.name)
        )


def remove(item: Item) -> None:
    """Take an expression of one's own out of the library and out of this file.

    Args:
        item: of the grid.

    Raises:
        LibraryError: see check_own. OSError.
    """
    check_own(item)
    if item.path is not None:
        item.path.unlink()
        item.path.with_suffix(".png").unlink(missing_ok=True)
    action = bpy.data.actions.get(item.action) if item.action else None
    if action is not None:
        bpy.data.actions.remove(action)


def read_all(where: Path) -> list[native.Expression]:
    """The expressions of a folder, all or none.

    Args:
        where: a folder with TOML files.

    Raises:
        LibraryError: one cannot be used, or there are none.
    """
    found, troubles = of_folder(where)
    if troubles:
        raise LibraryError(troubles[0])
    if not found:
        raise LibraryError(told("{folder}: it holds no expressions.", folder=where.name))
    return [expression for _, expression in found]


def favourites() -> set[str]:
    """Names of the expressions with a star, the same in all files."""
    path = own_folder("expressions") / _FAVOURITES
    try:
        return set(path.read_text(encoding="utf-8").split("\n")) - {""}
    except (OSError, UnicodeDecodeError):
        return set()


def set_favourite(names: Iterable[str], on: bool) -> None:
    """Give expressions a star, or take it away.

    Args:
        names: of expressions.
        on: whether they have one from now on.

    Raises:
        OSError: the list cannot be written.
    """
    known = favourites()
    known = known | set(names) if on else known - set(names)
    path = own_folder("expressions") / _FAVOURITES
    native.part("files.fileio").write_text(path, "".join(f"{name}\n" for name in sorted(known)))
