# SPDX-License-Identifier: MIT
"""Tests the command `risorius web`: contents of the page, and refusals.

packaging/ship/web.sh --check tests the page in a browser.
"""

import base64
import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius import Clip
from risorius.cli import main
from risorius.controls.regions import TITLES
from risorius.files.png import png
from risorius.web import kinds
from risorius.web import page as pages

MEDIUM = GOLDEN / "medium.dna"
EMPTY = (
    "<html><head><title>Risorius</title></head><body>\n<!--FACE-->\n"
    '<script type="application/octet-stream" id="viewer">dmlld2Vy</script>\n<i>the viewer</i>'
    "<script>/*BOOT*/\nboot();</script></body>"
)
LISTS = (
    "positions", "uv", "source", "sides", "corners", "influences", "joints", "weights", "normals",
    "moved", "vertices", "deltas",
)  # fmt: skip
ELEMENT = re.compile(r'<script type="[^"]*" id="([^"]*)">(.*?)</script>', re.S)


@pytest.fixture(autouse=True)
def _empty_page(monkeypatch):
    monkeypatch.setattr(pages, "empty_page", lambda: EMPTY)
    monkeypatch.setattr("risorius.cli.pages.web.empty_page", lambda: EMPTY)


def parts(page):
    """The JSON element face-table of a page, and name -> unpacked bytes of its other elements."""
    found = {}
    for name, text in ELEMENT.findall(page.decode()):
        found[name] = text
    del found["viewer"]
    table = json.loads(found.pop("face-table"))
    return table, {name: gzip.decompress(base64.b64decode(text)) for name, text in found.items()}


def unpacked(table, data):
    """The meshes of a page with their arrays, decoded as native/web/geometry.js decodes them.

    Args:
        table: the page's element face-table.
        data: the bytes of all arrays.
    """
    meshes, at = [], 0
    for about in table["meshes"]:
        own = dict(about)
        for name in LISTS:
            if name not in about:
                continue
            *step, count, width, stride = about[name]
            planes = np.frombuffer(data, np.uint8, count * width, at).reshape(width, count)
            at += count * width
            even = sum(planes[i].astype(np.int64) << 8 * i for i in range(width))
            whole = (even >> 1) ^ -(even & 1)
            if stride:
                rows = np.concatenate([whole, np.zeros(-count % stride, np.int64)])
                whole = np.cumsum(rows.reshape(-1, stride), axis=0).ravel()[:count]
            own[name] = whole * (step[0] if step else 1)
        meshes.append(own)
    assert at == len(data)
    return meshes


def same_mesh(own, mesh, size):
    """Check that a mesh of the page equals the DNA file's, within the page's quantisation.

    The order of joints and weights may differ.
    """
    positions = own["positions"].reshape(3, -1).T
    np.testing.assert_allclose(positions, mesh.positions, atol=size * 2**-17)
    corners = own["source"][own["corners"]]
    np.testing.assert_array_equal(corners, mesh.layout_positions[mesh.face_layouts])
    uv = own["uv"].reshape(2, -1).T[own["corners"]]
    wanted = mesh.texture_coordinates[mesh.layout_texture_coordinates[mesh.face_layouts]]
    np.testing.assert_allclose(uv, wanted, atol=2**-13)
    np.testing.assert_array_equal(own["influences"], np.diff(mesh.skin_offsets))
    assert sorted(own["joints"]) == sorted(mesh.skin_joint_indices)
    np.testing.assert_allclose(
        np.sort(own["weights"] / 1024), np.sort(mesh.skin_weights), atol=2**-10
    )
    targets = [t for t in mesh.blend_shape_targets if len(t.deltas)]
    assert own["shapes"] == [t.blend_shape_channel_index for t in targets]
    if not targets:
        return
    deltas, ends = own["deltas"].reshape(3, -1).T, np.cumsum(own["moved"])
    for target, begin, end in zip(targets, [0, *ends], ends, strict=False):
        moved = np.zeros_like(mesh.positions)
        moved[np.cumsum(own["vertices"][begin:end])] = deltas[begin:end]
        wanted = np.zeros_like(moved)
        wanted[target.vertex_indices] = target.deltas
        np.testing.assert_allclose(moved, wanted, atol=size * 2**-14)


def test_the_page_holds_the_face_and_each_raw_control_once(tmp_path, capsys):
    out = tmp_path / "page.html"
    assert main(["web", str(MEDIUM), "-o", str(out), "--title", "</script><b>"]) == 0
    assert capsys.readouterr().out.startswith(str(out))
    page = out.read_bytes()
    table, inside = parts(page)
    dna = risorius.load(MEDIUM)
    # The page contains the DNA file without meshes, and the meshes separately in fewer bytes.
    rig_alone = risorius.load(MEDIUM, layers=pages.RIG)
    assert risorius.load(inside["face"]).to_json() == rig_alone.to_json()
    packed = unpacked(table, inside["geometry"])
    assert [mesh["index"] for mesh in packed] == [
        i for i, m in enumerate(dna.meshes) if len(m.positions)
    ]
    for own in packed:
        same_mesh(own, dna.meshes[own["index"]], max(np.ptp(m.positions) for m in dna.meshes))
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


