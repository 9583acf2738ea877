# SPDX-License-Identifier: MIT
"""Fits eyeballs, teeth, gums, tongue and lashes of a template into a head that lacks them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from ... import Dna
from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles
from ...author.geometry.sparse import subset
from ...author.heads.islands import islands_of
from ...author.heads.parts import HeadPart
from ...author.input.obj import ObjMesh
from ...base.errors import ArgumentError
from ..eyes.eyeballs import Eyeball
from ..eyes.eyelids import Eyelids, find_eyelids
from ..eyes.opening import Opening, find_opening, near_eye
from ..surface import Surface
from ..telling import Progress, telling
from .fitted import BROWS, EYE, GUMS, LASHES, SKIN, TEETH, TONGUE, Fitted, Fittings
from .following import Followers
from .similarity import Similarity, similarity
from .sorting import sort_parts
from .template_parts import template_parts

Mask = npt.NDArray[np.bool_]
_RIM = 1.5  # mm from the edge of a lid: width of the rim that touches the eye
_PATCH = 40  # skin vertices that determine the place of a lash
# An eye counts as painted or closed if the area of its opening is at most _SEEN times the area on
# the template, or if the distance between its lids, divided by their width, is below _OPENED times
# this quotient on the template.
_SEEN = 0.3
_OPENED = 0.45
_AROUND = 2.5  # cm around the teeth: skin that determines their place
_STEP, _STEPS = 0.05, 16  # cm per step, and number of steps, that move teeth back behind the lips
_THROUGH = 0.02  # cm that teeth may come through the skin
_SIDES = {"L": "left", "R": "right"}


def complete(
    found: Fittings, template: Dna, laid: Doubles, progress: Progress | None = None
) -> Fittings:
    """The meshes of a head, completed with meshes of a template.

    Args:
        found: the meshes of the head.
        template: a face of a DNA file.
        laid: float64[V, 3], positions of the vertices of the template's skin on the head, in cm.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        ArgumentError: the length of `laid` is not the vertex count of the template's skin.
        Stopped: `progress` returned False.
    """
    number, parts = template_parts(template)
    skin = parts[number].mesh
    if len(laid) != len(skin.positions):
        raise ArgumentError(
            f"{len(skin.positions):,} vertices of the template's skin were expected, found "
            f"{len(laid):,}"
        )
    return _Completing(found, sort_parts(parts), skin, laid).made(telling(progress))


class _Completing:
    def __init__(self, found: Fittings, like: Fittings, skin: ObjMesh, laid: Doubles) -> None:
        self.found, self.like, self.laid = found, like, laid
        self.skin = Surface.of_polygons(skin.positions, skin.faces)
        self.target = Surface.of_polygons(found.face.mesh.positions, found.face.mesh.faces)
        self.out = replace(
            found, rows=list(found.rows), eyes=dict(found.eyes), notes=list(found.notes)
        )

    def made(self, tell: Callable[[float], object]) -> Fittings:
        """The completed meshes. tell: gets the finished share of the work."""
        fitted = []
        for share, side in ((0.1, "L"), (0.3, "R")):
            tell(share)
            if side not in self.found.eyes and self._eye(side):
                fitted.append(side)
        tell(0.5)
        if not self.found.of(LASHES):
            self._laid_on(LASHES)
        tell(0.7)
        if len(fitted) == 2:
            self._laid_on(SKIN)
        tell(0.8)
        self._mouth()
        tell(1.0)
        return self.out

    def _eye(self, side: str) -> bool:
        """Fit an eyeball of the template into the head; False if the head has no open lids."""
        ball = self.like.eyes.get(side)
        lids = find_eyelids(self.skin, ball) if ball is not None else None
        if ball is None or lids is None:
            return False
        way = self._seat(ball, lids)
        opened = lids.apart(self.laid) / max(lids.apart(self.skin.points), 1e-12)
        new = Eyeball(side, way.point(ball.middle), way.scale * ball.radius,
                      way.point(ball.points), ball.triangles)  # fmt: skip
        opening = find_opening(near_eye(self.target, new), new)
        seen = opening is not None and _size(opening) > _SEEN * _size(lids.opening)
        if not seen or opened < _OPENED:
            self.out.notes.append(f"the {_SIDES[side]} eye is painted on the skin, or closed: no "
                                  "eyeball is fitted in")  # fmt: skip
            return False
        self.out.eyes[side] = new
        for row in self.like.of(EYE):
            if row.side == side:
                self._add(row, way)
        self.out.notes.append(f"the {_SIDES[side]} eyeball is the template's")
        return True

    def _seat(self, ball: Eyeball, lids: Eyelids) -> Similarity:
        """The transform of an eyeball to its place behind the lids. The lid rims determine the size
        of the eyeball. Its depth is chosen so that the rims are as far from its surface as on the
        template."""
        rim, height = lids.rim(_RIM)
        near = similarity(self.skin.points[rim], self.laid[rim])
        front = near.turn @ lids.opening.frame.front
        # The lids determine the place of the eye but not its rotation.
        way = Similarity(np.eye(3), near.scale, ball.middle, near.point(ball.middle))
        middle, radius = way.point(ball.middle), way.scale * ball.radius
        low, high = -radius, radius
        for _ in range(40):
            depth = (low + high) / 2
            away = np.linalg.norm(self.laid[rim] - middle - depth * front, axis=1)
            over = float(np.median(away - radius - way.scale * height))
            low, high = (depth, high) if over > 0 else (low, depth)
        return way.shifted((low + high) / 2 * front)

    def _laid_on(self, kind: str) -> None:
        """Add the template's meshes of a kind; each moves with the skin below it."""
        rows = self.like.of(kind)
        for row in rows:
            mesh = row.part.mesh
            follow = Followers(self.skin, mesh.positions, islands_of(mesh), _PATCH)
            points = follow.carried(self.laid - self.skin.points, sized=True)
            part = replace(row.part, mesh=replace(mesh, positions=points))
            self.out.rows.append(replace(row, part=part, own=False))
        if rows and kind == LASHES:
            self.out.notes.append("the lashes are the template's")

    def _mouth(self) -> None:
        """Add missing teeth, gums and tongue, all by one similarity transform."""
        missing = [kind for kind in (TEETH, GUMS, TONGUE) if not self.found.of(kind)]
        if TEETH not in missing and GUMS in missing:
            missing.remove(GUMS)  # the head's teeth may include gums or do without
        rows = self.like.of(*missing)
        teeth = self.like.of(TEETH, GUMS)
        if not rows or not teeth:
            return
        points = np.concatenate([row.part.mesh.positions for row in teeth])
        low, high = points.min(axis=0) - _AROUND, points.max(axis=0) + _AROUND
        near = ((self.skin.points > low) & (self.skin.points < high)).all(axis=1)
        if np.count_nonzero(near) < 8:
            return
        way = similarity(self.skin.points[near], self.laid[near])
        if TEETH in missing:
            way = self._behind(way, near, teeth)
        for row in rows:
            self._add(row, way)
        names = {TEETH: "teeth", GUMS: "gums", TONGUE: "tongue"}
        said = [names[kind] for kind in missing if self.like.of(kind)]
        self.out.notes.append(f"from the template: {', '.join(said)}")

    def _behind(self, way: Similarity, near: Mask, teeth: list[Fitted]) -> Similarity:
        """The transform, shifted back in steps until the teeth do not come through the lips."""
        rest = self._through(self.skin.points[near], teeth, None)
        for _ in range(_STEPS):
            deep = self._through(self.laid[near], teeth, way)
            if (deep - rest).max(initial=0.0) < _THROUGH:
                break
            way = way.shifted(np.array([0.0, 0.0, -_STEP]))
        return way

    def _through(self, points: Doubles, teeth: list[Fitted], way: Similarity | None) -> Doubles:
        """float64[n]: depth of skin points inside the teeth in cm, 0 outside."""
        out = np.zeros(len(points))
        for row in teeth:
            solid = row.surface()
            places = solid.points if way is None else way.point(solid.points)
            tree = ClosestPoints(places, np.ascontiguousarray(solid.triangles, np.int32))
            triangle, shares, distance = tree.nearest(points)
            posed = Surface(places, solid.triangles)
            normal = posed.face_normals()[triangle]
            arm: Doubles = points - posed.at(triangle.astype(np.int64), shares)
            inside = (arm * normal).sum(axis=1) < 0
            out = np.maximum(out, np.where(inside & (distance < 0.5), distance, 0.0))
        return out

    def _add(self, row: Fitted, way: Similarity) -> None:
        mesh = replace(row.part.mesh, positions=way.point(row.part.mesh.positions))
        shapes = {name: way.way(delta) for name, delta in row.part.shapes.items()}
        self.out.rows.append(
            replace(row, part=replace(row.part, mesh=mesh, shapes=shapes), own=False)
        )


