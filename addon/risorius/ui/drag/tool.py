# SPDX-License-Identifier: GPL-3.0-or-later
"""The drag tool of the 3D view's toolbar: while it is active, a press on the skin starts a drag.

The tool also has Shift-click (pins, and selection of handles), Alt-click (Blender's selection), and
I, H and Alt-H for handles. All other shortcuts of Blender stay the same. While the tool is active,
it draws the handles and pins of the active face, and the point under the cursor.
"""

from typing import cast

import bpy
from bpy.types import WorkSpaceTool

from ...logic.base.errors import FaceError
from ...scene.base import parts, session
from ...scene.character import runtime
from ...scene.drag import picking
from ..blender_types import Context, Operator, Result, UILayout
from ..words import say
from . import drawing, pointing, properties, view
from .operators import can_drag

IDNAME = "risorius.drag"
_MODES = ("OBJECT", "POSE")
_USUAL = "builtin.select_box"  # activated if the earlier tool is unknown
_KEYS = (
    ("risorius.drag", {"type": "LEFTMOUSE", "value": "PRESS"}, None),
    ("risorius.drag", {"type": "LEFTMOUSE", "value": "PRESS", "ctrl": True}, None),
    (
        "risorius.select_handle",
        {"type": "LEFTMOUSE", "value": "PRESS", "shift": True},
        {"properties": [("extend", True)]},
    ),
    ("risorius.pin", {"type": "LEFTMOUSE", "value": "PRESS", "shift": True}, None),
    (
        "view3d.select",
        {"type": "LEFTMOUSE", "value": "PRESS", "alt": True},
        {"properties": [("deselect_all", True)]},
    ),
    ("risorius.key_handles", {"type": "I", "value": "PRESS"}, None),
    ("risorius.hide_handles", {"type": "H", "value": "PRESS"}, None),
    ("risorius.show_handles", {"type": "H", "value": "PRESS", "alt": True}, None),
    ("risorius.drag_hover", {"type": "MOUSEMOVE", "value": "ANY"}, None),
)

# "<workspace> <mode>" -> idname of the tool that was active there before the drag tool.
_before: dict[str, str] = session.table("tool.before", ("unregister",))
# Session uid of the face's armature, and the (mesh, vertex) of the face under the cursor; at most
# one entry.
_pointed: list[tuple[int, tuple[int, int]]] = session.keep("tool.pointed", list, ("load",))
_handles: list[object] = session.keep("tool.handles", list, ("unregister",))


class _Tool(WorkSpaceTool):
    bl_space_type = "VIEW_3D"
    bl_idname = IDNAME
    bl_label = "Drag the Face"
    bl_description = (
        "Point at the skin and drag it. Ctrl: one slider, Tab: the next slider; "
        "Shift-click: pin a point, or select handles that move together; I: key "
        "handles, H: hide handles"
    )
    bl_icon = "ops.pose.push"
    bl_widget = None
    bl_keymap = _KEYS
    bl_options = {"KEYMAP_FALLBACK"}

    @staticmethod
    def draw_settings(context: Context, layout: UILayout, _tool: object) -> None:
        choices = properties.choices_of(context)
        for name in ("symmetric", "region", "handles", "heat"):
            layout.prop(choices, name)
        layout.prop(choices, "method", text="")


class DragInObjectMode(_Tool):
    bl_context_mode = "OBJECT"


class DragInPoseMode(_Tool):
    bl_context_mode = "POSE"


class RISORIUS_OT_drag_tool(Operator):
    """Activate the tool that drags the skin, or return to the earlier tool"""

    bl_idname = "risorius.drag_tool"
    bl_label = "Drag the Face"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not can_drag(cls):
            return False
        if context.mode not in _MODES:
            cls.poll_message_set(say("Go to object mode or pose mode first."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        place, now = f"{context.workspace.name} {context.mode}", _active(context)
        wanted = _before.pop(place, _USUAL) if now == IDNAME else IDNAME
        if now != IDNAME:
            _before[place] = now or _USUAL
        bpy.ops.wm.tool_set_by_id(name=wanted, space_type="VIEW_3D")
        drawing.tag(context)
        return {"FINISHED"}


class RISORIUS_OT_drag_hover(Operator):
    """Show the point of the skin that a click would drag"""

    bl_idname = "risorius.drag_hover"
    bl_label = "Drag the Face"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return is_active(context) and can_drag(cls)

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        where = view.under(context, event)
        try:
            hit = pointing.pick(context, where, event) if where else None
        except FaceError:
            hit = None  # the press reports the reason
        found = [(hit.rig.session_uid, hit.point)] if hit is not None else []
        if found or _pointed:
            _pointed[:] = found
            drawing.tag(context)
        return {"PASS_THROUGH"}


def is_active(context: Context) -> bool:
    """Whether the drag tool is active. Args: context  context with the workspace and the mode."""
    return context.mode in _MODES and _active(context) == IDNAME


def _active(context: Context) -> str:
    """The idname of the active tool of 3D views in the current mode; "" if no tool is active."""
    tools = context.workspace.tools
    tool = tools.from_space_view3d_mode(context.mode, create=False)  # pyright: ignore  the stub's
    return tool.idname if tool is not None else ""


def _draw() -> None:
    """Draw the handles and pins of the active face, and the point under the cursor.

    Blender calls this function for each 3D view. Nothing is drawn while the tool is inactive or
    a drag runs.
    """
    context = cast(Context, bpy.context)
    space = context.space_data
    if drawing.is_drawing() or not is_active(context):
        return
    if not isinstance(space, bpy.types.SpaceView3D) or not space.overlay.show_overlays:
        return
    marks: list[drawing.Mark] = []
    for uid, point in _pointed:
        rig = next((r for r in parts.rigs() if r.session_uid == uid), None)
        live = runtime.of(rig) if rig is not None else None
        if rig is not None and live is not None and parts.controls_of(rig) is not None:
            places = picking.places(context, rig, live, [point])
            marks += [(place, drawing.OFFERED, 5.0) for place in places]
    active = parts.active_rig(context)
    if active is not None and active.library is None:
        marks += pointing.marks_of(context, active)
    drawing.draw_points(context, marks)


def register() -> None:
    """Add the tool to the toolbars of object mode and pose mode."""
    for cls in (DragInObjectMode, DragInPoseMode):
        # The argument `after` would set the place in the toolbar, but fails in Blender 4.3 and 4.5.
        bpy.utils.register_tool(cls, separator=True)
    if not _handles:
        draw_over = bpy.types.SpaceView3D.draw_handler_add
        _handles.append(draw_over(_draw, (), "WINDOW", "POST_PIXEL"))


def unregister() -> None:
    """Remove the tool from the toolbars and stop drawing."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
    for cls in (DragInPoseMode, DragInObjectMode):
        bpy.utils.unregister_tool(cls)
    _before.clear()
    _pointed.clear()


CLASSES = (RISORIUS_OT_drag_tool, RISORIUS_OT_drag_hover)
