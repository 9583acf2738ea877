# SPDX-License-Identifier: MIT
"""Explains RBF solvers: the distance and the weight of each pose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import risorius

from ..controls.control_names import ControlNames
from ..rigs.rotation import Doubles

_METHODS = ("euclidean", "quaternion", "swing angle", "twist angle")


def explain_solvers(
    dna: risorius.Dna, rig: risorius.Rig, controls: Doubles, lod: int, names: ControlNames
) -> list[dict[str, Any]]:
    """The solvers of a LOD, each with its poses; the pose with the greatest weight is first.

    Args:
        dna: the face.
        rig: rig compiled from `dna`.
        controls: float64[controls], of a pose.
        lod: LOD of the pose, from 0.
        names: names of the controls.
    """
    mapping = dna.rbf_behavior.lod_solver_mapping
    listed = mapping[lod].tolist() if lod < len(mapping) else []
    return [_solver(dna, dna.rbf_behavior.solvers[i], i, rig, controls, names) for i in listed]


def _solver(
    dna: risorius.Dna,
    solver: risorius.RbfSolver,
    index: int,
    rig: risorius.Rig,
    controls: Doubles,
    names: ControlNames,
) -> dict[str, Any]:
    x = controls[solver.raw_control_indices]
    is_angle = solver.distance_method != 0
    distances, weights = rig.solver_poses(index, controls)
    distances = np.degrees(distances) if is_angle else distances
    poses = [
        _pose(dna, int(p), float(d), float(w), names)
        for p, d, w in zip(solver.pose_indices, distances, weights, strict=True)
    ]
    poses.sort(key=lambda pose: (-pose["weight"], pose["distance"]))
    return {
        "name": solver.name or f"solver {index}",
        "index": index,
        "distance_method": _METHODS[min(solver.distance_method, 3)],
        "distance_unit": "degrees" if is_angle else None,
        "inputs": [
            {"name": names.name(int(i)), "value": float(v)}
            for i, v in zip(solver.raw_control_indices, x, strict=True)
        ],
        "poses": poses,
    }


def _pose(
    dna: risorius.Dna, index: int, distance: float, weight: float, names: ControlNames
) -> dict[str, Any]:
    ext = dna.rbf_behavior_ext
    outputs, weights, inputs = list[int](), list[float](), list[int]()
    if index < len(ext.poses):
        outputs = ext.poses[index].output_control_indices.tolist()
        weights = ext.poses[index].output_control_weights.tolist()
        inputs = ext.poses[index].input_control_indices.tolist()
    elif not ext.poses and not ext.pose_control_names:  # 2.4
        outputs, weights = [names.ml_end + index], [1.0]
    return {
        "name": dna.rbf_behavior.poses[index].name or f"pose {index}",
        "index": index,
        "distance": distance if math.isfinite(distance) else None,
        "weight": weight,
        "inputs": inputs,
        "outputs": [
            {"control": int(o), "name": names.name(int(o)), "weight": float(w)}
            for o, w in zip(outputs, weights, strict=True)
        ],
    }
