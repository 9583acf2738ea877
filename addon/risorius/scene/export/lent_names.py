# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that datablocks lend to copies: a file for another program bears the user's own names."""

from __future__ import annotations

import bpy


class Loans:
    """What was lent; `give_back` when the copies are gone."""

    def __init__(self) -> None:
        self._lent: list[tuple[bpy.types.ID, str]] = []
        self._taken: set[tuple[str, str]] = set()

    def take(self, kind: str, copy: bpy.types.ID, name: str) -> None:
        """Name a copy; who has the name waits under another, unless it is a copy too.

        Args:
            kind: of datablocks, as in bpy.data.
            copy: a new datablock.
            name: that it shall have.
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
        """Everyone has the name again that it had; the copies must be gone."""
        while self._lent:
            holder, name = self._lent.pop()
            holder.name = name
