# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports a character's DNA file with the user's edits; unedited data stay as imported."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...logic.character import plans, user_edits
from ..base import console, parts, storage
from ..base.blender_types import ArmatureObject, Context, MeshObject
from ..character import armatures, runtime, skin_weights
from ..lod import lods
from . import refit_joints, refit_meshes


class ExportError(FaceError):
    """A character cannot be exported; the text is one sentence for users."""


@dataclass(frozen=True)
class ExportOptions:
    """The kinds of the user's edits that an export writes into the DNA file.

    Attributes:
        shapes: edits of shape keys.
        neutral: edits of the neutral mesh.
        joints: edits of the neutral joints.
        weights: edits of skin weights.
    """

    shapes: bool = True
    neutral: bool = True
    joints: bool = True
    weights: bool = True


def export(
    context: Context, rig: ArmatureObject, options: ExportOptions | None = None
) -> tuple[bytes, list[str]]:
    """The bytes of a character's DNA file with the user's edits.

    Args:
        context: a Blender context with scene and view layer.
        rig: deforming armature of the character.
        options: kinds of edits to write; None: all.

    Returns:
        The bytes, and sentences about the changes with their sizes, which are also written to a
        Text and to the console. Without edits the bytes equal the imported file.

    Raises:
        ExportError: the polygons of a mesh differ from the DNA file, a mesh is in edit mode, or the
            data of the file are missing.
    """
    options = options or ExportOptions()
    live = runtime.of(rig)
    if live is None:
        raise ExportError(told("{face} has lost the data of its file.", face=rig.name))
    try:
        content = storage.content(rig.get(parts.DNA))
    except storage.ContentError as error:
        raise ExportError(
            told("{face} has lost the data of its file: {why}.", face=rig.name, why=error.args[0])
        ) from error
    unit = runtime.unit_of(rig)
    levels = tuple(lods.built(rig)) or (0,)
    plan = plans.plan_character(live.dna, rig.name, levels, unit, live.rests)
    written = native.module().load(content)  # a separate Dna, because the Runtime's must not change
    job = _Job(rig, live, plan, written, unit)
    names_of_bones = refit_joints.bones_by_joint(rig)
    labels = [names_of_bones.get(j, label) for j, label in enumerate(plan.armature.labels)]
    plan_of = {m.index: m for m in plan.meshes}
    for item in parts.meshes_of(rig):
        mesh_plan = plan_of.get(item[parts.MESH])
        if mesh_plan is None:
            continue
        _check(item, mesh_plan)
        job.mesh(item, mesh_plan, options)
        if options.weights:
            job.weights(item, mesh_plan, labels)
    if options.joints:
        with armatures.kept_selection(context):
            job.joints(refit_joints.joint_edits(context, rig, plan))
    if job.edited:
        content = job.content()
    else:
        job.report.insert(0, "Nothing was edited: the file is what was imported, byte for byte.")
    _keep_report(rig, job.report)
    return content, job.report


def _check(item: MeshObject, mesh_plan: plans.MeshPlan) -> None:
    if item.mode == "EDIT":
        raise ExportError(told("{name} is in edit mode: leave that first.", name=item.name))
    if not refit_meshes.has_faces_of(item.data, mesh_plan):
        raise ExportError(
            told(
                (
                    "{name} has other vertices or faces than the DNA file, so this mesh "
                    "cannot be exported."
                ),
                name=item.name,
            )
        )


