# SPDX-License-Identifier: GPL-3.0-or-later
"""The menu Face in the header, through which Blender's search finds the operators."""

from types import SimpleNamespace

import bpy
import pytest
from support import scene
from support.layout import Recorder

# Operators that the menu Face does not contain, because they act on an item of a panel or list or
# on a handle, or belong to an open dialog.
ELSEWHERE = {
    *("apply_pose_asset", "blend_pose_asset", "blend_expression", "delete_expression"),
    *("rename_expression", "star_expression", "update_expression", "render_thumbnails"),
    *("save_expression", "favourite", "hide_hints", "hide_joints", "shortcut", "install_speech"),
    *("layer_add", "layer_move", "unfire", "fire", "solo", "mask_renders", "test_channel"),
    *("drag", "drag_hover", "pin", "select_handle", "paste_pose_flipped"),
    *("live_subject", "live_finish", "live_discard", "live_neutral", "learn_range_live"),
    *("mix_add", "mix_add_scene", "mix_remove", "mix_preview", "mix_write"),
    *("forget_range", "load_range", "save_range", "add_character", "set_lod"),
    *("set_lod_by_distance", "set_shape_mode", "set_strands", "reset_board", "select_board"),
    *("assign_shape_key", "choose_shape_key", "select_shape_key", "shape_key_pictures"),
    *(
        "assign_curve",
        "choose_curve",
        "save_curve_mapping",
        "load_shape_key_names",
        "save_shape_key_names",
    ),
    *("place_landmark", "clear_landmarks", "landmark_names", "save_landmarks", "load_landmarks"),
    *("lead", "remove_board", "frame_board", "sound_set", "sound_insert", "sound_remove"),
}


class Menus(Recorder):
    """A fake layout that collects the entries of a menu and of its submenus, as the search does."""

    def __init__(self, top=None):
        super().__init__(top)
        if top is None:
            object.__setattr__(self, "paths", [])

    def menu(self, name, text="", icon="NONE", **_options):
        kind = getattr(bpy.types, name)
        below = Menus()
        kind.draw(SimpleNamespace(layout=below), bpy.context)
        title = text or kind.bl_label
        self.operators.extend(below.operators)
        self._top.paths.extend(f"{title} > {path}" for path in below.paths)

    def operator(self, name, text="", **options):
        kind = super().operator(name, text, **options)
        module, _, last = name.partition(".")
        title = text or getattr(getattr(bpy.ops, module), last).get_rna_type().name
        self._top.paths.append(title)
        return kind

    def operator_enum(self, name, _property, **_options):
        self.operator(name)


def found():
    """The entries of the menu Face.

    Returns their paths as Blender's search shows them, and the set of their operators' names.
    """
    layout = Menus()
    draw = scene.submodule("ui.menu.face_menu").draw_header
    assert draw in bpy.types.VIEW3D_MT_editor_menus._dyn_ui_initialize()
    draw(SimpleNamespace(layout=layout), bpy.context)
    return layout.paths, {name.partition(".")[2] for name in layout.operators}


def is_in_header():
    """Whether the header of 3D views shows the menu Face."""
    return bool(found()[0])


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file)


def test_search_finds_the_face_by_the_words_of_animators(rig):
    paths, operators = found()
    for words in (
        *("risorius", "blink", "breakdown", "key all", "tweak over", "frame face", "reset"),
        *("heat map", "mirror", "drag", "board", "speak", "import animation", "bake", "export"),
        *("expressions", "layer", "live capture", "eyes follow", "copy left to right"),
    ):
        assert any(words in path.lower() for path in paths), words
    assert all("risorius" in path.lower() for path in paths)
    assert "Face (Risorius) > Keys > Key All" in paths
    ours = {name for name in dir(bpy.ops.risorius) if not name.startswith("_")}
    assert ours - operators - ELSEWHERE == set()
    assert ELSEWHERE - ours == set()
    for name in operators & ours:  # the search leaves internal operators out
        assert "INTERNAL" not in getattr(bpy.ops.risorius, name).bl_options, name
    keymap = bpy.context.window_manager.keyconfigs.user.keymaps.new("3D View")
    for name in operators & ours:  # a shortcut can be assigned, and shows the operator's name
        item = keymap.keymap_items.new(f"risorius.{name}", "F", "PRESS", ctrl=True, alt=True)
        assert item.name == getattr(bpy.ops.risorius, name).get_rna_type().name, name
        keymap.keymap_items.remove(item)


def test_the_menu_stands_in_object_and_pose_mode_and_without_a_face(dna_file):
    assert is_in_header()
    assert "Face (Risorius) > Character > Add a Face > Face" in found()[0]
    rig = scene.load(dna_file)
    controls = scene.controls(rig)
    bpy.context.view_layer.objects.active = controls
    bpy.ops.object.mode_set(mode="POSE")
    assert is_in_header()
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = scene.meshes(rig)[0]
    bpy.ops.object.mode_set(mode="EDIT")
    assert not is_in_header()  # Blender's own menu Face is shown
    bpy.ops.object.mode_set(mode="OBJECT")


def test_without_the_native_module_the_menu_leads_to_the_preferences(monkeypatch):
    menu = scene.submodule("ui.menu.face_menu")
    monkeypatch.setattr(menu.native, "problem", lambda: "It is missing.")
    assert "Face (Risorius) > Risorius > Preferences" in found()[0]
    assert "reset" not in found()[1]
