# SPDX-License-Identifier: MIT
"""Tests joint rigs made from expressions by an independent reader; invalid input is refused."""

import copy
import importlib.util
import itertools
import json
import os
from pathlib import Path
from types import SimpleNamespace

import command_line
import dna_bytes
import face_shapes
import numpy as np
import pytest
import risorius
from conftest import GOLDEN, no_room
from risorius.author import (
    FitOptions,
    LodOptions,
    RigOptions,
    make_joint_rig,
    pivots,
)
from risorius.author.fitting import bounded
from risorius.author.geometry.polygon_mesh import polygon_mesh
from risorius.author.geometry.simplify import (
    attributes_of,
    fan_triangles,
    fewer_triangles,
    pieces_of,
    simplified,
)
from risorius.author.input import matching, shape_face, spec
from risorius.author.level_meshes import level_meshes, shapes_of
from risorius.author.work import TOLERANCE, begin
from risorius.cli import main
from risorius.cli.faces import author
from risorius.controls import arkit

# oracle.py of the Blender tests computes skinning and morphing without risorius.author.
_ORACLE = Path(__file__).parents[3] / "blender_tests" / "support" / "oracle.py"
_SPEC = importlib.util.spec_from_file_location("blender_oracle", _ORACLE)
oracle = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(oracle)

METRES = 0.01
EIGHT = [506, 304, 182, 109, 66, 39, 24, 24]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("egg")
    # The spec gives vertex budgets, because a face of 506 vertices has fewer LODs without them.
    face_shapes.write_all(folder, more=f"[lods]\nvertices = {EIGHT}\n")
    return folder


@pytest.fixture(scope="module")
def made(folder):
    page = folder / "report.html"
    done = command_line.run(
        "author", folder / "spec.toml", "-o", folder / "egg.dna", "--report", page, text=True
    )
    assert done.returncode == 0, done.stderr
    return risorius.load(folder / "egg.dna"), done.stdout


def tolerated(times=1.0):
    """The default tolerance of a vertex in cm, multiplied by the factor `times`."""
    return times * TOLERANCE * np.ptp(face_shapes.head()[0][:, 1])


def posed(dna, controls):
    """Posed vertices in metres and in Blender's axes.

    Args:
        controls: raw control without prefix -> value; others are 0.
    """
    rig = risorius.Rig(dna)
    names = list(dna.raw_control_names)
    values = np.zeros(len(names), np.float32)
    for name, value in controls.items():
        values[names.index("CTRL_expressions." + name)] = value
    pose = rig.evaluate(values)
    return oracle.vertices(dna, 0, pose)


def wanted(dna, delta):
    positions, _ = face_shapes.head()
    return oracle.to_blender(dna, positions + delta)


NAMES = {
    "mouthSmileLeft": "mouthCornerPullL",
    "mouthSmileRight": "mouthCornerPullR",
    "browOuterUpLeft": "browRaiseOuterL",
    "browOuterUpRight": "browRaiseOuterR",
    "eyeBlinkLeft": "eyeBlinkL",
    "eyeBlinkRight": "eyeBlinkR",
    "jawOpen": "jawOpen",
}


@pytest.mark.parametrize("name", NAMES)
def test_a_control_at_1_is_the_expression(made, name):
    dna, _ = made
    goal = wanted(dna, face_shapes.expressions(face_shapes.head()[0])[name])
    error = np.linalg.norm(posed(dna, {NAMES[name]: 1}) - goal, axis=1)
    assert error.max() / METRES < tolerated(1.01)  # 1 % for rounding


def test_the_file_is_sound_and_says_what_moves(made):
    dna, said = made
    assert len(dna.joint_names) == 42
    assert dna.joint_names[:2] == ["root", "head"]
    assert len(set(dna.joint_names)) == 42
    assert {name.split("_")[1] for name in dna.joint_names[2:]} == {"L", "R", "C"}
    assert any(name.startswith("FACIAL_L_Brow") for name in dna.joint_names)
    assert "40 new joints" in said


@pytest.fixture(scope="module")
def read(folder, made):
    """The written file, read without Risorius."""
    return dna_bytes.Face((folder / "egg.dna").read_bytes())


def raw(name, value=1.0):
    return {"CTRL_expressions." + NAMES[name]: value}


@pytest.mark.parametrize("name", NAMES)
def test_another_reader_gets_the_same_expression(read, name):
    positions, _ = face_shapes.head()
    delta = face_shapes.expressions(positions)[name]
    error = np.linalg.norm(read.vertices(raw(name)) - positions - delta, axis=1)
    assert error.max() < tolerated(1.01)


