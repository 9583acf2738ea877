# SPDX-License-Identifier: GPL-3.0-or-later
"""No text of a panel or dialog is cut off at default widths; special values have names."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import pytest
from support import measured, scene
from support.measured import DIALOG, FILE_BROWSER, SIDEBAR, Operator, Part, drawn
from support.plain_head import Package, plain_head

TABLES = Path(__file__).resolve().parents[2] / "addon" / "risorius" / "language"
LANGUAGES = sorted(path.stem.partition("_")[2] for path in TABLES.glob("interface_*.toml"))
STANDARD = Path(__file__).resolve().parents[2] / "tests" / "data" / "controls" / "standard_raw.txt"


def texts(part):
    """All texts that were drawn into a Part, also in the parts within it."""
    found = []
    for child in part.children:
        found += texts(child) if isinstance(child, Part) else [child[0]]
    return found


def ui(name):
    return scene.submodule(f"ui.{name}")


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file)


@pytest.fixture(params=["", *LANGUAGES], ids=lambda language: language or "en")
def language(request, monkeypatch):
    """Let panels show English texts (""), or the texts of a language with a translation table."""
    tables, words = scene.submodule("language.tables"), ui("words")
    there = tables.translation(request.param) if request.param else {}
    for (context, english), shown in there.items():
        if context == tables.CONTEXT:
            monkeypatch.setitem(measured.LOCAL, english, shown)
    if there:

        def say(text, **values):
            return measured.local(text).format(**values) if values else measured.local(text)

        monkeypatch.setattr(words, "say", say)
    return request.param


def test_the_ruler_finds_words_that_are_cut():
    layout = Part()
    row = layout.row()
    row.label(text="LOD, Viewport")
    for level in range(8):
        row.operator("risorius.set_lod", text=str(level))
    line = layout.split(factor=0.42)
    line.label(text="Lower Lip Depress")
    line.label(text="")
    assert layout.cut(1000) == []
    cut = [text for text, _needed, _room in layout.cut(SIDEBAR)]
    assert {"LOD, Viewport", "Lower Lip Depress"} <= set(cut)  # they are cut off in a real window


def test_every_panel_can_be_read(rig, language):
    scene.controls(rig).risorius_ranges.add().reason = "its peaks differ, so none is an extreme"
    for name, kind in (
        ("face.panel", "RISORIUS_PT_character"),
        ("face.panel", "RISORIUS_PT_options"),
        ("animation.panel", "RISORIUS_PT_animation"),
        ("bake.panel", "RISORIUS_PT_out"),
        ("live.panel", "RISORIUS_PT_live"),
        ("live.range_panel", "RISORIUS_PT_ranges"),
        ("face.controls_panel", "RISORIUS_PT_controls"),
    ):
        layout = drawn(getattr(ui(name), kind), bpy.context)
        assert texts(layout)
        cut = [text for text, _needed, _room in layout.cut(SIDEBAR) if not text.startswith("Xxx")]
        assert cut == [], kind  # next to a name of 90 letters


def test_what_a_head_lacks_can_be_read(monkeypatch, language):
    Package(monkeypatch).places.clear()
    plain_head()
    landmarks = scene.submodule("native").part("anyhead.landmarks.names")
    finding = scene.submodule("scene.anyhead.finding")
    monkeypatch.setattr(finding, "words", landmarks.landmark_words)
    monkeypatch.setattr(finding, "needed", landmarks.needed_landmarks)
    bpy.ops.risorius.place_landmark(landmark="ear_top_L")
    panel = ui("anyhead.panel")
    monkeypatch.setattr(panel, "_MOST", 99)
    layout = drawn(panel.RISORIUS_PT_head, bpy.context)
    assert measured.local("the middle of the left upper lid") in " ".join(texts(layout))
    assert layout.cut(SIDEBAR) == []
    kind = ui("anyhead.operators").RISORIUS_OT_make_rig_from_head
    options = {"template": "FILE", "template_file": ""}
    assert Operator(kind, **options).draw(bpy.context).cut(FILE_BROWSER) == []


def test_eight_levels_of_detail_have_two_rows_that_can_be_told_apart(rig, monkeypatch, language):
    panels = ui("face.panel")
    monkeypatch.setattr(panels.lods, "built", lambda _rig: list(range(8)))
    layout = drawn(panels.RISORIUS_PT_options, bpy.context)
    assert layout.cut(SIDEBAR) == []
    words = texts(layout)
    assert words.count("7") == 2
    assert set(map(measured.local, ("Detail in the Viewport", "Detail in Renders"))) <= set(words)


def test_the_names_of_all_sliders_can_be_read(rig):
    """No name of the 260 sliders of the standard face is cut off in one column of the sidebar."""
    face = {name: 0.0 for name in STANDARD.read_text().split()}
    layout, names = Part(), list(face)
    words = scene.submodule("logic.character.slider_words")
    regions = scene.submodule("native").regions()
    for region, shown in words.group_controls(names, regions).items():
        listed = [names[index] for index in shown]
        ui("face.controls_panel").draw_sliders(bpy.context, layout, face, region, listed, {}, {})
    assert layout.cut(SIDEBAR) == []
    words = texts(layout)
    assert {"Upper Lip Towards Teeth", "Lower Lip Depress", "Dimple"} <= set(words)


def test_all_sections_are_seen_at_once_on_a_laptop(rig, monkeypatch):
    """The headers of all panels fit into the tab of a new window on a screen of 1366 x 768 pixels.

    The tab is 688 - 84 = 604 pixels high there.
    """
    face, panel = scene.face(rig), ui("face.controls_panel")
    labels = [*STANDARD.read_text().split(), "spine_04.qx"]
    for name in labels:
        face[name] = 0.0
    monkeypatch.setattr(
        panel.runtime, "of", lambda _rig: SimpleNamespace(labels=labels, handles=[])
    )
    monkeypatch.setattr(measured.Part, "everything_open", False)
    panels = [getattr(bpy.types, n) for n in dir(bpy.types) if n.startswith("RISORIUS_PT_")]
    tabs = [kind for kind in panels if not getattr(kind, "bl_parent_id", "")]
    tabs = [kind for kind in tabs if "INSTANCED" not in getattr(kind, "bl_options", ())]
    tabs = [kind for kind in tabs if not hasattr(kind, "poll") or kind.poll(bpy.context)]
    closed = [k for k in tabs if "DEFAULT_CLOSED" in getattr(k, "bl_options", ())]
    opened = {k.bl_idname for k in tabs} - {k.bl_idname for k in closed}
    assert opened == {"RISORIUS_PT_character", "RISORIUS_PT_controls"}
    assert len(tabs) == 8
    layout = drawn(panel.RISORIUS_PT_controls, bpy.context)
    assert sum(part.is_header for part in layout.children) == 11  # regions
    height = len(tabs) * measured.HEADER + measured._LINE + layout.height() + 2 * measured.EDGES
    assert height <= 688 - 84


def test_a_slider_whose_name_is_short_has_one_line():
    face = dict.fromkeys(("CTRL_expressions.jawOpen", "CTRL_expressions.jawChinRaiseDL"), 0.0)
    layout = Part()
    ui("face.controls_panel").draw_sliders(bpy.context, layout, face, "jaw", list(face), {}, {})
    (column,) = layout.children
    assert [part.kind for part in column.children] == ["split", "split"]


def test_layers_and_reactions_can_be_read(rig, language):
    panel, controls = ui("layers.panel"), scene.controls(rig)
    props = scene.submodule("scene.animation.layer_properties")
    for kind in ("IDLE", "EXPRESSION"):
        known = next(iter(scene.submodule("scene.expressions.assets").all_expressions()))
        bpy.ops.risorius.layer_add(kind=kind, source=known if kind == "EXPRESSION" else "")
        layer = controls.risorius_layers[-1]
        layout = Part()
        panel._draw_layer(layout, controls, layer)
        assert layout.cut(SIDEBAR) == []
    assert measured.local("0: without an end") in texts(layout)
    for name, reaction in scene.submodule("scene.animation.layers").known_reactions().items():
        layout = Part()
        item = SimpleNamespace(name=name, bl_rna=props.RISORIUS_PG_reaction.bl_rna)
        ui("layers.lists").RISORIUS_UL_reactions.draw_item(
            None, None, layout, None, item, 0, None, ""
        )
        assert measured.local(reaction.label) in texts(layout)
        assert layout.cut(SIDEBAR - 36) == []  # next to the button, inside the list's frame


@pytest.mark.parametrize("choices", [{}, {"mapping": "FILE", "use_neutral": True}])
def test_the_import_of_animation_can_be_read(rig, choices, language):
    layout = Operator(ui("animation.operators").RISORIUS_OT_import_animation, **choices).draw(None)
    assert layout.cut(FILE_BROWSER) == []
    said = ("0: as the file says", "as *jawOpen=1.3 *Blink*=1.1", "0: none")
    assert set(map(measured.local, said)) <= set(texts(layout))


def test_the_import_of_a_face_can_be_read(language):
    layout = Operator(ui("file.import_operators").RISORIUS_OT_import_dna).draw(None)
    assert layout.cut(FILE_BROWSER) == []
    assert measured.local("Levels of Detail") in texts(layout)


def test_speech_can_be_read(rig, language):
    layout = Operator(ui("speech.operators").RISORIUS_OT_speak).draw(None)
    assert layout.cut(FILE_BROWSER) == []
    assert measured.local("Empty: it is listened for") in texts(layout)


@pytest.mark.parametrize("choice", ["GLTF", "FBX", "USD", "ALEMBIC", "RZC", "CSV"])
@pytest.mark.parametrize("frames", ["SCENE", "CUSTOM"])
def test_the_export_of_animation_can_be_read(rig, choice, frames, language):
    kind = ui("export.operators").RISORIUS_OT_export_animation
    layout = Operator(kind, format=choice, range=frames).draw(None)
    assert layout.cut(FILE_BROWSER) == []
    if choice not in ("RZC", "CSV"):
        assert measured.local("-1: as in the viewport") in texts(layout)
    assert (measured.local("0: all joints") in texts(layout)) == (choice == "GLTF")


def test_dialogs_can_be_read(rig, language):
    layout = Operator(ui("bake.operators").RISORIUS_OT_bake).draw(None)
    assert layout.cut(DIALOG) == []
    said = ("-1: as in the viewport", "0: a key at every step")
    assert set(map(measured.local, said)) <= set(texts(layout))
    kind = ui("animation.operators").RISORIUS_OT_import_arkit_rig
    assert Operator(kind, source="").draw(bpy.context).cut(DIALOG) == []


def test_a_value_that_was_chosen_needs_no_words(rig):
    layout = Operator(ui("bake.operators").RISORIUS_OT_bake, lod=2, error=0.1).draw(None)
    assert not any(text.startswith(("-1:", "0:")) for text in texts(layout))


def test_words_are_measured_for_the_width_that_the_sidebar_has():
    words = ui("words")
    long = "Upper Lip Towards Teeth"
    context = SimpleNamespace(preferences=bpy.context.preferences, region=None)
    assert not words.Ruler(context, 0.5).fits(long)
    points = bpy.context.preferences.ui_styles[0].widget.points
    assert words.width_of(long, points) == measured.width_of(long)
    context.region = SimpleNamespace(type="UI", width=500)
    assert words.Ruler(context, 0.5).fits(long)


def test_words_are_measured_once(rig, monkeypatch):
    """The width of each text is measured only once, although the panel is drawn twice.

    Each redraw of the sidebar draws up to 260 sliders, so measuring again would be slow.
    """
    words, asked = ui("words"), []
    real = words.blf.dimensions
    fake = SimpleNamespace(size=words.blf.size, dimensions=lambda *a: asked.append(a) or real(*a))
    monkeypatch.setattr(words, "blf", fake)
    words.width_of.cache_clear()
    for _ in range(2):
        drawn(ui("face.controls_panel").RISORIUS_PT_controls, bpy.context)
    names = [text for _font, text in asked]
    assert names
    assert len(names) == len(set(names))


def test_menus_offer_every_expression_and_the_actions_that_fit(rig):
    scene.face(rig).keyframe_insert('["CTRL_expressions.jawOpen"]', frame=1)
    scene.controls(rig).animation_data.action.name = "Speaks"
    bpy.data.actions.new("Walks")
    menus, expressions = ui("layers.menus"), ui("expressions.menus")
    assert texts(drawn(menus.RISORIUS_MT_actions, bpy.context)) == ["Speaks"]
    known = scene.submodule("scene.expressions.assets").all_expressions().values()
    shown = []
    for kind in menus._ADD:
        group = kind.bl_idname.rpartition("_")[2]
        labels = [e.label for e in known if e.group == group]
        assert texts(drawn(kind, bpy.context)) == labels != []
        assert texts(drawn(getattr(bpy.types, f"RISORIUS_MT_set_{group}"), bpy.context)) == labels
        shown.append(kind.bl_label)
    assert texts(drawn(expressions.RISORIUS_MT_expressions, bpy.context))[:-3] == shown
    add = texts(drawn(menus.RISORIUS_MT_layer_add, bpy.context))
    assert add == ["From Active Action", "Action", "Idle Life", *shown]
    fire = texts(drawn(menus.RISORIUS_MT_fire, bpy.context))
    assert "Flash" in " ".join(fire)
    assert "Clear Warp Points" in texts(drawn(menus.RISORIUS_MT_layer_more, bpy.context))
