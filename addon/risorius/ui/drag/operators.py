# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The operator that drags a point of the skin, from the press to the release."""

import bpy
import numpy as np
from numpy.typing import NDArray

from ...logic.base.errors import FaceError
from ...logic.character import slider_words
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from ...scene.drag import handles, stroke
from ..blender_types import Context, Operator, Result
from ..common import as_seen, face_rig, usable
from ..words import of_error, say
from . import drawing, pointing, properties, view

_ENDS = {"ESC", "RIGHTMOUSE"}
_ONE = {"LEFT_CTRL", "RIGHT_CTRL"}


class RISORIUS_OT_drag(Operator):
    """Drag a point of the skin: the sliders follow, within their limits"""

    bl_idname = "risorius.drag"
    bl_label = "Drag the Face"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    _others: tuple[stroke.Point, ...] = ()
    _is_handle = False

    mesh: bpy.props.IntProperty(
        name="Mesh",
        description="Number of the mesh in the DNA file, from 0",
        min=0,
        options={"SKIP_SAVE"},
    )
    vertex: bpy.props.IntProperty(
        name="Vertex",
        description="Number of the vertex in the mesh, from 0",
        min=0,
        options={"SKIP_SAVE"},
    )
    offset: bpy.props.FloatVectorProperty(
        name="Offset",
        description="Displacement of the point in axes and units of the scene",
        size=3,
        subtype="TRANSLATION",
        options={"SKIP_SAVE"},
    )
    view: bpy.props.FloatVectorProperty(
        name="View",
        description="Direction along which the point may move freely; 0, 0, 0: no direction",
        size=3,
        options={"SKIP_SAVE", "HIDDEN"},
    )
    symmetric: properties.symmetric_property()
    method: properties.method_property()
    region: properties.region_property()
    single: bpy.props.BoolProperty(
        name="One Slider",
        description="Move only the best slider",
        options={"SKIP_SAVE"},
    )
    choice: bpy.props.IntProperty(
        name="Which",
        description="Rank of the slider that is moved: 0 is the best slider, 1 the next",
        min=0,
        options={"SKIP_SAVE"},
    )
    with_selected: bpy.props.BoolProperty(
        name="Selected Handles",
        description="Move all selected handles in the same way",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        return can_drag(cls)

    def execute(self, context: Context) -> Result:
        try:
            rig = face_rig(context)
            self._others = _selected(context, rig) if self.with_selected else ()
            held = stroke.begin(context, rig, (self.mesh, self.vertex), self._how())
            along = np.array(self.view, np.float64) if any(self.view) else None
            target = held.start + np.array(self.offset, np.float64)
            moved = held.finish(context, target, along)
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        if not moved:
            self.report({"INFO"}, say("No slider moves this point nearer to the target."))
        return {"FINISHED"}

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        where = view.under(context, event)
        try:
            hit = pointing.pick(context, where, event) if where else None
            if where is None or hit is None:
                if event.type == "LEFTMOUSE":
                    return {"PASS_THROUGH"}  # a click beside the face keeps its usual meaning
                self.report({"WARNING"}, say("Point at the skin of a face."))
                return {"CANCELLED"}
            choices = properties.choices_of(context)
            self.symmetric, self.region = choices.symmetric, choices.region
            self.method, self.single, self.choice = choices.method, event.ctrl, 0
            self.mesh, self.vertex = hit.point
            chosen = _selected(context, hit.rig) if hit.is_handle else ()
            self.with_selected = hit.point in chosen
            self._others, self._is_handle = chosen if self.with_selected else (), hit.is_handle
            self._held = stroke.begin(context, hit.rig, hit.point, self._how())
        except FaceError as error:
            self.report({"WARNING"}, of_error(error))
            return {"CANCELLED"}
        pixel = where.pixel(hit.place)
        if pixel is None:
            return {"CANCELLED"}
        pointing.activate(context, hit.rig)
        self._where, self._mouse = where, where.mouse(event)
        self._grip = pixel - self._mouse  # the vertex may be some pixels from the cursor
        self._target, self._triangles = hit.place, _triangles(hit.rig, hit.point[0])
        drawing.start(self.bl_idname)
        context.window_manager.modal_handler_add(self)
        if context.window is not None:
            context.window.cursor_modal_set("SCROLL_XY")
        self._show(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        try:
            return self._react(context, event)
        except FaceError as error:  # the pose before the drag is already restored
            self.report({"WARNING"}, of_error(error))
            self._end(context)
            return {"CANCELLED"}

    def cancel(self, context: Context) -> None:
        self._end(context)

    def _react(self, context: Context, event: bpy.types.Event) -> Result:
        if event.type in _ENDS and event.value == "PRESS":
            self._held.restore(context)
            self._end(context)
            return {"CANCELLED"}
        if event.type == "LEFTMOUSE" and event.value == "RELEASE":
            return self._finish(context)
        if event.type == "MOUSEMOVE":  # skipped moves are of type INBETWEEN_MOUSEMOVE
            self._mouse = self._where.mouse(event)
        elif event.value == "PRESS" and event.type == "X":
            self.symmetric = not self.symmetric
        elif event.value == "PRESS" and event.type == "R":
            self.region = not self.region
        elif event.value == "PRESS" and event.type == "TAB":
            self.single, self.choice = True, self.choice + 1 if self.single else 0
        elif event.type in _ONE:
            self.single, self.choice = event.value == "PRESS", 0
        else:
            return {"RUNNING_MODAL"}
        self._held.options = self._how()
        self._target = self._where.target(self._mouse + self._grip, self._held.start)
        self._held.to(context, self._target, self._along())
        self._show(context)
        return {"RUNNING_MODAL"}

    def _finish(self, context: Context) -> Result:
        start = self._held.start
        if np.allclose(self._target, start, rtol=0, atol=1e-9):
            self._held.restore(context)
            self._end(context)
            self._click(context)
            return {"CANCELLED"}  # a click does not change the pose
        along = self._along()
        self._held.finish(context, self._target, along)
        self.offset, self.view = (self._target - start).tolist(), along.tolist()
        self._end(context)
        return {"FINISHED"}

    def _click(self, context: Context) -> None:
        """Select a handle or a bone after a press without motion of the mouse.

        A press on a handle selects it. A press on any other point of the skin deselects all
        handles, and in pose mode selects the bone under the cursor.
        """
        point = {"mesh": self.mesh, "vertex": self.vertex if self._is_handle else -1}
        if self._is_handle or _selected(context, self._held.rig):
            bpy.ops.risorius.select_handle("EXEC_DEFAULT", True, **point)  # pyright: ignore  ours
        if not self._is_handle and context.mode == "POSE":  # bones may be in front of the skin
            bpy.ops.view3d.select("INVOKE_DEFAULT", True, deselect_all=True)

    def _end(self, context: Context) -> None:
        drawing.end(context, self.bl_idname)
        if context.window is not None:
            context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)

    def _how(self) -> stroke.Options:
        method = self.method.lower()
        return stroke.Options(
            self.symmetric, method, self.single, self.choice, self.region, self._others
        )

    def _along(self) -> stroke.Float:
        return np.array(self._where.ray(self._mouse + self._grip)[1], np.float64)

    def _show(self, context: Context) -> None:
        held, shown = self._held, drawing.Shown()
        at = held.skin.seen_at(held.point)
        shown.points = [(self._target if at is None else at, drawing.HELD, 5.0)]
        shown.points += pointing.pins_of(context, held.rig, held.live)
        shown.lines = self._lines(context)
        if properties.choices_of(context).heat and self._triangles is not None:
            shown.places, shown.far = held.heat()
            shown.triangles = self._triangles
        drawing.show(context, shown)
        context.workspace.status_text_set(
            say("Drag  |  Ctrl: one slider, Tab: next slider  |  X: symmetric  |  R: region"
                " only  |  Esc, right click: cancel")
        )  # fmt: skip

    def _lines(self, context: Context) -> list[str]:
        swapped = as_seen(context)
        lines = [
            f"{slider_words.title_in_region(name, '', swapped=swapped)} {change:+.2f}"
            for name, change in self._held.moved(1 if self.single else 3)
        ]
        if self.single and not lines:
            lines.append(say("No single slider moves this point nearer to the target."))
        return lines


def can_drag(cls: type[Operator]) -> bool:
    """Poll: whether the .blend file has a face; if not, set the poll message of `cls`."""
    if not usable(cls):
        return False
    if not parts.rigs():
        cls.poll_message_set(say("There is no face in this file."))
        return False
    return True


def _selected(context: Context, rig: ArmatureObject) -> tuple[stroke.Point, ...]:
    """The selected handles of a face at the level of detail that is visible."""
    live = runtime.of(rig)
    if live is None or parts.controls_of(rig) is None:
        return ()
    return tuple(handles.selected(rig, pointing.skin_of(context, rig).surface))


def _triangles(rig: ArmatureObject, mesh: int) -> NDArray[np.int32] | None:
    """The triangles of a mesh, int32[T, 3].

    Args:
        rig: deforming armature of the face.
        mesh: index of the mesh in the DNA file.

    Returns:
        None if Blender has no object for this mesh, or if the object's number of vertices differs
        from the number in the DNA file.
    """
    item = next((i for i in parts.meshes_of(rig) if i[parts.MESH] == mesh), None)
    live = runtime.of(rig)
    if item is None or live is None or len(item.data.vertices) != pointing.counts_of(live)[mesh]:
        return None
    item.data.calc_loop_triangles()
    flat = np.empty(3 * len(item.data.loop_triangles), np.int32)
    item.data.loop_triangles.foreach_get("vertices", flat)
    return flat.reshape(-1, 3)


CLASSES = (RISORIUS_OT_drag,)
