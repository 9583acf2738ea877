# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the vertices of a face in a pose from its DNA alone.

The user's sculpts and painted weights are not included.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...logic.base.space import world_matrices
from ..base import parts, session
from ..base.blender_types import ArmatureObject
from ..character import meshes, runtime
from ..lod import lods

Doubles = NDArray[np.float64]
_skins: dict[tuple[int, int], tuple[runtime.Runtime, Skin]] = session.table(
    "displacement.skins", ("load",)
)
_MOST = 24  # largest number of cached skins


@dataclass(frozen=True)
class Skin:
    """The neutral vertices and the skin weights of a mesh in its DNA.

    Attributes:
        points: float64[V, 3] neutral vertices in Blender units.
        starts: int64[V], index of the first influence of each vertex.
        joints, weights: int64[n] and float64[n], joint and weight of each influence.
        bound: bool[V], whether a vertex has an influence.
    """

    points: Doubles
    starts: NDArray[np.int64]
    joints: NDArray[np.int64]
    weights: Doubles
    bound: NDArray[np.bool_]


def skin_of(live: runtime.Runtime, mesh: int) -> Skin:
    """The skin of a mesh, cached.

    Args:
        live: Runtime of the character.
        mesh: index of the mesh in the DNA file.
    """
    kept = _skins.get((id(live), mesh))
    if kept is None or kept[0] is not live:
        if len(_skins) >= _MOST:
            _skins.clear()
        kept = _skins[id(live), mesh] = (live, _skin(live, mesh))
    return kept[1]


def _skin(live: runtime.Runtime, mesh: int) -> Skin:
    held = live.dna.meshes[mesh]
    offsets = np.asarray(held.skin_offsets, np.int64)
    return Skin(
        points=meshes.imported_basis(held, live.space).astype(np.float64).reshape(-1, 3),
        starts=offsets[:-1],
        joints=np.asarray(held.skin_joint_indices, np.int64),
        weights=np.asarray(held.skin_weights, np.float64),
        bound=np.diff(offsets) > 0,
    )


def moves(live: runtime.Runtime, joints: NDArray[np.float32]) -> Doubles:
    """The skinning matrix of each joint: its posed matrix times the inverse of its rest matrix.

    Args:
        live: Runtime of the character.
        joints: float32[J, 9] deltas of a pose.

    Returns:
        float64[J, 4, 4] in Blender's axes and units; the identity for the neutral pose.
    """
    dna, space = live.dna, live.space
    deltas = np.asarray(joints, np.float64)
    turns = space.rotations(np.asarray(dna.neutral_joint_rotations, np.float64) + deltas[:, 3:6])
    scales = space.axes @ (np.eye(3) * (1.0 + deltas[:, None, 6:9])) @ space.axes.T
    places = space.points(np.asarray(dna.neutral_joint_translations, np.float64) + deltas[:, :3])
    posed = world_matrices(turns @ scales, places, np.asarray(dna.joint_parents))
    return posed @ np.linalg.inv(live.rest)


def vertices(
    live: runtime.Runtime,
    mesh: int,
    joints: NDArray[np.float32],
    shapes: NDArray[np.float32],
) -> Doubles:
    """The vertices of a mesh in a pose, float64[V, 3] in Blender units, without rotations of the
    neck and head bones.

    Args:
        live: Runtime of the character.
        mesh: index of the mesh in the DNA file.
        joints: float32[J, 9] deltas.
        shapes: float32[B] weights of the blend shape channels.
    """
    skin = skin_of(live, mesh)
    zero = np.zeros_like(skin.points, np.float32)
    morphed = live.morph(mesh).evaluate(np.ascontiguousarray(shapes, np.float32), base=zero)
    points = skin.points + morphed
    if not len(skin.joints):
        return points
    matrices = moves(live, joints)[:, :3]
    # One matrix per vertex: the sum of weight * matrix over its influences.
    blended = np.zeros((len(points), 3, 4))
    weighted = matrices[skin.joints] * skin.weights[:, None, None]
    there = np.flatnonzero(skin.bound)
    blended[there] = np.add.reduceat(weighted, skin.starts[there], axis=0)
    moved = np.einsum("vij,vj->vi", blended[:, :, :3], points) + blended[:, :, 3]
    moved[~skin.bound] = points[~skin.bound]
    return moved


