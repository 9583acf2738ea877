# SPDX-License-Identifier: MIT
"""Makes the joints of eyes and jaw from a head's meshes and shapes."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..geometry import skeleton as sk
from ..geometry.rigid import about, rigid_fit
from ..geometry.skeleton import Doubles, Ints
from .islands import Ball, ball_of, islands_of
from .parts import HeadPart, first_vertices, taken_apart

# Look control -> rotation of an eye in degrees about x (positive: down) and y (positive: left).
LOOKS = {"eyeLookUp": (-25, 0), "eyeLookDown": (30, 0), "eyeLookLeft": (0, 30),
          "eyeLookRight": (0, -30)}  # fmt: skip
_EYE = re.compile(r"eye|iris|pupil|sclera|cornea", re.IGNORECASE)
_BESIDE = re.compile(r"lash|brow|lid|eyeline|shadow|wet|edge|occl|glass|tear|shell", re.IGNORECASE)
# Largest standard deviation from the radius, in radii, of a sphere in a mesh named like an eye. It
# is larger than for other meshes, because corneas bulge.
_NAMED_ROUND = 0.18
_SIZES = (0.02, 0.16)  # smallest and largest radius of an eye, in heights of the face
_INSIDE = 1.1  # in radii: islands within this distance turn with the eye
_NONE = np.zeros(0, np.int64)
# In radii. A sphere without vertices farther than _FRONT in front of its centre is a hollow socket.
# A shape deforms a sphere if most vertices are farther than _SQUASH from their rigid motion.
_FRONT, _SQUASH = 0.6, 0.25
_LEAST_ANGLE = 0.03  # radians; smaller rotations do not count
_NO_TURN = 0.4  # largest error of a rotation relative to a shape's largest displacement
# Vertices that jawOpen moves by more than _HELD of its largest displacement count as rigid parts of
# the jaw. The lowest fraction _CHIN of them is the chin.
_HELD, _CHIN = 0.7, 0.4
_FOLLOWS = 0.05  # smallest motion of the chin by a shape, relative to jawOpen


@dataclass
class Turn:
    """A child joint of the head, and its motions.

    Attributes:
        name: name of the joint.
        position: float64[3], the joint's position in the rest pose.
        motions: raw control without prefix -> rotation [3, 3] from the rest pose about `position`,
            and shift [3] of the position.
    """

    name: str
    position: Doubles
    motions: dict[str, tuple[Doubles, Doubles]] = field(default_factory=dict)


@dataclass
class Eye:
    """An eye: its side (L or R), its sphere, and the parts that turn with it."""

    side: str
    ball: Ball
    parts: list[HeadPart]

    @property
    def joint(self) -> str:
        return f"FACIAL_{self.side}_Eye"


def take_eyes(
    parts: Sequence[HeadPart], height: float, lids: Mapping[str, Doubles]
) -> tuple[list[HeadPart], list[Eye]]:
    """Find the eyes: two spheres in one or two meshes. Returns the other meshes, and the eyes.

    Args:
        parts: parts of the head, upright and centred; x points to the left.
        height: height of the face.
        lids: L or R -> float64[3], the mean position of the vertices that a blink moves.
    """
    labels = [islands_of(part.mesh) for part in parts]
    found = [
        (number, ball)
        for number, part in enumerate(parts)
        for ball in _balls(part, labels[number], height)
    ]
    pair = _pair(parts, found, lids)
    if pair is None:
        return list(parts), []
    eyes = [Eye(side, ball, []) for side, (_, ball) in zip("LR", pair, strict=True)]
    rest = []
    for number, (part, islands) in enumerate(zip(parts, labels, strict=True)):
        own = [ball.vertices[:1] if at == number else _NONE for at, ball in pair]
        rest.extend(_divided(part, islands, eyes, own))
    return rest, eyes


def _balls(part: HeadPart, islands: Ints, height: float) -> list[Ball]:
    """The islands of a mesh that have the form and the size of eyes.

    Args:
        part: the mesh.
        islands: int64[V], island of each vertex.
        height: height of the face.
    """
    named = _EYE.search(part.name) is not None
    if _BESIDE.search(part.name):
        return []
    points, out = part.mesh.positions, []
    order = np.argsort(islands, kind="stable")
    for own in np.split(order, np.cumsum(np.bincount(islands))[:-1]):
        if len(own) < 12 or np.ptp(points[own], axis=0).max() > 4 * _SIZES[1] * height:
            continue
        ball = ball_of(points, own, _NAMED_ROUND) if named else ball_of(points, own)
        if ball is None or not _SIZES[0] * height < ball.radius < _SIZES[1] * height:
            continue
        if _looks_out(points, ball) and not _is_squashed(part, ball):
            out.append(ball)
    return out


def _looks_out(points: Doubles, ball: Ball) -> bool:
    """Whether a sphere has vertices at its front. A hollow socket shaped like an eye has none."""
    return bool(points[ball.vertices, 2].max() > ball.middle[2] + _FRONT * ball.radius)


def _is_squashed(part: HeadPart, ball: Ball) -> bool:
    """Whether a shape deforms most of a sphere, such as a blink of a cartoon eye with lids."""
    before = part.mesh.positions[ball.vertices]
    for delta in part.shapes.values():
        own = delta[ball.vertices]
        if np.abs(own).max() < _SQUASH * ball.radius:
            continue
        rotation, moved = rigid_fit(before, before + own)
        rest = before @ rotation.T + moved - before - own
        if np.median(np.linalg.norm(rest, axis=1)) > _SQUASH * ball.radius:
            return True
    return False


def _pair(
    parts: Sequence[HeadPart], found: Sequence[tuple[int, Ball]], lids: Mapping[str, Doubles]
) -> tuple[tuple[int, Ball], tuple[int, Ball]] | None:
    """The left and the right eye among spheres, each with the index of its mesh; None if no two
    spheres lie like eyes.

    Meshes named like eyes come before other meshes, then larger spheres before smaller ones.

    Args:
        parts: the meshes.
        found: index of the mesh, and sphere, of each candidate.
        lids: L or R -> float64[3], the mean position of the vertices that a blink moves.
    """
    best: tuple[tuple[bool, float], tuple[int, Ball], tuple[int, Ball]] | None = None
    for i, left in found:
        for j, right in found:
            if left.middle[0] <= right.middle[0] or left is right:
                continue
            radius = (left.radius + right.radius) / 2
            other = right.middle * [-1, 1, 1]
            named = all(_EYE.search(parts[k].name) for k in (i, j))
            off = np.linalg.norm(left.middle - other)
            loose = 2.5 if named else 0.7  # larger for named eyes, because heads may be asymmetric
            if off > loose * radius or abs(left.radius - right.radius) > 0.4 * radius:
                continue
            if left.middle[0] - right.middle[0] < 2 * radius or not (
                _under_lid(left, lids.get("L")) and _under_lid(right, lids.get("R"))
            ):
                continue
            key = (named, radius)
            if best is None or key > best[0]:
                best = key, (i, left), (j, right)
    return best[1:] if best else None


def _under_lid(ball: Ball, lid: Doubles | None) -> bool:
    return lid is None or bool(np.linalg.norm(ball.middle - lid) < 3 * ball.radius)


def _divided(
    part: HeadPart, islands: Ints, eyes: Sequence[Eye], own: Sequence[Ints]
) -> list[HeadPart]:
    """Give each island of a mesh that lies inside an eye's sphere to that eye. Returns a list with
    one mesh, which has the islands that no eye gets; the list is empty if the eyes get all
    islands.

    Args:
        part: the mesh.
        islands: int64[V], island of each vertex.
        eyes: both eyes.
        own: for each eye, the index of one vertex of its sphere; empty if the sphere belongs to
            another part.
    """
    if _BESIDE.search(part.name):
        return [part]
    count = int(islands.max()) + 1
    of_island = np.full(count, 2)
    with_polygons = np.zeros(count, bool)
    with_polygons[islands[first_vertices(part)]] = True
    for number, eye in enumerate(eyes):
        away = np.linalg.norm(part.mesh.positions - eye.ball.middle, axis=1)
        furthest = np.zeros(count)
        np.maximum.at(furthest, islands, away)
        reach = _INSIDE * eye.ball.radius
        if _EYE.search(part.name):
            reach *= 1.2  # the island of a cornea extends farther
        of_island[(furthest < reach) & with_polygons] = number
        of_island[islands[own[number]]] = number
    if (of_island == 2).all():
        return [part]
    out: list[HeadPart] = []
    kind = "cornea" if "cornea" in part.name.lower() else "eye"
    for number, name in enumerate((f"{kind}Left", f"{kind}Right", part.name)):
        labels = np.where(of_island[islands[first_vertices(part)]] == number, 0, -1)
        theirs = eyes[number].parts if number < 2 else out
        theirs.extend(taken_apart(part, [name], labels))
    return out


def eye_turn(eye: Eye, controls: Mapping[str, Sequence[str]]) -> tuple[Turn, dict[str, float]]:
    """The joint of an eye with the rotations of the look controls.

    A shape that turns the eye gives its rotation. Other look controls get usual angles.

    Args:
        eye: the eye. Its parts keep only the shapes that do not turn it, such as a pupil's.
        controls: shape -> raw controls without prefix.

    Returns: the joint; and for each shape that turns the eye, its name -> the largest distance of a
        vertex from its position after the rigid motion alone.
    """
    turn = Turn(eye.joint, eye.ball.middle)
    left: dict[str, float] = {}
    kept: list[str] = []
    names = dict.fromkeys(name for part in eye.parts for name in part.shapes)
    points = np.concatenate([part.mesh.positions for part in eye.parts])
    for name in names:
        delta = np.concatenate(
            [part.shapes.get(name, np.zeros_like(part.mesh.positions)) for part in eye.parts]
        )
        if np.abs(delta).max() < 1e-4 * eye.ball.radius:
            continue
        rotation, moved = rigid_fit(points, points + delta)
        angle = float(np.linalg.norm(sk.rotation_vectors(rotation)))
        every = controls.get(name, ())
        own = [control for control in every if control.endswith(eye.side) or len(every) == 1]
        arm = points - eye.ball.middle
        # A shape may turn the eye about another point, such as a joint of the body's rig.
        rotation, shift = about(eye.ball.middle, rotation, moved)
        rest = _longest(delta - (arm @ rotation.T + shift - arm))
        if angle > _LEAST_ANGLE and own and rest < _NO_TURN * _longest(delta):
            turn.motions.setdefault(own[0], (rotation, shift))
            left[name] = rest
        else:
            kept.append(name)
    for look in LOOKS:
        turn.motions.setdefault(look + eye.side, (look_turn(look), np.zeros(3)))
    for part in eye.parts:
        part.shapes = {name: part.shapes[name] for name in kept if name in part.shapes}
    return turn, left


def look_turn(look: str) -> Doubles:
    """float64[3, 3]: the usual rotation of an eye by a look control, from the rest pose.

    The matrix multiplies column vectors with x to the left, y up and z to the front.

    Args:
        look: key of LOOKS, the control's name without its side.
    """
    x, y = np.radians(LOOKS[look])
    return np.asarray(sk.matrices_of_vectors(np.array([[x, y, 0.0]]))[0])


def _longest(rows: Doubles) -> float:
    return float(np.linalg.norm(rows, axis=1).max())


def jaw_turn(
    points: Doubles,
    shapes: Mapping[str, Doubles],
    controls: Mapping[str, Sequence[str]],
    opening: Doubles,
    whole: Sequence[str],
) -> Turn | None:
    """The jaw's joint at its hinge, with the rigid motion of the chin in each shape that moves the
    chin and has a single control: a jaw control, or any control if the shape is in `whole`.

    Returns None if the mouth opens without a rotation.

    Args:
        points: float64[V, 3], vertices of the face.
        shapes: name -> displacements float64[V, 3].
        controls: shape -> raw controls without prefix.
        opening: float64[V, 3], displacements of the shape that opens the mouth.
        whole: names of shapes that move the whole mouth, such as visemes.
    """
    length = np.linalg.norm(opening, axis=1)
    held = np.flatnonzero(length > _HELD * length.max())
    heights = points[held, 1]
    chin = held[heights <= np.quantile(heights, _CHIN)]
    before = points[held]
    rotation, shift = rigid_fit(before, before + opening[held])
    if np.linalg.norm(sk.rotation_vectors(rotation)) < _LEAST_ANGLE:
        return None
    middle = before.mean(axis=0)
    turned = shift - (middle - rotation @ middle)
    arm, *_ = np.linalg.lstsq(np.eye(3) - rotation, turned, rcond=1e-3)
    turn = Turn("FACIAL_C_Jaw", np.asarray(middle + arm))
    least = _FOLLOWS * float(length[chin].mean())
    for name in shapes:
        own = controls.get(name, ())
        if len(own) != 1 or not (own[0].startswith("jaw") or name in whole):
            continue
        delta = shapes[name]
        rows = held if np.array_equal(delta, opening) else chin
        if np.linalg.norm(delta[rows], axis=1).mean() > least:
            fitted = rigid_fit(points[rows], points[rows] + delta[rows])
            turn.motions[own[0]] = about(turn.position, *fitted)
    return turn
