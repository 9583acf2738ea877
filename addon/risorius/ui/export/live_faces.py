# SPDX-License-Identifier: GPL-3.0-or-later
"""Warns if Blender's own exporters would write live (not baked) faces in their rest pose."""

from collections.abc import Mapping

import bpy

from ...logic.base import names
from ...scene.base import parts
from ...scene.base.blender_types import current_context
from ..words import say


def before_gltf(settings: Mapping[str, object]) -> None:
    """Warn about live faces in Blender's glTF export; the exporter calls this before writing.

    Args:
        settings: settings of the exporter, with its log and the choice of objects.
    """
    warning = getattr(settings.get("log"), "warning", None)
    found = live_faces(bool(settings.get("gltf_active_scene")), bool(settings.get("gltf_selected")))
    if warning is None or not found:
        return
    warning(
        say(
            "{faces}: Blender's own export knows no live faces and writes them at "
            "rest. Use Export Animation in the Risorius tab, or bake the faces first.",
            faces=names.printable(names.listed(found)),
        ),
        popup=True,
    )


def live_faces(active_scene: bool, selected: bool) -> list[str]:
    """The names of faces that are not baked, which an export would write in their rest pose.

    Args:
        active_scene: True: only the scene of the context is exported.
        selected: True: only the selected objects are exported.
    """
    here = current_context()
    scenes = [here.scene] if active_scene else bpy.data.scenes
    shown = {item for scene in scenes for item in scene.objects}
    if selected:
        shown &= set(here.selected_objects)
    return [
        rig.name.removesuffix("_rig")
        for rig in parts.rigs(linked=True)
        if parts.BAKED not in rig and shown & {rig, *parts.meshes_of(rig)}
    ]
