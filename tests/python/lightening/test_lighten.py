# SPDX-License-Identifier: MIT
"""Tests faces with fewer joints, correctives and LODs, which still play the same animation."""

import copy
import csv
import json

import command_line
import full_dna
import jointed_face
import numpy as np
import pytest
import risorius
from risorius import _native
from risorius.author.geometry import skeleton as sk
from risorius.base.budget import BudgetError
from risorius.base.errors import ArgumentError
from risorius.lightening import lighten


@pytest.fixture(scope="module")
def face():
    return jointed_face.build()


@pytest.fixture(scope="module")
def file(face, tmp_path_factory):
    path = tmp_path_factory.mktemp("lighten") / "face.dna"
    face.save(path)
    return path


def vertices(dna, raw, mesh, lod):
    return risorius.Surface(dna, risorius.Rig(dna), lod).positions(raw, mesh)


def test_a_lighter_face_keeps_controls_and_named_joints(face, file, tmp_path):
    out, table = tmp_path / "out.dna", tmp_path / "all.csv"
    done = command_line.run(
        "edit", "lighten", file, "--joints", 30, "--correctives", 5, "--lods", "0,2", "-o", out,
        "--report", table, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "joints                            62            30" in done.stdout
    assert "evaluation, us" in done.stdout
    assert "bytes " in done.stdout
    assert command_line.run("check", out, text=True).returncode == 0
    light = risorius.load(out)
    assert (len(light.joint_names), light.psd_count, light.lod_count) == (30, 5, 2)
    assert light.raw_control_names == face.raw_control_names
    assert light.gui_control_names == face.gui_control_names
    assert set(jointed_face.NAMED) <= set(light.joint_names)
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert len(rows) == 7 + 9
    assert {row["corrective"] for row in rows} == {"", "kept", "removed"}
    sizes = [float(row["largest_mm"]) for row in rows]
    assert sizes == sorted(sizes, reverse=True)
    # The animated map and the corrective that reads the neck solver's pose have the same values in
    # both faces.
    raw = risorius.Rig(face).initial_raw_controls
    raw[7:15] = [0, 0, 0.26, 0.9656] * 2
    raw[:7] = 1
    before, after = risorius.Rig(face).evaluate(raw), risorius.Rig(light).evaluate(raw)
    np.testing.assert_array_equal(before.animated_maps, after.animated_maps)
    assert after.controls[len(raw) + 4] == pytest.approx(before.controls[len(raw) + 8], abs=1e-6)
    assert before.controls[len(raw) + 8] > 0.9


def test_what_is_said_of_an_expression_is_so(face):
    light, report = lighten(face, joints=34)
    said = {row.name: row for row in report.expressions}
    raw = risorius.Rig(face).initial_raw_controls
    raw[3] = 1
    row = said["CTRL_expressions.mouthSmileRight"]
    way = vertices(face, raw, row.lod, row.lod) - vertices(light, raw, row.lod, row.lod)
    assert row.largest_mm == pytest.approx(10 * np.linalg.norm(way, axis=1).max(), rel=1e-3)
    # Remaining joints keep their motion, and vertices without weights on removed joints keep their
    # weights.
    same = [face.joint_names.index(name) for name in light.joint_names]
    old, new = risorius.Rig(face).evaluate(raw).joints, risorius.Rig(light).evaluate(raw).joints
    np.testing.assert_array_equal(old[same], new)
    for mesh, other in zip(face.meshes, light.meshes, strict=True):
        a, b = sk.dense_weights(mesh, 62), sk.dense_weights(other, 34)
        left = np.ones(62, bool)
        left[same] = False
        untouched = ~a[:, left].any(axis=1)
        assert untouched.any()
        np.testing.assert_array_equal(a[untouched][:, same], b[untouched])
        assert (np.diff(other.skin_offsets.astype(int)) <= 4).all()
        assert np.asarray(other.skin_weights).min() >= 0
        sums = np.add.reduceat(other.skin_weights, other.skin_offsets[:-1])
        np.testing.assert_allclose(sums, 1, atol=1e-5)


def test_weights_are_fitted_and_both_sides_alike(face):
    light, report = lighten(face, joints=34)
    left = [face.joint_names.index(name) for name in report.removed_joints]
    assert len(left) == 28
    sides = {j + (1 if j % 2 else -1) for j in left if 9 <= j < 57}  # indices of pairs are adjacent
    assert len(sides & set(left)) >= len(sides) - 1
    stays = [name not in report.removed_joints for name in face.joint_names]
    plain = _native.keep_parts(face, joints=stays, correctives=[True] * 9)
    squares = {"fitted": 0.0, "plain": 0.0}
    for control in range(7):
        raw = risorius.Rig(face).initial_raw_controls
        raw[control] = 1
        goal = vertices(face, raw, 0, 0)
        squares["fitted"] += float(((vertices(light, raw, 0, 0) - goal) ** 2).sum())
        squares["plain"] += float(((vertices(plain, raw, 0, 0) - goal) ** 2).sum())
    assert squares["fitted"] < 0.35 * squares["plain"]
    # If the neck rotates, the light face differs from the original face by less than 0.15 cm.
    moved = np.zeros((2, 62, 9))
    moved[1, 2, 5] = 15.0
    world = sk.world_matrices(face, moved)
    motion = (world[1] @ np.linalg.inv(world[0]))[:, :3]
    mesh, other = face.meshes[0], light.meshes[0]
    same = [face.joint_names.index(name) for name in light.joint_names]
    points = np.asarray(mesh.positions, float)
    a = sk.skinned(points, sk.dense_weights(mesh, 62), motion)
    b = sk.skinned(points, sk.dense_weights(other, 34), motion[same])
    assert np.abs(a - b).max() < 0.15


def test_shapes_hold_the_rest_where_a_level_has_shapes(face):
    fine = face.filter_lods([0, 1])
    light, report = lighten(fine, joints=20, shapes_mm=0.2)
    without = lighten(fine, joints=20)[1]
    assert without.expressions[0].largest_mm > 3
    singles = [row.largest_mm for row in report.expressions if not row.corrective]
    assert max(singles) < 0.201
    assert report.expressions[0].largest_mm < 0.5
    assert report.after.deltas > report.before.deltas
    assert light.validate() == []


def test_correctives_that_move_least_leave(face):
    light, report = lighten(face, correctives=6)
    assert light.joint_names == face.joint_names
    assert light.psd_count == 6
    names = [name.replace("CTRL_expressions.", "") for name in report.removed_correctives]
    # Later correctives move the face less, so that they are removed. Exceptions are number 6, which
    # drives the animated map, and the last one, which moves the face as much as a smile.
    assert all("jawOpen + neck" not in name for name in names)
    assert "eyeBlinkLeft + mouthSmileRight + jawOpen" not in names
    assert len(report.removed_correctives) == 3
    # Only one channel is removed: the channel that a removed corrective drives.
    none, _ = lighten(face, correctives=2, measured=False)
    assert none.psd_count == 2
    assert none.blend_shape_channel_names == face.blend_shape_channel_names[:-1]


def test_every_layer_is_counted_anew():
    dna = full_dna.full()
    light = _native.keep_parts(dna, joints=[True] * 3, correctives=[True, False])
    raw = np.array([0.1, 0.2, 0.3, 0.9, 0.7], np.float32)
    before, after = risorius.Rig(dna).evaluate(raw), risorius.Rig(light).evaluate(raw)
    stays = [0, 1, 2, 3, 4, 5, 7, 8, 9, 10]
    np.testing.assert_array_equal(before.controls[stays], after.controls)
    np.testing.assert_array_equal(before.joints, after.joints)
    with pytest.raises(risorius.DnaError, match="joint 2 cannot stay without its parent"):
        _native.keep_parts(dna, joints=[True, False, True], correctives=[True, True])
    with pytest.raises(risorius.DnaError, match="one value for each"):
        _native.keep_parts(dna, joints=[True, True], correctives=[True, True])
    # Networks, twist setups and swing setups move two of the three joints, which must stay.
    with pytest.raises(ArgumentError, match="must stay were expected"):
        lighten(dna, joints=1)


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (["--joints", 63], 1, "joints: at most the 62 that the face has were expected, found 63"),
        (["--joints", 8], 1, "joints: at least 9 joints that must stay were expected (root, "),
        (["--joints", 10, "--keep", "FACIAL_C_Skin0,FACIAL_C_Skin1"], 1, "at least 11 joints"),
        (["--joints", 20, "--keep", "nose"], 1, "keep: there is no joint 'nose'"),
        (["--lods", "0,3"], 1, "lods: 0 to 2 were expected, found 3"),
        (["--correctives", 10], 1, "at most the 9 that the face has were expected, found 10"),
        (["--correctives", 0], 1, "at least 1 corrective that networks, solvers or maps read"),
        ([], 2, "--joints, --correctives or --lods was expected"),
        (["--joints", 20, "--report", "page.html"], 2, "--report"),
        (["--joints", "many"], 2, "--joints"),
    ],
)
def test_what_cannot_be_done_is_a_sentence(file, tmp_path, options, code, words):
    out = tmp_path / "out.dna"
    done = command_line.run("edit", "lighten", file, "-o", out, *options, text=True)
    assert done.returncode == code
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert not out.exists()


