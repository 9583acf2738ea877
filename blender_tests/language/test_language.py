# SPDX-License-Identifier: GPL-3.0-or-later
"""In German, Blender finds our translations; names of objects stay untranslated."""

import bpy
import pytest
from support import scene

CONTROL = "CTRL_expressions.mouthCornerPullL"


@pytest.fixture
def german():
    if not bpy.app.build_options.international:
        pytest.skip("EXTRA NOT RUN: Blender as a module knows no other language than English")
    view = bpy.context.preferences.view
    known = bpy.app.translations.locales
    if "de_DE" not in known and "de" not in known:
        pytest.skip("EXTRA NOT RUN: this Blender has no German")
    before = view.language
    view.language = "de_DE" if "de_DE" in known else "de"
    view.use_translate_interface = view.use_translate_tooltips = True
    scene.submodule("ui.words").follow_language()
    yield
    view.language = before
    scene.submodule("ui.words").follow_language()


def test_our_words_have_a_context_of_their_own(german):
    look_up = bpy.app.translations.pgettext_iface
    assert look_up("Face", "Risorius") == "Gesicht"
    assert look_up("Face") != "Gesicht"  # Blender's translation is for a face of a mesh
    panel = bpy.types.RISORIUS_PT_character
    assert look_up(panel.bl_label, panel.bl_translation_context) == "Gesicht"
    operator = bpy.ops.risorius.mirror.get_rna_type()
    assert look_up(operator.name, operator.translation_context) == "Gesicht spiegeln"
    flipped = bpy.ops.risorius.paste_pose.get_rna_type().properties["flipped"]
    assert flipped.translation_context == "Risorius"
    layer = scene.submodule("scene.animation.layer_properties").RISORIUS_PG_layer
    kinds = layer.bl_rna.properties["kind"]
    assert kinds.translation_context == "Risorius"


def test_properties_that_blenders_types_get_have_the_context_too():
    """Properties that the add-on adds to Blender's types have the add-on's translation context.

    Without this context Blender would show their names in English.
    """
    ours = [
        prop
        for kind in (bpy.types.Object, bpy.types.WindowManager, bpy.types.Scene)
        for prop in kind.bl_rna.properties
        if prop.identifier.startswith("risorius_") and prop.name not in ("", prop.identifier)
    ]
    assert len(ours) > 8
    assert {p.identifier for p in ours if p.translation_context != "Risorius"} == set()


def test_tooltips_of_operators_and_controls_are_translated(german, dna_file):
    rig = scene.load(dna_file)
    look_up = bpy.app.translations.pgettext_tip
    told = scene.face(rig).id_properties_ui(CONTROL).as_dict()["description"]
    assert "Lächeln" in look_up(told)
    assert "Linke Seite" in look_up(told) or "linke Seite" in look_up(told)
    assert "Spiegel" in look_up(bpy.ops.risorius.mirror.get_rna_type().description)


def test_new_layers_have_german_names_where_blender_gives_new_things_such(german, dna_file):
    rig = scene.load(dna_file)
    view = bpy.context.preferences.view
    for theirs, expected in ((False, ["Idle Life", "Joy"]), (True, ["Leises Leben", "Freude"])):
        view.use_translate_new_dataname = theirs
        bpy.ops.risorius.layer_add(kind="IDLE")
        bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy")
        held = scene.controls(rig).risorius_layers
        assert [y.name for y in held if not y.removed][-2:] == expected
    view.use_translate_new_dataname = False


def test_names_are_not_translated(german, dna_file):
    rig = scene.load(dna_file)
    assert rig.name == "Small_rig"
    assert scene.face(rig).get(CONTROL) is not None
    bpy.ops.risorius.key()
    curves = scene.submodule("scene.base.compat").curves_of
    groups = {c.group.name for c in curves(scene.controls(rig).animation_data.action)}
    assert "Mouth" in groups


def test_english_needs_no_table():
    words = scene.submodule("ui.words")
    words.follow_language()
    assert words.say("Face") == "Face"
    assert words.say("{count} controls copied", count=3) == "3 controls copied"
    assert words._language["given"] == ""
