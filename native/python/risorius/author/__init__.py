# SPDX-License-Identifier: MIT
"""Joint rigs made from expressions."""

from .fitting import FitOptions, JointFit, fit_joints, fit_weights
from .joint_rig import JointRig, MeshErrors, RigOptions, make_joint_rig

__all__ = [
    "FitOptions",
    "JointFit",
    "JointRig",
    "MeshErrors",
    "RigOptions",
    "fit_joints",
    "fit_weights",
    "make_joint_rig",
]
