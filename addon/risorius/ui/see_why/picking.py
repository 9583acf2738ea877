# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The operator What Moves This Vertex.

The vertex is clicked in the view, selected, or given by its number.
"""

from typing import cast

import bpy
import numpy as np
from bpy_extras import view3d_utils

from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject, MeshObject
from ...scene.see_why import causes
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import say


class RISORIUS_OT_why_vertex(FaceOperator, Operator):
    """List the controls and correctives that move a vertex: click on the face"""

    bl_idname = "risorius.why_vertex"
    bl_label = "What Moves This Vertex"
    bl_options = {"REGISTER"}

    mesh: bpy.props.IntProperty(
        name="Mesh",
        description="Number of the mesh in the DNA file, from 0; -1: the active mesh",
        default=-1,
        min=-1,
    )
    vertex: bpy.props.IntProperty(
        name="Vertex",
        description="Number of the vertex in the mesh, from 0; -1: the first selected vertex",
        default=-1,
        min=-1,
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        mesh, vertex = self.mesh, self.vertex
        if vertex < 0:
            mesh, vertex = _selected(context, rig)
        held = {int(m[parts.MESH]): m for m in parts.meshes_of(rig)}
        if mesh not in held or not 0 <= vertex < len(held[mesh].data.vertices):
            self.report({"ERROR"}, say("Select a vertex of the face, or click on one."))
            return {"CANCELLED"}
        return self._find(context, rig, mesh, vertex)

    def _find(self, context: Context, rig: ArmatureObject, mesh: int, vertex: int) -> Result:
        found = causes.of_vertex(rig, mesh, vertex)
        if found is None:
            self.report({"ERROR"}, say("This face shows no controls now."))
            return {"CANCELLED"}
        self.report(
            {"INFO"},
            say(
                "Vertex {vertex}: moved by {count} controls, now {moved:.2f} mm from neutral",
                vertex=vertex,
                count=len(found.causes),
                moved=found.moved,
            ),
        )
        _redraw(context)
        return {"FINISHED"}

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if self.vertex >= 0 or context.area is None or context.area.type != "VIEW_3D":
            return self.execute(context)
        context.window_manager.modal_handler_add(self)
        if context.window is not None:
            context.window.cursor_modal_set("EYEDROPPER")
        _say_in_status(context, say("Click on the face; Esc or right click: cancel"))
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self.cancel(context)
            return {"CANCELLED"}
        if event.type != "LEFTMOUSE" or event.value != "PRESS":
            return {"PASS_THROUGH"} if event.type in _LOOKING else {"RUNNING_MODAL"}
        self.cancel(context)
        hit = under(context, event)
        if hit is None:
            self.report({"WARNING"}, say("There is no face under the pointer."))
            return {"CANCELLED"}
        return self._find(context, *hit)

    def cancel(self, context: Context) -> None:
        if context.window is not None:
            context.window.cursor_modal_restore()
        _say_in_status(context, None)


_LOOKING = {
    "MIDDLEMOUSE",
    "WHEELUPMOUSE",
    "WHEELDOWNMOUSE",
    "MOUSEMOVE",
    "TRACKPADPAN",
    "TRACKPADZOOM",
}


def _say_in_status(context: Context, text: str | None) -> None:
    context.workspace.status_text_set(text)


def _redraw(context: Context) -> None:
    for area in context.screen.areas if context.screen else ():
        if area.type == "VIEW_3D":
            area.tag_redraw()


def _selected(context: Context, rig: ArmatureObject) -> tuple[int, int]:
    """Index of the active mesh in the DNA file, and of the first selected vertex of this mesh.

    Both are -1 if the active object is no mesh of the face; the second is -1 if no vertex is
    selected.
    """
    item = context.object
    if item is None or item.type != "MESH" or parts.rig_of(item) != rig:
        return -1, -1
    item = cast("MeshObject", item)
    if item.mode == "EDIT":
        item.update_from_editmode()
    chosen = np.empty(len(item.data.vertices), bool)
    item.data.vertices.foreach_get("select", chosen)
    first = np.flatnonzero(chosen)
    return causes.mesh_of(item), int(first[0]) if len(first) else -1


def under(context: Context, event: bpy.types.Event) -> tuple[ArmatureObject, int, int] | None:
    """The face under the cursor, and the vertex nearest to the cursor.

    Args:
        context: context of Blender.
        event: event with the place of the cursor in the window.

    Returns:
        Deforming armature of the face, index of the mesh in the DNA file, and index of the vertex
        in the mesh; None if there is no face under the cursor.
    """
    area = context.area
    if area is None:
        return None
    region = next((r for r in area.regions if r.type == "WINDOW"), None)
    space = area.spaces.active
    if region is None or not isinstance(space, bpy.types.SpaceView3D) or space.region_3d is None:
        return None
    place = (event.mouse_x - region.x, event.mouse_y - region.y)
    origin = view3d_utils.region_2d_to_origin_3d(region, space.region_3d, place)
    ahead = view3d_utils.region_2d_to_vector_3d(region, space.region_3d, place)
    graph = context.evaluated_depsgraph_get()
    is_hit, where, _normal, polygon, item, _matrix = context.scene.ray_cast(graph, origin, ahead)
    item = item.original if is_hit and item is not None else None
    rig = parts.rig_of(item)
    if rig is None or item is None or causes.mesh_of(item) < 0:
        return None
    seen = item.evaluated_get(graph)
    data = cast("bpy.types.Mesh", seen.data)
    mesh = causes.mesh_of(item)
    if len(data.vertices) != len(cast("MeshObject", item).data.vertices):
        local = np.array(rig.matrix_world.inverted() @ where)  # subdivided mesh: nearest vertex
        return rig, mesh, causes.nearest(rig, mesh, local)
    local = seen.matrix_world.inverted() @ where
    corners = data.polygons[polygon].vertices
    return rig, mesh, min(corners, key=lambda v: (data.vertices[v].co - local).length)


CLASSES = (RISORIUS_OT_why_vertex,)
