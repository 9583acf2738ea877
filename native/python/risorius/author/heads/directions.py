# SPDX-License-Identifier: MIT
"""Where a face looks, where its left and its top are, from the names of its shapes and from places.

Names say where left is: what is called left moves vertices there. Brows over mouth and a jaw that
opens say where the top is. What moves lies before the rest of a head, bulges in its middle, and
lips pucker forwards: that says where the front is.
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
_SURE = 0.1  # votes that are smaller say nothing
_ALONG = 0.8  # of a direction's length: what lies less along its axis is turned against it
_POINTS = 600  # that are looked at for symmetry
_Y, _Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


@dataclass
class Direction:
    """How a head stands in its file.

    Attributes:
        left, up, front: float64[3], one of the six axes each. Left is where the named left is.
        named: how many pairs of names say where left is.
        sure_up, sure_front: whether places say so; else it is what formats agree on.
        inside_out: whether polygons show their backs, as in a file that was mirrored.
        turned: degrees by which the named sides are turned against the axes, 0 for little.
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
        """Whether left is where a face that looks so has its left."""
        return bool(np.dot(np.cross(self.up, self.front), self.left) > 0)


def axis_of(word: str) -> Doubles:
    """float64[3] of one of AXES."""
    out = np.zeros(3)
    out["xyz".index(word[1])] = 1.0 if word[0] == "+" else -1.0
    return out


def word_of(axis: Doubles, said: Sequence[str] = ("+x", "+y", "+z")) -> str:
    """One of AXES, or as others call it.

    Args:
        axis: float64[3], along one of the axes.
        said: what the three axes are called, each with its sign.
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
    """How a head stands.

    Args:
        mesh: of the face.
        shapes: float64[V, 3] by name.
        controls: raw controls without prefix by name.
        wishes: what is said and not guessed.
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
    """What shapes move, and where."""

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
        """The axis from what is called right to what is called left; pairs; degrees off it."""
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
        """The axis from mouth to brows, across to those that are taken."""
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
        """The axis that the face looks along."""
        if left is not None and abs(np.dot(left, up)) < 0.5:
            across = [left]
        else:  # the one across which the mesh is alike on both sides
            free = [a for a in np.eye(3) if abs(np.dot(a, up)) < 0.5]
            across = sorted(free, key=self._unlike)[:1]
        axis = np.abs(np.cross(up, across[0]))
        vote = self._forward(axis, np.abs(across[0]))
        if abs(vote) > _SURE:
            return np.asarray(np.sign(vote) * axis), True
        guess = _Z if abs(axis[2]) > 0.5 else axis
        return (np.asarray(np.cross(left, up)) if left is not None else guess), False

    def _forward(self, axis: Doubles, across: Doubles) -> float:
        """Whether the face looks along an axis (above 0) or against it."""
        depth = self.points @ axis
        if not self.rows:
            return 0.0
        extent = max(float(np.ptp(depth)), 1e-3 * self.size)
        totals = np.array([row[4] for row in self.rows])
        centers = np.array([row[2] for row in self.rows])
        middle = float((depth.max() + depth.min()) / 2)
        # Each shape counts alike: a jaw that opens wide is not the whole face.
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
        """Indices of the vertices near those that shapes move: the face, no back of the head."""
        middle = np.median(centers, axis=0)
        reach = 0.35 * max(float(np.ptp(self.points @ across)), 1e-9)
        away = self.points - middle
        away = away - np.outer(away @ across, across) * 0.5
        return np.flatnonzero(np.linalg.norm(away, axis=1) < reach)

    def _unlike(self, axis: Doubles) -> float:
        """How far the mesh is from its mirror image across an axis."""
        step = max(1, len(self.points) // _POINTS)
        points = self.points[::step] - (self.points.min(axis=0) + self.points.max(axis=0)) / 2
        other = points * (1 - 2 * np.abs(axis))
        apart = ((points[:, None] - other[None]) ** 2).sum(axis=2)
        return float(np.sqrt(apart.min(axis=1)).mean())

    def volume(self) -> float:
        """Below 0 where the polygons' backs are outside."""
        middle, total = self.points.mean(axis=0), 0.0
        for size in {len(face) for face in self.mesh.faces}:
            table = np.array([face for face in self.mesh.faces if len(face) == size])
            corners = self.points[table] - middle
            for k in range(1, size - 1):
                area = np.cross(corners[:, k], corners[:, k + 1])
                total += float((corners[:, 0] * area).sum())
        return total


def _sided(name: str, controls: Sequence[str]) -> tuple[str, str]:
    """What a shape is called without its side, and its side: L, R or ""."""
    sides = {side_of(control) for control in controls}
    if len(sides) == 1 and sides <= {"L", "R"}:
        return "|".join(control[:-1] for control in controls), sides.pop()
    loose = vocabulary.loose_name(name)
    if not controls and loose[-2:] in ("|l", "|r"):
        return loose[:-2], loose[-1].upper()
    return name, ""


def check_axes(wishes: Wishes) -> str:
    """What is wrong with the axes that were said, "" for nothing."""
    said = {name: getattr(wishes, name) for name in ("left", "up", "front")}
    for name, word in said.items():
        if word and word not in AXES:
            return f"{name}: one of {', '.join(AXES)} was expected, found {word!r}"
    used = [word[1] for word in said.values() if word]
    if len(set(used)) < len(used):
        return "left, up and front: three different axes were expected"
    return ""
