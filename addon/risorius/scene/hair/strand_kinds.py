# SPDX-License-Identifier: GPL-3.0-or-later
"""Defines number and shape of the strands that replace hair cards, for each kind of hair.

A lock is a group of strands of one card that share a root and a direction.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

_COIL = re.compile(r"radius=(\d+(?:\.\d+)?) pitch=(\d+(?:\.\d+)?)")  # in mm
# (strands per lock, locks per card) for large coils and for small coils.
_LOCKS = ((6, 5), (3, 10))
_LARGE = 0.0013  # metres: a coil with a smaller radius is a small coil


class Coil(NamedTuple):
    """Radius and pitch in metres of strands that wind about the path of their card."""

    radius: float
    pitch: float


class Kind(NamedTuple):
    """Number and shape of the strands that follow a card of one kind of hair, such as brows."""

    each: int  # strands per card
    radius: float  # metres, near the root
    apart: float  # metres: largest random displacement of a tip along each axis
    cut: float  # largest fraction of its length by which a strand is shortened
    # Strands also start outside their card, so that no card looks like a tuft: up to `aside` card
    # widths beyond either edge, and up to `along` metres before the root of the card.
    aside: float
    along: float
    # True: the material has fibres that pass light on to each other, as in dense hair. False: the
    # material only has the colour of the cards' image, because single fibres over skin would be too
    # dark.
    dense: bool
    root: float = 1.0  # radius at the root / `radius`, which is reached at 1/5 of the length
    coil: Coil | None = None
    lock: int = 1  # strands per lock; they share a root and a direction


_KINDS = {  # by the beginning of the mesh name
    "hair": Kind(32, 0.00008, 0.0015, 0.45, 0.45, 0.005, True),
    "brows": Kind(5, 0.00005, 0.0004, 0.35, 0.3, 0.0013, False, 0.45),
    "beard": Kind(12, 0.00005, 0.0015, 0.5, 0.9, 0.0022, False),
    "eyelashes": Kind(3, 0.00006, 0.0003, 0.25, 0.0, 0.0, False),
}


def kind_of(name: str, told: Mapping[str, str]) -> Kind | None:
    """The kind of strands of a mesh, or None if its name begins with no known kind.

    Args:
        name: name of the mesh in the DNA file.
        told: the file's metadata; "coil:<mesh>" has the radius and pitch of coils in mm.
    """
    kind = next((k for begin, k in _KINDS.items() if name.startswith(begin)), None)
    found = _COIL.fullmatch(told.get(f"coil:{name}", ""))
    if kind is None or found is None or not (float(found[1]) > 0 and float(found[2]) > 0):
        return kind
    coil = Coil(0.001 * float(found[1]), 0.001 * float(found[2]))
    lock, locks = _LOCKS[coil.radius < _LARGE]
    locks = max(2, round(locks * kind.each / _KINDS["hair"].each))
    aside, along = max(kind.aside, 0.35), max(kind.along, 0.007)
    return kind._replace(each=lock * locks, aside=aside, along=along, coil=coil, lock=lock)


def thicker(kind: Kind, more: float) -> Kind:
    """A kind with more strands per card, rounded to whole locks.

    Args:
        kind: kind of strands for the cards of LOD 0.
        more: factor of the number of strands; values below 1 count as 1.
    """
    return kind._replace(each=kind.lock * round(max(1.0, more) * kind.each / kind.lock))