def test_eight_levels_by_another_reader(read, made):
    """Each LOD has a subset of the finer LOD's joints and vertices, and moves nearly like it."""
    _, said = made
    assert read.lod_count == 8
    counts = [len(read.geometry[m[0]]["positions"]) for m in read.lod_meshes]
    assert counts[0] == 506
    assert counts[1:6] == sorted(set(counts[1:6]), reverse=True)
    assert counts[5] < 45 >= counts[7]
    joints = [set(level.tolist()) for level in read.lod_joints]
    assert all(a >= b for a, b in itertools.pairwise(joints))
    for level, budget in zip(joints, [40, 32, 24, 18, 12, 8, 5, 4], strict=True):
        assert budget - 1 <= len(level) - 2 <= budget  # joints of both sides, or neither
    positions, _ = face_shapes.head()
    for lod in range(1, 8):
        mesh = read.geometry[read.lod_meshes[lod][0]]
        places = np.linalg.norm(mesh["positions"][:, None] - positions, axis=2)
        assert places.min(axis=1).max() < 1e-5
        row = next(line for line in said.splitlines() if line.split()[:1] == [str(lod)]).split()
        assert int(row[2]) == counts[lod]
        fine = places.argmin(axis=1)
        far = [
            np.linalg.norm(read.vertices(raw(name), lod) - (positions + delta)[fine], axis=1).max()
            for name, delta in face_shapes.expressions(positions).items()
        ]
        assert 10 * max(far) == pytest.approx(float(row[-1]), abs=2e-3)
        assert max(far) < (0.5 if lod < 4 else 0.7)  # cm; motions are up to 3 cm


def test_levels_end_before_the_picture_breaks(folder, tmp_path):
    """A small face has fewer LODs; their skin stays near the fine skin and does not fold."""
    text = (folder / "spec.toml").read_text(encoding="utf-8")
    for name in ("neutral.obj", "shapes"):
        text = text.replace(f'"{name}"', f'"{(folder / name).as_posix()}"')
    spec = tmp_path / "few.toml"
    spec.write_text(text.partition("[lods]")[0] + "rounds = 2\n", encoding="utf-8")
    done = command_line.run("author", spec, "-o", tmp_path / "few.dna", text=True)
    assert "note: LOD 4 would have " in done.stdout
    assert ": there are 4 levels of 8\n" in done.stdout
    dna = risorius.load(tmp_path / "few.dna")
    assert dna.lod_count == 4
    assert len(dna.meshes[-1].positions) > 90
    for mesh in dna.meshes[1:]:
        triangles = np.asarray(mesh.layout_positions, int)[fan_triangles(mesh)]
        for name in ("rest", *face_shapes.expressions(face_shapes.head()[0])):
            points = np.asarray(mesh.positions, float)
            if name != "rest":
                neutral, _ = face_shapes.head()
                fine = np.linalg.norm(points[:, None] - neutral, axis=2).argmin(axis=1)
                points = points + face_shapes.expressions(neutral)[name][fine]
            ((slivers, folds),) = shapes_of([points], triangles)
            assert slivers <= 0.02
            assert folds <= 0.045


def test_hair_of_more_vertices_than_the_skin_ends_no_level():
    """A head with hair cards gets the same LODs as without hair."""
    positions, faces = face_shapes.head()
    moved = face_shapes.expressions(positions)
    shapes = shape_face.ShapeSet(
        "egg", shape_face.ObjMesh(positions, np.zeros((0, 2)), faces.tolist()), moved
    )
    alone = shape_face.make_shape_face(shapes, {name: [name] for name in moved})
    hairy = copy.copy(alone)
    card = np.array([[0, 0, 0], [0, -4, 0], [0.4, -4, 0], [0.4, 0, 0]])
    roots = np.stack([np.linspace(-8, 8, 300), np.full(300, 13.0), np.zeros(300)], axis=1)
    points = (roots[:, None] + card).reshape(-1, 3)
    quads = np.arange(1200).reshape(-1, 4).tolist()
    hair = polygon_mesh(points, points, quads, points[:, :2], quads)
    hair.skin_offsets, hair.skin_weights = np.arange(1201), np.ones(1200)
    hair.skin_joint_indices, hair.maximum_influence_per_vertex = np.ones(1200, int), 1
    hairy.meshes = [*alone.meshes, hair]
    hairy.mesh_names = [*alone.mesh_names, "hair_lod0_mesh"]
    hairy.lod_mesh_mapping = [[0, 1]]
    plans = []
    for dna in (alone, hairy):
        work = begin(dna)
        plans.append(level_meshes(work, work.wanted, LodOptions(), 8))
    assert plans[0].count == plans[1].count == 4
    assert plans[0].ended == plans[1].ended
    for lod, share in ((1, 0.6), (2, 0.36), (3, 0.216)):
        cards = len(plans[1].triangles[lod, 1]) / 2
        assert cards == int(cards)  # no card is cut
        assert share * 300 < cards < share**0.5 * 300


