# SPDX-License-Identifier: MIT
"""Differences of layers rbfb and rbfe: solvers and poses."""

from __future__ import annotations

import numpy as np

import risorius

from ...base.words import counted
from ..pairing.common import Place, choice, cut, lod_mapping, members, real, reals
from ..pairing.comparison import Comparison
from ..pairing.pairs import pair
from .definition import names

_CHOICES = {
    "solver_type": ("additive", "interpolative"),
    "automatic_radius": ("on", "off"),
    "distance_method": ("euclidean", "quaternion", "swing angle", "twist angle"),
    "normalize_method": ("only above one", "always"),
    "function_type": ("gaussian", "exponential", "linear", "cubic", "quintic"),
    "twist_axis": ("x", "y", "z"),
}


def compare(faces: Comparison) -> None:
    place = Place(faces, "RBF behavior", "rbf_behavior")
    a, b = faces.a.rbf_behavior, faces.b.rbf_behavior
    mappings = a.lod_solver_mapping, b.lod_solver_mapping
    lod_mapping(place.at("lod_solver_mapping"), faces.solvers, *mappings)
    names(place.at("solvers").at("name"), faces.solvers)
    for i, j in zip(faces.solvers.pairs.a.tolist(), faces.solvers.pairs.b.tolist(), strict=True):
        name = f"solver {faces.solvers.label(i)}"
        _solver(place.at("solvers", name), a.solvers[i], b.solvers[j])
    names(place.at("poses").at("name"), faces.poses)
    poses_a, poses_b = a.poses, b.poses
    for i, j in zip(faces.poses.pairs.a.tolist(), faces.poses.pairs.b.tolist(), strict=True):
        scale = place.at("poses", f"pose {faces.poses.label(i)}").at("scale", "scale")
        if i < len(poses_a) and j < len(poses_b):
            real(scale, poses_a[i].scale, poses_b[j].scale)
        elif i < len(poses_a) or j < len(poses_b):
            scale.say(f"only in {'A' if i < len(poses_a) else 'B'}")
    _pose_controls(faces)


def _solver(place: Place, a: risorius.RbfSolver, b: risorius.RbfSolver) -> None:
    faces = place.faces
    for name in ("radius", "weight_threshold"):
        real(place.at(name, name.replace("_", " ")), getattr(a, name), getattr(b, name))
    for name, words in _CHOICES.items():
        choice(place.at(name, name.replace("_", " ")), words, getattr(a, name), getattr(b, name))
    inputs, poses = place.at("raw_control_indices", "inputs"), place.at("pose_indices", "poses")
    members(inputs, faces.controls, a.raw_control_indices, b.raw_control_indices)
    members(poses, faces.poses, a.pose_indices, b.pose_indices)
    _targets(place.at("raw_control_values", "targets"), a, b)


def _targets(place: Place, a: risorius.RbfSolver, b: risorius.RbfSolver) -> None:
    """Report changed target values of an RBF solver; values of the same pose and control are
    compared."""
    faces = place.faces
    shapes = [(len(s.pose_indices), len(s.raw_control_indices)) for s in (a, b)]
    if any(
        s.raw_control_values.size != rows * columns
        for s, (rows, columns) in zip((a, b), shapes, strict=True)
    ):
        reals(place, "value", a.raw_control_values, b.raw_control_values)
        return
    rows = pair(faces.poses.in_a(a.pose_indices), faces.poses.in_b(b.pose_indices))
    columns = pair(
        faces.controls.in_a(a.raw_control_indices), faces.controls.in_b(b.raw_control_indices)
    )
    x = cut(a.raw_control_values.reshape(shapes[0]), rows.a, columns.a)
    y = cut(b.raw_control_values.reshape(shapes[1]), rows.b, columns.b)
    changed = faces.changed(x, y)
    if changed.any():
        at = rows.a[np.flatnonzero(changed.any(axis=1))]
        poses = faces.report.listed(faces.poses.labels(faces.poses.in_a(a.pose_indices[at])))
        number = counted(int(np.count_nonzero(changed)), "value")
        place.say(f"{number} changed {faces.by(x[changed], y[changed])} (of poses {poses})")


def _pose_controls(faces: Comparison) -> None:
    place = Place(faces, "RBF behavior", "rbf_behavior_ext")
    a, b = faces.a.rbf_behavior_ext, faces.b.rbf_behavior_ext
    if a.pose_control_names or b.pose_control_names:
        names(place.at("pose_control_names"), faces.pose_controls)
    if bool(a.pose_control_names) != bool(b.pose_control_names):
        side = "A" if a.pose_control_names else "B"
        place.at("pose_control_names").say(f"pose controls have names only in {side}")
    poses_a, poses_b = a.poses, b.poses
    for i, j in zip(faces.poses.pairs.a.tolist(), faces.poses.pairs.b.tolist(), strict=True):
        pose = place.at("poses", f"pose {faces.poses.label(i)}")
        if i < len(poses_a) and j < len(poses_b):
            _pose(pose, poses_a[i], poses_b[j])
        elif i < len(poses_a) or j < len(poses_b):
            pose.say(f"its controls are only in {'A' if i < len(poses_a) else 'B'}")


def _pose(place: Place, a: risorius.RbfPoseControls, b: risorius.RbfPoseControls) -> None:
    controls = place.faces.controls
    name = "input_control_indices"
    members(place.at(name, "inputs"), controls, getattr(a, name), getattr(b, name))
    name = "output_control_indices"
    members(place.at(name, "outputs"), controls, getattr(a, name), getattr(b, name))
    outputs_a = controls.in_a(a.output_control_indices)
    pairs = pair(outputs_a, controls.in_b(b.output_control_indices))
    x, y = a.output_control_weights[pairs.a], b.output_control_weights[pairs.b]
    for i in np.flatnonzero(place.faces.changed(x, y)).tolist():
        output = controls.label(int(outputs_a[pairs.a[i]]))
        real(place.at("output_control_weights", f"weight of {output}"), x[i], y[i])
