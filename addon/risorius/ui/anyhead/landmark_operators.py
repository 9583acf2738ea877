# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that find, place, show, save, load and remove the landmarks of a head."""

from __future__ import annotations

from typing import cast

import bpy
from bpy_extras import view3d_utils
from mathutils import Vector

from ... import native
from ...logic.base import names
from ...scene.anyhead import finding, heads, points
from ...scene.base.blender_types import MeshObject
from ...scene.base.task import Task
from ...scene.file import shape_key_head
from .. import words
from ..background_work import RunsBeside
from ..blender_types import (
    Context,
    ExportHelper,
    ImportHelper,
    Operator,
    OperatorBase,
    Result,
)
from ..common import explain, proposed_file, system_path, usable


class OfHead(OperatorBase):
    """Base of the operators on a head without expressions."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Whether a head is selected; sets the poll message if not."""
        if not usable(cls):
            return False
        if heads.head_of(context) is None:
            cls.poll_message_set(words.say("Select the mesh of a head that is no face yet."))
            return False
        return True


def head_there(context: Context) -> MeshObject:
    """The selected head; call it only after `poll` returned True."""
    return cast(MeshObject, heads.head_of(context))


def listed(missing: list[str]) -> str:
    """The labels of the landmarks `missing` in the user's language, joined by commas."""
    return names.listed([words.say(finding.words()[name]) for name in missing])


class RISORIUS_OT_find_landmarks(RunsBeside, OfHead, Operator):
    """Find eyes, lids, lips, nose, chin and ears of the selected head, and show them on it"""

    bl_idname = "risorius.find_landmarks"
    bl_label = "Find Landmarks"

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.wait_beside()
        return self.execute(context)

    def execute(self, context: Context) -> Result:
        item = head_there(context)
        taken = shape_key_head.taken_with(context, item)
        others = [*taken[1:], *shape_key_head.relatives_of(context, taken)]
        try:
            task = finding.find_task(finding.read(context, item, others))
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        self._task: Task[finding.Finding] = task
        self._head = item.name
        return self.begin(context, task)

    def finish(self, context: Context) -> Result:
        """Show the found landmarks and name the missing ones, or report the error of the search."""
        found, error = self._task.result, self._task.error
        if error is not None and not isinstance(error, native.user_errors()):
            raise error
        head = bpy.data.objects.get(self._head)
        if error is not None or found is None or head is None:
            self.report({"ERROR"}, explain(self._head, error or RuntimeError(self._head)))
            return {"CANCELLED"}
        show_found(self, context, cast(MeshObject, head), found)
        return {"FINISHED"}

    def shown(self, share: int) -> str:
        return words.say("Finding landmarks: {share} %, Esc cancels", share=share)

    def cancelled_text(self) -> str:
        return words.say("The search for landmarks was cancelled.")


def show_found(
    operator: Operator, context: Context, head: MeshObject, found: finding.Finding
) -> None:
    """Show landmarks on a head, and report missing landmarks by name.

    Args:
        operator: the operator that reports.
        context: has the scene.
        head: the mesh object.
        found: the landmarks of the head.
    """
    points.show(context, head, found.places)
    hide_lines(context)
    for sentence in found.notes[:5]:
        operator.report({"INFO"}, words.local(sentence))
    missing = [name for name in found.missing if name not in points.of(head)]
    if missing:
        text = "Not found: {names}. Place these landmarks in the panel Face from Head."
        operator.report({"WARNING"}, words.say(text, names=listed(missing)))
        return
    text = "{count} landmarks found"
    operator.report({"INFO"}, words.say(text, count=len(found.places)))


def hide_lines(context: Context) -> None:
    """Hide relationship lines in the 3D viewports of the window.

    Otherwise Blender draws a line from each landmark to the origin of its head.

    Args:
        context: has the window; without a window nothing happens.
    """
    screen = context.window.screen if context.window is not None else None
    for area in screen.areas if screen is not None else ():
        if area.type == "VIEW_3D":
            space = cast(bpy.types.SpaceView3D, area.spaces.active)
            space.overlay.show_relationship_lines = False