def _size(opening: Opening) -> float:
    """The area of the opening on a unit sphere around the eye."""
    heights = (opening.high - opening.low) * np.cos(opening.across)
    return float(heights.mean() * (opening.across[-1] - opening.across[0]))


def head_parts(
    fittings: Fittings, expressions: Mapping[str, Doubles], progress: Progress | None = None
) -> list[HeadPart]:
    """All meshes of a head with their expressions. Lashes, brows and meshes that lie on the skin
    follow it; other meshes keep their own shapes or are rigid.

    Args:
        fittings: the meshes of the head.
        expressions: float64[V, 3] by raw control, displacements of the skin.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        Stopped: `progress` returned False.
    """
    face, tell = fittings.face, telling(progress)
    skin = Surface.of_polygons(face.mesh.positions, face.mesh.faces)
    out = [replace(face, shapes=subset(expressions, expressions))]
    for number, row in enumerate(fittings.rows):
        tell(number / len(fittings.rows))
        if row.kind not in (LASHES, BROWS, SKIN):
            out.append(row.part)
            continue
        islands = islands_of(row.part.mesh) if row.kind == LASHES else None
        follow = Followers(skin, row.part.mesh.positions, islands)
        shapes = follow.ways(expressions)
        out.append(replace(row.part, shapes={**row.part.shapes, **shapes}))
    return out
