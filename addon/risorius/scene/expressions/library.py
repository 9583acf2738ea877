# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and writes expressions from three sources: Risorius, a library folder, and this .blend.

A library is a folder with a TOML file for each expression, in the format of risorius.expressions,
and a picture with the same name. Expressions of the .blend are pose assets with the same text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.names import printable
from ...logic.base.sentences import told
from ..base import session
from ..base.blender_types import Context

RISORIUS, LIBRARY, FILE = "RISORIUS", "LIBRARY", "FILE"
MARK = "risorius_expression"  # on an action and its asset: the text of the expression
_FAVOURITES = "favourites.txt"
_MOST = 2000  # largest number of files that are read from a library
_AT_ONCE = 100  # number of expressions that are written together, all or none


class LibraryError(FaceError):
    """A library or an expression cannot be used; the text is one sentence for users."""


class TakenError(LibraryError):
    """The user's files or expressions would be replaced without permission."""


@dataclass(frozen=True)
class Item:
    """An expression of the grid in the panel.

    Attributes:
        expression: the expression.
        source: RISORIUS, LIBRARY or FILE.
        path: path of its file in the library, or None.
        action: name of its pose asset in this .blend; "" if there is none.
    """

    expression: native.Expression
    source: str
    path: Path | None = None
    action: str = ""


def own_folder(part: str) -> Path:
    """A user folder of the add-on, which updates of the add-on keep; created if missing.

    Args:
        part: "expressions" or "thumbnails".
    """
    return Path(bpy.utils.extension_path_user(native.ADDON, path=part, create=True))


def folder(context: Context) -> Path:
    """The library folder from the preferences, or the add-on's own folder if none is set."""
    addon = context.preferences.addons.get(native.ADDON)
    chosen = getattr(addon.preferences, "expression_library", "") if addon is not None else ""
    return Path(bpy.path.abspath(chosen)) if chosen else own_folder("expressions")


def all_items(where: Path) -> tuple[dict[str, Item], list[str]]:
    """Name -> expression from all sources, and a sentence for each unusable file.

    If several sources have the same name, Risorius takes precedence, then the library.

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
    """(path, expression) pairs of a library, and a sentence for each unusable file.

    Only the first _MOST files in the order of their names are read.

    Args:
        where: the folder; a missing folder gives no expressions and one sentence.
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


@session.cached(("unregister",), 4096)
def _read(path: Path, _changed: int, _size: int) -> tuple[native.Expression, ...] | str:
    """The expressions of a file, or a sentence about its error. The time of the last change and the
    size are part of the cache key, so that a changed file is read again."""
    try:
        return tuple(native.part("expressions").load(path).values())
    except native.user_errors() as error:
        text = str(error).replace(str(path), path.name).rstrip(".")
        return f"{text}."


@session.cached(("unregister",), 1024)
def of_text(text: str) -> native.Expression | None:
    """The expression in the text of an asset; None if the text is invalid."""
    part = native.part("expressions")
    try:
        found = part.of_text(text)
    except native.user_errors():
        return None
    return next(iter(found.values()), None)


def of_action(action: bpy.types.Action) -> native.Expression | None:
    """The expression of a pose asset of this .blend; None for other actions."""
    text = action.get(MARK) if action.asset_data is not None else None
    return of_text(text) if isinstance(text, str) else None


def find(items: dict[str, Item], name: str) -> Item:
    """The expression with a name.

    Args:
        items: expressions by name, from all_items.
        name: name of the expression.

    Raises:
        LibraryError: no expression has this name.
    """
    if name not in items:
        raise LibraryError(told("There is no expression {name}.", name=name))
    return items[name]


def name_for(label: str) -> str:
    """Make the name of an expression, as used for its file, from its label."""
    return re.sub(r"\W+", "_", label.strip().lower()).strip("_")


def free_label(items: dict[str, Item], label: str) -> str:
    """A label whose name is not used, with a number if needed.

    Args:
        items: expressions by name, from all_items.
        label: wanted label.
    """
    taken, number, tried = {*items, ""}, 1, label
    while name_for(tried) in taken:
        number += 1
        tried = f"{label} {number}"
    return tried


class Entry(NamedTuple):
    """An expression to write into a library.

    Attributes:
        expression: the expression.
        picture: bytes of a PNG file; empty: keep the existing picture.
        over: the file to replace; None: a new file.
    """

    expression: native.Expression
    picture: bytes = b""
    over: Path | None = None