def test_faces_that_cannot_be_lighter_are_refused(face, tmp_path):
    plain = copy.copy(face)
    plain.psds, plain.psd_count = risorius.Psds(), 0
    plain.animated_maps = risorius.AnimatedMaps()
    plain.rbf_behavior, plain.rbf_behavior_ext = risorius.RbfBehavior(), risorius.RbfBehaviorExt()
    plain.joint_groups, plain.blend_shape_channels = [], risorius.BlendShapeChannels()
    with pytest.raises(ArgumentError, match="the face has none"):
        lighten(plain, correctives=1)
    broken = copy.copy(face)
    meshes = list(face.meshes)
    meshes[1] = copy.copy(meshes[1])
    meshes[1].skin_weights = np.where(np.arange(len(meshes[1].skin_weights)) == 5, np.nan, 0.25)
    broken.meshes = meshes
    with pytest.raises(ArgumentError, match="head_lod1_mesh: skin weights that are finite"):
        lighten(broken, joints=20)
    bare = copy.copy(face)
    bare.meshes = []
    with pytest.raises(ArgumentError, match="a face with meshes was expected"):
        lighten(bare, joints=20)
    many = copy.copy(face)
    many.raw_control_names = [*face.raw_control_names, *(f"c{i}" for i in range(50_000))]
    with pytest.raises(BudgetError, match="50,015 controls in 50,024 poses"):
        lighten(many, joints=20)
    with pytest.raises(risorius.DnaError, match="stopped"):
        lighten(face, joints=20, progress=lambda share: share < 0.3)


def test_json_says_all(file, tmp_path):
    done = command_line.run(
        "edit", "lighten", file, "--lods", "1", "-o", tmp_path / "one.json", "--json", text=True
    )
    said = json.loads(done.stdout)
    assert said["lods"] == [1]
    assert said["after"]["levels"] == 1
    # A face with only LOD 1 of the original has no errors at this LOD.
    assert max(row["largest_mm"] for row in said["expressions"]) < 1e-3
