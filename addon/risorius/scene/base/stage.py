# SPDX-License-Identifier: GPL-3.0-or-later
"""Control armatures evaluated alone, in a scene of data of its own.

This scene is in no file: no list, save, undo step, append or handler finds it. The armatures are
cameras of its markers: Blender evaluates these and counts no user. Blender finds the objects that
move them by itself.
"""

from __future__ import annotations

import ctypes
import math
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import cast

import bpy

from . import parts
from .blender_types import ArmatureObject, Depsgraph

# Blender counts one reference too few to temporary data, and would free it twice. The newest that
# was seen to do so; in a newer one the references are counted each time.
MISCOUNTED_UNTIL = (5, 2)
_FAR = 1_000_000  # frame of the first marker: no animation gets there
_HANDLERS = (
    "frame_change_pre",
    "frame_change_post",
    "depsgraph_update_pre",
    "depsgraph_update_post",
)
_TIME = ("fps", "fps_base", "frame_map_old", "frame_map_new")


class Stage:
    """A scene in data of its own.

    Args:
        roots: objects to evaluate.
    """

    def __init__(self, roots: Sequence[bpy.types.Object]) -> None:
        data = bpy.data.temp_data()  # which the stubs take for what it gives
        self._data = cast("AbstractContextManager[bpy.types.BlendData]", data)
        self._file = self._data.__enter__()
        # Three references are expected: ours, the creator's, and the argument of this call.
        if bpy.app.version[:2] <= MISCOUNTED_UNTIL or sys.getrefcount(self._file) < 3:
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._file))
        self._scene = self._file.scenes.new("Risorius")
        for number, item in enumerate(roots):
            marker = self._scene.timeline_markers.new(str(number), frame=_FAR + number)
            marker.camera = item
        self.roots = identity(roots)

    def evaluate(self, user: bpy.types.Scene) -> Depsgraph:
        """The graph at the time of a scene."""
        render = self._scene.render
        for name in _TIME:
            value = getattr(user.render, name)
            if getattr(render, name) != value:
                setattr(render, name, value)
        return self.evaluate_frame(user.frame_current, user.frame_subframe)

    def evaluate_frame(self, frame: int, part: float = 0.0) -> Depsgraph:
        """The graph at a frame. Args: frame; part  of the way to the next one, 0 to 1."""
        own, layer = self._scene, self._scene.view_layers[0]
        own.frame_current = frame
        if own.frame_subframe != part:
            own.frame_subframe = part
        with unheard():
            if own.frame_current == frame:
                layer.update()
            else:  # below 0 the preferences forbid it, but not to scripts; redraws every window
                own.frame_set(frame, subframe=part)
        return cast("Depsgraph", layer.depsgraph)

    def close(self) -> None:
        """Free the scene and its graph."""
        self._data.__exit__(None, None, None)


@contextmanager
def alone(armatures: Iterable[ArmatureObject]) -> Iterator[None]:
    """While a graph is built the controls do not point to their faces.

    A graph has all that its objects' properties point to: the meshes and their keys would be
    copied, and copied again at each frame.

    Args:
        armatures: control armatures.
    """
    held = [(controls, controls.get(parts.RIG)) for controls in armatures]
    held = [(controls, item) for controls, item in held if isinstance(item, bpy.types.Object)]
    try:
        for controls, _item in held:
            controls[parts.RIG] = controls
        yield
    finally:
        for controls, item in held:
            controls[parts.RIG] = item  # it keeps its marks


@contextmanager
def unheard() -> Iterator[None]:
    """Context manager: no handler is called for frames and updates, because these are not the
    user's."""
    lists = [getattr(bpy.app.handlers, name) for name in _HANDLERS]
    kept = [handlers[:] for handlers in lists]
    for handlers in lists:
        handlers.clear()
    try:
        yield
    finally:
        for handlers, before in zip(lists, kept, strict=True):
            handlers[:0] = before


def identity(items: Iterable[bpy.types.Object]) -> tuple[tuple[int, int], ...]:
    """Numbers that identify objects without holding references."""
    return tuple((item.session_uid, item.as_pointer()) for item in items)


@contextmanager
def shown_at(controls: ArmatureObject, frame: float) -> Iterator[ArmatureObject]:
    """A control armature as its keys, strips and drivers show it at a frame.

    A property without animation keeps its present value. Blender writes the animated values to the
    original too, as in any evaluation. The caller has to give the user's own edits back.

    Args:
        controls: the control armature.
        frame: need not be whole.
    """
    whole = math.floor(frame)
    made = Stage([controls])
    try:
        with alone([controls]):
            graph = made.evaluate_frame(whole, frame - whole)
        yield controls.evaluated_get(graph)
    finally:
        made.close()
