# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates control armatures alone, in a temporary scene outside the file's data.

The scene belongs to no file, so lists, saves, undo steps, appends and handlers do not find it. The
armatures are set as cameras of its timeline markers, because Blender evaluates these cameras and
their dependencies without raising their user counts.
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

# Newest Blender version known to count one Python reference too few to temporary data, which it
# would then free twice. In newer versions Stage checks the count.
MISCOUNTED_UNTIL = (5, 2)
_FAR = 1_000_000  # frame of the first marker, beyond any animation
_HANDLERS = (
    "frame_change_pre",
    "frame_change_post",
    "depsgraph_update_pre",
    "depsgraph_update_post",
)
_TIME = ("fps", "fps_base", "frame_map_old", "frame_map_new")


class Stage:
    """A temporary scene outside the file's data.

    Args:
        roots: objects to evaluate.

    Attributes:
        roots: (session uid, memory address) of each of these objects.
    """

    def __init__(self, roots: Sequence[bpy.types.Object]) -> None:
        data = bpy.data.temp_data()  # a context manager, contrary to the stubs
        self._data = cast("AbstractContextManager[bpy.types.BlendData]", data)
        self._file = self._data.__enter__()
        # getrefcount must give 3: self._file, Blender's own reference, and the call's argument.
        if bpy.app.version[:2] <= MISCOUNTED_UNTIL or sys.getrefcount(self._file) < 3:
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(self._file))
        self._scene = self._file.scenes.new("Risorius")
        for number, item in enumerate(roots):
            marker = self._scene.timeline_markers.new(str(number), frame=_FAR + number)
            marker.camera = item
        self.roots = identity(roots)

    def evaluate(self, user: bpy.types.Scene) -> Depsgraph:
        """The dependency graph at the current frame and time settings of the user's scene."""
        render = self._scene.render
        for name in _TIME:
            value = getattr(user.render, name)
            if getattr(render, name) != value:
                setattr(render, name, value)
        return self.evaluate_frame(user.frame_current, user.frame_subframe)

    def evaluate_frame(self, frame: int, part: float = 0.0) -> Depsgraph:
        """The dependency graph at a frame.

        Args:
            frame: the whole part of the frame number.
            part: the fraction of the frame number, 0 to 1.
        """
        own, layer = self._scene, self._scene.view_layers[0]
        own.frame_current = frame
        if own.frame_subframe != part:
            own.frame_subframe = part
        with unheard():
            if own.frame_current == frame:
                layer.update()
            else:  # frame_current refuses frames below 0; frame_set does not, but redraws windows
                own.frame_set(frame, subframe=part)
        return cast("Depsgraph", layer.depsgraph)

    def close(self) -> None:
        """Free the scene and its graph."""
        self._data.__exit__(None, None, None)


@contextmanager
def alone(armatures: Iterable[ArmatureObject]) -> Iterator[None]:
    """Context manager: the controls do not point to their faces while a graph is built.

    A graph includes all objects that custom properties point to. Otherwise the meshes of the face
    and their shape keys would be copied at each frame.

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
            controls[parts.RIG] = item  # the property keeps its override flag


@contextmanager
def unheard() -> Iterator[None]:
    """Context manager: call no frame or update handlers, because the evaluation is internal."""
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
    """(session uid, address) of each object, to identify objects without references to them."""
    return tuple((item.session_uid, item.as_pointer()) for item in items)


@contextmanager
def shown_at(controls: ArmatureObject, frame: float) -> Iterator[ArmatureObject]:
    """Context manager: the control armature, evaluated at a frame.

    The evaluation includes action, NLA strips and drivers of the armature.

    A property without animation keeps its present value. Blender also writes the animated values to
    the original; the caller must restore the user's edits.

    Args:
        controls: the control armature.
        frame: frame of the scene; need not be whole.
    """
    whole = math.floor(frame)
    made = Stage([controls])
    try:
        with alone([controls]):
            graph = made.evaluate_frame(whole, frame - whole)
        yield controls.evaluated_get(graph)
    finally:
        made.close()
