# SPDX-License-Identifier: MIT
"""Makes the poses in which faces are compared: each expression, and each corrective."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import Dna, Rig
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles, Ints
from ..rigs.joint_controls import joint_controls

_AT_ONCE = 1 << 16  # joints that are posed at once, 1 kB of memory each

Floats = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Pose:
    """The raw controls of one pose.

    Attributes:
        name: name of the control, or of a corrective's controls joined by +.
        raw: float32[R], values of all raw controls.
        input: index in the control vector of the raw control or corrective that the pose tests; -1
            if this corrective was removed.
        controls: number of controls in the pose; a joint's rotation counts as one.
    """

    name: str
    raw: Floats
    input: int
    controls: int


def poses_of(dna: Dna, rig: Rig) -> list[Pose]:
    """A pose per raw control at 1, then a pose per corrective with all of its controls at 1.

    Controls that are components of a joint's rotation get no pose, because their values are not
    weights. For a corrective that a pose solver drives, the pose has the solver's rotations. A
    corrective that reads an output of a network gets no pose.

    Args:
        dna: the face.
        rig: compiled from it.
    """
    names, rest = dna.raw_control_names, rig.initial_raw_controls
    turned = {c for joint in joint_controls(dna)[0] for c in joint.controls}
    out = []
    for control in range(len(names)):
        if control not in turned:
            out.append(_pose(names, rest, {control: 1.0}, control))
    factors = Factors(dna)
    for row in range(len(names), len(names) + dna.psd_count):
        found = factors.of(row)
        if found:
            out.append(_pose(names, rest, found, row))
    return out


def _pose(names: Sequence[str], rest: Floats, values: dict[int, float], source: int) -> Pose:
    raw = rest.copy()
    for control, value in values.items():
        raw[control] = value
    # The name of a solver's pose has the names of joints, not of their four rotation controls.
    shown = dict.fromkeys(
        names[c].rpartition(".")[0] if names[c].rpartition(".")[2] in ("qx", "qy", "qz", "qw")
        else names[c] for c in values
    )  # fmt: skip
    return Pose(" + ".join(shown), raw, source, len(shown))


class Factors:
    """Finds the raw controls that activate correctives."""

    def __init__(self, dna: Dna) -> None:
        """Args:
        dna: the face.
        """
        self.raw = len(dna.raw_control_names)
        self.parts = sk.psd_parts(dna)
        self._solved = _solver_poses(dna)

    def of(self, control: int) -> dict[int, float]:
        """Index of a raw control -> its value, so that `control` is 1; empty if there are none.

        Args:
            control: index in the control vector of a raw control, corrective or solver's pose.
        """
        values: dict[int, float] = {}
        waiting, seen = [control], set()
        while waiting:
            at = waiting.pop()
            if at in seen:
                continue
            seen.add(at)
            if at < self.raw:
                values.setdefault(at, 1.0)
            elif at in self.parts:
                waiting += sorted(self.parts[at], reverse=True)
            elif at in self._solved:
                values |= self._solved[at]
            else:
                return {}
        return values


def _solver_poses(dna: Dna) -> dict[int, dict[int, float]]:
    """Control that a solver's pose writes -> values of the raw controls at that pose."""
    behavior = dna.rbf_behavior
    at_pose: dict[int, dict[int, float]] = {}
    for solver in behavior.solvers:
        inputs = np.asarray(solver.raw_control_indices, np.int64)
        poses = np.asarray(solver.pose_indices, np.int64)
        values = np.asarray(solver.raw_control_values, np.float64)
        if len(values) != len(inputs) * len(poses):
            continue
        for pose, row in zip(poses.tolist(), values.reshape(len(poses), -1), strict=True):
            at_pose[pose] = dict(zip(inputs.tolist(), row.tolist(), strict=True))
    written = dna.rbf_behavior_ext.poses
    if not written:
        networks = len(dna.machine_learned_behavior.ml_control_names)
        first = len(dna.raw_control_names) + dna.psd_count + networks
        return {first + pose: values for pose, values in at_pose.items()}
    return {
        int(control): at_pose[pose]
        for pose, controls in enumerate(written) if pose in at_pose
        for control in controls.output_control_indices
    }  # fmt: skip


def motions_at(dna: Dna, deltas: Doubles, middle: Doubles) -> Doubles:
    """float64[n, joints, 3, 4]: motions of points fixed to joints, relative to an origin.

    Args:
        dna: face with the neutral pose and the joint hierarchy.
        deltas: float64[n, joints, 9], joint transforms relative to the neutral pose.
        middle: float64[3], the origin of the points.
    """
    posed = sk.world_matrices(dna, deltas)
    rest = sk.world_matrices(dna, np.zeros_like(deltas[0]))
    out = (posed @ np.linalg.inv(rest))[..., :3, :]
    out[..., 3] += out[..., :3] @ middle - middle
    return out


def motion_rows(
    dna: Dna, rig: Rig, lod: int, poses: Sequence[Pose], middle: Doubles
) -> Iterator[Doubles]:
    """The motions of joints in poses minus the identity, a block of poses at a time.

    The results are 0 in the neutral pose.

    Args:
        dna: the face.
        rig: compiled from it.
        lod: the LOD that is evaluated.
        poses: all poses.
        middle: float64[3], the origin of the points.

    Yields:
        float64[n, joints, 3, 4] of the next n poses.
    """
    count = len(dna.joint_names)
    step = max(1, _AT_ONCE // max(1, count))
    for begin in range(0, len(poses), step):
        some = poses[begin : begin + step]
        found = rig.evaluate_batch(np.stack([pose.raw for pose in some]), lod=lod)
        deltas = np.asarray(found.joints, np.float64).reshape(len(some), count, 9)
        yield motions_at(dna, deltas, middle) - np.eye(3, 4)


def descendants(parents: Ints, joint: int) -> Ints:
    """Indices of a joint and all of its descendants.

    Args:
        parents: int64[J], parent of each joint.
        joint: index of the joint.
    """
    below = np.zeros(len(parents), bool)
    below[joint] = True
    for _ in range(len(parents)):
        more = below | below[parents]
        if (more == below).all():
            break
        below = more
    return np.flatnonzero(below)
