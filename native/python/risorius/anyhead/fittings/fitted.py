# SPDX-License-Identifier: MIT
"""The meshes of a head beside its skin: what each is, and what it hangs on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints
from ...author.heads.parts import HeadPart
from ...author.heads.turning import LOOKS, Turn, jaw_turn, look_turn
from ..eyes.eyeballs import Eyeball
from ..surface import Surface

EYE, TEETH, GUMS, TONGUE = "eye", "teeth", "gums", "tongue"
LASHES, BROWS, SKIN, HAIR, OTHER = "lashes", "brows", "skin", "hair", "other"
HEAD, JAW = "head", "jaw"


@dataclass
class Fitted:
    """A mesh of a head.

    Attributes:
        kind: EYE, TEETH and so on; SKIN is what lies on the skin, such as the tears' edge.
        part: its mesh; `shapes` gives what expressions do to it where it is known.
        side: "L" or "R" of eyes, else "".
        hangs: HEAD or JAW, of what is rigid in the mouth; "" of the rest.
        own: whether it is of the target, not of the template.
    """

    kind: str
    part: HeadPart
    side: str = ""
    hangs: str = ""
    own: bool = True

    def surface(self) -> Surface:
        """The mesh as triangles."""
        return Surface.of_polygons(self.part.mesh.positions, self.part.mesh.faces)


@dataclass
class Fittings:
    """A head's skin and all that belongs to it.

    Attributes:
        face: the skin.
        rows: all other meshes.
        eyes: by side, L and R, of those that there are.
        notes: what was found and what was fitted in, a sentence each.
    """

    face: HeadPart
    rows: list[Fitted] = field(default_factory=list)
    eyes: dict[str, Eyeball] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def of(self, *kinds: str) -> list[Fitted]:
        """The meshes of some kinds.

        Args:
            kinds: EYE, TEETH and so on.
        """
        return [row for row in self.rows if row.kind in kinds]


class Bodies:
    """Where the eyes and the teeth are in each expression, which the skin is kept out of."""

    def __init__(self, fittings: Fittings, skin: Surface, shapes: Mapping[str, Doubles]) -> None:
        """Begins.

        Args:
            fittings: of the target.
            skin: of the target at rest.
            shapes: float64[V, 3] by raw control.
        """
        rows = fittings.of(TEETH, GUMS)
        self.jaw = _jaw(skin, shapes)
        self.rest: list[Doubles] = [row.part.mesh.positions for row in rows]
        self.triangles: list[Ints] = [row.surface().triangles for row in rows]
        self._on_jaw = [row.hangs == JAW for row in rows]

    def posed(self, controls: tuple[str, ...]) -> list[Doubles]:
        """float64[n, 3] of teeth and gums.

        Args:
            controls: raw controls that are 1.
        """
        motion = self._motion(controls)
        if self.jaw is None or motion is None:
            return self.rest
        (rotation, shift), hinge = motion, self.jaw.position
        return [
            (points - hinge) @ rotation.T + hinge + shift if jaw else points
            for points, jaw in zip(self.rest, self._on_jaw, strict=True)
        ]

    def _motion(self, controls: tuple[str, ...]) -> tuple[Doubles, Doubles] | None:
        if self.jaw is None:
            return None
        moving = [self.jaw.motions[c] for c in controls if c in self.jaw.motions]
        if not moving:
            return None
        rotation, shift = np.eye(3), np.zeros(3)
        for turn, move in moving:
            rotation, shift = turn @ rotation, shift + move
        return rotation, shift


def eye_turn_of(side: str, controls: tuple[str, ...]) -> Doubles | None:
    """float64[3, 3]: what controls turn an eye by; None where it rests.

    Args:
        side: "L" or "R".
        controls: raw controls that are 1.
    """
    out = None
    for look in LOOKS:
        if look + side in controls:
            out = look_turn(look) if out is None else look_turn(look) @ out
    return out


def _jaw(skin: Surface, shapes: Mapping[str, Doubles]) -> Turn | None:
    opening = shapes.get("jawOpen")
    if opening is None or not opening.any():
        return None
    named = {name: [name] for name in shapes}
    return jaw_turn(skin.points, shapes, named, opening, [])
