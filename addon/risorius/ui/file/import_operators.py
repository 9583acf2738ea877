# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that import faces from DNA files and add sample faces."""

from pathlib import Path

import bpy

from ... import native
from ...logic.base import names
from ...scene.base import parts, saved
from ...scene.character import build, rig_placement, runtime
from ...scene.file import sample_face
from ...scene.frame import evaluate
from ...scene.gaze import gaze_settings
from .. import words
from ..background_work import RunsBeside
from ..blender_types import Context, FileHandler, ImportHelper, Menu, Operator, Result
from ..common import MODES, explain, shown_progress, system_path, usable
from . import framing
from .studio_operators import SCENE_CAMERA, add_studio

FRAME_VIEW = bpy.props.BoolProperty(
    name="Frame the View",
    description=(
        "Turn the 3D views of this window to the face, and show its textures in "
        "Solid; not if several faces are imported, and not in a camera view"
    ),
    default=True,
)


def import_character(
    operator: Operator,
    context: Context,
    path: str | Path,
    options: build.BuildOptions,
    show: bool = False,
) -> Result:
    """Build a character from a DNA file and place it beside the other faces of the scene.

    The operator reports the result with at most five warnings, or the error.

    Args:
        operator: operator that reports.
        context: context of Blender.
        path: path of the DNA file.
        options: options of the build.
        show: True: frame the face in the 3D views of the user's window.

    Returns:
        {"FINISHED"}, or {"CANCELLED"} after an error: the result of the operator's `execute`.
    """
    try:
        with shown_progress(context) as progress:
            rig, warnings = build.import_file(context, path, options, progress)
    except native.user_errors() as error:
        operator.report({"ERROR"}, explain(path, error))
        return {"CANCELLED"}
    gaze_settings.begin(parts.controls_there(rig), runtime.there(rig))
    if rig_placement.put_beside(context.scene, rig):
        evaluate.bring_up(context, rig)
    if show and not bpy.app.background:
        framing.frame(context, rig)
    for warning in warnings[:5]:
        operator.report({"WARNING"}, names.printable(words.local(warning)))
    if len(warnings) > 5:
        operator.report(
            {"WARNING"}, words.say("and {count} more warnings", count=len(warnings) - 5)
        )
    count = len(parts.meshes_of(rig))
    found = saved.text(rig, parts.TEXTURES)
    if found:
        operator.report({"INFO"}, words.say("Textures of {found}", found=found))
    operator.report(
        {"INFO"},
        words.say("{name}: {count} meshes, ready to move", name=Path(path).name, count=count),
    )
    return {"FINISHED"}


