# SPDX-License-Identifier: MIT
"""Finds the left, top and front of a face from the names of its shapes and the vertices they move.

Left: shapes named left move vertices on the left. Top: brows are above the mouth, and a jaw opens
downwards. Front: moved vertices are in front of the rest of the head, the face bulges in its
middle, and lips pucker forwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...controls import vocabulary
from ...controls.regions import region_of, side_of
from ..geometry.skeleton import Doubles, Ints
from ..input.obj import ObjMesh
from .parts import AXES, Wishes

_FORWARD = ("mouthFunnel", "mouthLipsPurse", "jawFwd", "tongueOut", "mouthCheekBlow")
_SURE = 0.1  # smaller votes do not decide
_ALONG = 0.8  # smallest cosine between a direction and its axis; below, the face counts as turned
_POINTS = 600  # number of vertices that are compared for symmetry
_Y, _Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


@dataclass
class Direction:
    """The orientation of a head in its file.

    Attributes:
        left, up, front: float64[3], each along an axis. `left` is the side that shape names call
            left; without such names it follows from `up` and `front`.
        named: number of pairs of shape names that agree on `left`.
        sure_up, sure_front: True if the user or the shapes determine the axis, False if it is the
            usual axis of file formats.
        inside_out: whether polygons face inwards, for example in a mirrored file.
        turned: angle in degrees between `left` and the line from the shapes named right to the
            shapes named left; 0 for angles below 37 degrees.
    """

    left: Doubles
    up: Doubles
    front: Doubles
    named: int = 0
    sure_up: bool = False
    sure_front: bool = False
    inside_out: bool = False
    turned: float = 0.0

    @property
    def agrees(self) -> bool:
        """Whether `left` is the left side of a face with these `up` and `front`."""
        return bool(np.dot(np.cross(self.up, self.front), self.left) > 0)


def axis_of(word: str) -> Doubles:
    """float64[3]: the unit vector of a word of AXES, such as "-z"."""
    out = np.zeros(3)
    out["xyz".index(word[1])] = 1.0 if word[0] == "+" else -1.0
    return out


def word_of(axis: Doubles, said: Sequence[str] = ("+x", "+y", "+z")) -> str:
    """The signed name of an axis, such as "-z", or a name from `said`.

    Args:
        axis: float64[3], along an axis.
        said: names of x, y and z, each with a sign.
    """
    at = int(np.abs(axis).argmax())
    name, flip = said[at], axis[at] < 0
    return ("-" if (name[0] == "-") != flip else "+") + name[1:]


def find_direction(
    mesh: ObjMesh,
    shapes: Mapping[str, Doubles],
    controls: Mapping[str, Sequence[str]],
    wishes: Wishes,
) -> Direction:
    """Find the orientation of a head.

    Args:
        mesh: the mesh of the face.
        shapes: name -> displacements float64[V, 3].
        controls: name -> raw controls without prefix.
        wishes: the user's settings; other directions are guessed.
    """
    look = _Look(mesh, shapes, controls)
    left, named, turned = look.named_left()
    if wishes.left:
        left, named, turned = axis_of(wishes.left), 0, 0.0
    given_up = axis_of(wishes.up) if wishes.up else None
    given_front = axis_of(wishes.front) if wishes.front else None
    taken = [axis for axis in (left, given_front) if axis is not None]
    up, sure_up = (given_up, True) if given_up is not None else look.up(taken)
    if given_front is not None:
        front, sure_front = given_front, True
    else:
        front, sure_front = look.front(left, up)
    if left is None:
        left = np.cross(up, front)
    inside_out = look.volume() < 0
    return Direction(left, up, front, named, sure_up, sure_front, inside_out, turned)


class _Look:
    """Finds the axes of a head from the centre and the mean displacement of each shape."""

    def __init__(
        self,
        mesh: ObjMesh,
        shapes: Mapping[str, Doubles],
        controls: Mapping[str, Sequence[str]],
    ) -> None:
        self.mesh, self.points = mesh, mesh.positions
        self.size = float(np.ptp(self.points, axis=0).max()) or 1.0
        self.rows: list[tuple[str, list[str], Doubles, Doubles, float]] = []
        for name, delta in shapes.items():
            weight = (delta**2).sum(axis=1)
            total = float(weight.sum())
            if not total > (1e-6 * self.size) ** 2 or "+" in name:
                continue
            center = weight @ self.points / total
            mean = weight @ delta / total
            self.rows.append((name, list(controls.get(name, ())), center, mean, total))

    def named_left(self) -> tuple[Doubles | None, int, float]:
        """The axis from shapes named right to shapes named left.

        Returns: the axis, the number of agreeing pairs, and the angle to the axis in degrees (0 for
            angles below 37 degrees). The axis is None if there are no pairs, or if a third of them
            or more disagree.
        """
        sides: dict[str, dict[str, Doubles]] = {}
        for name, controls, center, _, _ in self.rows:
            key, side = _sided(name, controls)
            if side:
                sides.setdefault(key, {})[side] = center
        apart = [pair["L"] - pair["R"] for pair in sides.values() if len(pair) == 2]
        apart = [d for d in apart if np.linalg.norm(d) > 0.05 * self.size]
        if not apart:
            return None, 0, 0.0
        mean = np.mean(apart, axis=0)
        at = int(np.abs(mean).argmax())
        share = abs(mean[at]) / max(float(np.linalg.norm(mean)), 1e-300)
        axis = np.zeros(3)
        axis[at] = np.sign(mean[at])
        agreed = sum(bool(np.dot(d, axis) > 0) for d in apart)
        turned = 0.0 if share > _ALONG else float(np.degrees(np.arccos(share)))
        return (axis, agreed, turned) if 3 * agreed > 2 * len(apart) else (None, 0, 0.0)

    def up(self, taken: Sequence[Doubles]) -> tuple[Doubles, bool]:
        """The axis from the mouth to the brows, and whether the shapes determine it. If they do not
        determine it, the axis is +y, or +z if one of the axes `taken` is along y.

        Args:
            taken: axes to which the result must be perpendicular.
        """
        high, low, vote = [], [], np.zeros(3)
        for _, controls, center, mean, _ in self.rows:
            region = region_of(controls[0]) if controls else "other"
            if region in ("brow", "eye"):
                high.append(center)
            elif region in ("mouth", "jaw"):
                low.append(center)
            if "jawOpen" in controls or any("eyeBlink" in c for c in controls):
                vote -= mean / max(float(np.linalg.norm(mean)), 1e-300)
        if high and low:
            apart = np.mean(high, axis=0) - np.mean(low, axis=0)
            vote += 3 * apart / max(float(np.linalg.norm(apart)), 1e-300)
        free = np.ones(3)
        for axis in taken:
            free[int(np.abs(axis).argmax())] = 0.0
        vote = vote * free
        if np.abs(vote).max() > _SURE:
            axis = np.zeros(3)
            axis[int(np.abs(vote).argmax())] = np.sign(vote[int(np.abs(vote).argmax())])
            return axis, True
        return (_Y if free[1] else _Z), False

    def front(self, left: Doubles | None, up: Doubles) -> tuple[Doubles, bool]:
        """The axis along which the face looks, and whether the shapes determine it; otherwise the
        axis is a guess.

        Args:
            left: axis of the left side, or None.
            up: axis of the top.
        """
        if left is not None and abs(np.dot(left, up)) < 0.5:
            across = [left]
        else:  # the axis across which the mesh is most symmetric
            free = [a for a in np.eye(3) if abs(np.dot(a, up)) < 0.5]
            across = sorted(free, key=self._unlike)[:1]
        axis = np.abs(np.cross(up, across[0]))
        vote = self._forward(axis, np.abs(across[0]))
        if abs(vote) > _SURE:
            return np.asarray(np.sign(vote) * axis), True
        guess = _Z if abs(axis[2]) > 0.5 else axis
        return (np.asarray(np.cross(left, up)) if left is not None else guess), False

    def _forward(self, axis: Doubles, across: Doubles) -> float:
        """A vote: positive if the face looks along an axis, negative if against it.

        Args:
            axis: float64[3], the axis.
            across: float64[3], the axis from side to side.
        """
        depth = self.points @ axis
        if not self.rows:
            return 0.0
        extent = max(float(np.ptp(depth)), 1e-3 * self.size)
        totals = np.array([row[4] for row in self.rows])
        centers = np.array([row[2] for row in self.rows])
        middle = float((depth.max() + depth.min()) / 2)
        # Each shape has the same weight, because otherwise a wide jaw would outweigh the face.
        vote = 2.0 * float(np.clip((centers @ axis - middle).mean() / extent, -0.5, 0.5))
        for _, controls, _, mean, _ in self.rows:
            along = float(mean @ axis) / max(float(np.linalg.norm(mean)), 1e-300)
            if any(c.startswith(_FORWARD) for c in controls):
                vote += 0.5 * along
            elif "jawOpen" in controls:
                vote -= 0.3 * along
        near = self._near(centers[totals.argsort()], across)
        side = np.abs(self.points[near] @ across - np.median(self.points @ across))
        if len(near) > 8 and side.std() > 1e-6 * self.size and depth[near].std() > 0:
            vote -= float(np.corrcoef(depth[near], side)[0, 1])
        return vote

    def _near(self, centers: Doubles, across: Doubles) -> Ints:
        """Indices of the vertices near the centres of the shapes; excludes the back of the head.

        Args:
            centers: float64[n, 3], the centre of each shape.
            across: float64[3], the axis from side to side.
        """
        middle = np.median(centers, axis=0)
        reach = 0.35 * max(float(np.ptp(self.points @ across)), 1e-9)
        away = self.points - middle
        away = away - np.outer(away @ across, across) * 0.5
        return np.flatnonzero(np.linalg.norm(away, axis=1) < reach)

    def _unlike(self, axis: Doubles) -> float:
        """The mean distance of the mesh from its mirror image; the mirror is perpendicular to an
        axis."""
        step = max(1, len(self.points) // _POINTS)
        points = self.points[::step] - (self.points.min(axis=0) + self.points.max(axis=0)) / 2
        other = points * (1 - 2 * np.abs(axis))
        apart = ((points[:, None] - other[None]) ** 2).sum(axis=2)
        return float(np.sqrt(apart.min(axis=1)).mean())

    def volume(self) -> float:
        """Six times the volume of the mesh; negative if polygons face inwards."""
        middle, total = self.points.mean(axis=0), 0.0
        for size in {len(face) for face in self.mesh.faces}:
            table = np.array([face for face in self.mesh.faces if len(face) == size])
            corners = self.points[table] - middle
            for k in range(1, size - 1):
                area = np.cross(corners[:, k], corners[:, k + 1])
                total += float((corners[:, 0] * area).sum())
        return total


def _sided(name: str, controls: Sequence[str]) -> tuple[str, str]:
    """A name that a left shape shares with its right shape, and the shape's side: L, R or ""."""
    sides = {side_of(control) for control in controls}
    if len(sides) == 1 and sides <= {"L", "R"}:
        return "|".join(control[:-1] for control in controls), sides.pop()
    loose = vocabulary.loose_name(name)
    if not controls and loose[-2:] in ("|l", "|r"):
        return loose[:-2], loose[-1].upper()
    return name, ""


def check_axes(wishes: Wishes) -> str:
    """An error message if the user's axes are invalid, or ""."""
    said = {name: getattr(wishes, name) for name in ("left", "up", "front")}
    for name, word in said.items():
        if word and word not in AXES:
            return f"{name}: one of {', '.join(AXES)} was expected, found {word!r}"
    used = [word[1] for word in said.values() if word]
    if len(set(used)) < len(used):
        return "left, up and front: three different axes were expected"
    return ""
