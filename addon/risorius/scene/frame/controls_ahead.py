# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates the control armatures of a frame before Blender evaluates the frame.

Blender evaluates a frame with its simulations, and calls handlers afterwards. Values that handlers
write are too late for cloth and hair. So Risorius evaluates the control armatures first in a
separate graph, and the face has its pose when the frame begins.

The separate graph has a temporary scene that belongs to no file (base/stage.py).
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from contextlib import nullcontext

import bpy

from ...logic.base.sentences import told
from ..base import parts, session, stage
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import rig_placement
from ..skinning import caches
from . import lateness

Face = tuple[ArmatureObject, ArmatureObject]  # deforming armature, control armature

# Session uid of a scene of the user -> temporary scene with the controls of the user's scene.
_stages: dict[int, stage.Stage] = session.table("controls_ahead.stages", ("unregister",))
# Two truth values. _edited: whether the file may have been edited since the last frame. _simulated:
# whether the file has a simulation.
_edited = session.value("controls_ahead.edited", True, ("undo", "load"))
_simulated = session.value("controls_ahead.simulated", True, ("undo", "load"))
# Session uids of scenes that Blender evaluated since the last load, undo or redo.
_evaluated_scenes: set[int] = session.keep("controls_ahead.evaluated_scenes", set, ("free",))
_LOCK = threading.Lock()  # a render evaluates frames in another thread than the interface


def is_edited() -> bool:
    """Whether the file may have been edited since the last frame.

    Always True in background mode, because scripts may edit without an update that would notify.
    """
    return _edited.now or bpy.app.background


def is_needed() -> bool:
    """Whether the faces must be evaluated before Blender evaluates a frame.

    A simulation, or a frame handler of another add-on, needs the poses at that time. They are also
    needed at the first frame after an edit, because edited objects may read a face. In all other
    cases the early evaluation would only cost time.
    """
    if is_edited():
        _simulated.now = caches.any_simulates()
    if _edited.now or _simulated.now:
        return True
    ours = __name__.partition(".scene.")[0]
    places = (getattr(h, "__module__", None) or "" for h in bpy.app.handlers.frame_change_post)
    return any(not place.startswith(ours) for place in places)


def note_evaluated(scene: bpy.types.Scene) -> None:
    """Record that Blender has evaluated a scene.

    Args:
        scene: the original scene.
    """
    _evaluated_scenes.add(scene.session_uid)


def is_safe(user: bpy.types.Scene) -> bool:
    """Whether the separate graph may be built before a frame of a scene.

    Building it makes Blender rebuild the scene's own graph. Blender 4.2 and 4.3 crash if that graph
    was never evaluated, such as after switching a window to the scene. If the result is False, the
    faces must be updated after the frame.

    Args:
        user: the scene to be evaluated.
    """
    return bpy.app.version >= (4, 4) or user.session_uid in _evaluated_scenes


def at(user: bpy.types.Scene, faces: Sequence[Face]) -> tuple[Depsgraph | None, list[Face]]:
    """Evaluate the controls of faces at the time of a scene.

    Args:
        user: the scene that Blender is about to evaluate.
        faces: faces of the scene.

    Returns:
        The graph, and the faces whose controls can be read in it. Faces whose controls depend on a
        face are left out. (None, []) if another thread uses the graph or no face is left.
    """
    if not _LOCK.acquire(blocking=False):
        return None, []
    try:
        known = [face for face in faces if not lateness.is_circle(*face)]
        graph = _evaluated(user, known) if known else None
        if graph is None or not _faces_in(graph, known, whole=_edited.now):
            _edited.now = False
            return graph, known
        # The graph contains a face: either Blender rebuilt the graph while controls pointed to
        # their faces, or an object of the graph depends on a face. Rebuild the graph to find out
        # which of these is the cause.
        _close()
        graph = _evaluated(user, known)
        if _faces_in(graph, known, whole=True):
            _close()
            for rig, controls in known:
                if _depends(user, (rig, controls), known):
                    lateness.note_circle(rig, controls)
            known = [face for face in known if not lateness.is_circle(*face)]
            graph = _evaluated(user, known) if known else None
        _edited.now = False
        return graph, known
    finally:
        _LOCK.release()


def examine(user: bpy.types.Scene, rig: ArmatureObject, controls: ArmatureObject) -> str:
    """Check again whether the inputs of a face depend on the face.

    Args:
        user: a scene with the face.
        rig, controls: deforming and control armature of the face.

    Returns:
        The reason why the face cannot be baked, in one sentence; "" if it can.
    """
    lateness.forget(rig)
    with _LOCK:
        if not _depends(user, (rig, controls), [(rig, controls)]):
            return ""
    lateness.note_circle(rig, controls)
    return told(
        "{face} cannot be baked: {cause} depends on the motion of a face.",
        face=rig.name,
        cause=lateness.circle(rig),
    )


def note_edit() -> None:
    """Record that the file was edited, because Blender may rebuild graphs after an edit."""
    _edited.now = True


@session.at("free")
def close() -> None:
    """Release the temporary scenes and graphs before undo and load, which free their data."""
    with _LOCK:
        _close()


def _close() -> None:
    while _stages:
        _stages.popitem()[1].close()


def _evaluated(user: bpy.types.Scene, faces: Sequence[Face]) -> Depsgraph:
    roots = _roots(faces)
    made = _stages.get(user.session_uid)
    if made is not None and made.roots != stage.identity(roots):
        _close()
        made = None
    if made is None:
        made = _stages[user.session_uid] = stage.Stage(roots)
        _edited.now = True
    with stage.alone(c for _rig, c in faces) if is_edited() else nullcontext():
        return made.evaluate(user)


def _depends(user: bpy.types.Scene, face: Face, others: Sequence[Face]) -> bool:
    """Whether the inputs of a face depend on a face of `others`; `others` contains this face."""
    made = stage.Stage(_roots([face]))
    try:
        with stage.alone(c for _rig, c in others):
            return _faces_in(made.evaluate(user), others, whole=True)
    finally:
        made.close()


def _roots(faces: Iterable[Face]) -> list[bpy.types.Object]:
    """The objects to evaluate: control armatures, and the bodies to which faces are attached."""
    found: dict[bpy.types.Object, None] = {}
    for _rig, controls in faces:
        hold = rig_placement.body_of(controls)
        found[controls] = None
        if hold is not None and hold.target is not None:
            found[hold.target] = None
    return list(found)


def _faces_in(graph: Depsgraph, faces: Iterable[Face], whole: bool) -> bool:
    """Whether a graph contains the deforming armature of any of the faces.

    Args:
        graph: the dependency graph.
        faces: the faces to look for.
        whole: True: the result is also True if the graph contains a mesh of a face.
    """
    return any(
        item.evaluated_get(graph).is_evaluated
        for rig, _controls in faces
        for item in (rig, *(parts.meshes_of(rig) if whole else ()))
    )
