# SPDX-License-Identifier: GPL-3.0-or-later
# Blender takes properties where Python has annotations:
# pyright: reportInvalidTypeForm=false
"""Drag the face itself: one drag, the mode in which each press is one, and pins."""

from itertools import count

import bpy
import numpy as np
from numpy.typing import NDArray

from ...logic.base.errors import FaceError
from ...logic.character import slider_words
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from ...scene.drag import picking, pins, stroke
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, as_seen, face_rig, usable
from ..words import of_error, say
from . import drawing, properties, view

_numbers = count()
_ENDS = {"ESC", "RIGHTMOUSE"}
_NEAR = 9  # pixels, at an interface of 1, within which a press takes a handle
_ONE = {"LEFT_CTRL", "RIGHT_CTRL"}


class RISORIUS_OT_drag(Operator):
    """Drag a point of the skin: the sliders follow, within their limits"""

    bl_idname = "risorius.drag"
    bl_label = "Drag the Face"
    bl_options = {"REGISTER", "UNDO", "BLOCKING"}

    mesh: bpy.props.IntProperty(
        name="Mesh", description="Number of the mesh in the DNA", min=0, options={"SKIP_SAVE"}
    )
    vertex: bpy.props.IntProperty(
        name="Vertex", description="Number of the vertex", min=0, options={"SKIP_SAVE"}
    )
    offset: bpy.props.FloatVectorProperty(
        name="Offset",
        description="How far the point is dragged, in the scene's axes and units",
        size=3,
        subtype="TRANSLATION",
        options={"SKIP_SAVE"},
    )
    view: bpy.props.FloatVectorProperty(
        name="View",
        description="Along this direction the point may lie anywhere; 0, 0, 0 for none",
        size=3,
        options={"SKIP_SAVE", "HIDDEN"},
    )
    symmetric: properties.symmetric_property()
    method: properties.method_property()
    region: properties.region_property()
    single: bpy.props.BoolProperty(
        name="One Slider",
        description="Only the slider that does it best moves",
        options={"SKIP_SAVE"},
    )
    choice: bpy.props.IntProperty(
        name="Which", description="0 is the best, 1 the next", min=0, options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        return _can_drag(cls)

    def execute(self, context: Context) -> Result:
        try:
            held = stroke.begin(context, face_rig(context), (self.mesh, self.vertex), self._how())
            along = np.array(self.view, np.float64) if any(self.view) else None
            target = held.start + np.array(self.offset, np.float64)
            moved = held.finish(context, target, along)
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        if not moved:
            self.report({"INFO"}, say("No slider brings this point nearer to there."))
        return {"FINISHED"}

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        where = view.under(context, event)
        try:
            hit = _pick(context, where, event) if where else None
            if where is None or hit is None:
                self.report({"WARNING"}, say("Point at the skin of a face."))
                return {"CANCELLED"}
            choices = properties.choices_of(context)
            self.symmetric, self.region = choices.symmetric, choices.region
            self.method, self.single, self.choice = choices.method, event.ctrl, 0
            self.mesh, self.vertex = hit.point
            self._held = stroke.begin(context, hit.rig, hit.point, self._how())
        except FaceError as error:
            self.report({"WARNING"}, of_error(error))
            return {"CANCELLED"}
        pixel = where.pixel(hit.place)
        if pixel is None:
            return {"CANCELLED"}
        _activate(context, hit.rig)
        self._where, self._mouse = where, where.mouse(event)
        self._grip = pixel - self._mouse  # the vertex lies a little beside the cursor
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
        except FaceError as error:  # the face was given back what it was
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
        if event.type == "MOUSEMOVE":  # what Blender skipped comes as INBETWEEN_MOUSEMOVE
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
            return {"CANCELLED"}  # a click is no edit
        along = self._along()
        self._held.finish(context, self._target, along)
        self.offset, self.view = (self._target - start).tolist(), along.tolist()
        self._end(context)
        return {"FINISHED"}

    def _end(self, context: Context) -> None:
        drawing.end(context, self.bl_idname)
        if context.window is not None:
            context.window.cursor_modal_restore()
        context.workspace.status_text_set(None)

    def _how(self) -> stroke.Options:
        method = self.method.lower()
        return stroke.Options(self.symmetric, method, self.single, self.choice, self.region)

    def _along(self) -> stroke.Float:
        return np.array(self._where.ray(self._mouse + self._grip)[1], np.float64)

    def _show(self, context: Context) -> None:
        held, shown = self._held, drawing.Shown()
        at = held.skin.seen_at(held.point)
        shown.points = [(self._target if at is None else at, drawing.HELD, 5.0)]
        shown.points += _pins_of(context, held.rig, held.live)
        shown.lines = self._lines(context)
        if properties.choices_of(context).heat and self._triangles is not None:
            shown.places, shown.far = held.heat()
            shown.triangles = self._triangles
        drawing.show(context, shown)
        context.workspace.status_text_set(
            say("Drag  |  Ctrl: one slider, Tab: the next  |  X: symmetric  |  R: region only  |  "
                "Esc, right click: as before")
        )  # fmt: skip

    def _lines(self, context: Context) -> list[str]:
        swapped = as_seen(context)
        lines = [
            f"{slider_words.title_in_region(name, '', swapped=swapped)} {change:+.2f}"
            for name, change in self._held.moved(1 if self.single else 3)
        ]
        if self.single and not lines:
            lines.append(say("No slider alone does it better."))
        return lines


class RISORIUS_OT_drag_mode(Operator):
    """Point at the skin and drag it; Shift and click pins a point. Esc ends it"""

    bl_idname = "risorius.drag_mode"
    bl_label = "Drag the Face"
    bl_options = {"REGISTER"}

    _running: list[int] = []  # the number of the one that runs; the class has them, not operators

    @classmethod
    def poll(cls, context: Context) -> bool:
        return _can_drag(cls)

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if self._running:
            self._running.clear()  # the same button ends it: the other sees that it is not there
            return {"FINISHED"}
        self._number = next(_numbers)
        self._running.append(self._number)
        drawing.start(self.bl_idname)
        context.window_manager.modal_handler_add(self)
        _say_keys(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        if self._number not in self._running:
            return self._stop(context, {"CANCELLED"})
        if event.type == "ESC" and event.value == "PRESS":
            return self._stop(context, {"FINISHED"})
        where = view.under(context, event)
        if event.type not in ("MOUSEMOVE", "LEFTMOUSE") or where is None:
            return {"PASS_THROUGH"}
        try:
            hit = _pick(context, where, event)
        except FaceError as error:
            self.report({"WARNING"}, of_error(error))
            return {"PASS_THROUGH"}
        if event.type == "MOUSEMOVE":
            _offer(context, hit)
        elif event.value == "PRESS" and hit is not None and not event.alt:
            with context.temp_override(area=where.area, region=where.region):
                self._press(context, event, hit)
            return {"RUNNING_MODAL"}
        return {"PASS_THROUGH"}

    def _press(self, context: Context, event: bpy.types.Event, hit: picking.Hit) -> None:
        if event.shift:
            _activate(context, hit.rig)
            mesh, vertex = hit.point
            pin = bpy.ops.risorius.pin  # pyright: ignore  made by registration
            pin("EXEC_DEFAULT", True, mesh=mesh, vertex=vertex)
            _offer(context, hit)
        else:
            bpy.ops.risorius.drag("INVOKE_DEFAULT", True)  # pyright: ignore  as above
        _say_keys(context)

    def cancel(self, context: Context) -> None:
        self._stop(context, {"CANCELLED"})

    def _stop(self, context: Context, result: Result) -> Result:
        self._running[:] = [n for n in self._running if n != self._number]
        drawing.end(context, self.bl_idname)
        context.workspace.status_text_set(None)
        return result


class RISORIUS_OT_pin(FaceOperator, Operator):
    """Hold a point of the skin while others are dragged, or let it go"""

    bl_idname = "risorius.pin"
    bl_label = "Pin"

    mesh: bpy.props.IntProperty(
        name="Mesh", description="Number of the mesh in the DNA", min=0, options={"SKIP_SAVE"}
    )
    vertex: bpy.props.IntProperty(
        name="Vertex", description="Number of the vertex", min=0, options={"SKIP_SAVE"}
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        counts = _counts(runtime.there(rig))
        if self.mesh >= len(counts) or self.vertex >= counts[self.mesh]:
            self.report({"ERROR"}, say("This face has no such vertex."))
            return {"CANCELLED"}
        pins.toggle(rig, (self.mesh, self.vertex), counts)
        return {"FINISHED"}


class RISORIUS_OT_clear_pins(FaceOperator, Operator):
    """Remove all pins of this face"""

    bl_idname = "risorius.clear_pins"
    bl_label = "Remove All Pins"

    def execute(self, context: Context) -> Result:
        pins.put(face_rig(context), [])
        return {"FINISHED"}


def _can_drag(cls: type[Operator]) -> bool:
    if not usable(cls):
        return False
    if not parts.rigs():
        cls.poll_message_set(say("There is no face in this file."))
        return False
    return True


def _say_keys(context: Context) -> None:
    context.workspace.status_text_set(
        say("Drag the skin  |  Shift click: pin  |  Ctrl drag: one slider  |  Esc: end")
    )


def _activate(context: Context, rig: ArmatureObject) -> None:
    """Make a face the active one, so that panels, pins and repeats mean it."""
    if parts.active_rig(context) != rig:
        context.view_layer.objects.active = parts.controls_there(rig)


def _counts(live: runtime.Runtime) -> list[int]:
    return [len(mesh.positions) for mesh in live.dna.meshes]


def _pick(context: Context, where: view.View, event: bpy.types.Event) -> picking.Hit | None:
    """The point that a press would take: a handle that is near, else what lies under the cursor."""
    mouse = where.mouse(event)
    hit = picking.under(context, *where.ray(mouse))
    live = runtime.of(hit.rig) if hit is not None else None
    if hit is None or live is None or not properties.choices_of(context).handles:
        return hit
    near = _NEAR * context.preferences.system.ui_scale
    for point, place in picking.handles_of(context, hit.rig, live):
        pixel = where.pixel(place)
        if pixel is None or (pixel - mouse).length > near:
            continue
        if np.linalg.norm(place - hit.place) < picking.NEAR * picking.size_of(hit.rig, live):
            return picking.Hit(hit.rig, point, place)
    return hit


def _offer(context: Context, hit: picking.Hit | None) -> None:
    """Show the point that a press would take, and the pins of its face."""
    shown = drawing.Shown()
    if hit is not None:
        shown.points.append((hit.place, drawing.OFFERED, 4.0))
    rig = hit.rig if hit is not None else parts.active_rig(context)
    live = runtime.of(rig) if rig is not None else None
    if rig is not None and live is not None and parts.controls_of(rig) is not None:
        shown.points += _pins_of(context, rig, live)
        if properties.choices_of(context).handles:
            places = picking.handles_of(context, rig, live)
            shown.points += [(place, drawing.HANDLE, 3.0) for _, place in places]
    drawing.show(context, shown)


def _pins_of(
    context: Context, rig: ArmatureObject, live: runtime.Runtime
) -> list[tuple[stroke.Float, drawing.Colour, float]]:
    if parts.controls_of(rig) is None:
        return []
    places = picking.places(context, rig, live, pins.of(rig, _counts(live)))
    return [(place, drawing.PIN, 4.0) for place in places]


def _triangles(rig: ArmatureObject, mesh: int) -> NDArray[np.int32] | None:
    """int32[T, 3] of a mesh, where it is as the DNA has it."""
    item = next((i for i in parts.meshes_of(rig) if i[parts.MESH] == mesh), None)
    live = runtime.of(rig)
    if item is None or live is None or len(item.data.vertices) != _counts(live)[mesh]:
        return None
    item.data.calc_loop_triangles()
    flat = np.empty(3 * len(item.data.loop_triangles), np.int32)
    item.data.loop_triangles.foreach_get("vertices", flat)
    return flat.reshape(-1, 3)


CLASSES = (RISORIUS_OT_drag, RISORIUS_OT_drag_mode, RISORIUS_OT_pin, RISORIUS_OT_clear_pins)
