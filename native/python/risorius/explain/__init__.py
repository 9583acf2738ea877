# SPDX-License-Identifier: MIT
"""Explains a pose: which correctives fire, which joints move, and the share of each control.

facts = explain(dna, rig, raw)     # plain values that JSON can hold
print(page(facts))                 # as text
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

import risorius
from risorius.base.errors import ArgumentError

from ..controls.control_names import (
    ControlNames,
    Meaning,
    UnknownControlError,
    find_controls,
    named,
)
from .behavior import (
    explain_correctives,
    explain_maps,
    explain_networks,
    explain_raw,
    explain_setups,
    explain_shapes,
)
from .joints import bone_length, explain_joints
from .solvers import explain_solvers
from .words import page

__all__ = ["Meaning", "UnknownControlError", "explain", "find_controls", "page"]


def explain(
    dna: risorius.Dna,
    rig: risorius.Rig,
    raw: npt.ArrayLike,
    *,
    lod: int = 0,
    gui: npt.ArrayLike | None = None,
) -> dict[str, Any]:
    """All facts about the pose for some raw controls, as plain values.

    Args:
        dna: the face.
        rig: rig compiled from `dna`, with Euler angles.
        raw: float32[R], finite raw controls.
        lod: the LOD, 0 is the finest.
        gui: float32[G], GUI controls from which `raw` was computed, or None.

    Returns:
        A dict that json.dumps accepts. Active correctives and blend shapes are sorted by value,
        joints by movement, and animated maps by the difference from their rest, the largest first.
        The contributions to a joint sum to its pose.

    Raises:
        ValueError: the rig uses quaternions, or controls or pose are not finite.
    """
    if rig.rotation != "euler":
        raise ArgumentError("explain: a rig with rotation='euler' was expected")
    values = np.asarray(raw, np.float32)
    if not np.isfinite(values).all():
        raise ArgumentError("explain: raw controls that are finite were expected")
    pose = rig.evaluate(values, lod=lod)
    _check_finite(dna, pose)
    names = ControlNames(dna)
    controls = np.asarray(pose.controls, float)
    rest = np.asarray(rig.initial_raw_controls, float)
    maps_at_rest = rig.evaluate(rig.initial_raw_controls, lod=lod).animated_maps
    handles = None if gui is None else np.asarray(gui, float)
    return {
        "lod": lod,
        "translation_unit": dna.translation_unit,
        "bone_length": bone_length(dna),
        "joint_count": rig.joint_count,
        "raw_controls": explain_raw(dna, controls[: len(values)], rest, handles, names),
        "correctives": explain_correctives(dna, controls, lod, names),
        "solvers": explain_solvers(dna, rig, controls, lod, names),
        "networks": explain_networks(dna, controls, lod, names),
        "twists_and_swings": explain_setups(dna, controls, names),
        "joints": explain_joints(dna, pose, lod, names),
        "blend_shapes": explain_shapes(
            dna, np.asarray(pose.blend_shapes, float), controls, lod, names
        ),
        "animated_maps": explain_maps(
            dna,
            np.asarray(pose.animated_maps, float),
            np.asarray(maps_at_rest, float),
            controls,
            lod,
            names,
        ),
        "ignored_layers": rig.ignored_layers,
    }


def _check_finite(dna: risorius.Dna, pose: risorius.Pose) -> None:
    """Check that a pose is finite, because contributions must sum to it. Raises: ArgumentError."""
    of = {
        "joint": (pose.joints, dna.joint_names),
        "blend shape channel": (pose.blend_shapes, dna.blend_shape_channel_names),
        "animated map": (pose.animated_maps, dna.animated_map_names),
        "control": (pose.controls, dna.raw_control_names),
    }
    for kind, (found, names) in of.items():
        odd = np.argwhere(~np.isfinite(found))
        if len(odd):
            value = np.asarray(found)[tuple(odd[0])]
            name = named(names, int(odd[0, 0]), kind)
            raise ArgumentError(
                f"explain: a pose of finite numbers was expected, found {value} at {kind} {name}"
            )
