# SPDX-License-Identifier: MIT
"""Defines the meshes of a head other than its skin: their kinds, and the bones they follow."""

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
        kind: the kind of the mesh, such as EYE or TEETH. SKIN is the kind of a mesh that lies on
            the skin, such as a tear line.
        part: the mesh; `part.shapes` has its displacements by expression, if they are known.
        side: "L" or "R" for eyes, else "".
        hangs: HEAD or JAW, the bone of a rigid mesh in the mouth; "" for others.
        own: True for a mesh of the target, False for a mesh of the template.
    """

    kind: str
    part: HeadPart
    side: str = ""
    hangs: str = ""
    own: bool = True

    def surface(self) -> Surface:
        """The mesh `part` with its polygons divided into triangles."""
        return Surface.of_polygons(self.part.mesh.positions, self.part.mesh.faces)


@dataclass
class Fittings:
    """The meshes of a head.

    Attributes:
        face: the skin.
        rows: all other meshes.
        eyes: the eyeballs by side, "L" and "R"; a missing eye is left out.
        notes: sentences about meshes that were found or fitted in.
    """

    face: HeadPart
    rows: list[Fitted] = field(default_factory=list)
    eyes: dict[str, Eyeball] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def of(self, *kinds: str) -> list[Fitted]:
        """The meshes of some kinds.

        Args:
            kinds: kinds of meshes, such as EYE or TEETH.
        """
        return [row for row in self.rows if row.kind in kinds]


class Bodies:
    """Positions of teeth and gums in each expression. The skin must not cut into them."""

    def __init__(self, fittings: Fittings, skin: Surface, shapes: Mapping[str, Doubles]) -> None:
        """Find the jaw's motion in each expression, from the skin and its displacements.

        Args:
            fittings: the meshes of the target; only its teeth and gums are used.
            skin: the skin of the target in the rest pose.
            shapes: float64[V, 3] by raw control, displacements of the skin.
        """
        rows = fittings.of(TEETH, GUMS)
        self.jaw = _jaw(skin, shapes)
        self.rest: list[Doubles] = [row.part.mesh.positions for row in rows]
        self.triangles: list[Ints] = [row.surface().triangles for row in rows]
        self._on_jaw = [row.hangs == JAW for row in rows]

    def posed(self, controls: tuple[str, ...]) -> list[Doubles]:
        """float64[n, 3] for each mesh of teeth and gums: its posed vertices.

        Args:
            controls: names of the raw controls with value 1.
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
    """float64[3, 3]: the rotation of an eye from its rest pose; None if no control rotates it.

    Args:
        side: "L" or "R".
        controls: names of the raw controls with value 1.
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