def test_pieces_of_a_mesh_stay_whole_or_go_together():
    """A mesh with two eyes and forty lashes keeps both eyes, and all lashes or none."""
    positions, faces = face_shapes.head()
    eye = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
    box = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2],
                    [1, 3, 7, 5]])  # fmt: skip
    middles = [(3.0, 3.0, 12.0, 1.2), (-3.0, 3.0, 12.0, 1.2)]
    middles += [(0.3 * i - 6, 5.0, 12.0, 0.05) for i in range(40)]
    points, quads = [positions], [faces]
    for x, y, z, size in middles:
        quads.append(box + sum(map(len, points)))
        points.append(eye * size + [x, y, z])
    whole, corners = np.concatenate(points), np.concatenate(quads).tolist()
    mesh = polygon_mesh(whole, whole, corners, whole[:, :2], corners)
    pieces = pieces_of(mesh)
    assert pieces.max() == 42
    head, eyes = pieces[0], {int(pieces[506]), int(pieces[514])}
    assert (pieces[:506] == head).all()
    attributes = attributes_of(mesh, np.zeros((0, len(pieces), 3)))
    seen = set()
    for budget in (700, 500, 250, 120, 60):
        triangles = fewer_triangles(mesh, attributes, budget)
        there = set(pieces[np.asarray(mesh.layout_positions, int)[triangles]].ravel().tolist())
        assert {int(head), *eyes} <= there
        lashes = len(there) - 3
        assert lashes in (0, 40)
        seen.add(lashes)
    assert seen == {0, 40}


def test_a_coarser_level_keeps_the_rim_and_is_no_fold(read):
    """The open rim of the face keeps its extent, and no triangle's direction is reversed."""
    positions, _ = face_shapes.head()
    for lod in range(1, 5):
        mesh = read.geometry[read.lod_meshes[lod][0]]
        points = mesh["positions"]
        assert np.allclose(np.ptp(points, axis=0), np.ptp(positions, axis=0), rtol=0.03)
        corners = points[mesh["layouts"][np.array(mesh["faces"]), 0]]
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        outward = (across * corners.mean(axis=1)).sum(axis=1)
        assert (np.sign(outward) == np.sign(outward[0])).all()


def test_exact_leaves_nothing(folder, tmp_path):
    out = tmp_path / "exact.dna"
    assert command_line.run("author", folder / "spec.toml", "-o", out, "--exact").returncode == 0
    face = dna_bytes.Face(out.read_bytes())
    positions, _ = face_shapes.head()
    for name, delta in face_shapes.expressions(positions).items():
        error = np.linalg.norm(face.vertices(raw(name)) - positions - delta, axis=1)
        assert np.sqrt((error**2).mean()) < 1e-5 * np.ptp(positions[:, 1])


def test_budgets_are_kept(folder, tmp_path):
    path = tmp_path / "budgets.toml"
    text = (folder / "spec.toml").read_text(encoding="utf-8")
    for name in ("neutral.obj", "shapes"):
        text = text.replace(f'"{name}"', json.dumps((folder / name).as_posix()))
    text = text.partition("[lods]")[0]
    path.write_text(text + "[lods]\njoints = [40, 11, 3]\nvertices = [506, 120, 40]\n")
    out = tmp_path / "budgets.dna"
    done = command_line.run("author", path, "-o", out, "--joints-only", "--json", text=True)
    assert done.returncode == 0, done.stderr
    face = dna_bytes.Face(out.read_bytes())
    assert face.lod_count == 3
    for lod, (joints, vertices) in enumerate([(40, 506), (11, 120), (3, 40)]):
        assert len(face.lod_joints[lod]) - 2 in (joints, joints - 1)  # both sides, or neither
        assert len(face.geometry[face.lod_meshes[lod][0]]["positions"]) <= vertices
        assert json.loads(done.stdout)["lods"][lod]["joints"] == len(face.lod_joints[lod]) - 2


