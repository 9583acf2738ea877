# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators of Mix Faces: add and remove faces, show the preview, write the file."""

from collections.abc import Mapping
from pathlib import Path

import bpy

from ... import native
from ...scene.base import parts, saved
from ...scene.character import build
from ...scene.mixing import parents
from ..blender_types import Context, ExportHelper, ImportHelper, Operator, Result
from ..common import explain, shown_progress, system_path, usable
from ..file.import_operators import import_character
from ..words import of_error, say
from .properties import choices, follow, paths_of, shares_of


def _not_mixed(own: Mapping[str, str]) -> list[str]:
    """Sentences about textures that were not mixed; hair textures, which never are, are left out.

    Args:
        own: name of a texture -> reason why it was not mixed, such as "missing"; for "missing",
            "format" and "size" there is a sentence.
    """

    def names(why: str) -> str:
        return ", ".join(name for name, found in own.items() if found == why)

    texts = {
        "missing": say(
            "Not mixed, because not every face has these textures: {names}", names=names("missing")
        ),
        "format": say(
            "Not mixed, because Risorius mixes only PNG files of the kind that it writes: {names}",
            names=names("format"),
        ),
        "size": say(
            "Not mixed, because these textures have different sizes on the faces: {names}",
            names=names("size"),
        ),
    }
    return [text for why, text in texts.items() if names(why)]


def _add(operator: Operator, context: Context, paths: list[str]) -> Result:
    """Add faces to the mix.

    A face that cannot be read, or does not match the first face of the mix, is reported and not
    added. A face that the mix contains already is skipped without a report.

    Args:
        operator: operator that reports.
        context: context of Blender.
        paths: paths of DNA files.

    Returns:
        {"CANCELLED"} if no face was added.
    """
    chosen = choices(context)
    added = 0
    for path in paths:
        known = paths_of(context)
        if path in known:
            continue
        try:
            why = parents.refused(known[0] if known else path, path)
        except (OSError, *native.user_errors()) as error:
            operator.report({"ERROR"}, explain(path, error))
            continue
        if why:
            operator.report({"ERROR"}, why)
            continue
        chosen.parents.add().path = path
        added += 1
    follow(context)
    return {"FINISHED"} if added else {"CANCELLED"}


class _Usable:
    """Base of operators that need the native module."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        return usable(cls)  # type: ignore[arg-type]  # pyright: ignore


class RISORIUS_OT_mix_add(_Usable, Operator, ImportHelper):
    """Add faces of the same topology to the mix"""

    bl_idname = "risorius.mix_add"
    bl_label = "Add Face Files"

    filename_ext = ".dna"
    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})
    directory: bpy.props.StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})
    files: bpy.props.CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )

    def execute(self, context: Context) -> Result:
        names = [file.name for file in self.files if file.name]
        folder = system_path(self.directory)
        paths = [str(Path(folder, name)) for name in names] or [system_path(self.filepath)]
        return _add(self, context, paths)


class RISORIUS_OT_mix_add_scene(_Usable, Operator):
    """Add the files of this scene's faces to the mix"""

    bl_idname = "risorius.mix_add_scene"
    bl_label = "Add the Scene's Faces"

    def execute(self, context: Context) -> Result:
        paths = [bpy.path.abspath(saved.text(rig, parts.SOURCE)) for rig in parts.rigs(linked=True)]
        paths = [path for path in dict.fromkeys(paths) if path]
        if not paths:
            self.report({"ERROR"}, say("There is no face in this scene."))
            return {"CANCELLED"}
        return _add(self, context, paths)


class RISORIUS_OT_mix_remove(Operator):
    """Remove this face from the mix"""

    bl_idname = "risorius.mix_remove"
    bl_label = "Remove"

    index: bpy.props.IntProperty(options={"HIDDEN"})

    def execute(self, context: Context) -> Result:
        rows = choices(context).parents
        if not 0 <= self.index < len(rows):
            return {"CANCELLED"}
        rows.remove(self.index)
        if rows:
            follow(context)
        else:
            parents.hide(context)
            parents.forget()
        return {"FINISHED"}


class _Mixes(_Usable):
    """Base of operators that need at least one face in the mix."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not choices(context).parents:
            cls.poll_message_set(say("Add faces first."))  # type: ignore[attr-defined]  # pyright: ignore
            return False
        return True


class RISORIUS_OT_mix_preview(_Mixes, Operator):
    """Show the mix as a mesh that follows the sliders; press again to remove it"""

    bl_idname = "risorius.mix_preview"
    bl_label = "Preview"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: Context) -> Result:
        if parents.preview(context) is not None:
            parents.hide(context)
            return {"FINISHED"}
        shares, regions = shares_of(context)
        try:
            parents.show(context, paths_of(context), shares, regions)
        except (OSError, *native.user_errors()) as error:
            self.report({"ERROR"}, explain(getattr(error, "filename", None) or "", error))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_mix_write(_Mixes, Operator, ExportHelper):
    """Write the mix as a DNA file with its textures, and import it"""

    bl_idname = "risorius.mix_write"
    bl_label = "Write Mixed Face"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".dna"
    filter_glob: bpy.props.StringProperty(default="*.dna", options={"HIDDEN"})
    use_import: bpy.props.BoolProperty(
        name="Import", description="Import the new face", default=True
    )

    def execute(self, context: Context) -> Result:
        shares, regions = shares_of(context)
        paths = paths_of(context)
        self.filepath = system_path(self.filepath)
        try:
            with shown_progress(context) as progress:
                own = parents.write(self.filepath, paths, shares, regions, progress)
        except parents.MixError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        except (OSError, *native.user_errors()) as error:
            # If the DNA file of a mixed face is missing, the error contains the path of that file.
            name = getattr(error, "filename", None) or self.filepath
            self.report({"ERROR"}, explain(name, error))
            return {"CANCELLED"}
        for text in _not_mixed(own):
            self.report({"WARNING"}, text)
        if not self.use_import:
            return {"FINISHED"}
        parents.hide(context)
        return import_character(self, context, self.filepath, build.BuildOptions())


CLASSES = (
    RISORIUS_OT_mix_add,
    RISORIUS_OT_mix_add_scene,
    RISORIUS_OT_mix_remove,
    RISORIUS_OT_mix_preview,
    RISORIUS_OT_mix_write,
)
