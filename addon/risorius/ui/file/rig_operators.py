# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that make a face with joints from a head with shape keys."""

from collections.abc import Sequence
from typing import NamedTuple, cast

import bpy

from ... import native
from ...logic.base import names
from ...scene.base import parts
from ...scene.base.blender_types import MeshObject
from ...scene.character import build, rig_placement
from ...scene.file import shape_key_head
from ...scene.frame import evaluate
from ...scene.shape_keys import assigned
from .. import words
from ..background_work import RunsBeside
from ..blender_types import Context, ExportHelper, Menu, Operator, Result
from ..common import explain, proposed_file, system_path, usable
from . import framing
from .import_operators import import_character


class RISORIUS_OT_make_rig(RunsBeside, Operator, ExportHelper):
    """Make a face of joints from the selected meshes and their shape keys, as a DNA file"""

    bl_idname = "risorius.make_rig"
    bl_label = "Make Rig from Shape Keys"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".dna"
    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})
    joints: bpy.props.IntProperty(
        name="Joints", description="Number of joints", default=120, min=2, max=1000
    )
    levels: bpy.props.IntProperty(
        name="Levels of Detail",
        description=(
            "Largest number of levels of detail; each level has fewer joints and vertices than "
            "the one before"
        ),
        default=8,
        min=1,
        max=32,
    )
    use_shapes: bpy.props.BoolProperty(
        name="Keep Shapes",
        description="Add blend shapes that correct the errors of the joints",
        default=True,
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description=(
            "Errors of the joints up to this length, in millimetres, are not corrected by blend "
            "shapes; 0: a share of the head's height. The length is raised if the blend shapes "
            "would contain more displacements of vertices than the shape keys of the head"
        ),
        default=0.0,
        min=0.0,
        max=10.0,
    )

    use_family: bpy.props.BoolProperty(
        name="Take Others Along",
        description="Include other meshes of the same armature or parent object: eyes, teeth, hair",
        default=True,
    )
    height: bpy.props.FloatProperty(
        name="Height",
        description=(
            "Height of the face from the chin to the top of the head in "
            "millimetres. 0: keep the size"
        ),
        default=0.0,
        min=0.0,
        max=100_000.0,
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not usable(cls):
            return False
        if shape_key_head.head_of(context) is None:
            cls.poll_message_set(words.say("Select a mesh with shape keys that is no face yet."))
            return False
        return True

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.wait_beside()
        head = shape_key_head.head_of(context)
        if not self.filepath and head is not None:
            self.filepath = proposed_file(head.name, ".dna")
        return ExportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        item = cast(MeshObject, shape_key_head.head_of(context))
        self.filepath = system_path(self.filepath)
        taken = shape_key_head.taken_with(context, item)
        family = shape_key_head.relatives_of(context, taken) if self.use_family else []
        others = [*taken[1:], *family]
        said = {k: v for one in (*others, item) for k, v in assigned.said_of(one).items()}
        try:
            shapes = shape_key_head.shapes_of(context, item, others, self.height, said)
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        self._head, self._shapes = item.name, shapes
        wishes = shape_key_head.RigWishes(
            self.filepath, self.joints, self.levels, self.tolerance or None, self.use_shapes
        )
        task = shape_key_head.rig_task(shapes, wishes, said)
        self._task = task
        return self.begin(context, task)

    def shown(self, share: int) -> str:
        return words.say("Finding joints: {share} %, Esc cancels", share=share)

    def cancelled_text(self) -> str:
        return words.say("No rig was made.")

    def finish(self, context: Context) -> Result:
        """Import the written face beside the head and give it the head's materials."""
        task = self._task
        try:
            if task.result is None:
                raise task.error or RuntimeError("nothing was made")
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        made = MadeFace(self._head, self._shapes, *task.result)
        return show_made(self, context, self.filepath, made)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "joints")
        layout.prop(self, "levels")
        layout.prop(self, "use_shapes")
        row = layout.row()
        row.active = self.use_shapes
        row.prop(self, "tolerance")
        layout.prop(self, "height")
        self._draw_meshes(context)

    def _draw_meshes(self, context: Context) -> None:
        """Draw the names of the meshes that become the face."""
        head = shape_key_head.head_of(context)
        if head is None:
            return
        taken = shape_key_head.taken_with(context, head)
        column = self.layout.column()
        words.write(
            column, words.say("Meshes of the new face: {names}", names=names.listed(_named(taken)))
        )
        family = shape_key_head.relatives_of(context, taken)
        if family:
            column.prop(self, "use_family")
            also = column.column()
            also.active = self.use_family
            words.write(
                also, words.say("Also included: {names}", names=names.listed(_named(family)))
            )


