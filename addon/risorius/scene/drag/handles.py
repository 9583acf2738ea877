# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the drag handles of a face: the vertices that its controls move most.

These handles are vertices of the skin; the handles of a face board are bones.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from ... import native
from ..animation import keying
from ..base import session
from ..base.blender_types import ArmatureObject, Context
from ..character import board, runtime
from . import kept_points, sliders
from .skin import Point, Skin

COUNT = 18  # number of handles of a face
_SHARE = 0.1  # least motion of a handle by a slider, divided by the motion of its strongest slider
_placed: WeakKeyDictionary[native.Surface, list[Point]] = session.keep(
    "handles.placed", WeakKeyDictionary, ("unregister",)
)


def of(surface: native.Surface) -> list[Point]:
    """The (mesh, vertex) of each handle of a face; computed at the first call.

    Args:
        surface: surface of the visible level of detail; its largest mesh gets the handles.
    """
    if surface not in _placed:
        shown = surface.mesh_indices
        head = max(shown, key=lambda m: surface.vertex_counts[m], default=None)
        found = () if head is None else native.module().place_handles(surface, head, COUNT)
        _placed[surface] = [(int(head or 0), int(vertex)) for vertex in found]
    return _placed[surface]


def offered(rig: ArmatureObject, surface: native.Surface) -> list[Point]:
    """The handles of a face that are not hidden.

    Args:
        rig: the character.
        surface: surface of the visible level of detail.
    """
    hidden = kept_points.of(rig, kept_points.HIDDEN, surface.vertex_counts)
    return [point for point in of(surface) if point not in hidden]


def selected(rig: ArmatureObject, surface: native.Surface) -> list[Point]:
    """The handles that are selected and not hidden.

    Args:
        rig: the character.
        surface: surface of the visible level of detail.
    """
    chosen = kept_points.of(rig, kept_points.SELECTED, surface.vertex_counts)
    return [point for point in offered(rig, surface) if point in chosen]


def sliders_of(context: Context, rig: ArmatureObject) -> list[str]:
    """The sliders that have a strong effect on a selected handle.

    A slider counts if it moves the handle more than _SHARE times as far as the slider that moves
    this handle most. Sliders that drivers or layers move are left out.

    Args:
        context: has the visible scene.
        rig: the character.
    """
    live = runtime.there(rig)
    skin = Skin.of(context, rig, live)
    state = sliders.read(rig, live, skin.depsgraph)
    own = np.zeros(len(live.labels), bool)
    for mesh, vertex in selected(rig, skin.surface):
        reach = skin.surface.jacobian(
            state.seen, mesh, [vertex], lowest=state.low, highest=state.high
        )
        far = np.linalg.norm(reach[0], axis=0) * state.free
        own |= (far > _SHARE * far.max(initial=0.0)) & (far > 0)
    return [live.labels[i] for i in np.flatnonzero(own)]


def key(context: Context, rig: ArmatureObject) -> int:
    """Key the sliders or board handles that move the selected handles.

    Args:
        context: has the settings and the frame.
        rig: the character.

    Returns:
        The number of keyed properties.

    Raises:
        FaceError: an active tweak does not reach this frame.
    """
    labels, live = sliders_of(context, rig), runtime.there(rig)
    led: list[str] = []
    if board.leads_face(rig):
        reached = dict(zip(live.labels, live.table.reached, strict=True))
        led = [label for label in labels if reached[label]]
    paths = [board.path_of(h.bone) for h in board.handles_of_labels(rig, led)] if led else []
    return keying.key(context, rig, [n for n in labels if n not in led], paths)
