# SPDX-License-Identifier: MIT
"""Repairs expressions transferred to a head (the target), and reports faults before and after."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from ...author.geometry.skeleton import Doubles
from ...author.geometry.sparse import SparseShapes
from ...base.patience import patiently
from ..errors import Stopped
from ..eyes.eyelids import Eyelids, find_eyelids
from ..fittings.fitted import Bodies, Fittings, eye_turn_of
from ..surface import Surface
from .contact import LEAST, Contacts
from .lips import COLUMNS, Lips
from .parted import rest_closing
from .report import MM, Faults, Report

Pose = tuple[str, ...]
Progress = Callable[[float], bool | None]
_BLINK, _OPEN = "eyeBlink", "jawOpen"
_CLOSE = ("mouthLipsTogether", "mouthClose")  # prefixes of controls that close lips of an open jaw
_ELSEWHERE = "tongue"  # prefix of controls that move other meshes
_WELDED = 2  # columns of the mouth whose lips may be joined, as they are near its corners
_CUT = 0.002  # cm: smaller depths of lids in the eye are ignored


class Places(Protocol):
    """The part of Landmarks that repair uses."""

    @property
    def points(self) -> Mapping[str, Doubles]:
        """float64[3] by landmark name: the position of each landmark."""


@dataclass
class Repaired:
    """The result of `repair`.

    Attributes:
        expressions: float64[V, 3] by raw control, displacements of the skin; zeros for a control
            that moves the skin only in combinations.
        combinations: float64[V, 3] by controls that are 1 together: their whole displacement.
        report: faults before and after the repair.
    """

    expressions: SparseShapes[str]
    combinations: SparseShapes[Pose]
    report: Report


def repair(
    target: Surface,
    faces: Sequence[Sequence[int]],
    parts: Fittings,
    landmarks: Places | None,
    registered: object,
    expressions: Mapping[str, Doubles],
    combinations: Mapping[Pose, Doubles],
    progress: Progress | None = None,
) -> Repaired:
    """Repair expressions: close the lids and lips, and take skin out of eyes and teeth.

    The pose of closing_pose() is added to the combinations if it is not among them.

    Args:
        target: the skin in the rest pose, in cm, y up, the face towards +z.
        faces: polygons of the skin.
        parts: eyes, teeth and other meshes; the notes of the report are added to its notes.
        landmarks: give the corners of the mouth; None: the corners are searched for.
        registered: unused.
        expressions: float64[V, 3] by raw control, displacements of the skin.
        combinations: float64[V, 3] by controls that are 1 together: their whole displacement.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        Stopped: `progress` returned False.
    """
    del registered
    closing = closing_pose(expressions, combinations)
    work = Repairing(target, faces, parts, landmarks, expressions, closing)
    together = SparseShapes[Pose](len(target.points), combinations)
    if closing and not any(set(pose) == set(closing) for pose in together):
        together[closing] = _together(closing, expressions, combinations)
    expressions, together = work.closed_at_rest(expressions, together)
    singles = SparseShapes[str](len(target.points))
    jobs = len(expressions) + len(together)
    for number, (name, way) in enumerate(expressions.items()):
        one = partial(work.repaired, (name,), np.asarray(way, np.float64))
        singles[name] = patiently(one, partial(_ask, progress, number / jobs))
        _ask(progress, number / jobs)
    out = SparseShapes[Pose](len(target.points))
    for number, (pose, way) in enumerate(together.items(), len(expressions)):
        changes = [singles[c] - expressions[c] for c in pose if c in singles]
        whole = np.asarray(way, np.float64) + sum(changes, np.zeros(1))
        one = partial(work.repaired, pose, whole)
        out[pose] = patiently(one, partial(_ask, progress, number / jobs))
        _ask(progress, number / jobs)
    for name in dict.fromkeys(name for pose in out for name in pose):
        if name not in singles and not name.startswith(_ELSEWHERE):
            singles[name] = np.zeros_like(target.points)
    parts.notes.extend(work.report.notes)
    return Repaired(singles, out, work.report)


def _ask(progress: Progress | None, share: float) -> None:
    if progress is not None and progress(share) is False:
        raise Stopped


def closing_pose(expressions: Mapping[str, Doubles], combinations: Mapping[Pose, Doubles]) -> Pose:
    """The controls of an open jaw with closed lips; empty if the face has no such controls.

    Args:
        expressions: float64[V, 3] by raw control, displacements of the skin.
        combinations: float64[V, 3] by controls that are 1 together, displacements of the skin.
    """
    names = dict.fromkeys([*expressions, *(name for pose in combinations for name in pose)])
    lips = [name for name in names if name.startswith(_CLOSE)]
    return (_OPEN, *lips) if lips and _OPEN in expressions else ()


def _together(
    pose: Pose, expressions: Mapping[str, Doubles], combinations: Mapping[Pose, Doubles]
) -> Doubles:
    """float64[V, 3]: the displacements of a pose: the sum of the displacements of its controls and
    of the correctives of each pair of its controls."""

    def alone(name: str) -> Doubles:
        return np.asarray(expressions.get(name, 0.0), np.float64)

    out = sum((alone(name) for name in pose), np.zeros(1))
    for pair, way in combinations.items():
        if len(pair) == 2 and set(pair) <= set(pose):
            out = out + way - alone(pair[0]) - alone(pair[1])
    return np.asarray(out)


def _closes_eye(pose: Pose, side: str) -> bool:
    return _BLINK + side in pose


class Repairing:
    """Repairs poses of one target; see `repair`."""

    def __init__(
        self,
        target: Surface,
        faces: Sequence[Sequence[int]],
        parts: Fittings,
        landmarks: Places | None,
        expressions: Mapping[str, Doubles],
        closing: Pose,
    ) -> None:
        """Find the lids, lips and teeth.

        Args:
            target, faces, parts, landmarks, expressions: as in `repair`.
            closing: the result of closing_pose.
        """
        self.report = Report()
        self.target = target
        self.eyelids: dict[str, Eyelids] = {}
        for side, ball in parts.eyes.items():
            lids = find_eyelids(target, ball)
            if lids is not None:
                self.eyelids[side] = lids
                continue
            word = "left" if side == "L" else "right"
            self.report.notes.append(f"no lids were found at the {word} eye: they are not repaired")
        self.lips = Lips(target, expressions, _corners(landmarks))
        self.lip_controls = closing
        if not self.lips.found and self.lip_controls:
            self.report.notes.append("no lips that open were found: they are not repaired")
        welded = self.lips.welded() if self.lips.found else 0
        if welded > _WELDED:
            self.report.notes.append(
                f"the lips are joined in {welded / COLUMNS:.0%} of the mouth: there they cannot "
                "open"
            )
        self.bodies = Bodies(parts, target, expressions)
        self.contacts = Contacts(target, faces, self.bodies)

    def repaired(self, pose: Pose, way: Doubles) -> Doubles:
        """float64[V, 3]: the repaired displacements of a pose.

        If the pose has faults, or closes eyes or the mouth, its faults before and after the repair
        are added to the report. A pose without displacements is returned unchanged.

        Args:
            pose: names of the raw controls with value 1.
            way: float64[V, 3], the displacements of the pose.
        """
        if not way.any():
            return way
        before = self.faults(pose, way)
        closes = self._closes_mouth(pose)
        if closes and self.lips.too_far(self.target.points + way):
            closes = False
            self.report.notes.append(
                f"{'+'.join(pose)} leaves the lips {before.lip_gap:.0f} mm apart, too far to be "
                "brought together: is the mouth open at rest?"
            )
        out = self._at_eyes(pose, way)
        out = self._lips_closed(out) if closes else out
        if before.volume > LEAST:
            out = self.contacts.pushed(out, pose)
            out = self._lips_closed(out) if closes else out
        changed = out is not way and bool(np.abs(out - way).max(initial=0.0) > 0)
        after = self.faults(pose, out) if changed else before
        if before != Faults() or after != Faults() or self._closes(pose):
            self.report.rows["+".join(pose)] = before, after
        return out

    def closed_at_rest(
        self, expressions: Mapping[str, Doubles], combinations: SparseShapes[Pose]
    ) -> tuple[Mapping[str, Doubles], SparseShapes[Pose]]:
        """Expressions and combinations in which the lip controls also close a mouth that is open in
        the rest pose. If the lips meet in the rest pose, both are returned unchanged.

        The report contains no faults from before this change.

        Args:
            expressions: float64[V, 3] by raw control, displacements of the skin.
            combinations: float64[V, 3] by controls that are 1 together: their whole displacement,
                with the controls that close the mouth of an open jaw.
        """
        if not self.lips.found or not self.lip_controls:
            return expressions, combinations
        added = rest_closing(self.lips, self.lip_controls, expressions, combinations)
        if added is None:
            return expressions, combinations
        self.lip_controls = added.pose
        singles = SparseShapes[str](len(self.target.points), expressions)
        for name in self.lip_controls:
            motion = added.motion((name,))
            if motion.any():
                singles[name] = motion + singles.get(name, np.zeros(1))
        together = SparseShapes[Pose](len(self.target.points), combinations)
        for pose in combinations:
            motion = added.motion(pose)
            if motion.any():
                together[pose] = motion + together[pose]
        if len(added.pose) > 1 and not any(set(pose) == set(added.pose) for pose in together):
            together[added.pose] = _together(added.pose, singles, {}) + added.rest
        return singles, together

    def faults(self, pose: Pose, way: Doubles) -> Faults:
        """Measure the faults of a pose.

        Args:
            pose: names of the raw controls with value 1.
            way: float64[V, 3], the displacements of the pose.
        """
        gap = cut = 0.0
        for side, lids in self.eyelids.items():
            turn = eye_turn_of(side, pose)
            if turn is None and not lids.moves(way):
                continue
            if _closes_eye(pose, side):
                gap = max(gap, lids.gap(way, turn))
            cut = max(cut, lids.cut(way, turn))
        lip_gap = lip_cut = 0.0
        if self._closes_mouth(pose):
            points = self.target.points + way
            lip_gap, lip_cut = self.lips.widest(points), self.lips.deepest(points)
        volume = self.contacts.volume(way, pose)
        stretched = self.contacts.stretched(way)
        return Faults(gap * MM, cut * MM, lip_gap * MM, lip_cut * MM, volume, stretched)

    def _at_eyes(self, pose: Pose, way: Doubles) -> Doubles:
        out = way
        for side, lids in self.eyelids.items():
            turn = eye_turn_of(side, pose)
            if _closes_eye(pose, side):
                out = lids.closed(out, turn)
            elif (turn is not None or lids.moves(out)) and lids.cut(out, turn) > _CUT:
                out = lids.lifted(out, turn)
        return out

    def _lips_closed(self, way: Doubles) -> Doubles:
        return self.lips.closed(self.target.points + way) - self.target.points

    def _closes_mouth(self, pose: Pose) -> bool:
        return self.lips.found and bool(self.lip_controls) and set(self.lip_controls) <= set(pose)

    def _closes(self, pose: Pose) -> bool:
        return self._closes_mouth(pose) or any(_closes_eye(pose, side) for side in self.eyelids)


def _corners(landmarks: Places | None) -> Doubles | None:
    if landmarks is None:
        return None
    found = [landmarks.points.get(f"mouth_corner_{side}") for side in "RL"]
    if any(place is None for place in found):
        return None
    return np.array(found, np.float64)
