# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared code of operators and panels: poll functions, the active face, errors, progress."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from .. import native
from ..logic.base import names
from ..logic.base.errors import FaceError
from ..scene.base import parts
from ..scene.base.blender_types import ArmatureObject
from ..scene.character import board, runtime
from .blender_types import Context, Operator, OperatorBase, PanelBase
from .words import of_error, say

_NO_FACE = "Select a face first."
MODES = (
    (
        "AUTO",
        "Direct",
        (
            "Fastest: vertices get their final positions, bones are not "
            "posed. The face uses Live if needed"
        ),
    ),
    (
        "LIVE",
        "Live",
        (
            "Each mesh has one shape key, and its armature modifier acts after the key; bones "
            "are posed"
        ),
    ),
    (
        "KEYS",
        "Shape Keys",
        "Every channel is a real shape key with a driver: editable and exportable",
    ),
)


def explain(path: str | Path, error: Exception) -> str:
    """One sentence about an error with a file.

    Args:
        path: path of the file; the sentence begins with the file's name, unless the text of the
            error contains this name.
        error: error from reading or writing the file.
    """
    reason = error.strerror if isinstance(error, OSError) else None
    text = names.printable(reason or of_error(error)).strip().rstrip(".")
    name = names.printable(Path(path).name)
    return f"{text}." if name in text else f"{name}: {text}."


def system_path(path: str) -> str:
    """Convert a path of a dialog or script to a system path; `//` is the folder of the .blend.

    Args:
        path: path of a file or folder; an empty path stays empty.
    """
    return bpy.path.abspath(path) if path else path


def proposed_file(name: str, ending: str) -> str:
    """The name of a file that a file dialog proposes.

    Characters such as "/" are replaced, so the name cannot lead to another folder.

    Args:
        name: name of the exported object or action.
        ending: extension of the file, with the dot.
    """
    found: str = native.part("files.names").file_name(name.removesuffix("_rig"), ending)
    return found


def usable(cls: type[Operator]) -> bool:
    """Poll: whether the native module is available; if not, set the poll message."""
    trouble = native.problem()
    if trouble:
        cls.poll_message_set(say(trouble))
    return not trouble


@contextmanager
def shown_progress(context: Context) -> Iterator[Callable[[float], None]]:
    """Show progress at the cursor; yields a function that takes the finished share, 0 to 1."""
    manager = context.window_manager
    manager.progress_begin(0, 100)
    try:
        yield lambda share: manager.progress_update(round(share * 100))
    finally:
        manager.progress_end()


def active_controls(context: Context) -> ArmatureObject | None:
    """The control armature of the active face.

    Returns:
        None if no face is active, if the face has lost the armature, or if the native module cannot
        be used.
    """
    rig = None if native.problem() else parts.active_rig(context)
    return parts.controls_of(rig) if rig is not None else None


def face_rig(context: Context) -> ArmatureObject:
    """The deforming armature of the active face, for operators whose poll requires a face.

    Raises:
        FaceError: no face is active.
    """
    rig = parts.active_rig(context)
    if rig is None:
        raise FaceError(_NO_FACE)
    return rig


def face_controls(context: Context) -> ArmatureObject:
    """The control armature of the active face, for operators whose poll requires a face.

    Raises:
        FaceError: no face is active, the active face has lost its control armature, or the native
            module cannot be used.
    """
    controls = active_controls(context)
    if controls is None:
        raise FaceError(_NO_FACE)
    return controls


def as_seen(context: Context) -> bool:
    """Whether left and right in the interface are the viewer's sides, not the face's own sides.

    This is the setting `sides` of the add-on's preferences.
    """
    addon = context.preferences.addons.get(native.ADDON)
    return addon is None or getattr(addon.preferences, "sides", "SEEN") == "SEEN"


class FaceOperator(OperatorBase):
    """Base of operators on the active face.

    Class attributes decide for which faces `poll` makes the operator available.
    """

    bl_options = {"REGISTER", "UNDO"}
    whole_face = True  # whether `poll` requires the control armature and DNA data of the face
    baked_too = False  # whether faces with baked actions are accepted
    by_sliders = False  # whether a face that its face board moves is rejected

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Whether the operator is available for the active face; if not, set the poll message."""
        if not usable(cls):
            return False
        rig = parts.active_rig(context)
        if rig is None or (cls.whole_face and parts.controls_of(rig) is None):
            cls.poll_message_set(say(_NO_FACE))
            return False
        if cls.whole_face and runtime.of(rig) is None:
            cls.poll_message_set(
                say("The text data-block with the DNA data of this face is missing.")
            )
            return False
        if parts.BAKED in rig and not cls.baked_too:
            cls.poll_message_set(say("This face is baked: choose Back to Live first."))
            return False
        if cls.by_sliders and board.leads_face(rig):
            cls.poll_message_set(
                say("The board leads this face: choose Sliders in the panel Controls first.")
            )
            return False
        return True


class FacePanel(PanelBase):
    """Base of all panels in the sidebar tab Risorius."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Risorius"  # not translated, because it is a name


class FaceOnlyPanel(FacePanel):
    """Base of panels that are hidden without a face."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        return active_controls(context) is not None
