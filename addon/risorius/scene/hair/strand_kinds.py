# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of strands by kind of hair: their differences from the card that they follow."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

_COIL = re.compile(r"radius=(\d+(?:\.\d+)?) pitch=(\d+(?:\.\d+)?)")  # mm
# Strands in a lock and locks for each card: for large coils, for small coils.
_LOCKS = ((6, 5), (3, 10))
_LARGE = 0.0013  # metres, radius of a coil


class Coil(NamedTuple):
    """How strands wind about the way of their card; metres."""

    radius: float
    pitch: float


class Kind(NamedTuple):
    """How strands differ from the card that they follow."""

    each: int  # strands of a card
    radius: float  # at the root, metres
    apart: float  # how far tips part, metres
    cut: float  # of their length, what is cut off at most
    # Roots also stand between cards, so that no card looks like a tuft: distance beyond either edge
    # in widths of the card, and before its root in metres.
    aside: float
    along: float
    # Light passes from fibre to fibre in dense hair. Single hairs over skin use the colour of the
    # picture, because transmitting fibres would be too dark there.
    dense: bool
    root: float = 1.0  # radius at the root itself, of `radius`, which a strand has a fifth farther
    coil: Coil | None = None
    lock: int = 1  # strands that begin and go together


_KINDS = {  # by what the name of a mesh begins with
    "hair": Kind(32, 0.00008, 0.0015, 0.45, 0.45, 0.005, True),
    "brows": Kind(5, 0.00005, 0.0004, 0.35, 0.3, 0.0013, False, 0.45),
    "beard": Kind(12, 0.00005, 0.0015, 0.5, 0.9, 0.0022, False),
    "eyelashes": Kind(3, 0.00006, 0.0003, 0.25, 0.0, 0.0, False),
}


def kind_of(name: str, told: Mapping[str, str]) -> Kind | None:
    """The kind of strands of a mesh.

    Args:
        name: of the mesh, in the file.
        told: the file's metadata.
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
    """The kind with more strands for each card, whole locks of them.

    Args:
        kind: of cards at LOD 0.
        more: factor of the number; at least 1.
    """
    return kind._replace(each=kind.lock * round(max(1.0, more) * kind.each / kind.lock))