def at_vertex(
    live: runtime.Runtime,
    mesh: int,
    vertex: int,
    joints: NDArray[np.float32],
    shapes: NDArray[np.float32],
) -> Doubles:
    """Positions of one vertex in N poses, float64[N, 3] in Blender units.

    Args:
        live: Runtime of the character.
        mesh, vertex: mesh and vertex index.
        joints: float32[N, J, 9] deltas.
        shapes: float32[N, B] weights of the blend shape channels.
    """
    skin = skin_of(live, mesh)
    deltas = np.zeros((shapes.shape[1], 3))
    for target in live.dna.meshes[mesh].blend_shape_targets:
        at = np.flatnonzero(np.asarray(target.vertex_indices) == vertex)
        channel = int(target.blend_shape_channel_index)
        deltas[channel] += np.asarray(target.deltas, np.float64)[at].sum(axis=0)
    points = skin.points[vertex] + shapes.astype(np.float64) @ live.space.points(deltas)
    first = int(skin.starts[vertex])
    last = int(np.append(skin.starts, len(skin.joints))[vertex + 1])
    if first == last:
        return points
    joint_of, share = skin.joints[first:last], skin.weights[first:last]
    ends = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    out = np.zeros_like(points)
    for number, matrices in enumerate(_moves_of(live, joints, joint_of)):
        out += share[number] * np.einsum("nij,nj->ni", matrices[:, :3], ends)
    return out


def _moves_of(
    live: runtime.Runtime, joints: NDArray[np.float32], wanted: NDArray[np.int64]
) -> list[Doubles]:
    """float64[N, 4, 4] for each wanted joint: its skinning matrices in N poses."""
    dna, space, count = live.dna, live.space, len(joints)
    parents = np.asarray(dna.joint_parents)
    worlds: dict[int, Doubles] = {}

    def world(joint: int) -> Doubles:
        if joint not in worlds:
            deltas = joints[:, joint].astype(np.float64)
            local = np.tile(np.eye(4), (count, 1, 1))
            neutral = np.asarray(dna.neutral_joint_rotations, np.float64)[joint]
            scales = space.axes @ (np.eye(3) * (1.0 + deltas[:, None, 6:9])) @ space.axes.T
            local[:, :3, :3] = space.rotations(neutral + deltas[:, 3:6]) @ scales
            place = np.asarray(dna.neutral_joint_translations, np.float64)[joint] + deltas[:, :3]
            local[:, :3, 3] = space.points(place)
            parent = int(parents[joint])
            worlds[joint] = local if parent == joint else world(parent) @ local
        return worlds[joint]

    return [world(int(joint)) @ np.linalg.inv(live.rest[int(joint)]) for joint in wanted]


def millimetres(rig: ArmatureObject) -> float:
    """Millimetres per Blender unit of a face.

    Args:
        rig: the character's deforming armature.
    """
    return runtime.unit_of(rig) * 1000.0


def distances(
    live: runtime.Runtime,
    mesh: int,
    one: tuple[NDArray[np.float32], NDArray[np.float32]],
    other: tuple[NDArray[np.float32], NDArray[np.float32]],
) -> Doubles:
    """Distances between the vertices of a mesh in two poses, float64[V] in Blender units.

    Args:
        live: Runtime of the character.
        mesh: index of the mesh in the DNA file.
        one, other: float32[J, 9] deltas of the joints and float32[B] weights of the blend shape
            channels, for each pose.
    """
    apart = vertices(live, mesh, *one) - vertices(live, mesh, *other)
    return np.linalg.norm(apart, axis=1)


def meshes_at(rig: ArmatureObject, lod: int) -> list[int]:
    """Indices in the DNA file of the meshes that a level of detail shows.

    Args:
        rig: deforming armature.
        lod: the level of detail.
    """
    shown = [m for m in parts.meshes_of(rig) if lods.shows(m, lod)]
    return [int(m[parts.MESH]) for m in shown]