def test_a_seam_of_the_texture_stays_closed():
    """A simplified sheet whose texture has a seam in the middle has no gap and the same corners."""
    n = 12
    x, y = np.meshgrid(np.arange(2 * n + 1), np.arange(n + 1))
    positions = np.stack([x.ravel(), y.ravel(), 0.01 * (x * y).ravel()], axis=1).astype(float)
    uvs = np.concatenate([positions[:, :2] / 24, positions[:, :2] / 24 + [0.5, 0]])
    corner = np.arange(len(positions)).reshape(x.shape)
    quads = np.stack(
        [corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    right = positions[quads].mean(axis=1)[:, 0] > n
    pairs = np.stack([quads, quads + right[:, None] * len(positions)], axis=-1)
    layouts, index = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    mesh = risorius.Mesh(
        positions=positions, texture_coordinates=uvs,
        normals=np.tile([0.0, 0, 1], (len(positions), 1)),
        layout_positions=layouts[:, 0], layout_texture_coordinates=layouts[:, 1],
        layout_normals=layouts[:, 0], face_offsets=4 * np.arange(len(quads) + 1),
        face_layouts=index.ravel(),
    )  # fmt: skip
    bend = np.zeros((1, len(positions), 3))
    bend[0, :, 2] = np.maximum(0, positions[:, 1] - 8)
    coarse, kept = simplified(mesh, fewer_triangles(mesh, attributes_of(mesh, bend), 60))
    assert 20 < len(kept) <= 60
    triangles = np.asarray(coarse.face_layouts, int).reshape(-1, 3)
    places = np.asarray(coarse.layout_positions, int)[triangles]
    assert np.array_equal(coarse.positions, positions.astype(np.float32)[kept])
    flat = np.asarray(coarse.positions)[places][:, :, :2]
    edges = flat[:, 1:] - flat[:, :1]
    areas = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    assert (areas > 0).all()
    assert areas.sum() / 2 == pytest.approx(2 * n * n)  # neither holes nor overlaps
    used = np.asarray(coarse.layout_texture_coordinates, int)[triangles]
    found = np.asarray(coarse.texture_coordinates)[used] * 24 - flat
    assert np.allclose(found[flat.mean(axis=1)[:, 0] < n], 0, atol=1e-4)
    assert np.allclose(found[flat.mean(axis=1)[:, 0] > n], [12, 0], atol=1e-4)
    pairs = np.sort(places[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, uses = np.unique(pairs, axis=0, return_counts=True)
    assert uses.max() == 2


def test_a_mesh_that_is_all_seams_gets_coarser_all_the_same():
    positions, faces = face_shapes.head()
    uvs = np.random.default_rng(1).random((faces.size, 2))
    corners = np.arange(faces.size).reshape(faces.shape).tolist()
    mesh = shape_face.ObjMesh(positions, uvs, faces.tolist(), corners)
    moved = face_shapes.expressions(positions)
    face = shape_face.make_shape_face(shape_face.ShapeSet("seams", mesh, moved), {})
    mesh = face.meshes[0]
    few = fewer_triangles(mesh, attributes_of(mesh, np.stack(list(moved.values()))), 100)
    coarse, kept = simplified(face.meshes[0], few)
    assert 80 < len(kept) <= 100
    places = np.asarray(coarse.layout_texture_coordinates, int)
    old = np.asarray(face.meshes[0].texture_coordinates)
    for corner in places:
        assert (old == coarse.texture_coordinates[corner]).all(axis=1).any()


def test_a_report_is_one_page(folder, made, tmp_path):
    text = (folder / "report.html").read_text(encoding="utf-8")
    for name in NAMES.values():
        assert f"<td>{name}</td>" in text
    assert text.count("<figure") == 4
    assert "http" not in text.replace("http://www.w3.org", "")
    other = ("author", folder / "spec.toml", "-o", tmp_path / "b.dna", "--report", "page.txt")
    done = command_line.run(*other, text=True)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "a name ending in .html was expected" in done.stderr
    assert not (tmp_path / "b.dna").exists()


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
def test_without_room_for_the_page_there_is_no_face_either(folder, tmp_path, monkeypatch, capsys):
    out, page = tmp_path / "a.dna", tmp_path / "a.html"
    out.write_text("old")
    page.write_text("old too")
    made = SimpleNamespace(dna=risorius.load(GOLDEN / "core.dna"))
    for name, said in (("as_lines", []), ("as_trade", ""), ("lighten", None)):
        monkeypatch.setattr(author, name, lambda *_given, said=said: said)
    monkeypatch.setattr(author, "make_joint_rig", lambda *_given: made)
    monkeypatch.setattr(author, "report_page", lambda *_given: b"x" * 1_000_000)
    command = ["author", str(folder / "spec.toml"), "-o", str(out)]
    with no_room(500_000):
        assert main([*command, "--report", str(page)]) == 1
    assert str(page) in capsys.readouterr().err
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {
        "a.dna": "old", "a.html": "old too",
    }  # fmt: skip
    command[-1] = str(page)
    assert main([*command, "--report", str(page)]) == 2
    assert "another file than that of -o" in capsys.readouterr().err


def test_joints_alone_come_near(folder, tmp_path):
    out = tmp_path / "joints.dna"
    done = command_line.run(
        "author", folder / "spec.toml", "-o", out, "--joints-only", "--json", text=True
    )
    told = json.loads(done.stdout)
    dna = risorius.load(out)
    assert sum(len(mesh.blend_shape_targets) for mesh in dna.meshes) == 0
    table = {row["name"]: row for row in told["meshes"][0]["expressions"]}
    for name, delta in face_shapes.expressions(face_shapes.head()[0]).items():
        error = np.linalg.norm(posed(dna, {NAMES[name]: 1}) - wanted(dna, delta), axis=1)
        row = table["CTRL_expressions." + NAMES[name]]
        assert error.max() * 1000 == pytest.approx(row["joints_largest_mm"], abs=2e-3)
        # Motion along an arc is also fitted at half of its way, which makes the error at its end
        # larger.
        assert error.max() < 0.12 * np.linalg.norm(delta, axis=1).max() * METRES
        if name.startswith(("mouth", "brow")):  # others follow an arc
            between = max(
                np.linalg.norm(posed(dna, {NAMES[name]: t}) - wanted(dna, t * delta), axis=1).max()
                for t in (0.25, 0.5, 0.75)
            )
            assert between * 1000 == pytest.approx(row["between_largest_mm"], abs=2e-3)


def test_a_jaws_hinge_and_an_eyes_middle_are_found():
    positions, _ = face_shapes.head()
    opened = face_shapes.expressions(positions)["jawOpen"]  # rotation about (0, 0, -2)
    (jaw,) = pivots.find_pivots(
        ["x.jawOpen"], positions, opened[None], [], np.zeros((0, 3)), jaw=False
    )
    assert np.abs(jaw.position - [0, 0, -2]).max() < 0.2
    assert jaw.expressions == (0,)
    # Vertices of a lid on the surface of a ball, along which the lid slides down.
    middle, turn = np.array([3.0, 2.0, 7.0]), np.linspace(0.1, 0.6, 9)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(-0.7, 0.7, 9), turn))

    def ball(up):
        return 1.2 * np.stack([np.sin(u) * np.cos(up), np.sin(up), np.cos(u) * np.cos(up)], axis=1)

    lid, shut = middle + ball(v), ball(v - 0.5) - ball(v)
    names = ["x.eyeBlinkL", "x.eyeWidenL", "x.eyeBlinkR"]
    moved = np.stack([shut, -0.3 * shut, 0 * shut])
    (eye,) = pivots.find_pivots(names, lid, moved, [], np.zeros((0, 3)), jaw=False)
    assert np.abs(eye.position - middle).max() < 1e-6
    assert eye.expressions == (0, 1)
    given = np.array([[9.0, 9.0, 9.0]])
    (eye,) = pivots.find_pivots(names[:2], lid, moved[:2], ["FACIAL_L_Eye"], given, jaw=False)
    assert (eye.position == given[0]).all()
    half = lid + pivots.arc(lid, shut, middle, 0.5) - middle
    assert np.linalg.norm(half, axis=1) == pytest.approx(1.2)  # on the ball, not on the line
    assert np.linalg.norm(lid + 0.5 * shut - middle, axis=1).max() < 1.19
    for share, goal in ((0.0, 0 * shut), (1.0, shut)):
        assert np.allclose(pivots.arc(lid, shut, middle, share), goal, atol=1e-12)


def test_both_sides_mirror_each_other(made):
    dna, _ = made
    left = posed(dna, {"mouthCornerPullL": 1})
    right = posed(dna, {"mouthCornerPullR": 1})
    grid = right.reshape(face_shapes.DOWN, face_shapes.ACROSS, 3)[:, ::-1].reshape(-1, 3)
    assert np.abs(left - grid * [-1, 1, 1]).max() < 1e-4  # 0.1 mm


def test_threads_change_no_byte(folder, tmp_path):
    files = []
    for threads in (1, 3):
        files.append(tmp_path / f"{threads}.dna")
        command = ("author", folder / "spec.toml", "-o", files[-1], "--threads", threads)
        assert command_line.run(*command).returncode == 0
    assert files[0].read_bytes() == files[1].read_bytes()


def test_the_largest_error_is_fought_for_longer(folder, tmp_path):
    def largest(*more):
        out = tmp_path / "bound.dna"
        done = command_line.run(
            "author", folder / "spec.toml", "-o", out, "--joints-only", "--json", *more, text=True
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)["lods"][0]["largest_mm"]

    # The margin is only 2 %, because the result of 200 rounds depends on the compiler's rounding.
    assert largest("--bound") < 0.98 * largest()
    more = bounded(FitOptions(rounds=300))
    assert (more.rounds, more.emphasis, more.bound) == (300, 3.0, True)


def test_joints_that_are_there_stay(folder):
    """A source with a neck and a jaw joint keeps both.

    The neck joint keeps its weight of 0.5 on the lower vertices, and the jaw keeps its rotation.
    """
    read = spec.read_spec(folder / "spec.toml")
    dna = spec.read_face(read).dna
    positions, _ = face_shapes.head()
    dna.joint_names = [*dna.joint_names, "neck", "jaw"]
    dna.joint_parents = [0, 0, 0, 1]
    head = np.asarray(dna.neutral_joint_translations)[1]
    dna.neutral_joint_translations = [[0, 0, 0], head, [0, -12, 0], np.array([0, 0, -2]) - head]
    dna.neutral_joint_rotations = np.zeros((4, 3))
    dna.lod_joint_mapping = [range(4)]
    dna.joint_row_count = 36
    jaw = list(dna.raw_control_names).index("CTRL_expressions.jawOpen")
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[1], input_indices=[jaw], output_indices=[3 * 9 + 3], joint_indices=[3],
            values=np.degrees([[0.3]]),
        )
    ]  # fmt: skip
    mesh = dna.meshes[0]
    low = positions[:, 1] < -9
    weights = np.zeros((len(positions), 4))
    weights[:, 1] = 1
    weights[low] = [0, 0.5, 0.5, 0]
    set_skin(mesh, weights)
    dna.meshes = [mesh]
    before = {name: posed(dna, {name: 1}) for name in ("jawOpen", "mouthCornerPullL")}
    rig = make_joint_rig(dna, RigOptions(FitOptions(joints=60, rounds=8)))
    rows = shape_weights(rig.dna.meshes[0], len(rig.dna.joint_names))
    parents = np.asarray(rig.dna.joint_parents)
    under = (parents == 2) | (np.arange(len(parents)) == 2)
    carried = rows[:, under].sum(axis=1)
    assert np.abs(carried[low] - 0.5).max() < 0.15
    assert carried[positions[:, 1] > -5].max() < 0.05
    assert np.count_nonzero(under) >= 3, "joints of the lower half have seconds under the neck"
    kept = [g for g in rig.dna.joint_groups if 3 in list(g.joint_indices)]
    assert len(kept) == 1
    at = list(kept[0].output_indices).index(30), list(kept[0].input_indices).index(jaw)
    assert kept[0].values[at] == pytest.approx(np.degrees(0.3))
    for name, goal in before.items():
        error = np.linalg.norm(posed(rig.dna, {name: 1}) - goal, axis=1)
        assert error.max() / METRES < tolerated(1.01)


