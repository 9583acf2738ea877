# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the raw controls with and without a layer, to show the effect of the layer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...logic.animation import clip_units
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..animation import layer_mixing, layers
from ..base import parts
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import runtime
from ..frame import inputs

Controls = NDArray[np.float32]


def raw_pair(
    rig: ArmatureObject, live: runtime.Runtime, place: int, depsgraph: Depsgraph
) -> tuple[Controls, Controls]:
    """The current raw controls with a layer and without it: float32[R] each.

    Rotations of head and neck are not included.

    Args:
        rig: deforming armature.
        live: Runtime of the character.
        place: index of the layer in the settings of the character.
        depsgraph: graph for reading the controls.

    Raises:
        FaceError: the layer does not exist, or cannot be played.
    """
    controls = parts.controls_there(rig)
    maximum = parts.maximum_of(controls)
    seen = controls.evaluated_get(depsgraph)
    with_it, _ = inputs.read_inputs(seen, live, depsgraph, maximum)
    stack = layer_mixing.compiled(controls, live, depsgraph.scene, maximum)
    if place not in stack.places or not layers.has_any(controls):
        raise FaceError(told("This layer plays nothing at the current frame."))
    at = stack.places.index(place)
    layer = stack.layers[at]
    # The layer is replaced by a layer that moves nothing. The layer is not muted instead, because
    # muting a solo layer would let other layers take effect.
    nothing = np.zeros(len(live.labels) + len(clip_units.BONES), np.float32)
    stack.layers[at] = replace(layer, mask=nothing)
    stack.weights = ()  # so that the mixer reads its layers again
    try:
        without_it, _ = inputs.read_inputs(seen, live, depsgraph, maximum)
    finally:
        stack.layers[at] = layer
        stack.weights = ()
    return with_it, without_it
