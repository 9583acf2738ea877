# SPDX-License-Identifier: GPL-3.0-or-later
"""Defines settings of gaze, lids and head of a character, as properties of its control armature."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...language import tables
from ..base.blender_types import ArmatureObject
from ..character import runtime

_OVERRIDE: Any = {"LIBRARY_OVERRIDABLE"}


def _changed(self: bpy.types.bpy_struct, _context: bpy.types.Context) -> None:
    """Let Blender evaluate the character again after a setting has changed."""
    owner = self.id_data
    assert owner is not None
    owner.update_tag()


def _all() -> dict[str, object]:
    """The property definitions by name. Their defaults keep the motion of files that were saved
    before a setting existed."""
    shared: Any = {"min": 0.0, "max": 1.0, "subtype": "FACTOR", "override": _OVERRIDE}
    shared |= {"update": _changed, "translation_context": tables.CONTEXT}
    return {
        "risorius_converge": bpy.props.FloatProperty(
            name="Eyes Meet",
            description=(
                "Convergence of the eyes; 1: both eyes look at the target, "
                "0: the eyes stay parallel"
            ),
            **shared,
        ),
        "risorius_lids": bpy.props.FloatProperty(
            name="Lids Follow",
            description=(
                "Strength of the lid motion with a gaze up or down, in "
                "addition to the motion of the rig"
            ),
            **shared,
        ),
        "risorius_body_turn": bpy.props.FloatProperty(
            name="Body's Turn",
            description="Share of the rotation of the body's neck and head that the face follows",
            default=1.0,
            **shared,
        ),
        "risorius_neck_poses": bpy.props.BoolProperty(
            name="Head Drives Neck Poses",
            description=(
                "Set the raw controls of head and neck rotation from the joints, so that the "
                "corrective poses of the DNA file correct neck and jaw. Off: the sliders of "
                "these raw controls set them"
            ),
            default=True,
            override=_OVERRIDE,
            update=_changed,
            translation_context=tables.CONTEXT,
        ),
    }


def register() -> None:
    """Add the properties to Blender objects."""
    for name, kind in _all().items():
        setattr(bpy.types.Object, name, kind)


def unregister() -> None:
    """Remove the properties; their values in .blend files stay."""
    for name in _all():
        delattr(bpy.types.Object, name)


def begin(controls: ArmatureObject, live: runtime.Runtime) -> None:
    """Set the initial gaze settings of a new face.

    Args:
        controls: its control armature.
        live: its Runtime.
    """
    controls.risorius_converge = 1.0
    controls.risorius_lids = 0.0 if moves_lids(live) else 0.5


def moves_lids(live: runtime.Runtime) -> bool:
    """Whether a look control for looking up or down also moves more than the eye joints.

    It may move other joints, or blend shapes.
    """
    eyes = set(live.anchors.eyes.values())
    for controls in live.look.values():
        for index, _yaw, pitch in controls:
            if not pitch:
                continue
            raw = np.array(live.rests, np.float32)
            still = live.rig.evaluate(raw)
            raw[index] = 1.0
            pose = live.rig.evaluate(raw)
            others = [j for j in np.flatnonzero((pose.joints != still.joints).any(axis=1))]
            if set(map(int, others)) - eyes or (pose.blend_shapes != still.blend_shapes).any():
                return True
    return False