def test_what_goes_with_a_jaw_is_its_child(folder):
    """New joints in the skin that the jaw moves become children of the jaw joint.

    So the skin equals the source's at jawOpen 0.5 and in combinations with other expressions.
    """
    dna = spec.read_face(spec.read_spec(folder / "spec.toml")).dna
    positions, _ = face_shapes.head()
    hinge = np.array([0, 0, -2.0])
    head = np.asarray(dna.neutral_joint_translations)[1]
    dna.joint_names = [*dna.joint_names, "jaw"]
    dna.joint_parents = [0, 0, 1]
    dna.neutral_joint_translations = [[0, 0, 0], head, hinge - head]
    dna.neutral_joint_rotations = np.zeros((3, 3))
    dna.lod_joint_mapping = [range(3)]
    dna.joint_row_count = 27
    names = list(dna.raw_control_names)
    opening = names.index("CTRL_expressions.jawOpen")
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[1], input_indices=[opening], output_indices=[2 * 9 + 3], joint_indices=[2],
            values=np.degrees([[0.3]]),
        )
    ]  # fmt: skip
    mesh = dna.meshes[0]
    share = np.clip((-positions[:, 1] - 2) / 6, 0, 1)
    weights = np.stack([0 * share, 1 - share, share], axis=1)
    set_skin(mesh, weights)
    kept = [t for t in mesh.blend_shape_targets if t.blend_shape_channel_index != opening]
    chin = face_shapes.bump(positions, 0, -9, 3)[:, None] * [0.0, -0.4, 0.2]
    moved = np.flatnonzero(chin.any(axis=1))
    kept.append(
        risorius.BlendShapeTarget(
            deltas=chin[moved], vertex_indices=moved, blend_shape_channel_index=opening
        )
    )
    mesh.blend_shape_targets = kept
    dna.meshes = [mesh]
    levels = LodOptions(count=1)
    options = RigOptions(FitOptions(joints=40), shapes=False, least_effect_mm=0.0, lods=levels)
    made = make_joint_rig(dna, options).dna
    assert list(made.joint_parents).count(2) >= 3
    for controls, most in (
        ({"jawOpen": 1}, 0.6),
        ({"jawOpen": 0.5}, 0.4),
        ({"jawOpen": 1, "mouthCornerPullL": 1}, 1.2),
    ):
        error = np.linalg.norm(posed(made, controls) - posed(dna, controls), axis=1)
        assert error.max() * 1000 < most, controls


