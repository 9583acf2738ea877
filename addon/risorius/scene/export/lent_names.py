# SPDX-License-Identifier: GPL-3.0-or-later
"""Renames datablocks during an export, so that exported copies have the names of the originals."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.names import printable
from ...logic.base.sentences import told


class Loans:
    """Renamed originals of an export; call `give_back` after removing the copies."""

    def __init__(self) -> None:
        self._lent: list[tuple[bpy.types.ID, str]] = []
        self._taken: set[tuple[str, str]] = set()

    def take(self, kind: str, copy: bpy.types.ID, name: str) -> None:
        """Name a copy. An original with this name temporarily gets another name.

        Args:
            kind: name of the collection in bpy.data, such as "objects".
            copy: the copy to name.
            name: name of the copy in the exported file.
        """
        holder = next(
            (x for x in getattr(bpy.data, kind) if x.name == name and x.library is None), None
        )
        if holder not in (None, copy) and (kind, name) not in self._taken:
            self._lent.append((holder, name))
            holder.name = f"{name[:40]} lent"
        copy.name = name
        self._taken.add((kind, name))

    def give_back(self) -> None:
        """Restore the names of the originals; the copies must be removed before."""
        while self._lent:
            holder, name = self._lent.pop()
            holder.name = name


@contextmanager
def images_as_files() -> Iterator[None]:
    """Context manager: temporarily rename images whose names are not valid file names.

    If an image has no path, Blender's USD exporter writes it to a file with the name of the image,
    even if this name contains `../`.

    Raises:
        FaceError: a linked image has such a name and cannot be renamed here.
    """
    names = native.part("files.names")
    odd = [image for image in bpy.data.images if not names.is_file_name(image.name)]
    for image in odd:
        if image.library is not None:
            raise FaceError(
                told(
                    "rename the linked image {name} in the .blend file from which it is "
                    "linked: the name must not contain / or other characters that file "
                    "names cannot have",
                    name=printable(image.name),
                )
            )
    before = [(image, image.name) for image in odd]
    try:
        for image in odd:
            image.name = names.file_name(image.name, taken=[i.name for i in bpy.data.images])
        yield
    finally:
        for image, name in before:
            image.name = name