class RISORIUS_OT_import_dna(Operator, ImportHelper):
    """Build a face from a MetaHuman DNA file"""

    bl_idname = "risorius.import_dna"
    bl_label = "Import DNA"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filename_ext = ".dna"
    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})
    # Folder and names of several files that were chosen in the file browser or dropped together.
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    lods: bpy.props.BoolVectorProperty(
        name="Levels of Detail",
        description="Levels whose meshes are built; 0 is the finest",
        size=8,
        default=(True, False, False, False, False, False, False, False),
    )
    shape_mode: bpy.props.EnumProperty(
        name="Shapes", description="Mode of the blend shapes", items=MODES, default="AUTO"
    )
    use_normals: bpy.props.BoolProperty(
        name="Custom Normals", description="Use the normals of the DNA file", default=True
    )
    use_materials: bpy.props.BoolProperty(
        name="Materials",
        description="Build materials for skin, eyes, teeth and lashes",
        default=True,
    )
    use_textures: bpy.props.BoolProperty(
        name="Textures",
        description=(
            "Load textures from Texture Folder, or from beside the DNA file, and pack them "
            "into the .blend file"
        ),
        default=True,
    )
    texture_folder: bpy.props.StringProperty(
        name="Texture Folder",
        description="Folder of textures with MetaHuman names; empty: search beside the DNA file",
        subtype="DIR_PATH",
    )
    use_simple_materials: bpy.props.BoolProperty(
        name="Simple Materials",
        description="Fast to draw: without subsurface scattering, pores, wrinkles and flush",
        default=False,
    )
    use_frame_view: FRAME_VIEW

    @classmethod
    def poll(cls, context: Context) -> bool:
        return usable(cls)

    def execute(self, context: Context) -> Result:
        options = build.BuildOptions(
            lods=tuple(i for i, chosen in enumerate(self.lods) if chosen) or (0,),
            mode=self.shape_mode,
            normals=self.use_normals,
            materials=self.use_materials,
            textures=self.use_materials and self.use_textures,
            texture_folder=self.texture_folder,
            simple_materials=self.use_simple_materials,
        )
        folder = system_path(self.directory)
        named = [str(Path(folder, item.name)) for item in self.files if item.name]
        paths = named or [system_path(self.filepath)]
        show = self.use_frame_view and len(paths) == 1
        results = [import_character(self, context, path, options, show) for path in paths]
        return {"FINISHED"} if {"FINISHED"} in results else {"CANCELLED"}

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        given = self.properties.is_property_set
        if given("filepath") or given("files"):  # dropped onto the window
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.label(text="Levels of Detail", text_ctxt=words.CONTEXT)
        row = layout.row(align=True)
        row.use_property_split = False
        for level in range(8):
            row.prop(self, "lods", index=level, text=str(level), toggle=True)
        layout.prop(self, "shape_mode")
        column = layout.column(heading="Keep")
        column.prop(self, "use_normals")
        column.prop(self, "use_materials")
        row = column.row()
        row.active = self.use_materials
        row.prop(self, "use_textures")
        row = column.row()
        row.active = self.use_materials
        row.prop(self, "use_simple_materials")
        row = layout.row()
        row.active = self.use_materials and self.use_textures
        words.prop_or(row.column(), self, "texture_folder", "", "Empty: search beside the DNA file")
        layout.prop(self, "use_frame_view")


class RISORIUS_FH_dna(FileHandler):
    """Drop a DNA file onto the 3D view"""

    bl_idname = "RISORIUS_FH_dna"
    bl_label = "MetaHuman DNA"
    bl_import_operator = "risorius.import_dna"
    bl_file_extensions = ".dna"

    @classmethod
    def poll_drop(cls, context: Context) -> bool:
        return context.area is not None and context.area.type in {"VIEW_3D", "OUTLINER"}


