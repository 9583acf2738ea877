# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds reasons why a face does not follow its controls, as sentences for the panel."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...logic.base.sentences import told
from ..base import compat, parts, saved
from ..base.blender_types import ArmatureObject
from ..character import runtime

_LEANS = 1e-4  # largest cosine between two axes of a matrix that does not count as sheared


def words(rig: ArmatureObject) -> Iterator[str]:
    """Yields sentences about two causes: keyframes on joints, and a sheared control armature.

    Keyframes on joints override the controls; a deforming armature cannot follow sheared controls.

    Args:
        rig: deforming armature.
    """
    controls = parts.controls_of(rig)
    if controls is None or parts.BAKED in rig:
        return
    if _has_joint_keys(rig):
        yield told(
            "Keys on joints of {rig} lead: from the next frame on, the sliders do "
            "not move these joints. Mute or remove the action of {rig}.",
            rig=rig.name,
        )
    if rig.get(parts.FOLLOW) and _is_sheared(controls):
        yield told(
            "The parent of {controls} shears it, and the face cannot follow a shear: "
            "the face is not at the place of its controls. Apply the scale of the "
            "parent.",
            controls=controls.name,
        )


def _has_joint_keys(rig: ArmatureObject) -> bool:
    """Whether a played action of the rig moves joints that the evaluator writes."""
    live, played = runtime.of(rig), compat.played_actions(rig)
    if live is None or not played:
        return False
    owned = {
        f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"]'
        for bone in rig.data.bones
        if saved.whole(bone, parts.JOINT, -1) in live.owned
    }
    curves = (c for action in played for c in compat.curves_of(action) if not c.mute)
    return any(curve.data_path.rpartition(".")[0] in owned for curve in curves)


def _is_sheared(item: ArmatureObject) -> bool:
    """Whether the axes of an object's world matrix are not perpendicular."""
    x, y, z = (axis.normalized() for axis in item.matrix_world.to_3x3().transposed())
    return max(abs(x.dot(y)), abs(y.dot(z)), abs(z.dot(x))) > _LEANS