def test_joints_of_a_pair_are_named_alike(made):
    names = made[0].joint_names
    sides = [{n[9:] for n in names if n.startswith(f"FACIAL_{side}_")} for side in "LR"]
    assert sides[0] == sides[1]
    regions = {n.split("_")[2].rstrip("0123456789") for n in names if n.startswith("FACIAL_")}
    assert regions == {"Brow", "Eye", "Mouth", "JawSkin"}
    assert not [n for n in names if n.endswith(("A", "B"))]
    positions = np.asarray(made[0].neutral_joint_translations)
    brows = [positions[i][1] for i, n in enumerate(names) if "_Brow" in n]
    mouth = [positions[i][1] for i, n in enumerate(names) if "_Mouth" in n]
    assert min(brows) > max(mouth)


def test_half_the_way_of_an_arc_is_no_worse_than_its_end(folder):
    dna = spec.read_face(spec.read_spec(folder / "spec.toml")).dna
    options = RigOptions(FitOptions(joints=40), shapes=False, lods=LodOptions(count=1))
    (errors,) = make_joint_rig(dna, options).errors
    for name in ("jawOpen", "eyeBlinkL", "eyeBlinkR"):
        at = errors.expressions.index("CTRL_expressions." + name)
        assert errors.between_largest[at] < errors.joints_largest[at]


