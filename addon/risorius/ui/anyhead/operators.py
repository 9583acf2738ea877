# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The operators Make Rig from Head and Conform Face to Head."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...scene.anyhead import finding, heads, making, points
from ...scene.base import parts, saved
from ...scene.base.blender_types import ArmatureObject, MeshObject
from ...scene.character import build, rig_placement, runtime
from ...scene.file import shape_key_head
from ...scene.frame import evaluate
from .. import words
from ..background_work import RunsBeside
from ..blender_types import Context, ExportHelper, Menu, Operator, Result
from ..common import explain, proposed_file, system_path
from ..file import framing
from ..file.import_operators import import_character
from ..file.rig_operators import MadeFace, show_made
from .landmark_operators import OfHead, head_there, hide_lines

TEMPLATES = [
    ("SAMPLE", "Sample Man", "The sample man that is included in Risorius"),
    (
        "FACE",
        "Face of the Scene",
        ("The face that is selected together with the head, or the only face of the scene"),
    ),
    ("FILE", "DNA File", "Any face with expressions"),
]
_STAGES = {
    making.FIT: words.mark("Fitting the face to the head: {share} %, Esc cancels"),
    making.JOINTS: words.mark("Finding joints: {share} %, Esc cancels"),
}


class _Makes(RunsBeside, OfHead, ExportHelper):
    """Base of the operators that make a face from a head."""

    filename_ext = ".dna"

    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})
    use_family: bpy.props.BoolProperty(
        name="Take Others Along",
        description="Include other meshes of the same armature or parent object: eyes, teeth, hair",
        default=True,
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.wait_beside()
        if not self.filepath:
            self.filepath = proposed_file(head_there(context).name, ".dna")
        return ExportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        item = head_there(context)
        self.filepath = system_path(self.filepath)
        taken = shape_key_head.taken_with(context, item)
        family = shape_key_head.relatives_of(context, taken) if self.use_family else []
        try:
            native.part("files.fileio").check_writable(self.filepath)
            head = finding.read(context, item, [*taken[1:], *family])
            task = self._begin(context, head)
        except native.user_errors() as error:
            self.report({"ERROR"}, self._said(error))
            return {"CANCELLED"}
        self._head, self._task = item.name, task
        return self.begin(context, task)

    def _begin(self, context: Context, head: finding.Head) -> making.HeadTask:
        """Create the task that makes the face from `head`; the caller starts the task."""
        raise NotImplementedError

    def _show(self, context: Context) -> Result:
        """Import the face from the file that the task wrote."""
        raise NotImplementedError

    def finish(self, context: Context) -> Result:
        """Import the face, or report the error of the task."""
        task = self._task
        try:
            if task.result is None:
                raise task.error or RuntimeError("nothing was made")
        except native.user_errors() as error:
            self.report({"ERROR"}, self._said(error))
            return {"CANCELLED"}
        return self._show(context)

    def _said(self, error: Exception) -> str:
        """The sentence that reports an error. The name of the file is added to an OSError; the
        messages of other errors already name the head or the template."""
        if isinstance(error, OSError):
            return explain(error.filename or self.filepath, error)
        return words.of_error(error)

    def shown(self, share: int) -> str:
        return words.say(_STAGES[self._task.stage], share=share)

    def cancelled_text(self) -> str:
        return words.say("No face was made.")


class RISORIUS_OT_make_rig_from_head(_Makes, Operator):
    """Make a face from the selected head, which needs no expressions: another face lends them"""

    bl_idname = "risorius.make_rig_from_head"
    bl_label = "Make Rig from Head"

    template: bpy.props.EnumProperty(
        name="Expressions of",
        description="Face that lends its expressions to the head",
        items=TEMPLATES,
    )
    template_file: bpy.props.StringProperty(
        name="File", description="A DNA file with expressions", subtype="FILE_PATH"
    )
    strength: bpy.props.FloatProperty(
        name="Strength",
        description="Strength of the expressions; 1: as strong as on the face that lends them",
        default=1.0,
        min=0.0,
        max=1.5,
        subtype="FACTOR",
    )
    use_repair: bpy.props.BoolProperty(
        name="Repair Contacts",
        description=(
            "Correct the expressions so that lids close on these eyes, lips "
            "meet, and the skin stays out of eyes and teeth"
        ),
        default=True,
    )
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

    def _begin(self, context: Context, head: finding.Head) -> making.HeadTask:
        wishes = shape_key_head.RigWishes(self.filepath, self.joints, self.levels)
        transfer = making.Transfer(self.strength, self.use_repair)
        return making.rig_task(head, self._template(context), transfer, wishes)

    def _template(self, context: Context) -> making.Template:
        """The face whose expressions the new rig gets.

        Raises:
            FaceError: no DNA file was chosen, the scene has no face to choose, or the package has
                no sample face.
        """
        if self.template == "FACE":
            rig = heads.face_there(context)
            return making.Template(runtime.there(rig).dna, _source(rig))
        if self.template == "FILE":
            if not self.template_file:
                raise FaceError(
                    told("Choose the DNA file of the face that lends its expressions to the head.")
                )
            return making.Template(path=system_path(self.template_file))
        path = native.bundled_sample("man")
        if path is None:
            raise FaceError(told("This package has no sample face: choose a DNA file."))
        return making.Template(path=str(path))

    def _show(self, context: Context) -> Result:
        made = cast("making.Made", self._task.result)
        head = bpy.data.objects.get(self._head)
        if head is not None and head.type == "MESH":
            points.show(context, cast(MeshObject, head), made.finding.places)
            hide_lines(context)
        face = MadeFace(self._head, made.shapes, *made.rigged)
        return show_made(self, context, self.filepath, face, with_materials=True)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "template")
        if self.template == "FILE":
            layout.prop(self, "template_file")
        layout.prop(self, "strength")
        layout.prop(self, "use_repair")
        layout.prop(self, "joints")
        layout.prop(self, "levels")
        layout.prop(self, "use_family")