class RISORIUS_OT_add_character(RunsBeside, Operator):
    """Add a free sample face"""

    bl_idname = "risorius.add_character"
    bl_label = "Face"
    bl_options = {"REGISTER", "UNDO"}

    person: bpy.props.EnumProperty(
        name="Person",
        description="Who",
        items=[
            ("man", "Man", "A man, 28 years old; included in Risorius"),
            ("woman", "Woman", "A woman, 31 years old; data (48 MB) are downloaded once"),
            ("girl", "Girl", "A girl, 8 years old; data (48 MB) are downloaded once"),
            ("lady", "Lady", "A woman, 58 years old; data (48 MB) are downloaded once"),
            ("fighter", "Fighter", "A strong man, 42 years old; data (48 MB) are downloaded once"),
            ("elder", "Elder", "A man, 75 years old; data (48 MB) are downloaded once"),
        ],
        default="man",
    )
    shape_mode: bpy.props.EnumProperty(
        name="Shapes", description="Mode of the blend shapes", items=MODES, default="AUTO"
    )
    use_frame_view: FRAME_VIEW
    use_studio: bpy.props.BoolProperty(
        name="With Studio",
        description="Also add a portrait camera, three lights and a backdrop around the face",
        default=False,
        options={"SKIP_SAVE"},
    )
    use_scene_camera: SCENE_CAMERA

    @classmethod
    def poll(cls, context: Context) -> bool:
        return usable(cls)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        for name in ("person", "shape_mode", "use_frame_view", "use_studio"):
            layout.prop(self, name)
        row = layout.row()
        row.active = self.use_studio
        row.prop(self, "use_scene_camera")

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.wait_beside()
        return self.execute(context)

    def execute(self, context: Context) -> Result:
        self._path = native.bundled_sample(self.person) or self._own_path()
        if self._path.is_file():
            return self._import(context)
        online = bpy.app.online_access
        if not online and not sample_face.can_be_built(self._path.parent):
            self.report(
                {"ERROR"},
                words.say(
                    "This face is built from data (48 MB) that have to be downloaded once: "
                    "allow online access first (Preferences, System, Network)."
                ),
            )
            return {"CANCELLED"}
        task = sample_face.sample_task(self._path, self.person, offline=not online)
        self._task = task
        return self.begin(context, task)

    def _own_path(self) -> Path:
        folder = Path(bpy.utils.extension_path_user(native.ADDON, path="sample"))
        return folder / f"{self.person}-{native.addon_version()}.dna"

    def _import(self, context: Context) -> Result:
        options = build.BuildOptions(mode=self.shape_mode)
        done = import_character(self, context, self._path, options, self.use_frame_view)
        if done == {"FINISHED"} and self.use_studio and parts.active_rig(context) is not None:
            add_studio(self, context, self.use_scene_camera)
        return done

    def finish(self, context: Context) -> Result:
        """Import the face that the task has built, or report its error."""
        error = self._task.error
        if error is None:
            return self._import(context)
        if isinstance(error, OSError):
            trouble = words.say(
                "The sample face could not be stored in Blender's folder for extensions: {reason}. "
                "See that you may write there and that the disk has room.",
                reason=(error.strerror or "").rstrip("."),
            )
        elif isinstance(error, native.user_errors()):
            reason = str(error).rstrip(".")
            trouble = words.say("The sample face could not be built: {reason}.", reason=reason)
        else:
            raise error
        self.report({"ERROR"}, trouble)
        return {"CANCELLED"}

    def shown(self, share: int) -> str:
        came = self._task.fetched
        if came is not None:
            text = "Fetching data of 48 MB, once: {share} %, Esc cancels"
            return words.say(text, share=round(came * 100))
        return words.say("Building the face: {share} %, Esc cancels", share=share)

    def cancelled_text(self) -> str:
        return words.say("No face was added.")


def draw_import(self: Menu, _context: Context) -> None:
    """Add the entry for DNA files to the menu File > Import."""
    self.layout.operator(RISORIUS_OT_import_dna.bl_idname, text="MetaHuman DNA (.dna)")


class RISORIUS_MT_sample(Menu):
    """The people to add."""

    bl_idname = "RISORIUS_MT_sample"
    bl_label = "Face"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator_context = "INVOKE_REGION_WIN"
        layout.operator_enum(RISORIUS_OT_add_character.bl_idname, "person")
        layout.separator()
        layout.menu(RISORIUS_MT_sample_studio.bl_idname, icon="CAMERA_DATA")
        layout.operator("risorius.add_studio", text="Studio for This Face", icon="LIGHT_AREA")


class RISORIUS_MT_sample_studio(Menu):
    """The people to add with camera, lights and backdrop."""

    bl_idname = "RISORIUS_MT_sample_studio"
    bl_label = "With Studio"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator_context = "INVOKE_REGION_WIN"
        adding = bpy.ops.risorius.add_character  # pyright: ignore  made by registration
        for person in adding.get_rna_type().properties["person"].enum_items:
            name = words.say(person.name)
            button = layout.operator("risorius.add_character", text=name, translate=False)
            button.person, button.use_studio = person.identifier, True


def draw_add(self: Menu, _context: Context) -> None:
    """Add the submenu of sample faces to the 3D view's Add menu."""
    self.layout.menu(RISORIUS_MT_sample.bl_idname, icon="USER")


CLASSES = (
    RISORIUS_OT_import_dna,
    RISORIUS_FH_dna,
    RISORIUS_OT_add_character,
    RISORIUS_MT_sample,
    RISORIUS_MT_sample_studio,
)
