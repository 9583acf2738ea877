# SPDX-License-Identifier: GPL-3.0-or-later
"""Finished positions of a face in the live keys of its meshes, with no bone posed.

A mesh in Direct mode bears the property FINISHED, which undo, duplicates and files that Blender
saves by itself keep: its live key has final positions, and its armature modifier is disabled.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import bmesh
import numpy as np
from mathutils import Quaternion
from numpy.typing import NDArray

from ..base import last_written, parts, session
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import meshes, runtime
from . import bone_writer, conditions, skins


@dataclass(frozen=True)
class Shape:
    """What a face was shown with.

    Attributes:
        joints: float32[J, 9] of a Pose.
        weights: float32[C] of the channels.
        turns: "neck" and "head" -> Quaternion in the armature's axes.
    """

    joints: NDArray[np.float32]
    weights: NDArray[np.float32]
    turns: Mapping[str, Quaternion]


@dataclass(frozen=True)
class Frame:
    """A shape of a face, ready to be written to its meshes.

    Attributes:
        live: the Runtime; shape; bones: of the deforming armature.
        matrices: float32[B, 3, 4], the skinning matrices in the armature's space.
    """

    live: runtime.Runtime
    shape: Shape
    bones: skins.Bones
    matrices: NDArray[np.float32]


# Deforming armature -> the Frame that was last written.
_shown: dict[int, Frame] = session.table("direct.shown", ("rewrite", "undo", "load"))


def settle(rig: ArmatureObject, plan: conditions.Plan) -> bool:
    """Bring the meshes of a face into the modes of a plan.

    Args:
        rig: deforming armature.
        plan: of the face.

    Returns:
        Whether a mesh changed its mode: what was last written says nothing of it then.
    """
    changed = False
    for item in parts.meshes_of(rig):
        wanted = item.session_uid in plan.direct
        if wanted and not _is_taken(item, rig):
            take(item, rig)
            changed = True
        elif not wanted and parts.FINISHED in item:
            give_back(item, rig)
            changed = True
    return changed


def _is_taken(item: MeshObject, rig: ArmatureObject) -> bool:
    own = conditions.armature_of(item, rig)
    off = own is not None and not own.show_viewport and not own.show_render
    return off and parts.FINISHED in item and meshes.live_block(item) is not None


def take(item: MeshObject, rig: ArmatureObject) -> None:
    """Bring a mesh into Direct mode; its positions are written afterwards.

    Args:
        item: the mesh object, which gets a live key where it has none.
        rig: deforming armature.
    """
    if meshes.live_block(item) is None:
        meshes.add_live_key(item)
    item[parts.FINISHED] = True
    own = conditions.armature_of(item, rig)
    assert own is not None
    own.show_viewport = own.show_render = False
    _forget(item)


def give_back(item: MeshObject, rig: ArmatureObject) -> None:
    """Bring a mesh out of Direct mode: its modifier deforms it again.

    Args:
        item: the mesh object.
        rig: deforming armature; the live key is written afterwards.
    """
    item.pop(parts.FINISHED, None)
    own = conditions.armature_of(item, rig)
    if own is not None:
        own.show_viewport = own.show_render = True
    if item.mode == "EDIT":
        _reset_edited(item)
    _forget(item)


def _reset_edited(item: MeshObject) -> None:
    """Give the live key of a mesh in edit mode the neutral form: leaving the mode stores it."""
    edit, block = bmesh.from_edit_mesh(item.data), meshes.live_block(item)
    layers: Any = edit.verts.layers.shape
    key = item.data.shape_keys
    if block is None or key is None or block.name not in layers.keys():  # noqa: SIM118  no dict
        return
    live, base = layers[block.name], layers[key.reference_key.name]
    for vertex in edit.verts:
        vertex[live] = vertex[base]


def _forget(item: MeshObject) -> None:
    key = item.data.shape_keys
    if key is not None:
        last_written.weights.pop(key.session_uid, None)


def begin(rig: ArmatureObject, live: runtime.Runtime, shape: Shape) -> Frame:
    """Pose the bones of a face natively.

    Args:
        rig: deforming armature; nothing is written to it.
        live: its Runtime.
        shape: what the face is shown with.
    """
    bones, writer = skins.bones_of(rig), bone_writer.writer_of(rig, live)
    owned = bone_writer.pose_of(writer, shape.joints, shape.turns)
    bones.location[writer.where] = owned["location"]
    bones.rotation[writer.where] = owned["rotation_quaternion"]
    bones.scale[writer.where] = owned["scale"]
    matrices = bones.chain.evaluate(bones.location, bones.rotation, bones.scale)
    frame = _shown[rig.session_uid] = Frame(live, shape, bones, matrices)
    return frame


def shown(rig: ArmatureObject) -> Frame | None:
    """What a face was last shown with; None where none of its meshes is in Direct mode.

    Args:
        rig: deforming armature.
    """
    return _shown.get(rig.session_uid)


def write(item: MeshObject, frame: Frame, force: bool) -> None:
    """Write the finished positions of a mesh to its live key.

    Args:
        item: the mesh object, in Direct mode.
        frame: see `begin`.
        force: write also what seems unchanged.
    """
    key, block, number = item.data.shape_keys, meshes.live_block(item), item[parts.MESH]
    if key is None or block is None:
        return
    skin, morph = skins.of(item, frame.bones, frame.live), frame.live.morph(number)
    weights = frame.shape.weights
    state = (weights[morph.channel_indices].tobytes(), frame.matrices[skin.used].tobytes())
    if not last_written.is_new(last_written.weights, key, state) and not force:
        return
    points = skin.skin.evaluate(morph.evaluate(weights, base=skin.base), frame.matrices)
    block.points.foreach_set("co", points.ravel())
    conditions.note_written(item)
    item.data.update_tag()