class RISORIUS_OT_conform_face(_Makes, Operator):
    """Copy a face; the copy gets the selected head's form and keeps topology, names and controls"""

    bl_idname = "risorius.conform_face"
    bl_label = "Conform Face to Head"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if heads.face_of(context) is None:
            cls.poll_message_set(words.say("Select the head and one face."))
            return False
        return True

    def _begin(self, context: Context, head: finding.Head) -> making.HeadTask:
        rig = heads.face_there(context)
        source = _source(rig)
        if source and Path(source).resolve() == Path(self.filepath).resolve():
            raise FaceError(told("This is the face's own file: choose another name."))
        template = making.Template(runtime.there(rig).dna, source)
        return making.conform_task(head, template, self.filepath)

    def _show(self, context: Context) -> Result:
        notes = cast("list[str]", self._task.result)
        done = import_character(self, context, self.filepath, build.BuildOptions())
        rig, head = parts.active_rig(context), bpy.data.objects.get(self._head)
        if done == {"FINISHED"} and rig is not None and head is not None:
            rig_placement.put_clear_of(rig, head)
            evaluate.bring_up(context, rig)
            if not bpy.app.background:
                framing.frame(context, rig)
        for sentence in notes[:5]:
            self.report({"INFO"}, words.local(sentence))
        return done

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        rig = heads.face_of(context)
        if rig is not None:
            words.write(
                layout,
                words.say(
                    "The face {name} takes the form of the selected head.", name=parts.title_of(rig)
                ),
            )
        layout.prop(self, "use_family")


def _source(rig: ArmatureObject) -> str:
    """The path of the DNA file from which a face was imported, or "" if the face has no path.

    The file may have been deleted or moved since.
    """
    return bpy.path.abspath(saved.text(rig, parts.SOURCE))


def draw_from_head(self: Menu, _context: Context) -> None:
    """Draw the entry Make Rig from Head in the Object menu."""
    self.layout.operator(RISORIUS_OT_make_rig_from_head.bl_idname)


CLASSES = (RISORIUS_OT_make_rig_from_head, RISORIUS_OT_conform_face)
