# SPDX-License-Identifier: MIT
"""Adds RBF neck poses to a head without them: corrective shapes at the limits of the neck's turns.

The head gets twelve raw controls, the quaternions of neck_01, neck_02 and head. It also gets an
RBF solver that reads these controls, like the solvers of a MetaHuman, and a blend shape channel for
each pose. The shapes follow rules: the skin that several joints share is smoothed, and the muscles
from the skull to the breastbone are raised as ridges.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import risorius
from risorius.rigs.joint_controls import (
    ANGLES,
    PARTS,
    head_turns,
    joint_controls,
    matrix,
    shared,
    turn_axes,
    turned_joints,
)

# Pose -> (yaw to the left, pitch up, roll to the left) of neck and head, radians.
LIMITS = {
    "left": {"neck": (0.6, 0.0, 0.0), "head": (0.6, 0.0, 0.0)},
    "right": {"neck": (-0.6, 0.0, 0.0), "head": (-0.6, 0.0, 0.0)},
    "up": {"neck": (0.0, 0.45, 0.0), "head": (0.0, 0.45, 0.0)},
    "down": {"neck": (0.0, -0.35, 0.0), "head": (0.0, -0.45, 0.0)},
    "tilt left": {"neck": (0.0, 0.0, 0.3), "head": (0.0, 0.0, 0.35)},
    "tilt right": {"neck": (0.0, 0.0, -0.3), "head": (0.0, 0.0, -0.35)},
}
# Pose -> height of the ridges of the left muscle, the right muscle and the throat, cm; negative for
# a groove.
MUSCLES = {
    "left": (-0.2, 1.3, 0.2),
    "right": (1.3, -0.2, 0.2),
    "up": (0.9, 0.9, 0.5),
    "down": (-0.2, -0.2, 0.0),
    "tilt left": (-0.3, 1.2, 0.2),
    "tilt right": (1.2, -0.3, 0.2),
}
ROUNDS = 24  # number of smoothing passes
WIDTH = 1.3  # width of a muscle, cm


def add(source: Path, target: Path) -> None:
    """Write a copy of a DNA file with the neck poses added.

    Args:
        source: DNA file of a face with joints neck_01, neck_02 and head, x to the left and y up,
            for example a sample person.
        target: path of the written file. The file contains only LOD 0.
    """
    dna = risorius.load(source, lods=(0, 0))
    turns = turned_joints(dna.joint_names)
    raw = [f"{dna.joint_names[joint]}.q{part}" for joint in turns for part in PARTS]
    _add_controls(dna, raw, 1 + len(LIMITS))
    _add_solver(dna, len(dna.raw_control_names) - len(raw), turns)
    neck = _Neck(dna)
    first = len(dna.blend_shape_channel_names)
    targets = list(dna.meshes[0].blend_shape_targets)
    for number, name in enumerate(LIMITS):
        deltas = neck.pose(name)
        moved = np.flatnonzero(np.linalg.norm(deltas, axis=1) > 1e-3)
        targets.append(
            risorius.BlendShapeTarget(
                deltas=deltas[moved].astype(np.float32),
                vertex_indices=moved.astype(np.uint32),
                blend_shape_channel_index=first + number,
            )
        )
        print(f"    {name}: up to {np.linalg.norm(deltas, axis=1).max():.2f} cm")
    dna.meshes[0].blend_shape_targets = targets
    _add_channels(dna, first)
    dna.save(str(target))


def _add_controls(dna: risorius.Dna, names: list[str], poses: int) -> None:
    """Append raw controls and renumber the controls that the rig's tables read.

    The controls are numbered in this order: raw controls, correctives, RBF poses. So the indices of
    the correctives grow by the number of new raw controls.

    Args:
        dna: the face to change.
        names: names of the new raw controls.
        poses: number of RBF poses that will be added.
    """
    count = len(dna.raw_control_names)
    dna.raw_control_names = [*dna.raw_control_names, *names]

    def moved(indices):
        indices = np.asarray(indices, np.int64)
        return np.where(indices >= count, indices + len(names), indices).astype(np.uint16)

    dna.psds.rows, dna.psds.columns = moved(dna.psds.rows), moved(dna.psds.columns)
    groups = dna.joint_groups
    for group in groups:
        group.input_indices = moved(group.input_indices)
    dna.joint_groups = groups
    maps = dna.animated_maps.conditionals
    for rows in (dna.blend_shape_channels, maps):
        rows.input_indices = moved(rows.input_indices)
    dna.joint_column_count += len(names) + poses


def _turns_of(name: str, joint_turns: dict[int, tuple[str, float]]) -> dict[int, np.ndarray]:
    """Joint -> quaternion x, y, z, w of its rotation from rest pose to a pose, in the face's axes.

    Args:
        name: key of LIMITS; any other name gives the rest pose.
        joint_turns: joint -> (control bone, fraction of the bone's turn), from turned_joints().
    """
    angles = LIMITS.get(name, dict.fromkeys(ANGLES, (0.0, 0.0, 0.0)))
    return {
        joint: shared(head_turns(np.array([angles[bone]])), share)[0]
        for joint, (bone, share) in joint_turns.items()
    }


def _add_solver(dna: risorius.Dna, first: int, turns: dict[int, tuple[str, float]]) -> None:
    controls = {item.joint: item for item in joint_controls(dna)[0]}
    names = ["rest", *LIMITS]
    values = [controls[j].values(q) for name in names for j, q in _turns_of(name, turns).items()]
    dna.rbf_behavior.lod_solver_mapping = [[0]]
    dna.rbf_behavior.solvers = [
        risorius.RbfSolver(
            name="neck", raw_control_indices=range(first, first + 4 * len(turns)),
            pose_indices=range(len(names)), raw_control_values=np.ravel(values),
            radius=1.0, automatic_radius=0, solver_type=1, distance_method=1,
            normalize_method=0, function_type=0, twist_axis=0, weight_threshold=0.001,
        )
    ]  # fmt: skip
    dna.rbf_behavior.poses = [risorius.RbfPose(name=name, scale=1) for name in names]
    begin = len(dna.raw_control_names) + dna.psd_count
    dna.rbf_behavior_ext.pose_control_names = [f"neck_{name.replace(' ', '_')}" for name in names]
    dna.rbf_behavior_ext.poses = [
        risorius.RbfPoseControls(output_control_indices=[begin + i], output_control_weights=[1.0])
        for i in range(len(names))
    ]


def _add_channels(dna: risorius.Dna, first: int) -> None:
    begin = len(dna.raw_control_names) + dna.psd_count + 1
    rows, count = dna.blend_shape_channels, len(LIMITS)
    dna.blend_shape_channel_names = [
        *dna.blend_shape_channel_names,
        *(f"head__neck_{name.replace(' ', '_')}" for name in LIMITS),
    ]
    rows.input_indices = [*rows.input_indices, *range(begin, begin + count)]
    rows.output_indices = [*rows.output_indices, *range(first, first + count)]
    rows.lods = [len(rows.input_indices)]
    dna.lod_blend_shape_mapping = [list(range(first + count))]
    dna.mesh_blend_shape_channel_mapping = [
        (number, target.blend_shape_channel_index)
        for number, mesh in enumerate(dna.meshes)
        for target in mesh.blend_shape_targets
    ]


class _Neck:
    """The head's mesh with its skin weights, and the joints of the neck that move it."""

    def __init__(self, dna: risorius.Dna) -> None:
        self.dna, mesh = dna, dna.meshes[0]
        self.turns = turned_joints(dna.joint_names)
        self.rest = mesh.positions.astype(np.float64)
        self.edges = _edges(mesh)
        self.weights = np.zeros((len(self.rest), len(dna.joint_names)))
        owner = np.repeat(np.arange(len(self.rest)), np.diff(mesh.skin_offsets))
        np.add.at(self.weights, (owner, mesh.skin_joint_indices), mesh.skin_weights)
        self.mask = self._shared()

    def _shared(self) -> np.ndarray:
        """float64[V]: the degree to which several joints of the neck share a vertex.

        0: one joint with all that follows it has the whole weight. 1: no joint has more than 0.6 of
        the weight. The values are smoothed along the edges of the mesh.
        """
        parents, chain = self.dna.joint_parents, [0, *self.turns]
        column = []
        for joint in range(len(parents)):
            above = joint
            while above not in chain:
                above = int(parents[above])
            column.append(chain.index(above))
        owned = self.weights @ np.eye(len(chain))[column]
        mask = np.clip(2.5 * (1.0 - owned.max(axis=1)), 0.0, 1.0)
        return np.clip(self._smoothed(mask[:, None], 6)[:, 0], 0.0, 1.0)

    def _smoothed(self, values: np.ndarray, rounds: int) -> np.ndarray:
        a, b = self.edges
        count = np.bincount(np.concatenate([a, b]), minlength=len(values))[:, None].clip(1)
        for _ in range(rounds):
            sums = np.zeros_like(values)
            np.add.at(sums, a, values[b])
            np.add.at(sums, b, values[a])
            values = 0.5 * values + 0.5 * sums / count
        return values

    def _normals(self, points: np.ndarray) -> np.ndarray:
        out = np.zeros_like(points)
        offsets, corners = self.dna.meshes[0].face_offsets, self.dna.meshes[0].face_layouts
        layout = self.dna.meshes[0].layout_positions
        first = offsets[:-1]
        a, b, c = (points[layout[corners[first + i]]] for i in range(3))
        across = np.cross(b - a, c - a)
        for i in range(3):
            np.add.at(out, layout[corners[first + i]], across)
        return out / np.linalg.norm(out, axis=1, keepdims=True).clip(1e-12)

    def _matrices(self, name: str) -> np.ndarray:
        """float64[V, 3, 4]: the skinning matrix of each vertex in a pose."""
        turned = _turns_of(name, self.turns)
        rest, posed = (_world(self.dna, turns) for turns in ({}, turned))
        moves = np.array([p @ np.linalg.inv(r) for p, r in zip(posed, rest, strict=True)])
        return np.einsum("vj,jrc->vrc", self.weights, moves[:, :3])

    def pose(self, name: str) -> np.ndarray:
        """float64[V, 3]: the blend shape deltas of a pose in cm, which apply before skinning."""
        moves = self._matrices(name)
        ends = np.concatenate([self.rest, np.ones((len(self.rest), 1))], axis=1)
        skinned = np.einsum("vrc,vc->vr", moves, ends)
        # Smoothing the posed skin removes its detail. So the detail of the neutral skin is turned
        # by the joints and added.
        detail = self.rest - self._smoothed(self.rest, ROUNDS)
        turned = np.einsum("vrc,vc->vr", moves[:, :, :3], detail)
        smooth = self._smoothed(skinned, ROUNDS) + turned - skinned
        wanted = self.mask[:, None] * smooth
        wanted += self._muscles(name, skinned)
        return np.linalg.solve(moves[:, :, :3], wanted[:, :, None])[:, :, 0]

    def _nearest(self, place: tuple[float, float, float]) -> int:
        return int(np.linalg.norm(self.rest - np.array(place), axis=1).argmin())

    def _muscles(self, name: str, skinned: np.ndarray) -> np.ndarray:
        normals = self._normals(skinned)
        base = _world(self.dna, {})
        head, low = (base[j][:3, 3] for j in (max(self.turns), min(self.turns)))
        left, right, throat = MUSCLES[name]
        front = float(self.rest[:, 2][np.abs(self.rest[:, 1] - low[1] + 1.5) < 1].max())
        out = np.zeros_like(skinned)
        for side, height in ((1.0, left), (-1.0, right)):
            skull = skinned[self._nearest((6.6 * side, head[1] + 0.5, head[2] - 2.0))]
            breast = skinned[self._nearest((1.4 * side, low[1] - 4.0, front))]
            out += self._ridge(skinned, normals, skull, breast, height)
        chin = skinned[self._nearest((0.0, head[1] - 4.0, front + 3.0))]
        notch = skinned[self._nearest((0.0, low[1] - 4.0, front))]
        return out + self._ridge(skinned, normals, chin, notch, throat)

    def _ridge(
        self,
        points: np.ndarray,
        normals: np.ndarray,
        start: np.ndarray,
        end: np.ndarray,
        height: float,
    ) -> np.ndarray:
        """float64[V, 3]: a displacement along the normals that makes a ridge with hollow sides.

        Args:
            points: posed vertices [V, 3], cm.
            normals: their unit normals [V, 3].
            start, end: both ends of the ridge, cm.
            height: height of the ridge, cm; negative for a groove.
        """
        along = end - start
        share = (points - start) @ along / (along @ along)
        apart = points - start - share[:, None] * along
        apart -= np.sum(apart * normals, axis=1, keepdims=True) * normals
        ratio = np.sum(apart**2, axis=1) / WIDTH**2
        middle = start + np.clip(share, 0, 1)[:, None] * along
        near = np.linalg.norm(points - middle, axis=1) < 3.5 * WIDTH
        ends = np.sin(np.pi * np.clip(share, 0.0, 1.0)) ** 0.7
        form = height * ends * (1.0 - 0.55 * ratio) * np.exp(-ratio) * near
        return self._smoothed(form[:, None], 2) * self._smoothed(normals, 2)


def _edges(mesh: risorius.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Vertex indices of both ends of the mesh's edges. Each edge occurs once."""
    corners = mesh.layout_positions[mesh.face_layouts].astype(np.int64)
    following = np.arange(len(corners)) + 1
    following[mesh.face_offsets[1:] - 1] = mesh.face_offsets[:-1]
    pairs = np.unique(np.sort(np.stack([corners, corners[following]], axis=1), axis=1), axis=0)
    return pairs[:, 0], pairs[:, 1]


def _world(dna: risorius.Dna, turns: dict[int, np.ndarray]) -> list[np.ndarray]:
    """World matrices [4, 4] of all joints. Joints without an entry in `turns` are not rotated.

    Args:
        dna: the face; its neutral joint translations are used, its neutral rotations are not.
        turns: joint -> quaternion x, y, z, w about the face's axes.
    """
    found: list[np.ndarray] = []
    for joint, parent in enumerate(dna.joint_parents):
        local = np.eye(4)
        local[:3, 3] = dna.neutral_joint_translations[joint]
        if joint in turns:
            x, y, z, w = turns[joint]
            local[:3, :3] = matrix(np.array([*(turn_axes(dna, joint) @ (x, y, z)), w]))
        found.append(local if joint == parent else found[parent] @ local)
    return found
