# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls Blender's exporters with suitable settings for each format."""

import os
from contextlib import nullcontext
from pathlib import Path
from typing import Protocol

import bpy

from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...scene.base.blender_types import Override
from ...scene.base.console import quiet
from ...scene.export import lent_names, whole_files
from ..words import say

FORMATS = (
    ("GLTF", "glTF", "Bones and shape keys, one binary .glb file"),
    ("FBX", "FBX", "Bones and shape keys"),
    ("USD", "USD", "Bones and shape keys"),
    ("ALEMBIC", "Alembic", "Vertex positions of every frame, without bones"),
    ("RZC", "Clip (.rzc)", "Exact values of the controls in a small file, for any face"),
    ("CSV", "CSV", "Values of the controls as a plain table"),
)
_OPERATORS = {
    "GLTF": ("export_scene", "gltf"),
    "FBX": ("export_scene", "fbx"),
    "USD": ("wm", "usd_export"),
    "ALEMBIC": ("wm", "alembic_export"),
}


Settings = dict[str, object]  # settings of one of Blender's exporters


class ExportOperator(Protocol):
    """The properties of our export operator that decide the settings of Blender's exporter."""

    format: str
    step: float
    influences: int
    fbx_units: str
    lod_groups: bool


def _gltf(operator: ExportOperator, stage: bpy.types.Scene) -> Settings:
    return {
        "export_format": "GLB",
        "use_active_scene": True,
        "export_animations": True,
        "export_animation_mode": "ACTIVE_ACTIONS",
        # If this setting were True, every action of the .blend file with matching bone names would
        # be exported.
        "export_anim_single_armature": False,
        "export_nla_strips_merged_animation_name": stage.objects[0].name,
        "export_frame_range": True,
        "export_frame_step": whole_step(operator),
        "export_force_sampling": True,
        "export_optimize_animation_size": False,
        # If this setting were True, Blender 4.5 would write wrong bones if two armatures are
        # exported together.
        "export_optimize_disable_viewport": False,
        "export_skins": True,
        "export_all_influences": operator.influences == 0,
        "export_influence_nb": max(operator.influences, 1),
        "export_morph": True,
        "export_morph_normal": False,
        "export_rest_position_armature": True,
        "export_apply": False,
    }


def _fbx(operator: ExportOperator, _stage: bpy.types.Scene) -> Settings:
    return {
        "object_types": {"ARMATURE", "MESH", "EMPTY"},  # an empty represents a LOD group
        "use_custom_props": operator.lod_groups,  # these properties mark an empty as a LOD group
        "add_leaf_bones": False,
        "use_armature_deform_only": False,
        "bake_anim": True,
        "bake_anim_use_all_bones": True,
        "bake_anim_use_nla_strips": False,
        "bake_anim_use_all_actions": False,
        "bake_anim_force_startend_keying": True,
        "bake_anim_step": float(whole_step(operator)),
        "bake_anim_simplify_factor": 0.0,
        "apply_scale_options": operator.fbx_units,
        "path_mode": "COPY",
        "embed_textures": True,
        # Blender drops the shape keys if modifiers are applied.
        "use_mesh_modifiers": False,
        "mesh_smooth_type": "FACE",
    }


def _usd(_operator: ExportOperator, _stage: bpy.types.Scene) -> Settings:
    return {
        "export_animation": True,
        "export_armatures": True,
        "export_shapekeys": True,
        "only_deform_bones": False,
        "export_hair": False,
        "export_materials": True,
        "evaluation_mode": "RENDER",
    }


def _alembic(_operator: ExportOperator, stage: bpy.types.Scene) -> Settings:
    return {
        "start": stage.frame_start,
        "end": stage.frame_end,
        "xsamples": 1,
        "gsamples": 1,
        "uvs": True,
        "normals": True,
        "face_sets": True,
        "as_background_job": False,
        "evaluation_mode": "RENDER",
    }


# Format -> function that returns the settings of Blender's exporter for this format. `export`
# leaves out settings that the exporter of the running Blender version lacks.
_SETTINGS = {"GLTF": _gltf, "FBX": _fbx, "USD": _usd, "ALEMBIC": _alembic}


def whole_step(operator: ExportOperator) -> int:
    """The step between exported frames, rounded because exporters accept only whole numbers."""
    return max(1, round(operator.step))


def missing(kind: str) -> str:
    """The reason why this Blender cannot write a format, in one sentence; "" if it can."""
    if kind not in _OPERATORS:
        return ""
    group, name = _OPERATORS[kind]
    if name in dir(getattr(bpy.ops, group)):
        return ""
    label = next(f[1] for f in FORMATS if f[0] == kind)
    return say(
        "This Blender has no {format} exporter: enable its add-on, or use another build.",
        format=label,
    )


def export(operator: ExportOperator, override: Override, path: Path) -> None:
    """Write a file with Blender's exporter for the format.

    Args:
        operator: export operator with the format and settings of the user.
        override: members of the context that the exporter gets: the scene and objects that
            `export_animation.copies` has copied for this export.
        path: file to write, in a folder that is used for this export only.

    Raises:
        FaceError: the exporter reports an error, wrote nothing, or wrote only a part of the file.
    """
    group, name = _OPERATORS[operator.format]
    function = getattr(getattr(bpy.ops, group), name)
    known = set(function.get_rna_type().properties.keys())
    settings = _SETTINGS[operator.format](operator, override["scene"])
    named = lent_names.images_as_files() if operator.format == "USD" else nullcontext()
    with named, bpy.context.temp_override(**override), quiet():
        try:
            done = function(filepath=str(path), **{k: v for k, v in settings.items() if k in known})
        except RuntimeError as error:  # an error message of Blender's exporter
            said = str(error).replace(f"{path.parent}{os.sep}", "")  # the folder is temporary
            raise FaceError(said.strip().removeprefix("Error: ")) from error
    if "FINISHED" not in done or not path.exists():
        raise FaceError(told("Blender's exporter wrote nothing to {file}.", file=path.name))
    if whole_files.is_cut(path):
        raise FaceError(
            told("Blender's exporter wrote only a part of the file: free some space on the disk")
        )
