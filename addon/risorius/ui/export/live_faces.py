# SPDX-License-Identifier: GPL-3.0-or-later
"""Live faces in Blender's own exports, which step through no frame as the face does."""

from collections.abc import Mapping

import bpy

from ...logic.base import names
from ...scene.base import parts
from ...scene.base.blender_types import current_context
from ..words import say


def before_gltf(settings: Mapping[str, object]) -> None:
    """Warn about live faces in Blender's own glTF export; the exporter calls this before writing.

    Args:
        settings: settings of the exporter; its log and the choice of objects are used.
    """
    warning = getattr(settings.get("log"), "warning", None)
    found = live_faces(bool(settings.get("gltf_active_scene")), bool(settings.get("gltf_selected")))
    if warning is None or not found:
        return
    warning(
        say(
            "{faces}: Blender's own export knows no live faces and writes them at rest. Use Export "
            "Animation of the tab Risorius, or Bake first.",
            faces=names.printable(names.listed(found)),
        ),
        popup=True,
    )


def live_faces(active_scene: bool, selected: bool) -> list[str]:
    """The names of unbaked faces, which an export would show at rest.

    Args:
        active_scene: only the scene of the context is exported.
        selected: only selected objects of it.
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
