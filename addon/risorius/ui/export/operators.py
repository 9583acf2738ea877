# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Exports moving faces with Blender's exporters, or the curves of their controls as a file."""

from collections.abc import Generator
from pathlib import Path
from typing import TypeVar

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...scene.animation.clip_actions import frame_rate
from ...scene.bake import sampling
from ...scene.base.blender_types import ArmatureObject
from ...scene.export import export_animation, plain_materials
from .. import words
from ..bake.selection import FacesOperator, FrameRange, selected_rigs
from ..blender_types import Context, ExportHelper, Operator, Result
from ..common import proposed_file, shown_progress, system_path
from .exporters import FORMATS, export, missing

_T = TypeVar("_T")
_ENDINGS = {
    "GLTF": ".glb",
    "FBX": ".fbx",
    "USD": ".usdc",
    "ALEMBIC": ".abc",
    "RZC": ".rzc",
    "CSV": ".csv",
}
_KNOWN = {*_ENDINGS.values(), ".usd", ".usda", ".usdz", ".gltf"}


class RISORIUS_OT_export_animation(FrameRange, FacesOperator, ExportHelper, Operator):
    """Write the animation of the selected faces to a file."""

    bl_idname = "risorius.export_animation"
    bl_label = "Export Animation"
    bl_description = (
        "Write the animation of the selected faces to a file: baked, from a copy; the scene stays "
        "as it is"
    )
    bl_options = {"PRESET"}

    filename_ext = ".glb"
    check_extension = None  # set by the format
    filter_glob: bpy.props.StringProperty(
        default="*.glb;*.fbx;*.usd;*.usdc;*.usda;*.usdz;*.abc;*.rzc;*.csv", options={"HIDDEN"}
    )
    format: bpy.props.EnumProperty(name="Format", items=FORMATS)
    wanted: bpy.props.EnumProperty(
        name="Parts",
        items=(
            ("BONES", "Bones", "Animation of the bones"),
            ("SHAPES", "Shapes", "Shape keys and their animation"),
        ),
        options={"ENUM_FLAG"},
        default={"BONES", "SHAPES"},
    )
    all_shapes: bpy.props.BoolProperty(
        name="All Shapes",
        description="Include shape keys that do not move in this frame range",
        default=False,
    )
    influences: bpy.props.IntProperty(
        name="Influences",
        description=(
            "Largest number of joints per vertex. Engines take 4 or 8; 0 writes all, "
            "as Blender shows them"
        ),
        default=0,
        min=0,
        max=32,
    )
    fbx_units: bpy.props.EnumProperty(
        name="Units",
        description=(
            "Place where the FBX file stores the unit: in its settings, or as a scale of the "
            "objects"
        ),
        items=(
            (
                "FBX_SCALE_NONE",
                "On Objects",
                "The unit is the scale of the objects, which is 100, as Unreal expects",
            ),
            (
                "FBX_SCALE_ALL",
                "In the File",
                "The file states the unit, and objects have scale 1, as Unity expects",
            ),
        ),
    )
    lod_groups: bpy.props.BoolProperty(
        name="LOD Groups",
        description="Also write the coarser levels that were built: a group of levels for each "
        "mesh, of which an engine shows one level by distance",
    )
    bake_materials: bpy.props.BoolProperty(
        name="Bake Materials",
        description=(
            "Give the file plain materials with one image each for colour, "
            "roughness and normals: other programs do not read node trees. Animated "
            "maps stay neutral in the file"
        ),
        default=True,
    )
    texture_size: bpy.props.IntProperty(
        name="Texture Size",
        description="Width and height of the baked images in pixels; images that a "
        "material shows unchanged keep their own size",
        default=1024,
        min=64,
        max=8192,
    )
    maps: bpy.props.BoolProperty(
        name="With Maps",
        description="Include the values of animated maps",
        default=False,
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        rigs = selected_rigs(context)
        if not self.filepath and rigs:
            self.filepath = proposed_file(rigs[0].name, _ENDINGS[self.format])
        return ExportHelper.invoke(self, context, event)

    def check(self, context: Context) -> bool:
        """Give the file name in the open dialog the extension of the chosen format.

        Returns whether the file name was changed.
        """
        if self.format == "USD" and self.filepath.endswith((".usd", ".usda", ".usdz")):
            return False
        path = Path(self.filepath)
        # A name may contain a dot, such as "shot.v02". Only known extensions are replaced.
        stem = path.stem if path.suffix.lower() in _KNOWN else path.name
        changed = str(path.with_name(stem + _ENDINGS[self.format])) if stem else self.filepath
        if Path(self.filepath).name in ("", ".") or changed == self.filepath:
            return False
        self.filepath = changed
        return True

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "format")
        self.draw_range(layout)
        if self.format not in ("RZC", "CSV"):
            self.draw_lod(layout)
            layout.prop(self, "bake_materials")
            if self.bake_materials:
                layout.prop(self, "texture_size")
        if self.format in ("GLTF", "FBX", "USD"):
            layout.prop(self, "wanted")
            layout.prop(self, "all_shapes")
        if self.format == "GLTF":
            words.prop_or(layout, self, "influences", 0, "0: all joints")
        if self.format == "FBX":
            layout.prop(self, "fbx_units")
            layout.prop(self, "lod_groups")
        if self.format in ("RZC", "CSV"):
            layout.prop(self, "maps")
        layout.prop(self, "every")

    def execute(self, context: Context) -> Result:
        if not Path(self.filepath).name:
            self.report({"ERROR"}, words.say("Enter a file name: no name was given."))
            return {"CANCELLED"}
        trouble = missing(self.format)
        if trouble:
            self.report({"ERROR"}, trouble)
            return {"CANCELLED"}
        start, end = self.frames(context)
        options = export_animation.ShipOptions(
            start, end, self.step, self.lod, frozenset(self.wanted), self.all_shapes,
            self.lod_groups and self.format == "FBX",
        )  # fmt: skip
        try:
            characters = run(
                context, export_animation.sampled(context, self.faces(context), options)
            )
            written = self._write(context, characters, options)
        except native.user_errors() as error:
            self.report({"ERROR"}, _one_sentence(self.filepath, error))
            return {"CANCELLED"}
        self.report({"INFO"}, written)
        return {"FINISHED"}

    def _write(
        self,
        context: Context,
        characters: list[tuple[ArmatureObject, int, sampling.Samples]],
        options: export_animation.ShipOptions,
    ) -> str:
        path = Path(system_path(self.filepath))
        frames = len(characters[0][2].frames)
        if self.format in ("RZC", "CSV"):
            if len(characters) > 1:
                raise FaceError(told("a file contains the controls of one face: select one face"))
            scene = context.scene
            clip = export_animation.clip(
                *characters[0], frame_rate(scene), scene.frame_start, self.maps
            )
            _write_csv(clip, path) if self.format == "CSV" else clip.save(path)
        else:
            with export_animation.copies(context, characters, options) as (override, loans):
                if self.bake_materials:
                    run(context, plain_materials.flatten(override, loans, self.texture_size))
                # Blender's exporters overwrite an existing file from its start, so a failure would
                # damage it. So they write another file, which then replaces the existing file.
                with native.part("files.fileio").staging(path) as made:
                    export(self, override, made)
                    if self.bake_materials and self.format == "ALEMBIC":
                        folder = made.with_name(path.stem + "_textures")
                        plain_materials.write_images(override["scene"], folder)
        return f"{path.name}: {frames} frames, {path.stat().st_size:,} bytes"


def run(context: Context, job: Generator[float, None, _T]) -> _T:
    """Run a generator to its end and show its progress.

    Args:
        context: context with the window for the progress.
        job: generator that yields the finished share, 0 to 1.

    Returns:
        The return value of the generator.
    """
    with shown_progress(context) as progress:
        try:
            while True:
                progress(next(job))
        except StopIteration as finished:
            return finished.value


def _write_csv(clip: "native.Clip", path: Path) -> None:
    writing = native.part("importing.writing")
    writing.write_text(writing.csv_text(clip), path)


def _one_sentence(path: str, error: Exception) -> str:
    """A sentence with the name of the file and the last useful line of an error's text.

    If the text is a traceback of an exporter, its location lines are skipped.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    useful = [x for x in lines if not x.startswith(("Location:", "File ", "Traceback"))]
    text = (useful or ["it failed without a word"])[-1].removeprefix("Error: ").rstrip(".")
    return f"{Path(path).name}: {text}."


CLASSES = (RISORIUS_OT_export_animation,)
