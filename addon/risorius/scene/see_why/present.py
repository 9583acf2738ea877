# SPDX-License-Identifier: GPL-3.0-or-later
"""Gets the current pose of a face, and the names of its controls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import native
from ..base import last_written, parts, session
from ..base.blender_types import ArmatureObject
from ..character import runtime
from ..frame import inputs, look_masks
from ..lod import lods

Factors = dict[int, list[int]]
# id of a Runtime -> (the Runtime, its ControlNames, the factors of its correctives)
_known: dict[int, tuple[runtime.Runtime, native.ControlNames, Factors]] = session.table(
    "present.known", ("load",)
)


@dataclass(frozen=True)
class Present:
    """A face in its current pose.

    Attributes:
        live: Runtime of the character.
        raw: float32[R] raw controls with the effects of bones and layers, before solo and mute.
        lod: the shown LOD.
        look: look_masks.Look, which applies solo and mute.
    """

    live: runtime.Runtime
    raw: NDArray[np.float32]
    lod: int
    look: look_masks.Look

    @property
    def rests(self) -> NDArray[np.float32]:
        """float32[R], rest values of the raw controls."""
        return np.array(self.live.rests, np.float32)

    def pose(self) -> native.Pose:
        """The shown pose, with solo and mute."""
        pose = self.live.rig.evaluate(look_masks.raw_of(self.look, self.raw, self.live), self.lod)
        look_masks.apply(self.look, pose, self.live, self.lod)
        return pose


def of(rig: ArmatureObject) -> Present | None:
    """The current pose of a character.

    None if its data or controls are lost, or if the character is baked.

    Args:
        rig: its deforming armature.
    """
    live, controls = runtime.of(rig), parts.controls_of(rig)
    if live is None or controls is None or parts.BAKED in rig:
        return None
    state = last_written.inputs.get(rig.session_uid)
    if isinstance(state, tuple):
        raw, lod = np.frombuffer(state[0], np.float32), int(state[1])
    else:  # nothing was evaluated since undo or load
        raw, lod = inputs.read_leading(controls, live), lods.viewport_level(rig)
    return Present(live, raw, lod, look_masks.of(rig))


def _known_of(live: runtime.Runtime) -> tuple[runtime.Runtime, native.ControlNames, Factors]:
    kept = _known.get(id(live))
    if kept is None or kept[0] is not live:
        factors: Factors = {}
        pairs = zip(live.dna.psds.rows.tolist(), live.dna.psds.columns.tolist(), strict=True)
        for row, column in pairs:
            factors.setdefault(row, []).append(column)
        names = native.part("controls.control_names").ControlNames(live.dna)
        factors.update(_inputs_of_poses(live.dna, names.ml_end))
        kept = _known[id(live)] = (live, names, factors)
    return kept


def _inputs_of_poses(dna: native.Dna, first: int) -> Factors:
    """Output control of an RBF pose -> the controls on which its value depends.

    Args:
        dna: the file.
        first: the index of the first output control of a pose.
    """
    found: Factors = {}
    poses = dna.rbf_behavior_ext.poses
    for solver in dna.rbf_behavior.solvers:
        for pose in solver.pose_indices.tolist():
            # Files of version 2.4 have an output control for each pose and no list of output
            # controls.
            outputs, more = [first + pose], list[int]()
            if pose < len(poses):
                outputs = poses[pose].output_control_indices.tolist()
                more = poses[pose].input_control_indices.tolist()
            for output in outputs:
                found.setdefault(output, []).extend([*solver.raw_control_indices.tolist(), *more])
    return found


def names_of(live: runtime.Runtime) -> native.ControlNames:
    """The names of all controls of a file, in the order raw, corrective, network, pose."""
    return _known_of(live)[1]


def factors_of(live: runtime.Runtime) -> Factors:
    """Corrective -> its factors; output control of an RBF pose -> the inputs of pose and solver."""
    return _known_of(live)[2]


def name_of(live: runtime.Runtime, control: int) -> str:
    """The name of a control for lists: its short name; for a corrective its shape or its factors.

    Args:
        live: Runtime of the character.
        control: index in raw | corrective | network | pose.
    """
    names = names_of(live)
    if names.kind(control) != "corrective":
        return str(names.short(control))
    shape = str(names.name(control)).partition(" (")[2].rstrip(")")
    if shape:
        return shape
    factors = [str(names.short(c)) for c in factors_of(live).get(control, ())]
    return " x ".join(factors) or str(names.name(control))
