# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads the properties of a class from annotations, which a type checker takes for types:
# pyright: reportInvalidTypeForm=false
"""Solves control curves from a moving mesh: shape keys, an Alembic cache or another rig."""

import bpy
import numpy as np

from ... import native
from ...logic.base.errors import FaceError
from ...scene.animation import mesh_curves
from ...scene.base import parts
from ...scene.base.blender_types import MeshObject
from .. import words
from ..background_work import RunsBeside
from ..blender_types import Context, Operator, Result
from ..common import explain, face_rig, shown_progress
from .place_clip import PlacesClip


class RISORIUS_OT_curves_from_mesh(RunsBeside, PlacesClip, Operator):
    """Find curves of the controls that repeat the motion of a mesh with the topology of the face"""

    bl_idname = "risorius.curves_from_mesh"
    bl_label = "Control Curves from Mesh"
    bl_options = {"REGISTER", "UNDO"}

    source: bpy.props.StringProperty(
        name="Object",
        description=(
            "Mesh with the same number of vertices as the face; empty: the selected "
            "mesh, or the only such mesh"
        ),
        options={"SKIP_SAVE"},
    )
    first: bpy.props.IntProperty(name="First Frame", description="Frame range to solve", default=1)
    last: bpy.props.IntProperty(name="Last Frame", description="Frame range to solve", default=250)
    use_relative: bpy.props.BoolProperty(
        name="Movement Only",
        description=(
            "Use the motion of the mesh and ignore its form: for another face of the same topology"
        ),
    )
    sparse: bpy.props.FloatProperty(
        name="Few Controls",
        description="Cost of using a control; higher values use fewer controls",
        default=1.0,
        min=0.0,
        soft_max=4.0,
    )
    smooth: bpy.props.FloatProperty(
        name="Quiet Curves",
        description="Cost of sudden changes; higher values smooth a noisy mesh",
        default=1.0,
        min=0.0,
        soft_max=4.0,
    )
    use_colour: bpy.props.BoolProperty(
        name="Show Remaining Distance",
        description="Colour the face by the remaining distance to the mesh; the color "
        "attribute risorius_residual contains the colours",
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not mesh_curves.sources(context, face_rig(context)):
            cls.poll_message_set(
                words.say(
                    "No other mesh of this scene has the same number of vertices as a mesh "
                    "of the face."
                )
            )
            return False
        return True

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.wait_beside()
        scene = context.scene
        if not self.properties.is_property_set("first"):
            self.first, self.last = scene.frame_start, scene.frame_end
        found = mesh_curves.source_of(context, face_rig(context))
        self.source = found.name if found is not None else ""
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        item = self._item(context)
        if item is None:
            self.report(
                {"ERROR"}, words.say("Select the moving mesh from which to take the animation.")
            )
            return {"CANCELLED"}
        self._name, self._face = item.name, rig.session_uid
        try:
            with shown_progress(context) as progress:
                frames = mesh_curves.recorded(context, item, self.first, self.last, progress)
            self._task = mesh_curves.MeshCurvesTask(
                rig,
                item,
                frames,
                mesh_curves.rate_of(context.scene),
                relative=self.use_relative,
                sparse=self.sparse,
                smooth=self.smooth,
            )
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(item.name, error))
            return {"CANCELLED"}
        return self.begin(context, self._task)

    def _item(self, context: Context) -> MeshObject | None:
        there = mesh_curves.sources(context, face_rig(context))
        if not self.source:
            return mesh_curves.source_of(context, face_rig(context))
        return next((item for item in there if item.name == self.source), None)

    def shown(self, share: int) -> str:
        return words.say("Solving {name}: {share} %, Esc cancels", name=self._name, share=share)

    def cancelled_text(self) -> str:
        return words.say("Solving was cancelled; nothing was changed.")

    def finish(self, context: Context) -> Result:
        """Place the solved curves on the face, unless the face was deleted or is not active."""
        task = self._task
        try:
            solved = task.result
            if solved is None:
                raise task.error or FaceError("nothing was solved")
            rig = parts.active_rig(context)
            if rig is None or rig.session_uid != self._face:
                text = "The solved face is no longer active: make this face active and solve again."
                self.report({"ERROR"}, words.say(text))
                return {"CANCELLED"}
            self.start = float(self.first)
            self.place(context, solved.clip, self._name, self._notes(solved), whole=True)
            if self.use_colour:
                self._paint(context, solved)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self._name, error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _notes(self, solved: "native.SolvedClip") -> list[str]:
        mm = self._task.mm
        frames = solved.frame_residual.astype(np.float64) * mm
        worst = int(np.argmax(frames))
        return [
            words.say(
                (
                    "Left over: {mean} mm of distance to the mesh (root mean square), at most "
                    "{most} mm; the worst frame is {frame}."
                ),
                mean=f"{np.sqrt((frames**2).mean()):.3f}",
                most=f"{solved.largest * mm:.3f}",
                frame=self.first + worst,
            )
        ]

    def _paint(self, context: Context, solved: "native.SolvedClip") -> None:
        residual = solved.vertex_residual[self._task.mesh] * self._task.mm
        hottest = mesh_curves.show_residual(face_rig(context), self._task.mesh, residual)
        if hottest:
            text = words.say(
                "The hottest colour marks a remaining distance of {mm} mm.", mm=f"{hottest:.2f}"
            )
            self.report({"INFO"}, text)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop_search(self, "source", context.scene, "objects")
        for name in ("first", "last", "target", "scene_range"):
            layout.prop(self, name)
        for name in ("use_relative", "sparse", "smooth", "use_colour"):
            layout.prop(self, name)


CLASSES = (RISORIUS_OT_curves_from_mesh,)