def _named(items: Sequence[MeshObject]) -> list[str]:
    return [item.name for item in items]


class MadeFace(NamedTuple):
    """A face that was made from a head and written to a file.

    Attributes:
        head: name of the head's mesh object.
        shapes: meshes of the head and their shapes, from which the face was made.
        rig: the joint rig, with the distances between its vertices and the shapes.
        odd: warnings, one sentence each.
    """

    head: str
    shapes: "native.ShapeSet"
    rig: "native.JointRig"
    odd: Sequence[str]


def show_made(
    operator: Operator,
    context: Context,
    path: str,
    made: MadeFace,
    *,
    with_materials: bool = False,
) -> Result:
    """Import the face beside its head, give it the head's materials, and report.

    Args:
        operator: operator that reports.
        context: context of Blender.
        path: path of the DNA file.
        made: the face that was made.
        with_materials: True: build new materials for meshes that have no material on the head.

    Returns:
        {"FINISHED"}, or {"CANCELLED"} after an error: the result of the operator.
    """
    before, materials = set(bpy.data.objects), set(bpy.data.materials)
    options = build.BuildOptions(materials=with_materials)
    if import_character(operator, context, path, options) != {"FINISHED"}:
        return {"CANCELLED"}
    _take_place(context, made, before)
    for material in set(bpy.data.materials) - materials:
        if not material.users:  # replaced by a material of the head
            bpy.data.materials.remove(material)
    for sentence in made.shapes.notes:
        operator.report({"INFO"}, words.local(sentence))
    for sentence in made.odd[:5]:
        operator.report({"WARNING"}, words.local(sentence))
    rig = made.rig
    operator.report(
        {"INFO"},
        words.say(
            "{count} joints; vertices moved by shape keys: {before} before, {after} after; "
            "largest error of a vertex: {mm} mm",
            count=len(rig.new_joints),
            before=rig.deltas_before,
            after=rig.deltas_after,
            mm=f"{rig.levels[0].largest_with_shapes:.2f}",
        ),
    )
    return {"FINISHED"}


def _take_place(context: Context, face: MadeFace, before: set[bpy.types.Object]) -> None:
    """Place the new face beside the head and assign the head's materials.

    Args:
        context: context of Blender.
        face: the face that was made.
        before: all objects before the import.
    """
    head = bpy.data.objects.get(face.head)
    made = next((o for o in set(bpy.data.objects) - before if parts.is_rig(o)), None)
    if head is None or made is None:
        return
    shape_key_head.take_materials(parts.meshes_of(made), face.shapes)
    rig_placement.put_beside_mesh(made, head)
    rig_placement.put_beside(context.scene, made)
    evaluate.bring_up(context, made)
    if not bpy.app.background:
        framing.frame(context, made)


def draw_make_rig(self: Menu, _context: Context) -> None:
    """Draw the entry Make Rig from Shape Keys in the menu Object or the menu of the key list."""
    self.layout.separator()
    self.layout.operator(RISORIUS_OT_make_rig.bl_idname, icon="ARMATURE_DATA")


CLASSES = (RISORIUS_OT_make_rig,)
