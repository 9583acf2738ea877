# SPDX-License-Identifier: GPL-3.0-or-later
"""Registers all classes, properties and handlers, and unregisters them in reverse order."""

from collections.abc import Mapping

import bpy

from . import native
from .language import errors, tables
from .scene.animation import layer_properties, range_properties
from .scene.base import compat, console, session
from .scene.events import handlers
from .scene.export import ordinary_form
from .scene.gaze import gaze_settings
from .scene.live import capture
from .scene.speech import spoken_properties
from .ui import (
    about,
    animation,
    anyhead,
    bake,
    board,
    drag,
    export,
    expressions,
    face,
    file,
    hand,
    layers,
    live,
    menu,
    mixing,
    see_why,
    shape_keys,
    speech,
    upkeep,
    words,
)
from .ui.about import manual, preferences, timing_overlay
from .ui.animation import operators as animation_operators
from .ui.anyhead import operators as head_operators
from .ui.anyhead import overlay as landmark_overlay
from .ui.drag import drawing as drag_drawing
from .ui.drag import properties as drag_properties
from .ui.drag import tool as drag_tool
from .ui.export import live_faces
from .ui.expressions import previews as expression_previews
from .ui.expressions import properties as expression_properties
from .ui.face import channel_preview, favourites_panel, paste_flipped
from .ui.file import framing_operators, import_operators, rig_operators
from .ui.file import operators as file_operators
from .ui.live import properties as live_properties
from .ui.menu import face_menu
from .ui.mixing import properties as mixing_properties
from .ui.see_why import overlay as why_overlay
from .ui.see_why import panel as why_panel
from .ui.see_why import properties as why_properties

# Panels with equal bl_order appear in the order of registration.
CLASSES = (
    *layer_properties.CLASSES,
    *range_properties.CLASSES,
    *spoken_properties.CLASSES,
    *about.CLASSES,
    *file.CLASSES,
    *upkeep.CLASSES,
    *bake.CLASSES,
    *export.CLASSES,
    *drag.CLASSES,
    *face.CLASSES,
    *board.CLASSES,
    *animation.CLASSES,
    *shape_keys.CLASSES,
    *anyhead.CLASSES,
    *hand.CLASSES,
    *speech.CLASSES,
    *expressions.CLASSES,
    *layers.CLASSES,
    *see_why.CLASSES,
    *live.CLASSES,
    *mixing.CLASSES,
    *menu.CLASSES,
)


# The caches of these functions are kept until Blender quits, because the files of the extension,
# from which the functions read, do not change.
session.adopt(
    ("quit",),
    native.addon_version,
    native.website,
    native.regions,
    native.live_sources,
    errors.best,
    errors.rows,
    tables.controls,
    tables.error_rows,
    tables.languages,
    tables.search_words,
    tables.translation,
)
# RISORIUS_Idle, if it was registered because another copy of the add-on is active; else empty.
_idle: list[type] = session.keep("registration.idle", list, ("unregister",))


def _window_properties() -> dict[str, object]:
    """Properties of the window manager, which are not stored in the .blend."""
    return {
        "risorius_search": bpy.props.StringProperty(
            name="Search",
            translation_context=tables.CONTEXT,
            description=(
                "Show only the controls with these words, such as smile, open mouth, kiss or frown"
            ),
            options={"TEXTEDIT_UPDATE", "SKIP_SAVE"},
        ),
        "risorius_only_used": bpy.props.BoolProperty(
            name="Only Controls in Use",
            translation_context=tables.CONTEXT,
            description="Show only the controls that are not at rest or have keys",
            options={"SKIP_SAVE"},
        ),
        "risorius_stars": bpy.props.BoolProperty(
            name="Stars",
            translation_context=tables.CONTEXT,
            description="Show a star beside each control to mark favourites",
            options={"SKIP_SAVE"},
        ),
        "risorius_show_timing": timing_overlay.show_property(),
        "risorius_live": bpy.props.PointerProperty(type=live_properties.RISORIUS_PG_live),
        "risorius_drag": bpy.props.PointerProperty(type=drag_properties.RISORIUS_PG_drag),
        "risorius_mix": bpy.props.PointerProperty(type=mixing_properties.RISORIUS_PG_mix),
        "risorius_why": bpy.props.PointerProperty(type=why_properties.RISORIUS_PG_why),
        "risorius_expressions": bpy.props.PointerProperty(
            type=expression_properties.RISORIUS_PG_expressions
        ),
        "risorius_test": channel_preview.weight_property(),
    }


