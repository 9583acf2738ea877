# SPDX-License-Identifier: MIT
"""Risorius: read, check, evaluate and write the DNA files of face rigs.

bytes --load--> Dna --Rig--> evaluate(raw controls) --> Pose
"""

from __future__ import annotations

from . import expressions
from ._native import (
    AnimatedMaps,
    BlendShapeChannels,
    BlendShapeTarget,
    BoneSpace,
    ClipError,
    Conditionals,
    DirectFace,
    Dna,
    DnaError,
    Instance,
    JointBehaviorMetadata,
    JointChain,
    JointGroup,
    Limits,
    LodMapping,
    MachineLearnedBehavior,
    MachineLearnedBehaviorExt,
    Mesh,
    MlJoints,
    MlOperation,
    MlType,
    Morph,
    NeuralNetwork,
    NeuralNetworkLayer,
    Pose,
    Psds,
    RbfBehavior,
    RbfBehaviorExt,
    RbfPose,
    RbfPoseControls,
    RbfSolver,
    Rig,
    Skin,
    TwistSwingBehavior,
    TwistSwingSetup,
    available_simd,
    deform_faces,
    evaluate_faces,
)
from .anim.clip import Clip, ClipReader, Event
from .anim.clip_writer import ClipWriter
from .anim.idle import Life, idle
from .anim.mixer import Layer, Mixer
from .base.errors import RisoriusError
from .base.version import __version__ as __version__
from .rigs.cache import compile_cached
from .rigs.load import Finding, check, load
from .solving.clip import SolvedClip, solve_clip
from .solving.controls import ControlLimits, ControlSharing
from .solving.drag import Solved, best_controls, local_ease, solve_drag
from .solving.handles import place_handles
from .solving.surface import Surface

__all__ = [
    "AnimatedMaps",
    "BlendShapeChannels",
    "BlendShapeTarget",
    "BoneSpace",
    "Clip",
    "ClipError",
    "ClipReader",
    "ClipWriter",
    "Conditionals",
    "ControlLimits",
    "ControlSharing",
    "DirectFace",
    "Dna",
    "DnaError",
    "Event",
    "Finding",
    "Instance",
    "JointBehaviorMetadata",
    "JointChain",
    "JointGroup",
    "Layer",
    "Life",
    "Limits",
    "LodMapping",
    "MachineLearnedBehavior",
    "MachineLearnedBehaviorExt",
    "Mesh",
    "Mixer",
    "MlJoints",
    "MlOperation",
    "MlType",
    "Morph",
    "NeuralNetwork",
    "NeuralNetworkLayer",
    "Pose",
    "Psds",
    "RbfBehavior",
    "RbfBehaviorExt",
    "RbfPose",
    "RbfPoseControls",
    "RbfSolver",
    "Rig",
    "RisoriusError",
    "Skin",
    "Solved",
    "SolvedClip",
    "Surface",
    "TwistSwingBehavior",
    "TwistSwingSetup",
    "available_simd",
    "best_controls",
    "check",
    "compile_cached",
    "deform_faces",
    "evaluate_faces",
    "expressions",
    "idle",
    "load",
    "local_ease",
    "place_handles",
    "solve_clip",
    "solve_drag",
]
