# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct mode: writes final vertex positions to live shape keys of meshes, without posing bones.

A mesh in Direct mode has the property FINISHED, which survives undo, duplication and automatic
saves. Its live shape key has final positions, and its armature modifier is disabled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bmesh
import numpy as np
from mathutils import Quaternion
from numpy.typing import NDArray

from ... import native
from ..base import compat, last_written, parts, session
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import meshes, runtime
from . import bone_writer, conditions, skins


@dataclass(frozen=True)
class Shape:
    """The inputs from which the shown pose of a face is computed.

    Attributes:
        joints: float32[J, 9] deltas of a Pose.
        weights: float32[C] weights of the blend shape channels.
        turns: "neck" and "head" -> Quaternion in the armature's axes.
    """

    joints: NDArray[np.float32]
    weights: NDArray[np.float32]
    turns: Mapping[str, Quaternion]


@dataclass(frozen=True)
class Frame:
    """The data for writing the meshes of a face.

    Attributes:
        live: Runtime of the character.
        shape: the inputs of the shown pose.
        bones: bones of the deforming armature.
        writer: bone_writer.Writer of the bones that the evaluator writes.
    """

    live: runtime.Runtime
    shape: Shape
    bones: skins.Bones
    writer: bone_writer.Writer

    def bone_channels(self) -> dict[str, NDArray[np.float32]]:
        """ "location", "rotation_quaternion", "scale" -> float32[B, width] of all bones."""
        bones, writer = self.bones, self.writer
        owned = bone_writer.pose_of(writer, self.shape.joints, self.shape.turns)
        rest = (bones.location, bones.rotation, bones.scale)
        channels = dict(zip(owned, (values.copy() for values in rest), strict=True))
        for name, values in channels.items():
            values[writer.where] = owned[name]
        return channels

    def matrices(self) -> NDArray[np.float32]:
        """float32[B, 3, 4], the skinning matrices of the bones in the armature's space."""
        return self.bones.chain.evaluate(*self.bone_channels().values())


@dataclass(frozen=True)
class _Face:
    """Compiled data of a face.

    Attributes:
        face: compiled skinning of all meshes in Direct mode.
        skins: session uid of a mesh object -> its Skin, in the order of the meshes in `face`.
        bones: bones of the deforming armature.
        writer: bone_writer.Writer of the bones that the evaluator writes.
    """

    face: native.DirectFace
    skins: dict[int, skins.Skin]
    bones: skins.Bones
    writer: bone_writer.Writer


@dataclass(frozen=True)
class Job:
    """A face whose vertex positions are written.

    Attributes:
        face: compiled skinning of its meshes.
        frame: the inputs of the face.
        items: index of a mesh in `face` -> mesh object.
        anew: whether unchanged values are written too.
    """

    face: native.DirectFace
    frame: Frame
    items: dict[int, MeshObject]
    anew: bool


# Session uid of a deforming armature -> the plan that `settle` last applied to its meshes.
_settled: dict[int, conditions.Plan] = session.table("direct.settled", ("rewrite", "undo", "load"))
# _shown: session uid of a deforming armature -> its last written Frame. _faces: the same uid ->
# compiled data of the face.
_shown: dict[int, Frame] = session.table("direct.shown", ("undo", "load"))
_faces: dict[int, _Face] = session.table("direct.faces", ("rewrite", "undo", "load"))


def unsettle(rig: ArmatureObject) -> None:
    """Let `settle` check the modes of a face's meshes again.

    Args:
        rig: deforming armature.
    """
    _settled.pop(rig.session_uid, None)


def settle(rig: ArmatureObject, plan: conditions.Plan) -> bool:
    """Switch the meshes of a face to the modes of a plan.

    Args:
        rig: deforming armature.
        plan: plan of the face.

    Returns:
        Whether a mesh changed its mode, so that its last written values are outdated.
    """
    if _settled.get(rig.session_uid) is plan:
        return False
    _settled[rig.session_uid] = plan
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
    """Switch a mesh to Direct mode. The caller writes its positions afterwards.

    Args:
        item: the mesh object; it gets a live key if it has none.
        rig: deforming armature.
    """
    if meshes.live_block(item) is None:
        meshes.add_live_key(item)
    own = conditions.armature_of(item, rig)
    if own is not None:
        item[parts.FINISHED] = compat.uid_of(own)
        own.show_viewport = own.show_render = False
    _forget(item)


def give_back(item: MeshObject, rig: ArmatureObject) -> None:
    """Let the armature modifier deform a mesh again. The caller writes its live key afterwards.

    Args:
        item: the mesh object.
        rig: deforming armature.
    """
    own = conditions.armature_of(item, rig)
    item.pop(parts.FINISHED, None)
    if own is not None:
        own.show_viewport = own.show_render = True
    if item.mode == "EDIT":
        _reset_edited(item, rig)
    _forget(item)


