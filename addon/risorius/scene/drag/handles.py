# SPDX-License-Identifier: GPL-3.0-or-later
"""A few vertices that are offered to be dragged: where the controls reach most."""

from __future__ import annotations

from weakref import WeakKeyDictionary

from ... import native
from .skin import Point

COUNT = 18
_placed: WeakKeyDictionary[native.Surface, list[Point]] = WeakKeyDictionary()


def of(surface: native.Surface) -> list[Point]:
    """The handles of a face: mesh and vertex of each, found when first asked for.

    Args:
        surface: of the level of detail that is seen; its largest mesh is the skin.
    """
    if surface not in _placed:
        shown = surface.mesh_indices
        head = max(shown, key=lambda m: surface.vertex_counts[m], default=None)
        found = () if head is None else native.module().place_handles(surface, head, COUNT)
        _placed[surface] = [(int(head or 0), int(vertex)) for vertex in found]
    return _placed[surface]