def painted(folder):
    """Write a face with textures: skin, eye, hair with opacity, wrinkle map, mask, bad names."""
    dna = risorius.load(MEDIUM)
    head, eye, hair = (f"{part}_lod0_mesh" for part in ("head", "eyeLeft", "hair"))
    dna.mesh_names = [head, eye, hair, *(f"other{i}" for i in range(3, len(dna.mesh_names)))]
    maps = list(dna.animated_map_names)
    maps[1] = "head_wm2_normal_head_wm2_smile_L"
    dna.animated_map_names = maps
    textures = folder / "face_textures"
    textures.mkdir(parents=True)
    shades = np.random.default_rng(3).uniform(size=(64, 64, 4))
    soft = {"skin": shades[..., :3], "hair": shades, "flat": np.ones((64, 64, 3)) * (0.5, 0.5, 1)}
    soft["head_wm2_smile_L_msk"] = shades[:, :, 0]
    for name, image in soft.items():
        (textures / f"{name}.png").write_bytes(png(image))
    (folder / "text.png").write_bytes(b"no picture")
    (folder.parent / "secret.png").write_bytes(png(np.zeros((2, 2))))
    dna.metadata = {
        f"texture:{head}:color": "skin.png",
        f"texture:{eye}:color": "skin.png",
        f"texture:{hair}:color": "hair.png",
        f"texture:{head}:normal:2": "flat.png",
        f"texture:{head}:roughness": "../secret.png",
        f"texture:{dna.mesh_names[3]}:color": str(folder.parent / "secret.png"),
        f"texture:{dna.mesh_names[4]}:color": "text.png",
        f"texture:{dna.mesh_names[5]}:color": "gone.png",
    }
    dna.save(folder / "face.dna")
    return dna


def test_each_picture_stands_once_in_the_page_as_a_small_jpeg(tmp_path):
    dna = painted(tmp_path / "home")
    out = tmp_path / "page.html"
    assert main(["web", str(tmp_path / "home" / "face.dna"), "-o", str(out)]) == 0
    table, inside = parts(out.read_bytes())
    of = {dna.mesh_names[m["index"]]: table["materials"][m["material"]] for m in table["meshes"]}
    skin, eye, hair = (of.get(name, {}) for name in dna.mesh_names[:3])
    assert [skin["kind"], eye["kind"], hair["kind"]] == ["skin", "eyes", "hair"]
    assert skin["color"] == eye["color"]
    assert "alpha" in hair
    assert "roughness" not in skin
    assert skin["wrinkles"]["maps"] == [[1, 0, 1]]
    assert list(skin["wrinkles"]["sets"]) == ["2"]
    assert all("color" not in of[name] for name in dna.mesh_names[3:] if name in of)
    data, at = inside["pictures"], 0
    for media, size in table["pictures"]:
        assert media == "image/jpeg"
        assert data[at : at + 2] == b"\xff\xd8"
        assert data[at + size - 2 : at + size] == b"\xff\xd9"
        at += size
    assert at == len(data)
    assert len(table["pictures"]) == 5  # skin, hair, its opacity, wrinkles, their masks


def test_without_pictures_a_mesh_has_the_kind_that_its_name_tells():
    names = {
        "head_lod0_mesh": "skin", "Wolf3D_Teeth": "teeth", "EyeLeft": "eyes", "Hair001": "hair",
        "eyelashes_lod2_mesh": "lashes", "cornea_lod0_mesh": "wet", "saliva": "wet",
        "Wolf3D_Outfit_Top": "cloth", "tongue": "tongue", "cartilage_lod0_mesh": "gum",
        "beard": "hair", "Mesh_12": "skin",
    }  # fmt: skip
    assert {name: kinds.kind_of(name) for name in names} == names


def test_a_script_shows_the_face_on_a_page_of_the_users_own(tmp_path):
    out = tmp_path / "sample.js"
    assert main(["web", str(MEDIUM), "-o", str(out)]) == 0
    text = out.read_text(encoding="ascii")
    assert text.rstrip().endswith("boot();")
    face = json.loads(re.search(r'\["sample"\] = (.*)\);$', text, re.M)[1])
    assert face["files"]["viewer"] == "dmlld2Vy"
    data = gzip.decompress(base64.b64decode(face["files"]["geometry"]))
    assert len(unpacked(face["table"], data)) == len(face["table"]["meshes"])


def test_a_take_of_arkit_finds_the_controls_of_the_face(tmp_path):
    out = tmp_path / "page.html"
    assert main(["web", str(MEDIUM), "-o", str(out)]) == 0
    captures = parts(out.read_bytes())[0]["captures"]
    names = risorius.load(MEDIUM).raw_control_names
    assert captures["rows"]["HeadYaw"] == [["head.yaw", -1.0]]
    used = [place for row in captures["rows"].values() for place, _ in row]
    assert all(place in range(len(names)) or "." in place for place in used)


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["-o", "page.txt"], 2, "-o: a name ending in .html, .htm or .js was expected"),
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
