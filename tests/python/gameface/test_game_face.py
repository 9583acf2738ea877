# SPDX-License-Identifier: MIT
"""Tests `risorius export`: the exported file moves like the rig, and limits are reported.

gltf_oracle.py reads the file and dna_bytes.py evaluates the rig; neither shares code with the
exporter. packaging/ship/gameface.sh tests exported files in three.js and with gltf-validator.
"""

import json
import re

import dna_bytes
import gameface_take
import numpy as np
import pytest
import risorius
from conftest import GOLDEN, PROJECT, no_room
from gltf_oracle import GlbFile
from risorius import importing
from risorius.cli import main
from risorius.controls import arkit
from risorius.files.jpeg import jpeg
from risorius.files.png import png
from risorius.gameface import Wishes, export, faces
from risorius.gameface.combining import weight_of
from risorius.gameface.refining import pose_of
from risorius.gameface.targets import find_targets

UNITS = list(arkit.mapping())
HEAD, TEETH = "head_lod0_mesh", "teeth_lod0_mesh"
LISTS = {
    "plain": [],
    "sparse": ["--sparse", "--no-skeleton"],
    "quantized": ["--quantize", "--normals"],
    "bare": ["--quantize", "--sparse", "--no-skeleton"],
    "packed": ["--quantize", "--meshopt"],
    "floats": ["--meshopt"],
}
TAKE = PROJECT.parent / "shared" / "data" / "real" / "livelink" / "rom_134s.csv"
SAMPLE = PROJECT / "build" / "sample" / "man.dna"


def controls():
    """Names of the 69 raw controls that ARKit's shapes use."""
    return list(dict.fromkeys(c for row in arkit.mapping().values() for c in row))


@pytest.fixture(scope="module")
def face(tmp_path_factory):
    """The path of a face with most of the controls that ARKit's shapes use; some are missing."""
    dna = risorius.load(GOLDEN / "medium.dna")
    count = len(dna.raw_control_names)
    dna.raw_control_names = controls()[:count]
    meshes, apart = list(dna.meshes), np.random.default_rng(3)
    for mesh in meshes:  # each vertex has its own place, so that a place identifies the vertex
        mesh.positions = mesh.positions + apart.uniform(-0.05, 0.05, mesh.positions.shape)
    dna.meshes = meshes
    path = tmp_path_factory.mktemp("face") / "anna.dna"
    dna.save(path)
    return path


def poses(face):
    """Yields (target name, raw controls of its pose, raw controls of the pose it starts from).

    mouthClose starts from the open jaw, all others from the neutral pose.
    """
    there = set(risorius.load(face).raw_control_names)
    for name, row in arkit.mapping().items():
        raw = {control: value for control, value in row.items() if control in there}
        base = {"CTRL_expressions.jawOpen": 1.0} if name == "mouthClose" else {}
        if raw:
            yield name, {**base, **raw}, base


def made(face, tmp_path, *more):
    out = tmp_path / "face.glb"
    assert main(["export", str(face), "-o", str(out), "--shapes", "arkit", *more]) == 0
    return GlbFile(out.read_bytes())


def places(face):
    """The face as read by dna_bytes.py, which evaluates it, and its vertices at rest in metres."""
    oracle = dna_bytes.Face(face.read_bytes())
    return oracle, oracle.vertices({}) / 100


@pytest.mark.parametrize("kind", LISTS)
def test_each_target_is_the_evaluated_rig_at_that_pose(face, tmp_path, kind):
    found = made(face, tmp_path, *LISTS[kind])
    oracle, rest = places(face)
    names = list(found.meshes())
    at_rest = np.concatenate([found.positions(name) for name in names])
    nearest = np.array([np.square(rest - point).sum(axis=1).argmin() for point in at_rest])
    within = 2e-4 if "--quantize" in LISTS[kind] else 5e-5  # metres
    assert np.abs(at_rest - rest[nearest]).max() < within / 4
    every = 3 if kind == "plain" else 15
    looked_at = [p for i, p in enumerate(poses(face)) if i % every == 0 or p[0] == "mouthClose"]
    for name, raw, base in looked_at:
        weights = {name: 1.0, **({"jawOpen": 1.0} if base else {})}
        client = np.concatenate([found.positions(mesh, weights) for mesh in names])
        wanted = oracle.vertices(raw) / 100
        assert np.linalg.norm(client - wanted[nearest], axis=1).max() < within, name
    moved = np.linalg.norm(client - at_rest, axis=1).max()
    assert moved > 1e-4