class _Job:
    """One export: writes edits into a Dna and sentences about them into a report.

    Args:
        rig: deforming armature.
        live: Runtime of the character.
        plan: names, joints and meshes of the imported character.
        dna: a separate Dna, which is changed.
        unit: metres per Blender unit.
    """

    def __init__(
        self,
        rig: ArmatureObject,
        live: runtime.Runtime,
        plan: plans.CharacterPlan,
        dna: native.Dna,
        unit: float,
    ) -> None:
        self._rig, self._live, self._plan, self._dna, self._unit = rig, live, plan, dna, unit
        self._space = live.space
        self.report = []
        self.edited = False

    def content(self) -> bytes:
        """The bytes of the edited DNA file, in the file version of the import."""
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            content = self._dna.to_bytes(version=f"2.{self._live.dna.version}")
        self.report += [str(warning.message) for warning in said]
        return content

    def _say(self, what: str, moves: NDArray[np.float64]) -> None:
        count, largest, mean = user_edits.sizes(moves, self._unit)
        self.edited = True
        self.report.append(
            told(
                "{what}: {count} vertices, at most {largest:.3f} mm, {mean:.3f} mm in the mean.",
                what=what,
                count=count,
                largest=largest,
                mean=mean,
            )
        )

    def mesh(self, item: MeshObject, mesh_plan: plans.MeshPlan, options: ExportOptions) -> None:
        """Write edits of the neutral vertices and the shape keys of a mesh.

        Args:
            item: the mesh object.
            mesh_plan: the mesh in the imported file.
            options: kinds of edits to write.
        """
        shape = refit_meshes.read_shape(self._live, item, mesh_plan, known=True)
        dna_mesh = self._dna.meshes[mesh_plan.index]
        name = self._dna.mesh_names[mesh_plan.index]
        if options.neutral and shape.moved.any():
            self._neutral(dna_mesh, shape, mesh_plan)
            rows = np.any(shape.moved != 0, axis=1)
            self._say(told("{name}, neutral", name=name), shape.moved[rows])
        if options.shapes:
            for key, difference in shape.edits.items():
                self._shape(dna_mesh, shape, key, difference)
                rows = np.any(difference != 0, axis=1)
                channel = self._dna.blend_shape_channel_names[shape.channels[key]]
                self._say(
                    told("{name}, shape {channel}", name=name, channel=channel), difference[rows]
                )
        if shape.own:
            self.report.append(
                told(
                    "{name}: keys of your own are not written: {own}.",
                    name=name,
                    own=", ".join(shape.own),
                )
            )
        for key in shape.channels:
            block = parts.keys_there(item).key_blocks[key]
            if block.mute or block.vertex_group:
                self.report.append(
                    told(
                        (
                            "{name}: the muting or the vertex group of the shape key {key} "
                            "is not written."
                        ),
                        name=name,
                        key=key,
                    )
                )

    def _neutral(
        self, dna_mesh: native.Mesh, shape: refit_meshes.Shape, mesh_plan: plans.MeshPlan
    ) -> None:
        """Write the neutral coordinates that differ from the import; others stay bit-identical.

        Args:
            dna_mesh: the mesh of the Dna to write; changed.
            shape: positions of the mesh object with the user's edits.
            mesh_plan: the mesh in the imported file.
        """
        moved = user_edits.changed(shape.points, mesh_plan.positions)
        # Blender's axes are the file's axes in another order and direction, so each coordinate in
        # Blender belongs to one coordinate in the file.
        theirs = moved @ (np.abs(self._space.axes) > 0.5)
        positions = dna_mesh.positions.copy()
        positions[theirs] = self._space.file_points(shape.points)[theirs]
        dna_mesh.positions = positions

    def _shape(
        self,
        dna_mesh: native.Mesh,
        shape: refit_meshes.Shape,
        key: str,
        difference: NDArray[np.float64],
    ) -> None:
        """Write the deltas of the edited vertices of a shape key.

        Args:
            dna_mesh: the mesh of the Dna to write; changed.
            shape: positions of the mesh object with the user's edits.
            key: name of the shape key.
            difference: float64[V, 3], offsets by the user's edit.
        """
        vertices = np.flatnonzero(np.any(difference != 0, axis=1))
        base = shape.keys[shape.relative[key]]
        delta = shape.keys[key][vertices].astype(np.float64) - base[vertices]
        totals = self._space.file_points(delta).astype(np.float32)
        channel = shape.channels[key]
        targets = [
            t for t in dna_mesh.blend_shape_targets if t.blend_shape_channel_index == channel
        ]
        written = user_edits.replace_totals(
            [(t.vertex_indices, t.deltas.reshape(-1, 3)) for t in targets], vertices, totals
        )
        for target, (indices, deltas) in zip(targets, written, strict=True):
            target.vertex_indices, target.deltas = indices, deltas

    def weights(self, item: MeshObject, mesh_plan: plans.MeshPlan, labels: Sequence[str]) -> None:
        """Write skin weights of vertices that the user painted; others stay bit-identical.

        Args:
            item: the mesh object.
            mesh_plan: the mesh in the imported file.
            labels: bone names by joint index.
        """
        present = skin_weights.read(item)
        painted = skin_weights.edited_vertices(present, skin_weights.file_pairs(mesh_plan, labels))
        ours = {name: joint for joint, name in reversed(list(enumerate(labels)))}
        known = {name for name in ours if name in present}
        used = {labels[j] for j in np.unique(mesh_plan.skin_joints)}
        for name in known - used:  # groups of joints without weights on this mesh in the file
            painted.update(present[name])
        if not painted:
            return
        dna_mesh = self._dna.meshes[mesh_plan.index]
        bounds = mesh_plan.skin_offsets
        rows = []
        for vertex in range(len(mesh_plan.positions)):
            begin, end = int(bounds[vertex]), int(bounds[vertex + 1])
            if vertex in painted:
                rows.append(_normalised(present, known, ours, vertex))
            else:
                joints = mesh_plan.skin_joints[begin:end]
                rows.append((joints, mesh_plan.skin_weights[begin:end]))
        counts = [len(joints) for joints, _ in rows]
        dna_mesh.skin_offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.uint32)
        dna_mesh.skin_joint_indices = np.concatenate([r[0] for r in rows]).astype(np.uint16)
        dna_mesh.skin_weights = np.concatenate([r[1] for r in rows]).astype(np.float32)
        most = max(dna_mesh.maximum_influence_per_vertex, *counts)
        dna_mesh.maximum_influence_per_vertex = most
        self.edited = True
        name = self._dna.mesh_names[mesh_plan.index]
        self.report.append(
            told("{name}: weights of {count} vertices.", name=name, count=len(painted))
        )

    def joints(self, found: Mapping[int, refit_joints.JointEdit]) -> None:
        """Write translations and rotations of neutral joints that the user edited."""
        offsets = self._dna.neutral_joint_translations.copy()
        angles = self._dna.neutral_joint_rotations.copy()
        for joint, edit in found.items():
            if edit.moved:
                change = self._space.file_points(edit.after[None, :3, 3])[0]
                before = self._space.file_points(edit.before[None, :3, 3])[0]
                # Coordinates that did not change stay bit-identical.
                far = np.abs(change - before) > 1e-6 * np.abs(before).max(initial=1e-9)
                offsets[joint][far] = change[far]
            if edit.turned:
                near = angles[joint : joint + 1].astype(np.float64)
                angles[joint] = self._space.file_rotations(edit.after[None, :3, :3], near)[0]
            self.edited = True
            self.report.append(
                told(
                    "Joint {joint}: {distance:.3f} mm, {angle:.3f} degrees.",
                    joint=self._dna.joint_names[joint],
                    distance=edit.distance * self._unit * 1000,
                    angle=np.degrees(edit.angle),
                )
            )
        if found:
            self._dna.neutral_joint_translations = offsets
            self._dna.neutral_joint_rotations = angles


def _normalised(
    present: skin_weights.Weights, known: Iterable[str], ours: Mapping[str, int], vertex: int
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Joints and weights of a vertex, with the largest weight first and a sum of 1.

    Args:
        present: weights of the mesh object.
        known: vertex groups of the object that belong to joints.
        ours: name of a vertex group -> joint index.
        vertex: index of the vertex.
    """
    held = [(present[n][vertex], ours[n]) for n in known if present[n].get(vertex, 0.0) > 0.0]
    held.sort(key=lambda pair: (-pair[0], pair[1]))
    total = sum(weight for weight, _ in held)
    joints = np.array([joint for _, joint in held], np.int64)
    return joints, np.array([weight / total for weight, _ in held], np.float32)


def _keep_report(rig: ArmatureObject, sentences: Sequence[str]) -> None:
    """Write the report of an export to a Text and to the console."""
    title = f"{rig.name.removesuffix('_rig')} export report"
    text = bpy.data.texts.get(title) or bpy.data.texts.new(title)
    text.from_string("\n".join(sentences) + "\n")
    console.say(*sentences)