def rest_form(item: MeshObject, rig: ArmatureObject) -> NDArray[np.float32] | None:
    """float32[V, 3]: positions of a mesh after its blend shapes and before skinning.

    In LIVE mode, in which the armature modifier deforms the mesh, the live shape key has these
    positions. None if the mesh has no shape keys; the neutral mesh if no pose was shown, or if the
    DNA file has another number of vertices.

    Args:
        item: the mesh object.
        rig: deforming armature, in its last shown pose.
    """
    key, frame = item.data.shape_keys, shown(rig)
    if key is None:
        return None
    rest = meshes.points_of(key.reference_key)
    if frame is None or len(rest) != frame.live.vertex_count(item[parts.MESH]):
        return rest
    return frame.live.morph(item[parts.MESH]).evaluate(frame.shape.weights, base=rest)


def _reset_edited(item: MeshObject, rig: ArmatureObject) -> None:
    """Give the live key of a mesh in edit mode its positions before skinning. Blender copies the
    key from the edited mesh when the user leaves edit mode."""
    edit, block = bmesh.from_edit_mesh(item.data), meshes.live_block(item)
    layers: Any = edit.verts.layers.shape
    rest = rest_form(item, rig)
    if block is None or rest is None or block.name not in layers.keys():  # noqa: SIM118  no dict
        return
    live = layers[block.name]
    if len(rest) == len(edit.verts):
        for vertex, place in zip(edit.verts, rest.tolist(), strict=True):
            vertex[live] = place


def _forget(item: MeshObject) -> None:
    key = item.data.shape_keys
    if key is not None:
        last_written.weights.pop(key.session_uid, None)


def shown(rig: ArmatureObject) -> Frame | None:
    """The last Frame that `prepare` stored for a face, even if Direct mode has ended since.

    None if there is none since the file was opened or since undo.

    Args:
        rig: deforming armature.
    """
    return _shown.get(rig.session_uid)


def prepare(
    rig: ArmatureObject,
    live: runtime.Runtime,
    shape: Shape,
    items: Sequence[MeshObject],
    anew: bool,
) -> Job:
    """Store the inputs of a face as shown, and compile its data if bones or skins have changed.

    Args:
        rig: deforming armature; nothing is written to it.
        live: its Runtime.
        shape: inputs of the face.
        items: mesh objects in Direct mode to write.
        anew: write unchanged values too.
    """
    bones, writer = skins.bones_of(rig), bone_writer.writer_of(rig, live)
    frame = _shown[rig.session_uid] = Frame(live, shape, bones, writer)
    wanted = {item.session_uid: skins.of(item, bones, live) for item in items}
    kept = _faces.get(rig.session_uid)
    if kept is None or kept.bones is not bones or kept.writer is not writer:
        kept = None
    if kept is None or any(kept.skins.get(uid) is not skin for uid, skin in wanted.items()):
        others = {} if kept is None else kept.skins  # meshes of other LODs remain compiled
        kept = _faces[rig.session_uid] = _compile(frame, {**others, **wanted})
    order = {uid: number for number, uid in enumerate(kept.skins)}
    found = {order[item.session_uid]: item for item in items}
    return Job(kept.face, frame, found, anew)


def _compile(frame: Frame, found: dict[int, skins.Skin]) -> _Face:
    bones, writer = frame.bones, frame.writer
    face = native.module().DirectFace(
        frame.live.rig,
        writer.space,
        bones.chain,
        writer.where,
        [(frame.live.morph(skin.mesh), skin.base, skin.skin) for skin in found.values()],
        turned=[row for _name, row, _share, _rest in writer.turning],
    )
    face.keep(bones.location, bones.rotation, bones.scale)
    return _Face(face, found, bones, writer)


def write(jobs: Sequence[Job]) -> None:
    """Write final vertex positions to the live shape keys of all given faces together.

    Args:
        jobs: the faces, one Job for each.
    """
    targets = [_addresses(job.items) for job in jobs]
    done = native.module().deform_faces(
        [job.face for job in jobs],
        [job.frame.shape.joints for job in jobs],
        [job.frame.shape.weights for job in jobs],
        targets,
        turns=[_turns(job.frame) for job in jobs],
        anew=any(job.anew for job in jobs),
    )
    for job, written in zip(jobs, done, strict=True):
        for number in written:
            item = job.items[number]
            conditions.note_written(item)
            item.data.update_tag()


def _addresses(items: Mapping[int, MeshObject]) -> dict[int, tuple[int, int]]:
    """Index of a mesh -> memory address of the points of its live shape key, number of points."""
    found = {}
    for number, item in items.items():
        block = meshes.live_block(item)
        if block is not None and len(block.points):
            points = block.points
            found[number] = (points[0].as_pointer(), len(points))
    return found


def _turns(frame: Frame) -> NDArray[np.float32] | None:
    """float32[t, 4]: quaternions (w x y z) of the joints of neck and head, in the axes of their
    bones; None without rotations."""
    turns, turning = frame.shape.turns, frame.writer.turning
    if not turns or not turning:
        return None
    found = np.tile(np.array([1, 0, 0, 0], np.float32), (len(turning), 1))
    for place, (name, _row, share, rest) in enumerate(turning):
        if name in turns:
            part = Quaternion().slerp(turns[name], share) if share < 1.0 else turns[name]
            found[place] = rest.inverted() @ part @ rest
    return found