def test_a_coarser_mesh_hangs_on_the_same_joints(folder):
    """LOD 1 of the source has every third row and second column of vertices, and its own shapes."""
    dna = spec.read_face(spec.read_spec(folder / "spec.toml")).dna
    positions, _ = face_shapes.head()
    grid = np.arange(len(positions)).reshape(face_shapes.DOWN, face_shapes.ACROSS)[::3, ::2]
    kept = grid.ravel()
    corner = np.arange(len(kept)).reshape(grid.shape)
    faces = np.stack(
        [corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]], axis=-1
    ).reshape(-1, 4)
    coarse = shape_face.ObjMesh(positions[kept], np.zeros((0, 2)), faces.tolist())
    moved = {n: d[kept] for n, d in sorted(face_shapes.expressions(positions).items())}
    other = shape_face.make_shape_face(
        shape_face.ShapeSet("coarse", coarse, moved), {n: [NAMES[n]] for n in moved}
    )
    assert other.raw_control_names == dna.raw_control_names
    dna.lod_count = 2
    dna.meshes = [dna.meshes[0], other.meshes[0]]
    dna.mesh_names = ["fine", "coarse"]
    dna.lod_mesh_mapping = [[0], [1]]
    dna.lod_joint_mapping = [[0, 1]] * 2
    dna.lod_blend_shape_mapping = [range(7)] * 2
    channels = dna.blend_shape_channels
    channels.lods = [7, 7]
    dna.blend_shape_channels = channels
    rig = make_joint_rig(dna, RigOptions(FitOptions(joints=40), shapes=False)).dna
    two = RigOptions(FitOptions(9), lods=LodOptions(count=2))
    assert [(e.name, e.lod) for e in make_joint_rig(dna, two).errors] == [
        ("fine", 0),
        ("coarse", 1),
    ]
    names = list(rig.raw_control_names)
    for expression, delta in moved.items():
        values = np.zeros(len(names), np.float32)
        values[names.index("CTRL_expressions." + NAMES[expression])] = 1
        pose = risorius.Rig(rig).evaluate(values, lod=1)
        goal = oracle.to_blender(rig, positions[kept] + delta)
        error = np.linalg.norm(oracle.vertices(rig, 1, pose) - goal, axis=1)
        assert error.max() < 0.1 * np.linalg.norm(delta, axis=1).max() * METRES


def set_skin(mesh, weights):
    vertex, joint = np.nonzero(weights)
    counts = (weights > 0).sum(axis=1)
    mesh.skin_offsets = np.concatenate([[0], np.cumsum(counts)])
    mesh.skin_weights, mesh.skin_joint_indices = weights[vertex, joint], joint
    mesh.maximum_influence_per_vertex = int(counts.max())


def shape_weights(mesh, joints):
    out = np.zeros((len(mesh.positions), joints))
    vertex = np.repeat(np.arange(len(out)), np.diff(mesh.skin_offsets.astype(int)))
    out[vertex, mesh.skin_joint_indices] = mesh.skin_weights
    return out


@pytest.mark.parametrize(
    ("name", "controls"),
    [
        ("jawOpen", ["jawOpen"]),
        ("eyeBlink_L", ["eyeBlinkL"]),
        ("EyeBlinkRight", ["eyeBlinkR"]),
        ("browInnerUp", ["browRaiseInL", "browRaiseInR"]),
        ("AU12", ["mouthCornerPullL", "mouthCornerPullR"]),
        ("AU12_L", ["mouthCornerPullL"]),
        ("Left_Smile", ["mouthCornerPullL"]),
        ("CTRL_expressions_noseWrinkleL", []),
        ("noseWrinkleL", ["noseWrinkleL"]),
        ("grumpy", []),
    ],
)
def test_names_are_guessed(name, controls):
    assert matching.guess(name) == controls


def test_a_control_belongs_to_one_expression():
    found = matching.assign(["blinkLeft", "eyeBlinkLeft", "odd one"], {"eyeBlinkLeft": "eyeBlinkL"})
    assert found.controls == {
        "blinkLeft": ["blinkLeft"],
        "eyeBlinkLeft": ["eyeBlinkL"],
        "odd one": ["odd_one"],
    }


def test_a_sum_of_both_sides_is_split_softly():
    positions, faces = face_shapes.head()
    mesh = shape_face.ObjMesh(positions, np.zeros((0, 2)), [list(f) for f in faces])
    whole = face_shapes.bump(positions, 0, 5, 6)[:, None] * [0, 1.0, 0]
    shapes = shape_face.ShapeSet("x", mesh, {"browInnerUp": whole})
    dna = shape_face.make_shape_face(shapes, {"browInnerUp": ["browRaiseInL", "browRaiseInR"]})
    halves = np.zeros((2, *whole.shape))
    for target in dna.meshes[0].blend_shape_targets:
        halves[target.blend_shape_channel_index, target.vertex_indices] = target.deltas
    assert np.allclose(halves.sum(axis=0), whole, atol=1e-5)
    assert not halves[0][positions[:, 0] < -1].any()  # the left of the character is +x
    assert not halves[1][positions[:, 0] > 1].any()