class RISORIUS_OT_place_landmark(OfHead, Operator):
    """Put a landmark where you click on the head, or at the 3D cursor"""

    bl_idname = "risorius.place_landmark"
    bl_label = "Place Landmark"

    landmark: bpy.props.StringProperty(
        name="Landmark",
        description="Name of the landmark, such as eye_inner_L",
        options={"SKIP_SAVE"},
    )
    way: bpy.props.EnumProperty(
        name="Where",
        items=[
            ("CURSOR", "At the 3D Cursor", "Where the 3D cursor is"),
            ("CLICK", "By Click", "Where you click on the head; Esc or right click: cancel"),
        ],
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if self.way == "CURSOR" or context.window is None:
            return self.execute(context)
        if self.landmark not in finding.words():
            return self._unknown()
        context.window_manager.modal_handler_add(self)
        context.window.cursor_modal_set("EYEDROPPER")
        title = words.say(finding.words()[self.landmark])
        text = words.say("Click on {landmark}; Esc or right click: cancel", landmark=title)
        context.workspace.status_text_set(text)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        """Place the landmark at a left click, and stop at Esc or a right click."""
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self.cancel(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"}
        self.cancel(context)
        where = _under(context, event, head_there(context))
        if where is None:
            self.report({"WARNING"}, words.say("There is no head under the pointer."))
            return {"CANCELLED"}
        return self._place(context, where)

    def cancel(self, context: Context) -> None:
        if context.window is not None:
            context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)

    def execute(self, context: Context) -> Result:
        head = head_there(context)
        into = head.matrix_world.inverted_safe()
        return self._place(context, into @ context.scene.cursor.location)

    def _place(self, context: Context, where: Vector) -> Result:
        if self.landmark not in finding.words():
            return self._unknown()
        points.place(context, head_there(context), self.landmark, where)
        return {"FINISHED"}

    def _unknown(self) -> Result:
        text = "There is no landmark {name}."
        self.report({"ERROR"}, words.say(text, name=self.landmark or '""'))
        return {"CANCELLED"}


def _under(context: Context, event: bpy.types.Event, head: MeshObject) -> Vector | None:
    """The point of the head's surface under the mouse pointer, in the object space of the head.

    Returns None if the pointer is not over the head in a 3D view.
    """
    for area in context.screen.areas if context.screen else ():
        if area.type != "VIEW_3D":
            continue
        region = next(r for r in area.regions if r.type == "WINDOW")
        x, y = event.mouse_x - region.x, event.mouse_y - region.y
        if not (0 <= x < region.width and 0 <= y < region.height):
            continue
        view = cast(bpy.types.SpaceView3D, area.spaces.active).region_3d
        if view is None:
            continue
        origin = view3d_utils.region_2d_to_origin_3d(region, view, (x, y))
        way = view3d_utils.region_2d_to_vector_3d(region, view, (x, y))
        into = head.matrix_world.inverted_safe()
        seen = head.evaluated_get(context.evaluated_depsgraph_get())
        hit, place, _normal, _face = seen.ray_cast(into @ origin, into.to_3x3() @ way)
        return place if hit else None
    return None


class _OfLandmarks(OfHead):
    """Base of the operators that need existing landmarks."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Whether the head has landmarks; sets the poll message if not."""
        if not super().poll(context):
            return False
        if not points.of(head_there(context)):
            cls.poll_message_set(words.say("Find the landmarks of this head first."))
            return False
        return True


class RISORIUS_OT_clear_landmarks(_OfLandmarks, Operator):
    """Remove all landmarks of this head, including landmarks that you placed"""

    bl_idname = "risorius.clear_landmarks"
    bl_label = "Remove Landmarks"

    def execute(self, context: Context) -> Result:
        head = head_there(context)
        points.remove(head)
        if context.active_object is None:  # the active object was a landmark
            context.view_layer.objects.active = head
        return {"FINISHED"}


class RISORIUS_OT_landmark_names(_OfLandmarks, Operator):
    """Show the names of the landmarks in the 3D view, or hide the names"""

    bl_idname = "risorius.landmark_names"
    bl_label = "Names of Landmarks"

    enable: bpy.props.BoolProperty(name="Show", default=True)

    def execute(self, context: Context) -> Result:
        for point in points.of(head_there(context)).values():
            point.item.show_name = self.enable
        return {"FINISHED"}


class RISORIUS_OT_save_landmarks(_OfLandmarks, Operator, ExportHelper):
    """Write the landmarks of this head to a file, for example for risorius author --landmarks"""

    bl_idname = "risorius.save_landmarks"
    bl_label = "Save Landmarks"
    bl_options = {"REGISTER"}

    filename_ext = ".json"
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.filepath:
            self.filepath = proposed_file(head_there(context).name, ".landmarks.json")
        return ExportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        head = head_there(context)
        self.filepath = system_path(self.filepath)
        places = {name: point.place for name, point in points.of(head).items()}
        try:
            text = finding.text_of(finding.read(context, head, ()), places)
            native.part("files.fileio").write_text(self.filepath, text)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_load_landmarks(OfHead, Operator, ImportHelper):
    """Load the landmarks of this head from a file; they replace the landmarks that you placed"""

    bl_idname = "risorius.load_landmarks"
    bl_label = "Load Landmarks"

    filename_ext = ".json"
    filter_glob: bpy.props.StringProperty(default="*.json", options={"HIDDEN"})

    def execute(self, context: Context) -> Result:
        head = head_there(context)
        self.filepath = system_path(self.filepath)
        try:
            places = finding.read_file(finding.read(context, head, ()), self.filepath)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        for name, where in places.items():
            points.place(context, head, name, where)
        self.report({"INFO"}, words.say("{count} landmarks", count=len(places)))
        return {"FINISHED"}


CLASSES = (
    RISORIUS_OT_find_landmarks,
    RISORIUS_OT_place_landmark,
    RISORIUS_OT_clear_landmarks,
    RISORIUS_OT_landmark_names,
    RISORIUS_OT_save_landmarks,
    RISORIUS_OT_load_landmarks,
)
