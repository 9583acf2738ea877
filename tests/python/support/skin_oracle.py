# SPDX-License-Identifier: MIT
"""Computes skinning in float64 from the format's description, and makes a small face to test it."""

from __future__ import annotations

import numpy as np
import risorius

SIDE = 14  # vertices along a side of the face's patch


def skinned(dna, pose, mesh=0):
    """Vertices of a posed mesh in the file's units, float64[V, 3].

    The file's angles are in degrees, with the rotation order x, y, z.
    """
    geometry = dna.meshes[mesh]
    points = geometry.positions.astype(np.float64)
    for target in geometry.blend_shape_targets:
        weight = float(pose.blend_shapes[target.blend_shape_channel_index])
        points[target.vertex_indices] += weight * target.deltas
    rest, posed = _worlds(dna, np.zeros_like(pose.joints)), _worlds(dna, pose.joints)
    out = np.zeros_like(points)
    for vertex, point in enumerate(points):
        for i in range(geometry.skin_offsets[vertex], geometry.skin_offsets[vertex + 1]):
            joint = geometry.skin_joint_indices[i]
            move = posed[joint] @ np.linalg.inv(rest[joint])
            out[vertex] += geometry.skin_weights[i] * (move @ [*point, 1.0])[:3]
    return out


def _worlds(dna, deltas):
    out = []
    for joint, parent in enumerate(dna.joint_parents):
        x, y, z = np.radians(dna.neutral_joint_rotations[joint] + deltas[joint, 3:6])
        cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
        turn = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
        turn = turn @ [[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]
        turn = turn @ [[1, 0, 0], [0, cx, -sx], [0, sx, cx]]
        local = np.eye(4)
        local[:3, :3] = turn * (1.0 + deltas[joint, 6:9])
        local[:3, 3] = dna.neutral_joint_translations[joint] + deltas[joint, :3]
        out.append(local if parent == joint else out[parent] @ local)
    return out


def small_face():
    """A bent patch of 14 x 14 vertices, 13 cm wide and symmetric, with 6 joints.

    Raw controls: jawOpen rotates a joint by 20 degrees; smileLeft and smileRight each move one
    joint sideways by 1 cm and up by 0.7 cm; puff is a blend shape; jawOpenTwin equals jawOpen; idle
    does nothing; widen scales a joint. A corrective of jawOpen and smileLeft is another blend
    shape.
    """
    across, up = np.meshgrid(np.arange(SIDE) - (SIDE - 1) / 2, np.arange(SIDE), indexing="ij")
    places = np.stack([across, up, 4 - 0.08 * across**2], axis=-1).reshape(-1, 3)
    centres = np.array([[0, 6, 0], [0, 2, 2], [-4, 5, 3], [4, 5, 3], [0, 10, 3], [0, 7, 4]], float)
    near = np.exp(-((places[:, None] - centres) ** 2).sum(axis=2) / 12)
    near[:, 0] = 0.05
    near /= near.sum(axis=1, keepdims=True)
    mesh = risorius.Mesh()
    mesh.positions = places
    mesh.skin_offsets = np.arange(len(places) + 1) * 6
    mesh.skin_weights, mesh.skin_joint_indices = near.ravel(), np.tile(np.arange(6), len(places))
    mesh.maximum_influence_per_vertex = 6
    puff, fold = risorius.BlendShapeTarget(), risorius.BlendShapeTarget()
    for target, channel, centre in ((puff, 0, [0, 7, 4]), (fold, 1, [-3, 4, 3])):
        height = np.exp(-((places - centre) ** 2).sum(axis=1) / 6)
        target.vertex_indices = np.flatnonzero(height > 0.05)
        target.deltas = height[height > 0.05, None] * [0.1, 0.0, 0.8]
        target.blend_shape_channel_index = channel
    mesh.blend_shape_targets = [puff, fold]
    dna = risorius.Dna()
    dna.lod_count, dna.meshes, dna.mesh_names = 1, [mesh], ["head"]
    dna.coordinate_system = ("right", "up", "front")
    dna.lod_mesh_mapping = [[0]]
    dna.joint_names, dna.joint_parents = [f"joint{i}" for i in range(6)], [0] * 6
    dna.neutral_joint_translations = np.concatenate([centres[:1], centres[1:] - centres[0]])
    dna.neutral_joint_rotations = np.array(
        [[0, 0, 0], *[[10.0 * i, 0, -5.0 * i] for i in range(5)]]
    )
    names = ("jawOpen", "smileLeft", "smileRight", "puff", "jawOpenTwin", "idle", "widen")
    dna.raw_control_names = [f"CTRL_expressions.{name}" for name in names]
    dna.psd_count = 1
    dna.psds = risorius.Psds(rows=[7, 7], columns=[0, 1], values=[1.0, 1.0])
    values = np.zeros((7, 7))
    values[0, [0, 4]] = 20.0  # rx of joint 1
    values[[1, 2], 1] = -1.0, 0.7
    values[[3, 4], 2] = 1.0, 0.7
    values[5, 6] = 0.4
    rows = [9 + 3, 18, 19, 27, 28, 36 + 6, 36 + 7]
    group = risorius.JointGroup(
        lods=[7], input_indices=np.arange(7), output_indices=rows, values=values
    )
    dna.joint_groups, dna.joint_row_count, dna.joint_column_count = [group], 54, 8
    dna.blend_shape_channel_names = ["puff", "fold"]
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[2], input_indices=[3, 7], output_indices=[0, 1]
    )
    return dna