def test_names_are_as_clients_expect_them(face, tmp_path, capsys):
    groups = "arkit,visemes,vrm"
    out = tmp_path / "face.glb"
    assert main(["export", str(face), "-o", str(out), "--shapes", groups]) == 0
    found, said = GlbFile(out.read_bytes()), capsys.readouterr().out
    names = found.names(HEAD)
    assert names[:2] == ["browDownLeft", "browDownRight"]
    assert {"viseme_sil", "viseme_PP", "viseme_aa", "viseme_U"} < set(names)
    assert {"happy", "aa", "ou", "blink", "blinkLeft", "lookUp", "neutral"} < set(names)
    assert len(set(names)) == len(names) == 46 + 15 + 18
    assert set(found.names(TEETH)) < set(names)  # targets that do not move the teeth are left out
    assert "tongueOut (tongueOut)" in said  # the rig lacks it
    assert re.search(r"arkit: \d+ shapes? of 52 left out, the rig lacks", said)
    assert re.search(r"visemes: 15 targets, \d+ vertices, [\d,]+ bytes, linear sum within", said)


def test_a_minimal_skeleton_stands_where_the_face_has_its_joints(face, tmp_path):
    found = made(face, tmp_path)
    names = [found.json["nodes"][j]["name"] for j in found.json["skins"][0]["joints"]]
    assert names[0] == "Root"
    assert set(names) <= {"Root", "Neck", "Head", "Jaw", "LeftEye", "RightEye"}
    assert "skins" not in made(face, tmp_path, "--no-skeleton").json


def test_normals_turn_with_the_surface(face, tmp_path):
    found = made(face, tmp_path, "--normals")
    rest = found.positions(HEAD, kind="NORMAL")
    turned = found.positions(HEAD, {"jawOpen": 1.0}, kind="NORMAL")
    assert np.abs(np.linalg.norm(rest, axis=1) - 1).max() < 1e-5
    assert np.abs(turned - rest).max() > 0.01
    assert np.linalg.norm(turned, axis=1).max() < 1.7


def test_the_driver_brings_sums_of_two_to_the_rig(face, tmp_path):
    dna, rig = risorius.load(face), risorius.compile_cached(face)
    wishes = Wishes(shapes=("arkit",), within=0.05)
    result = export(dna, rig, face, "face.glb", wishes)
    assert list(result.files) == ["face.glb", "face.combinations.json", "combinations.js"]
    found = GlbFile(result.files["face.glb"])
    rows = json.loads(result.files["face.combinations.json"])["combinations"]
    assert rows
    surface, there = risorius.Surface(dna, rig), {n: raw for n, raw, _ in poses(face)}
    [mesh] = [i for i, name in enumerate(dna.mesh_names) if name == HEAD]
    rest = surface.positions(rig.initial_raw_controls, mesh) / 100
    at_rest = found.positions(HEAD)
    nearest = np.array([np.square(rest - p).sum(axis=1).argmin() for p in at_rest])
    plain = [r for r in rows if r["weight"] in ("product", "half") and "mouthClose" not in r["of"]]
    for row in [r for r in plain if r["target"] in found.names(HEAD)][:6]:
        share = 0.5 if row["weight"] == "half" else 1.0
        raw = rig.initial_raw_controls.copy()
        for name in row["of"]:
            for control, value in there[name].items():
                raw[rig.raw_control_names.index(control)] += share * value
        wanted = surface.positions(raw, mesh)[nearest] / 100
        weights = dict.fromkeys(row["of"], share)
        assert np.abs(found.positions(HEAD, weights) - wanted).max() > 2e-5
        weights[row["target"]] = 1.0  # for weights of 1 their product, for a half 4 w (1 - w)
        assert np.abs(found.positions(HEAD, weights) - wanted).max() < 5e-5


@pytest.mark.parametrize("kind", ["cubic", "early", "late", "middle", "triple"])
def test_refinements_leave_exact_poses_alone(kind):
    # If only one of the targets is active, or if two are at 1, a refinement adds nothing.
    many = {"cubic": 1, "triple": 3}.get(kind, 2)
    for on in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.5, 0.0), (0.0, 0.5)):
        weights = np.array([*on, 0.0])[:many]
        if many > 1 or weights[0] in (0, 0.5, 1):
            assert abs(float(weight_of(kind, *weights))) < 1e-12
    assert weight_of("shut", np.array(0.1), np.array(0.1), np.array(1.0)) == 0.9


