# SPDX-License-Identifier: MIT
"""The command `risorius web`: what it puts into the page, and how it says no.

That a browser shows it is tried by packaging/ship/web.sh --check."""

import base64
import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius import Clip, web
from risorius.cli import main
from risorius.controls.regions import TITLES
from risorius.files.png import png
from risorius.web import page as pages

MEDIUM = GOLDEN / "medium.dna"
EMPTY = "<html><head><title>Risorius</title></head><body>\n<!--FACE-->\n<i>the viewer</i></body>"
ELEMENT = re.compile(
    r'<script type="([^"]*)"(?: data-packed="(gzip)")? id="([^"]*)">(.*?)</script>', re.S
)


@pytest.fixture(autouse=True)
def _empty_page(monkeypatch):
    monkeypatch.setattr(pages, "empty_page", lambda: EMPTY)
    monkeypatch.setattr("risorius.cli.pages.web.empty_page", lambda: EMPTY)


def parts(page):
    """What stands in a page: the table, and the bytes of its elements by name."""
    found = {}
    for _, packed, name, text in ELEMENT.findall(page.decode()):
        data = gzip.decompress(base64.b64decode(text)) if packed else text
        found[name] = data
    return json.loads(found.pop("face-table")), found


def test_the_page_holds_the_face_and_each_raw_control_once(tmp_path, capsys):
    out = tmp_path / "page.html"
    assert main(["web", str(MEDIUM), "-o", str(out), "--title", "</script><b>"]) == 0
    assert capsys.readouterr().out.startswith(str(out))
    page = out.read_bytes()
    table, inside = parts(page)
    dna = risorius.load(MEDIUM)
    assert risorius.load(inside["face"]).to_json() == dna.to_json()
    indices = sorted(i for region in table["regions"] for i in region["controls"])
    assert indices == list(range(len(dna.raw_control_names)))
    assert {region["title"] for region in table["regions"]} <= set(TITLES.values())
    assert table["title"] == "</script><b>"
    assert b"</script><b>" not in page
    assert table["clip"] is None
    assert b"<i>the viewer</i>" in page
    assert b"<!--FACE-->" not in page


def test_a_filtered_page_has_the_levels_that_were_asked_for(tmp_path):
    out = tmp_path / "page.html"
    assert main(["web", str(MEDIUM), "-o", str(out), "--lods", "1:2"]) == 0
    _, inside = parts(out.read_bytes())
    wanted = risorius.load(MEDIUM, lods=(1, 2))
    assert risorius.load(inside["face"]).mesh_names == wanted.mesh_names


def test_a_clip_and_its_sound_come_along(tmp_path):
    names = risorius.load(MEDIUM).raw_control_names
    curves = np.array([np.linspace(0, 1, 7), np.linspace(1, 0, 7), [np.nan] * 7], np.float32)
    Clip([names[5], names[2], "gone"], curves, 24.0).save(tmp_path / "take.rzc")
    (tmp_path / "voice.wav").write_bytes(b"RIFFxxxx")
    out = tmp_path / "page.html"
    command = ["web", str(MEDIUM), "-o", str(out), "--clip", str(tmp_path / "take.rzc")]
    assert main([*command, "--sound", str(tmp_path / "voice.wav")]) == 0
    table, inside = parts(out.read_bytes())
    clip = table["clip"]
    assert (clip["rate"], clip["frames"], clip["controls"]) == (24.0, 7, [5, 2])
    values = np.frombuffer(inside["clip"], "<f4").reshape(7, 2)
    np.testing.assert_array_equal(values, curves[:2].T)
    kind, data = clip["sound"]["url"].split(",")
    assert (kind, base64.b64decode(data)) == ("data:audio/wav;base64", b"RIFFxxxx")
    assert clip["sound"]["offset"] == 0


def test_pictures_are_those_beside_the_file_and_no_other(tmp_path):
    dna = risorius.load(MEDIUM)
    mesh = dna.mesh_names[0]
    secret = tmp_path / "secret.png"
    secret.write_bytes(png(np.zeros((2, 2))))
    home = tmp_path / "home"
    (home / "face_textures").mkdir(parents=True)
    (home / "face_textures" / "skin.png").write_bytes(png(np.ones((2, 2, 3))))
    (home / "text.png").write_bytes(b"no picture")
    dna.metadata = {
        f"texture:{mesh}:color": "skin.png",
        f"texture:{mesh}:alpha": "../secret.png",
        "texture:other:color": str(secret),
        "texture:third:color": "text.png",
        "texture:fourth:color": "gone.png",
        f"texture:{mesh}:map:flush": "skin.png",
    }
    found = web.find_pictures(dna, home / "face.dna")
    assert list(found) == [mesh]
    assert list(found[mesh]) == ["color"]
    kind, data = found[mesh]["color"].split(",")
    assert kind == "data:image/png;base64"
    assert base64.b64decode(data) == (home / "face_textures" / "skin.png").read_bytes()


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["-o", "page.txt"], 2, "-o: a name ending in .html or .htm was expected"),
        (["-o", "no/page.html"], 1, f"{Path('no/page.html')}: cannot write it"),
        (["--sound", "voice.wav"], 2, "--sound: it goes with a clip"),
        (["--clip", "take.rzc", "--sound", "voice.flac"], 2, "--sound: a name ending in .wav"),
        (["--lods", "fine"], 2, "--lods: two levels as in 0:2 were expected"),
        (["--lods", "40"], 1, "none of the LODs asked for"),
        (["--clip", "gone.rzc"], 1, "gone.rzc"),
        (["--clip", "other.rzc"], 1, "the clip moves no raw control of this face"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(tmp_path, monkeypatch, capsys, options, code, said):
    monkeypatch.chdir(tmp_path)
    Clip(["elsewhere"], np.zeros((1, 3), np.float32), 30.0).save("other.rzc")
    out = [] if "-o" in options else ["-o", "page.html"]
    assert main(["web", str(MEDIUM), *out, *options]) == code
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert not (tmp_path / "page.html").exists()


def test_a_face_without_meshes_is_refused(tmp_path, capsys):
    bare = tmp_path / "bare.dna"
    risorius.load(MEDIUM, layers="behavior").save(bare)
    assert main(["web", str(bare)]) == 1
    assert "no meshes" in capsys.readouterr().err


def test_a_build_without_the_page_says_so_before_it_reads(monkeypatch, capsys):
    monkeypatch.undo()
    monkeypatch.setattr(pages, "_EMPTY", "not_there.html")
    assert main(["web", "gone.dna", "-o", "page.html"]) == 1
    said = capsys.readouterr().err
    assert "packaging/ship/web.sh makes it" in said
    assert said.count("\n") == 1
