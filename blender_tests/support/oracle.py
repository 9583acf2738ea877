# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes skinning and morphing in float64 from the description of the format alone.

This module uses no code of the add-on. It takes a Pose, which contains the joints and the weights
of blend shape channels, and returns vertices in Blender's axes and units.
"""

import numpy as np

_AXES = {
    "right": (1, 0, 0), "left": (-1, 0, 0), "up": (0, 0, 1), "down": (0, 0, -1),
    "front": (0, -1, 0), "back": (0, 1, 0),
}  # fmt: skip


def _rotation(dna, angles):
    """Rotation matrix for column vectors; the first axis of the rotation sequence acts first.

    Args:
        dna: Dna with the unit, sequence and signs of the rotations.
        angles: float64[3], in the DNA's unit.
    """
    if dna.rotation_unit == "degrees":
        angles = np.radians(angles)
    matrix = np.eye(3)
    for letter in dna.rotation_sequence:
        axis = "xyz".index(letter)
        a = angles[axis] * dna.rotation_signs[axis]
        c, s = np.cos(a), np.sin(a)
        turn = {
            "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
            "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        }[letter]
        matrix = np.array(turn) @ matrix
    return matrix


def _world(dna, deltas, turns=None):
    """World matrices of all joints in the axes and units of the Dna, a list of float64[4, 4].

    Args:
        dna: the face.
        deltas: float[joints, 9], values of a Pose that are added to the neutral joints.
        turns: as in `vertices`.
    """
    parents = dna.joint_parents
    result = []
    for joint, parent in enumerate(parents):
        d = np.asarray(deltas[joint], np.float64)
        local = np.eye(4)
        angles = dna.neutral_joint_rotations[joint].astype(np.float64) + d[3:6]
        local[:3, :3] = _rotation(dna, angles) @ np.diag(1 + d[6:9])
        if turns and joint in turns:
            rest = _rotation(dna, dna.neutral_joint_rotations[joint].astype(np.float64))
            local[:3, :3] = rest @ turns[joint] @ rest.T @ local[:3, :3]
        local[:3, 3] = dna.neutral_joint_translations[joint].astype(np.float64) + d[:3]
        result.append(local if parent == joint else result[parent] @ local)
    return result


def to_blender(dna, points, unit_scale=1.0):
    """Convert points from the DNA's axes and unit to Blender's axes and units."""
    axes = np.array([_AXES[w] for w in dna.coordinate_system], np.float64).T
    metres = 0.01 if dna.translation_unit == "cm" else 1.0
    return points @ axes.T * metres / unit_scale


def vertices(dna, mesh_index, pose, unit_scale=1.0, turns=None):
    """Vertices of a mesh after morph and skinning, float64[V, 3], in Blender's axes and units.

    Args:
        dna: the face.
        mesh_index: index of the mesh.
        pose: risorius.Pose.
        unit_scale: metres per Blender unit.
        turns: index of a joint -> float64[3, 3], a rotation about the joint's axes at rest that is
            added to the joint's pose; None: no added rotations.
    """
    mesh = dna.meshes[mesh_index]
    points = mesh.positions.astype(np.float64)
    for target in mesh.blend_shape_targets:
        weight = float(pose.blend_shapes[target.blend_shape_channel_index])
        np.add.at(points, target.vertex_indices, weight * target.deltas.astype(np.float64))
    rest = _world(dna, np.zeros((len(dna.joint_names), 9)))
    posed = _world(dna, pose.joints, turns)
    moves = [p @ np.linalg.inv(r) for p, r in zip(posed, rest, strict=True)]
    homogeneous = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    result = np.zeros((len(points), 3))
    offsets = mesh.skin_offsets
    for vertex in range(len(points)):
        for i in range(offsets[vertex], offsets[vertex + 1]):
            move = moves[mesh.skin_joint_indices[i]]
            result[vertex] += mesh.skin_weights[i] * (move @ homogeneous[vertex])[:3]
    return to_blender(dna, result, unit_scale)
