# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that Export Web Page writes the face with edits, animation and sound, or an error."""

import base64
import gzip
import json
import re
import wave

import bpy
import numpy as np
import pytest
import risorius
from risorius.web import page as pages
from support import scene
from support.animation import animate

EMPTY = "<title>Risorius</title><!--FACE-->"  # replaces the real page, which is tested in a browser
ELEMENT = re.compile(r'id="([^"]*)">([^<]*)</script>')


def _export(path, **options):
    settings = {"range": "CUSTOM", "start": 3, "end": 9, **options}
    return bpy.ops.risorius.export_web(filepath=str(path), **settings)


def _inside(path):
    found = dict(ELEMENT.findall(path.read_text(encoding="utf-8")))
    table = json.loads(found.pop("face-table"))
    return table, {k: gzip.decompress(base64.b64decode(v)) for k, v in found.items()}


@pytest.fixture
def sound(tmp_path):
    path = tmp_path / "voice.wav"
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, 16000, 0, "NONE", ""))
        file.writeframes(b"\x86\x00" * 16000)
    return path


def test_the_page_holds_what_the_face_does_and_says(dna_file, tmp_path, sound, monkeypatch):
    monkeypatch.setattr(pages, "empty_page", lambda: EMPTY)
    rig = scene.load(dna_file)
    animate(rig)
    stage = bpy.context.scene
    stage.render.fps = 24
    path = tmp_path / "face.html"
    strips = scene.submodule("scene.base.compat").strips_of(stage)
    # A Blender without audio support cannot add a sound strip. Then the exported page has no sound.
    heard = bpy.app.build_options.audaspace
    if heard:
        strips.new_sound("voice", str(sound), 1, 5)
    assert _export(path) == {"FINISHED"}
    table, inside = _inside(path)
    dna = risorius.load(dna_file)
    rig_alone = risorius.load(dna_file, layers=pages.RIG)
    assert risorius.load(inside["face"]).to_json() == rig_alone.to_json()
    shown = [i for i, mesh in enumerate(dna.meshes) if len(mesh.positions)]
    assert [mesh["index"] for mesh in table["meshes"]] == shown
    clip = table["clip"]
    assert (clip["rate"], clip["frames"]) == (24, 7)
    values = np.frombuffer(inside["clip"], "<f4").reshape(7, -1)
    jaw = clip["controls"].index(dna.raw_control_names.index("CTRL_expressions.jawOpen"))
    for row, frame in zip(values, range(3, 10), strict=True):
        stage.frame_set(frame)
        raw = scene.raw_of(rig, dna_file)
        assert row[jaw] == raw[clip["controls"][jaw]]
    assert np.ptp(values[:, jaw]) > 0.3
    if heard:
        assert clip["sound"]["offset"] == pytest.approx(2 / 24)
        data = base64.b64decode(clip["sound"]["url"].partition(",")[2])
        assert data == sound.read_bytes()
    else:
        assert clip["sound"] is None
    assert _export(path, use_animation=False) == {"FINISHED"}
    assert _inside(path)[0]["clip"] is None


def test_without_the_page_or_a_folder_it_is_one_sentence(dna_file, tmp_path, monkeypatch):
    scene.load(dna_file)
    monkeypatch.setattr(pages, "_EMPTY", "not_there.html")
    with pytest.raises(
        RuntimeError, match=r"^Error: [^\n]*packaging/ship/web\.sh makes it[^\n]*\n?$"
    ):
        _export(tmp_path / "face.html", use_animation=False)
    monkeypatch.setattr(pages, "empty_page", lambda: EMPTY)
    with pytest.raises(RuntimeError, match=r"^Error: [^\n]+\n?$"):
        _export(tmp_path / "none" / "face.html", use_animation=False)
    assert list(tmp_path.glob("*.html")) == []