def test_refinements_bring_poses_that_are_partly_on_nearer(face, tmp_path, capsys):
    arguments = ["export", str(face), "-o", str(tmp_path / "f.glb"), "--shapes", "arkit"]
    arguments += ["--lod", "3"]
    take = tmp_path / "take.csv"
    rows = [",".join(["Timecode,BlendShapeCount", *(u[0].upper() + u[1:] for u in UNITS)])]
    rows += [f"00:00:{i:02}:00.0,52,{','.join(['0.4'] * 52)}" for i in range(20)]
    take.write_text("\n".join(rows))
    assert main([*arguments, "--within", "250", "--takes", str(take)]) == 0
    said = capsys.readouterr().out
    after, before = re.search(r"poses within ([\d.]+) mm, without them ([\d.]+)", said).groups()
    assert float(after) < 0.95 * float(before)
    table = json.loads((tmp_path / "f.combinations.json").read_text())["combinations"]
    found, names = GlbFile((tmp_path / "f.glb").read_bytes()), arkit.mapping().keys()
    for row in table:
        assert row["target"] in found.names("head_lod3_mesh")
        assert names >= set(row["of"])
    assert {"product", "triple"} & {row["weight"] for row in table}
    code, line = sentence(capsys, *arguments[1:], "--within", "1", "--takes", str(face))
    assert code == 1
    assert str(face) in line
    take.write_text("time,a,b\n0,1,2\n1,2,3\n")
    code, line = sentence(capsys, *arguments[1:], "--within", "1", "--takes", str(take))
    assert (code, "curves of ARKit's units were expected" in line) == (1, True), line
    code, line = sentence(capsys, *arguments[1:], "--takes", str(take))
    assert (code, "add --within" in line) == (2, True)


def test_poses_of_weights_are_those_of_imported_captures(face, tmp_path):
    rig, take = risorius.compile_cached(face), tmp_path / "take.csv"
    targets, _ = find_targets(rig, ["arkit"], "the face")
    weights = faces.typical([target.name for target in targets], 12)
    table = [",".join(["time", *(target.name for target in targets)])]
    table += [",".join(map(str, (i / 30, *row))) for i, row in enumerate(weights)]
    take.write_text("\n".join(table))
    clip, _ = importing.import_file(take, rig.raw_control_names, mapping="arkit")
    rest = np.asarray(rig.initial_raw_controls, np.float32)
    assert (weights[:, [t.name for t in targets].index("mouthClose")] > 0).any()
    for row, wanted in zip(weights, clip.curves.T, strict=True):
        raw = dict(zip(rig.raw_control_names, pose_of(targets, rest, row), strict=True))
        for name, value in zip(clip.names, wanted, strict=True):
            assert abs(raw.get(name, value) - value) < 1e-5, name


def test_a_size_lowers_textures_then_vertices_then_the_level(face, tmp_path, capsys):
    dna = risorius.load(face)
    dna.metadata = {f"texture:{HEAD}:color": "skin.png"}
    path = tmp_path / "painted.dna"
    dna.save(path)
    noise = np.random.default_rng(5).random((300, 300, 3))
    (tmp_path / "skin.png").write_bytes(png(noise))
    whole = made(path, tmp_path)
    size = len((tmp_path / "face.glb").read_bytes())
    assert whole.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    capsys.readouterr()
    for share, wanted in ((0.7, "textures of 256 pixels"), (0.2, "LOD 2")):
        made(path, tmp_path, "--mb", str(size * share / 1e6))
        assert len((tmp_path / "face.glb").read_bytes()) <= size * share
        [line] = [x for x in capsys.readouterr().out.splitlines() if x.startswith("for ")]
        assert wanted in line
    assert main(["export", str(path), "-o", str(tmp_path / "f.glb"), "--mb", "0.001"]) == 1
    assert "at most 0.001 MB were expected" in capsys.readouterr().err


def sentence(capsys, *arguments):
    code = main(["export", *map(str, arguments)])
    [line] = capsys.readouterr().err.splitlines()
    return code, line