def register() -> None:
    """Register classes, properties, menus and handlers.

    If another copy of the add-on is active, this copy does nothing, because two active copies would
    move each face twice.
    """
    words.follow_language()
    other = native.other_copy()
    if other:
        console.say(preferences.twice(other))
        bpy.utils.register_class(preferences.RISORIUS_Idle)
        _idle.append(preferences.RISORIUS_Idle)
        return
    for cls in CLASSES:
        words.give_context(cls)
        bpy.utils.register_class(cls)
    layer_properties.register()
    range_properties.register()
    spoken_properties.register()
    gaze_settings.register()
    for name, choice in _window_properties().items():
        setattr(bpy.types.WindowManager, name, choice)
    bpy.types.TOPBAR_MT_file_import.append(import_operators.draw_import)
    bpy.types.TOPBAR_MT_file_import.append(animation_operators.draw_import)
    bpy.types.TOPBAR_MT_file_export.append(file_operators.draw_export)
    bpy.types.VIEW3D_MT_add.append(import_operators.draw_add)
    bpy.types.MESH_MT_shape_key_context_menu.append(rig_operators.draw_make_rig)
    bpy.types.VIEW3D_MT_object.append(rig_operators.draw_make_rig)
    bpy.types.VIEW3D_MT_object.append(head_operators.draw_from_head)
    bpy.types.UI_MT_button_context_menu.append(favourites_panel.draw_button_menu)
    face_menu.register()
    framing_operators.register()
    trouble = native.problem()
    manual.register()
    for sentence in (trouble, compat.notice()):
        if sentence:
            console.say(sentence)
    handlers.register()
    ordinary_form.register()
    paste_flipped.register()
    capture.register()
    drag_tool.register()
    why_overlay.start()
    landmark_overlay.start()
    bpy.app.timers.register(_refresh_once, first_interval=0.0)


def before_gltf(settings: Mapping[str, object]) -> None:
    """Warn about live faces and switch off Direct mode before Blender's glTF exporter writes.

    Args:
        settings: settings of the exporter.
    """
    if not _idle:
        live_faces.before_gltf(settings)
        ordinary_form.begin(ordinary_form.GLTF)


def after_gltf() -> None:
    """Allow Direct mode again after Blender's glTF exporter has written."""
    if not _idle:
        ordinary_form.end(ordinary_form.GLTF)


def _refresh_once() -> None:
    """Update all faces; a timer calls this, because data must not change during registration."""
    handlers.refresh()


def unregister() -> None:
    """Undo the steps of `register` in reverse order."""
    if _idle:
        bpy.utils.unregister_class(_idle.pop())
        words.forget_language()
        session.end("unregister")
        return
    if bpy.app.timers.is_registered(_refresh_once):
        bpy.app.timers.unregister(_refresh_once)
    why_panel.stop()
    why_overlay.stop()
    landmark_overlay.stop()
    drag_tool.unregister()
    capture.unregister()
    paste_flipped.unregister()
    ordinary_form.unregister()
    handlers.unregister()
    manual.unregister()
    timing_overlay.stop()
    drag_drawing.stop()
    expression_previews.forget()
    framing_operators.unregister()
    face_menu.unregister()
    bpy.types.UI_MT_button_context_menu.remove(favourites_panel.draw_button_menu)
    bpy.types.VIEW3D_MT_object.remove(head_operators.draw_from_head)
    bpy.types.VIEW3D_MT_object.remove(rig_operators.draw_make_rig)
    bpy.types.MESH_MT_shape_key_context_menu.remove(rig_operators.draw_make_rig)
    bpy.types.VIEW3D_MT_add.remove(import_operators.draw_add)
    bpy.types.TOPBAR_MT_file_export.remove(file_operators.draw_export)
    bpy.types.TOPBAR_MT_file_import.remove(animation_operators.draw_import)
    bpy.types.TOPBAR_MT_file_import.remove(import_operators.draw_import)
    for name in reversed(_window_properties()):
        delattr(bpy.types.WindowManager, name)
    gaze_settings.unregister()
    spoken_properties.unregister()
    range_properties.unregister()
    layer_properties.unregister()
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    words.forget_language()
    session.end("unregister")
