# SPDX-License-Identifier: GPL-3.0-or-later
"""The controls of a frame before Blender evaluates it.

Blender evaluates a frame in one go, simulations too, and calls its handlers afterwards: what they
write comes too late for cloth and hair. So the control armatures alone are evaluated first, in a
graph of their own, and the face has its pose when the frame begins.

The scene of that graph is in no file, see `stage`.
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

# Scene -> its stage.
_stages: dict[int, stage.Stage] = session.table("controls_ahead.stages", ("unregister",))
# Whether the file was edited since the last frame, and whether anything in it is simulated.
_edited = session.value("controls_ahead.edited", True, ("undo", "load"))
_simulated = session.value("controls_ahead.simulated", True, ("undo", "load"))
# Session uids of scenes, since the last load or undo.
_evaluated_scenes: set[int] = session.keep("controls_ahead.evaluated_scenes", set, ("free",))
_LOCK = threading.Lock()  # a render works beside the interface


def is_edited() -> bool:
    """Whether the file may have been edited since the last frame.

    Without an interface scripts edit and step without an update between.
    """
    return _edited.now or bpy.app.background


def is_needed() -> bool:
    """Whether anything sees a frame before its faces could be brought up after it.

    Else the curves would be evaluated twice for nothing. The first frame after an edit is always
    done: what was edited may read a face.
    """
    if is_edited():
        _simulated.now = caches.any_simulates()
    if _edited.now or _simulated.now:
        return True
    ours = __name__.partition(".scene.")[0]
    places = (getattr(h, "__module__", None) or "" for h in bpy.app.handlers.frame_change_post)
    return any(not place.startswith(ours) for place in places)


def note_evaluated(scene: bpy.types.Scene) -> None:
    """A scene of the user's was evaluated. Args: scene  the original."""
    _evaluated_scenes.add(scene.session_uid)


def is_safe(user: bpy.types.Scene) -> bool:
    """Whether a graph may be built before a frame of a scene.

    Blender builds the scene's own graph anew then. Blender 4.2 and 4.3 die of that where this graph
    was built and never evaluated, as that of a scene which a window was just switched to: its
    first frame is brought up afterwards. To look into such a graph is as deadly.

    Args:
        user: the scene that Blender is about to evaluate.
    """
    return bpy.app.version >= (4, 4) or user.session_uid in _evaluated_scenes


def at(user: bpy.types.Scene, faces: Sequence[Face]) -> tuple[Depsgraph | None, list[Face]]:
    """Evaluate the controls of faces at the time of a scene.

    Args:
        user: the scene that Blender is about to evaluate.
        faces: those in it.

    Returns:
        The graph, and the faces whose controls can be read in it: not those that depend on what
        a face does, which is not known yet. Where another thread is at it, none.
    """
    if not _LOCK.acquire(blocking=False):
        return None, []
    try:
        known = [face for face in faces if not lateness.is_circle(*face)]
        graph = _evaluated(user, known) if known else None
        if graph is None or not _faces_in(graph, known, whole=_edited.now):
            _edited.now = False
            return graph, known
        # Either Blender built the graph anew since, and the whole faces came in with the
        # pointers; or something there depends on a face.
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
    """Look anew whether what moves a face depends on it.

    Args:
        user: a scene that has it.
        rig, controls: its armatures.

    Returns:
        Why it cannot be baked, in one sentence; empty where it can.
    """
    lateness.forget(rig)
    with _LOCK:
        if not _depends(user, (rig, controls), [(rig, controls)]):
            return ""
    lateness.note_circle(rig, controls)
    return told(
        "{face} cannot be baked: {cause} depends on what a face does.",
        face=rig.name,
        cause=lateness.circle(rig),
    )


def note_edit() -> None:
    """Something was edited: Blender may build graphs anew."""
    _edited.now = True


@session.at("free")
def close() -> None:
    """Give the scene and its graph back: before undo and load, which free what they point to."""
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
    """Whether what moves a face depends on one of several faces, itself among them."""
    made = stage.Stage(_roots([face]))
    try:
        with stage.alone(c for _rig, c in others):
            return _faces_in(made.evaluate(user), others, whole=True)
    finally:
        made.close()


def _roots(faces: Iterable[Face]) -> list[bpy.types.Object]:
    """The control armatures, and the bodies: of a body's bones only those are read that turn."""
    found: dict[bpy.types.Object, None] = {}
    for _rig, controls in faces:
        hold = rig_placement.body_of(controls)
        found[controls] = None
        if hold is not None and hold.target is not None:
            found[hold.target] = None
    return list(found)


def _faces_in(graph: Depsgraph, faces: Iterable[Face], whole: bool) -> bool:
    """Whether a graph has a face. Args: whole  look for its meshes, too."""
    return any(
        item.evaluated_get(graph).is_evaluated
        for rig, _controls in faces
        for item in (rig, *(parts.meshes_of(rig) if whole else ()))
    )
