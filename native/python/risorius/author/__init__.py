# SPDX-License-Identifier: MIT
"""Makes joint rigs from the shapes of expressions."""

from .fitting import FitOptions, JointFit, Progress, fit_joints, fit_motions, fit_weights
from .joint_rig import JointRig, find_reference, make_joint_rig
from .levels import LodOptions
from .reference import Reference
from .work import Level, MeshErrors, RigOptions

__all__ = [
    "FitOptions",
    "JointFit",
    "JointRig",
    "Level",
    "LodOptions",
    "MeshErrors",
    "Progress",
    "Reference",
    "RigOptions",
    "find_reference",
    "fit_joints",
    "fit_motions",
    "fit_weights",
    "make_joint_rig",
]
