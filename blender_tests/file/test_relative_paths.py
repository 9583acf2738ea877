# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths that begin with `//`, for each operator that opens or writes a file."""

import bpy
import numpy as np
import pytest
import risorius
from support import scene
from support.plain_head import Onto

JAW = "CTRL_expressions.jawOpen"
RANGE = f"""format = "risorius range 1"
[controls]
"{JAW}" = {{ neutral = 0.1, extreme = 0.9 }}
"""
MARKS = """{"format": "risorius landmarks", "version": 1,
"landmarks": {"chin": {"how": "found", "point": [0, -9, 8]}}}"""


def _library(folder, name):
    """Make a folder with one expression file for the expression `name`."""
    folder.mkdir()
    expression = risorius.expressions.Expression(name, name, "own", "", {JAW: 0.5}, ())
    text = risorius.expressions.text_of(expression)
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")


OF_HEADS = (
    *("make_rig", "load_shape_key_names", "save_shape_key_names", "make_rig_from_head"),
    *("conform_face", "save_landmarks", "load_landmarks"),
)


def _calls(folder):
    """Write the files that the operators read, and list the calls of the operators.

    Returns:
        Operator -> list of (arguments with `//` paths, file that the call must write in `folder`,
        or "" if it writes none). For `speak`, the value is only the arguments.
    """
    risorius.Clip([JAW], [[0.0, 0.5]], 24.0).save(folder / "take.rzc")
    opened = 0.8 * (np.arange(240) % 60 < 20)
    risorius.Clip([JAW], [opened], 60.0).save(folder / "opens.rzc")
    (folder / "given.toml").write_text(RANGE, encoding="utf-8")
    (folder / "names.toml").write_text('[controls]\njawOpen = "jawOpen"', encoding="utf-8")
    _library(folder / "bad", "grin")
    (folder / "marks.json").write_text(MARKS, encoding="utf-8")
    one = {"filepath": "//small.dna"}
    many = {"directory": "//", "files": [{"name": "small.dna"}]}
    on_head = {"filepath": "//on_head.dna", "template": "FILE", "template_file": "//small.dna"}
    on_head |= {"joints": 2, "levels": 1}
    csv = {"filepath": "//out.csv", "format": "CSV", "range": "CUSTOM", "start": 1, "end": 2}
    return {
        "replace_dna": [(one, "")],
        "export_dna": [({"filepath": "//out.dna"}, "out.dna")],
        "export_animation": [(csv, "out.csv")],
        "import_animation": [({"filepath": "//take.rzc"}, "")],
        "export_expressions": [({"directory": "//given"}, "given/mine.toml")],
        "import_expressions": [({"directory": "//bad"}, "library/grin.toml")],
        "mix_add": [(one, ""), (many, "")],
        "mix_write": [({"filepath": "//mix.dna", "use_import": False}, "mix.dna")],
        "export_web": [({"filepath": "//page.html", "use_animation": False}, "page.html")],
        "export_game_face": [({"filepath": "//game.glb", "lod": 0}, "game.glb")],
        "import_dna": [(one, ""), (many, "")],
        "make_rig": [({"filepath": "//rig.dna", "joints": 2, "levels": 1}, "rig.dna")],
        "make_rig_from_head": [(on_head, "on_head.dna")],
        "conform_face": [({"filepath": "//conformed.dna"}, "conformed.dna")],
        "load_landmarks": [({"filepath": "//marks.json"}, "")],
        "save_landmarks": [({"filepath": "//kept.json"}, "kept.json")],
        "learn_range": [({"filepath": "//opens.rzc"}, "")],
        "load_range": [({"filepath": "//given.toml"}, "")],
        "save_range": [({"filepath": "//saved.toml"}, "saved.toml")],
        "load_shape_key_names": [({"filepath": "//names.toml"}, "")],
        "save_shape_key_names": [({"filepath": "//kept.toml"}, "kept.toml")],
        "save_curve_mapping": [({"filepath": "//map.toml", "use_import": False}, "map.toml")],
        "speak": {"filepath": "//voice.wav"},
    }


def _head():
    """Add a mesh with a shape key from which a rig can be made."""
    mesh = bpy.data.meshes.new("Head")
    places = [(x, y, z) for x in (-0.1, 0.1) for y in (0, 0.1) for z in (0, 0.1, 0.2)]
    mesh.from_pydata(places, [], [(0, 1, 4, 3), (1, 2, 5, 4), (6, 7, 10, 9), (7, 8, 11, 10)])
    mesh.uv_layers.new(name="UVMap")
    item = bpy.data.objects.new("Head", mesh)
    bpy.context.scene.collection.objects.link(item)
    item.shape_key_add(name="Basis")
    item.shape_key_add(name="jawOpen").data[0].co.z -= 0.05
    return item


def _deaf(monkeypatch):
    """Replace the speech recogniser by one that fails.

    Returns a list that receives the path of each sound file that the recogniser should read.
    """
    heard = []

    class Task:
        result, error = None, scene.submodule("logic.base.errors").FaceError("nobody speaks")

        def __init__(self, path, *_given, **_named):
            heard.append(path)

        def run(self):
            pass

    speech = scene.submodule("scene.animation.speech_task")
    monkeypatch.setattr(speech, "has_recogniser", lambda: True)
    monkeypatch.setattr(speech, "SpeechTask", Task)
    return heard


def test_two_slashes_begin_at_the_blend_in_every_operator(dna_file, tmp_path, monkeypatch):
    folder = tmp_path / "file"
    folder.mkdir()
    _library(folder / "library", "mine")
    dna_file.rename(folder / "small.dna")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
    rig = scene.load("//small.dna")
    addon = bpy.context.preferences.addons.get(scene.MODULE) or bpy.context.preferences.addons.new()
    addon.module = scene.MODULE
    addon.preferences.expression_library = str(folder / "library")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    table, run, paths = _calls(folder), bpy.ops.risorius, {"filepath", "directory"}
    assert set(table) == {
        name for name in dir(run) if paths & {*getattr(run, name).get_rna_type().properties.keys()}
    }
    monkeypatch.setattr(scene.submodule("scene.export.web_page"), "page", lambda *_given: b"a page")
    heard = _deaf(monkeypatch)
    Onto(monkeypatch)
    curves = scene.submodule("scene.shape_keys.unknown_curves")
    curves.keep(scene.controls(rig), curves.Unknown("arkit", {}, ["Key 1"]))
    bpy.context.view_layer.objects.active = scene.controls(rig)
    with pytest.raises(RuntimeError, match=r"voice.wav: nobody speaks"):
        run.speak(**table.pop("speak"))
    assert heard == [str(folder / "voice.wav")]
    for name, calls in table.items():
        for given, made in calls:
            bpy.context.view_layer.objects.active = (
                _head() if name in OF_HEADS else scene.controls(rig)
            )
            if name == "save_landmarks":
                run.place_landmark(landmark="chin")
            if name == "mix_add" and len(bpy.context.window_manager.risorius_mix.parents):
                run.mix_remove(index=0)
            assert getattr(run, name)(**given) == {"FINISHED"}, name
            assert (folder / made).exists(), name
    run.mix_remove(index=0)
    assert list((tmp_path / "elsewhere").iterdir()) == []