def test_what_cannot_be_is_said_in_a_sentence(face, tmp_path, capsys):
    out = tmp_path / "face.glb"
    code, line = sentence(capsys, face, "-o", out, "--shapes", "arkit,visemes", "--most", 40)
    assert code == 1
    assert "40 targets at most were asked for, arkit and visemes are " in line
    code, line = sentence(capsys, face, "-o", out, "--shapes", "arkit,faces")
    assert (code, "found 'faces'" in line) == (2, True)
    code, line = sentence(capsys, face, "-o", out, "--lod", 9)
    assert (code, "a LOD from 0 to 3 was expected, found 9" in line) == (1, True)
    assert not out.exists()
    with no_room(3000):
        code, line = sentence(capsys, face, "-o", out)
    assert code == 1
    assert str(out) in line
    assert not list(tmp_path.iterdir())


def test_a_face_whose_pose_is_no_number_is_a_sentence(tmp_path, capsys):
    path = GOLDEN / "malformed" / "group_value_nan.dna"
    code, line = sentence(capsys, path, "-o", tmp_path / "f.glb", "--shapes", "all")
    assert code == 1
    assert "one is no number or farther" in line


def test_a_rig_without_the_controls_is_told_and_given_by_its_own_names(tmp_path, capsys):
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    dna.raw_control_names = [f"face/own.{i}" for i in range(len(dna.raw_control_names))]
    path, out = tmp_path / "own.dna", tmp_path / "own.glb"
    dna.save(path)
    code, line = sentence(capsys, path, "-o", out, "--shapes", "arkit")
    assert code == 1
    assert "the rig has face/own.0, face/own.1" in line
    assert "--shapes all" in line
    assert main(["export", str(path), "--shapes", "all"]) == 0
    said = capsys.readouterr().out
    assert "face/own.0: no client reads such a name: the target is face_own_0" in said
    found = GlbFile(out.read_bytes())
    names = {name for mesh in found.meshes() for name in found.names(mesh)}
    assert "face_own_0" in names
    assert not any(set(name) & set("/.[]:") for name in names)


def test_a_picture_of_another_program_comes_as_it_is(face, tmp_path, capsys):
    dna = risorius.load(face)
    dna.metadata = {f"texture:{HEAD}:color": "skin.jpg"}
    path = tmp_path / "photo.dna"
    dna.save(path)
    picture = jpeg(np.zeros((8, 8, 3), np.uint8))
    (tmp_path / "skin.jpg").write_bytes(picture)
    found = made(path, tmp_path)
    mesh = dna.meshes[dna.mesh_names.index(HEAD)]
    corners = np.c_[
        mesh.positions[mesh.layout_positions] / 100,
        mesh.texture_coordinates[mesh.layout_texture_coordinates] * [1, -1] + [0, 1],
    ]
    own = np.c_[found.positions(HEAD), found.positions(HEAD, kind="TEXCOORD_0")]
    assert {tuple(row) for row in own.round(4)} <= {tuple(row) for row in corners.round(4)}
    assert f"it comes as it is, {len(picture)} bytes" in capsys.readouterr().out
    [image] = found.json["images"]
    assert image["mimeType"] == "image/jpeg"
    assert bytes(found.view(image["bufferView"])) == picture


def test_a_texture_of_16_384_pixels_is_left_out_with_a_line(face, tmp_path, capsys):
    dna = risorius.load(face)
    dna.metadata = {f"texture:{HEAD}:color": "skin.png"}
    path = tmp_path / "large.dna"
    dna.save(path)
    header = bytearray(png(np.zeros((4, 4, 3))))
    header[16:24] = (16384).to_bytes(4, "big") * 2
    (tmp_path / "skin.png").write_bytes(header)
    found = made(path, tmp_path)
    said = capsys.readouterr().out
    assert "skin.png: at most 8,192 pixels a side were expected, found 16,384 x 16,384" in said
    assert "images" not in found.json


@pytest.mark.skipif(
    not (TAKE.exists() and SAMPLE.exists()), reason="EXTRA NOT RUN: no real take, or no sample"
)
def test_the_driver_brings_frames_of_a_real_take_nearer_to_the_rig():
    away = gameface_take.frames(SAMPLE, TAKE, lod=4, every=400)
    assert len(away) > 5
    assert away[:, 1].mean() < away[:, 0].mean() / 1.5