def write(where: Path, entries: Sequence[Entry]) -> list[Path]:
    """Write expressions into a library, in groups of _AT_ONCE that are written all or none.

    A file gets the name of its expression, or another name if a file of this name exists. Only the
    files in `over` of the entries are replaced.

    Args:
        where: the folder; created if missing.
        entries: expressions to write.

    Returns:
        The path of each entry's file.

    Raises:
        ValueError: an entry cannot be written as TOML; nothing was written.
        OSError: a file cannot be written; earlier groups were written.
    """
    part, taken = native.part("expressions"), _stems(where)
    files: list[dict[Path, bytes]] = []
    for expression, picture, over in entries:
        path = over or where / _file_name(expression, taken)
        taken.append(path.name)
        files.append({path: part.text_of(expression).encode()})
        if picture:
            files[-1][path.with_suffix(".png")] = picture
    for first in range(0, len(files), _AT_ONCE):
        joined = {p: data for row in files[first : first + _AT_ONCE] for p, data in row.items()}
        native.part("files.fileio").write_all(joined)
    return [next(iter(row)) for row in files]


def in_the_way(where: Path, entries: Sequence[Entry]) -> list[Entry]:
    """Find the existing files that new entries would replace.

    Args:
        where: the folder.
        entries: entries whose attribute `over` is None.

    Returns:
        Copies of the entries. The attribute `over` of each copy is the existing file with the
        entry's file name; None if there is no such file.
    """
    folded = native.part("files.names").folded
    there = {folded(name): name for name in reversed(_stems(where))}
    given: list[str] = []
    for expression, *_ in entries:
        given.append(_file_name(expression, given))
    found = [there.get(folded(name)) for name in given]
    return [
        entry._replace(over=where / name if name else None)
        for entry, name in zip(entries, found, strict=True)
    ]


def _file_name(expression: native.Expression, taken: Sequence[str]) -> str:
    name: str = native.part("files.names").file_name(expression.name, ".toml", taken)
    return name


def _stems(where: Path) -> list[str]:
    """The names of TOML files in a folder; a picture counts as the TOML file of the same name."""
    try:
        return sorted(
            p.name if p.suffix == ".toml" else f"{p.stem}.toml"
            for p in where.iterdir()
            if p.suffix.lower() in (".toml", ".png")
        )
    except FileNotFoundError:  # the folder is created later
        return []


def check_own(item: Item) -> None:
    """Check that an expression may be changed.

    Args:
        item: an expression of the grid.

    Raises:
        LibraryError: the expression belongs to Risorius, or its file has several expressions.
    """
    if item.source == RISORIUS:
        raise LibraryError(
            told(
                "{label} came with Risorius: you can change only your own expressions.",
                label=item.expression.label,
            )
        )
    if item.path is not None and len(native.part("expressions").load(item.path)) > 1:
        raise LibraryError(
            told(
                "{file} holds several expressions: edit the file in a text editor.",
                file=item.path.name,
            )
        )


def remove(item: Item) -> None:
    """Remove the user's own expression from the library and from this .blend.

    Args:
        item: an expression of the grid.

    Raises:
        LibraryError: the expression belongs to Risorius, or its file has several expressions.
        OSError: its file cannot be removed.
    """
    check_own(item)
    if item.path is not None:
        item.path.unlink()
        item.path.with_suffix(".png").unlink(missing_ok=True)
    action = bpy.data.actions.get(item.action) if item.action else None
    if action is not None:
        bpy.data.actions.remove(action)


def read_all(where: Path) -> list[native.Expression]:
    """The expressions of a folder; an error is raised if any expression is unusable.

    Args:
        where: a folder with TOML files.

    Raises:
        LibraryError: a file cannot be used, two expressions have the same name, or there are none.
    """
    found, troubles = of_folder(where)
    if troubles:
        raise LibraryError(troubles[0])
    if not found:
        raise LibraryError(told("The folder {folder} contains no expressions.", folder=where.name))
    names = [expression.name for _, expression in found]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise LibraryError(
                told(
                    "{file}: another file of the folder has an expression {name} too.",
                    file=found[number][0].name,
                    name=printable(name),
                )
            )
    return [expression for _, expression in found]


def favourites() -> set[str]:
    """Names of the expressions with a star. The list is shared by all .blend files."""
    path = own_folder("expressions") / _FAVOURITES
    try:
        return set(path.read_text(encoding="utf-8").split("\n")) - {""}
    except (OSError, UnicodeDecodeError):
        return set()


def set_favourite(names: Iterable[str], on: bool) -> None:
    """Add a star to expressions, or remove it.

    Args:
        names: names of the expressions.
        on: True: add; False: remove.

    Raises:
        OSError: the list cannot be written.
    """
    known = favourites()
    known = known | set(names) if on else known - set(names)
    path = own_folder("expressions") / _FAVOURITES
    native.part("files.fileio").write_text(path, "".join(f"{name}\n" for name in sorted(known)))