def test_a_unit_of_several_controls_is_divided_by_side_and_lip():
    positions, faces = face_shapes.head()
    mesh = shape_face.ObjMesh(positions, np.zeros((0, 2)), [list(f) for f in faces])
    whole = face_shapes.bump(positions, 0, -5, 4)[:, None] * [0, 0, 1.0]
    quarters = [name.removeprefix("CTRL_expressions.") for name in arkit.mapping()["mouthFunnel"]]
    for controls in (quarters, ["mouthPressUL", "mouthPressDL"], ["browDownL", "browLateralL"]):
        dna = shape_face.make_shape_face(
            shape_face.ShapeSet("x", mesh, {"a": whole}), {"a": controls}
        )
        assert [
            name.removeprefix("CTRL_expressions.") for name in dna.raw_control_names
        ] == controls
        parts = np.zeros((len(controls), *whole.shape))
        for target in dna.meshes[0].blend_shape_targets:
            parts[target.blend_shape_channel_index, target.vertex_indices] = target.deltas
        assert np.allclose(parts.sum(axis=0), whole, atol=1e-4)
        for name, part in zip(controls, parts, strict=True):
            middle = (part[:, 2] @ positions) / part[:, 2].sum()
            if name[-2] in "UD":
                assert (middle[1] > -5) == (name[-2] == "U")
            if len(controls) == 4:
                assert (middle[0] > 0) == (name[-1] == "L")


def refused(*arguments):
    done = command_line.run("author", *arguments, text=True)
    assert done.returncode == 1, done.stdout
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_bad_input_is_one_sentence(tmp_path):
    path = face_shapes.write_all(tmp_path / "a")
    out = tmp_path / "out.dna"
    positions, faces = face_shapes.head()
    bad = path.parent / "shapes" / "bad.obj"
    face_shapes.write_obj(bad, positions[:-1], faces)
    assert "bad.obj: 506 vertices were expected" in refused(path, "-o", out)
    bad.write_text("v 1 2 nan\n", encoding="utf-8")
    assert "bad.obj: line 1: 3 finite numbers" in refused(path, "-o", out)
    bad.unlink()
    neutral = path.parent / "neutral.obj"
    text = neutral.read_text(encoding="utf-8")
    neutral.write_text(text + "f 1 2 9999\n", encoding="utf-8")
    assert "vertex 9999 of 506 is not there" in refused(path, "-o", out)
    neutral.write_text(text, encoding="utf-8")
    plain = path.read_text(encoding="utf-8")
    for change, words in (
        ("[joint]\n", "joint: one of name, source, joints, shapes, correctives, lods, controls"),
        ("number = 3\n", "joints.number: one of count"),
        ("rounds = 1.5\n", "joints.rounds: a whole number was expected, found 1.5"),
        ("influences = 99\n", "joints.influences: 1 to 16 was expected, found 99"),
        ("[lods]\ncount = 33\n", "lods.count: 1 to 32 was expected, found 33"),
        ("[lods]\njoints = [40, 50]\n", "lods.joints: numbers that do not grow were expected"),
        (
            "[lods]\ncount = 3\nvertices = [5, 4]\n",
            "lods.vertices: 3 numbers were expected, found 2",
        ),
        ("[lods]\njoints = [4, true]\n", "lods.joints: a whole number was expected, found True"),
    ):
        path.write_text(plain + change, encoding="utf-8")
        assert words in refused(path, "-o", out)
    path.write_text('[source]\ndna = "nowhere.dna"\n', encoding="utf-8")
    assert "nowhere.dna" in refused(path, "-o", out)
    path.write_text("[source]\n", encoding="utf-8")
    assert "either dna or neutral was expected" in refused(path, "-o", out)
    assert not out.exists()


def test_nothing_that_moves_is_refused_and_oddities_are_named(tmp_path):
    path = face_shapes.write_all(tmp_path / "a")
    positions, faces = face_shapes.head()
    shapes = path.parent / "shapes"
    smile = face_shapes.expressions(positions)["mouthSmileLeft"]
    face_shapes.write_obj(shapes / "again.obj", positions + smile, faces)
    face_shapes.write_obj(shapes / "baked.obj", positions + np.array([0, 3, 0]), faces)
    face_shapes.write_obj(shapes / "still.obj", positions, faces)
    face_shapes.write_obj(shapes / "tall.obj", positions * 10, faces)
    said = command_line.run("author", path, "--names", text=True).stdout
    for words in (
        "mouthSmileLeft is the same as again",
        "baked moves the whole mesh",
        "still moves nothing",
        "tall is far from the neutral mesh",
    ):
        assert words in said
    for file in shapes.glob("*.obj"):
        face_shapes.write_obj(file, positions, faces)
    assert "no expression moves a vertex" in refused(path, "-o", tmp_path / "out.dna")


def test_progress_can_stop_it(folder):
    dna = spec.read_face(spec.read_spec(folder / "spec.toml")).dna
    shares = []

    def tell(share):
        shares.append(share)
        return len(shares) < 3

    with pytest.raises(risorius.DnaError, match="stopped"):
        make_joint_rig(dna, RigOptions(FitOptions(joints=10)), tell)
    assert len(shares) == 3

    def fail(_share):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        make_joint_rig(dna, RigOptions(FitOptions(joints=10)), fail)
