# SPDX-License-Identifier: MIT
"""Tests faces mixed by region, compared with a calculation in this test."""

import copy
import importlib.util
import json
import os
import zlib
from pathlib import Path

import face_shapes
import numpy as np
import pytest
import risorius
import sample_people
from risorius.author import FitOptions, LodOptions, RigOptions, make_joint_rig
from risorius.author.input import spec
from risorius.base.errors import ArgumentError
from risorius.cli import main
from risorius.files.png import png, read_png
from risorius.mixing import REGIONS, Masks, Mix, check_compatible, difference, mix_faces

_ORACLE = Path(__file__).parents[3] / "blender_tests" / "support" / "oracle.py"
_SPEC = importlib.util.spec_from_file_location("blender_oracle_mixing", _ORACLE)
oracle = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(oracle)

OPTIONS = RigOptions(FitOptions(joints=24, rounds=4), lods=LodOptions(count=3))


def stretched(dna, factors, lift):
    """A copy of a face with blend shapes, scaled by `factors` (x, y, z) and then raised by `lift`.

    Joint 0 stays where it was; `lift` is in the file's unit.
    """
    out = copy.deepcopy(dna)
    meshes = []
    for mesh in out.meshes:
        mesh.positions = np.asarray(mesh.positions, np.float64) * factors + [0, lift, 0]
        targets = mesh.blend_shape_targets
        for target in targets:
            target.deltas = np.asarray(target.deltas) * factors
        mesh.blend_shape_targets = targets
        meshes.append(mesh)
    out.meshes = meshes
    shifts = np.array(out.neutral_joint_translations, np.float64)
    shifts[1:] *= factors
    shifts[1] += [0, lift, 0]
    out.neutral_joint_translations = shifts
    return out


@pytest.fixture(scope="module")
def faces(tmp_path_factory):
    """Three joint faces with equal topology.

    The second is narrow; the third is 1.2 times as large and 30 units higher.
    """
    folder = tmp_path_factory.mktemp("mixing")
    face_shapes.write_all(folder)
    dna = spec.read_face(spec.read_spec(folder / "spec.toml")).dna
    first = make_joint_rig(dna, OPTIONS)
    out = [first.dna]
    for factors, lift in (([0.8, 1.1, 1.0], 0.0), ([1.2, 1.2, 1.2], 30.0)):
        other = stretched(dna, np.array(factors), lift)
        out.append(make_joint_rig(other, OPTIONS, like=first.reference).dna)
    for dna, name in zip(out, ("one", "narrow", "high"), strict=True):
        dna.name = name
    return out


def dense_joints(dna):
    """Values of all joint groups as one matrix, float64[9 * joints, controls].

    The controls are the raw controls and the correctives.
    """
    out = np.zeros((9 * len(dna.joint_names), len(dna.raw_control_names) + dna.psd_count))
    for group in dna.joint_groups:
        out[np.ix_(group.output_indices, group.input_indices)] += group.values
    return out


def dense_targets(mesh, channels):
    out = np.zeros((channels, len(mesh.positions), 3))
    for target in mesh.blend_shape_targets:
        out[target.blend_shape_channel_index, target.vertex_indices] += target.deltas
    return out


@pytest.mark.parametrize(("shares", "at"), [([1, 0, 0], 0), ([0, 2, 0], 1), ([0, 0, 0.5], 2)])
def test_one_share_is_that_parent_bit_for_bit(faces, shares, at):
    assert mix_faces(faces, Mix(shares)).to_bytes() == faces[at].to_bytes()


def test_halves_are_the_mean_of_all_numbers(faces):
    """If both shares are equal, each number of the mix is the mean of the parents' numbers."""
    one, narrow, _ = faces
    mixed = mix_faces([one, narrow], Mix([0.5, 0.5]))
    assert mixed.validate() == []
    assert risorius.load(mixed.to_bytes()).validate() == []
    for m, mesh in enumerate(mixed.meshes):
        parents = [dna.meshes[m] for dna in (one, narrow)]
        for name in ("positions", "texture_coordinates"):
            mean = (np.asarray(getattr(parents[0], name)) + getattr(parents[1], name)) / 2
            np.testing.assert_allclose(getattr(mesh, name), mean, atol=2e-6)
        count = len(mixed.blend_shape_channel_names)
        mean = sum(dense_targets(p, count) for p in parents) / 2
        np.testing.assert_allclose(dense_targets(mesh, count), mean, atol=2e-6)
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-5)
        np.testing.assert_allclose(mesh.skin_weights, parents[0].skin_weights, atol=1e-6)
    shifts = [np.asarray(d.neutral_joint_translations) for d in (mixed, one, narrow)]
    np.testing.assert_allclose(shifts[0], (shifts[1] + shifts[2]) / 2, atol=2e-6)
    rows = [dense_joints(d) for d in (mixed, one, narrow)]
    np.testing.assert_allclose(rows[0], (rows[1] + rows[2]) / 2, atol=1e-5)


def test_a_mix_moves_half_way_between_its_parents(faces):
    """An expression of the mix is the mean of its parents' expressions, within 0.3 mm.

    The vertices are computed without the package.
    """
    one, narrow, _ = faces
    mixed = mix_faces([one, narrow], Mix([0.5, 0.5]))
    values = np.zeros(len(one.raw_control_names), np.float32)
    values[list(one.raw_control_names).index("CTRL_expressions.mouthCornerPullL")] = 1
    posed = [oracle.vertices(d, 0, risorius.Rig(d).evaluate(values)) for d in (mixed, one, narrow)]
    apart = np.linalg.norm(posed[0] - (posed[1] + posed[2]) / 2, axis=1)
    assert apart.max() * 1000 < 0.3
    assert np.linalg.norm(posed[1] - posed[2], axis=1).max() > 0.005


def test_blend_shapes_keep_the_order_of_the_first_parent(faces):
    one, narrow = (copy.copy(dna) for dna in faces[:2])
    targets = one.meshes[0].blend_shape_targets
    order = [int(t.blend_shape_channel_index) for t in targets][::-1]
    assert order != sorted(order)
    mesh = one.meshes[0]
    mesh.blend_shape_targets = targets[::-1]
    one.meshes = [mesh, *one.meshes[1:]]
    mixed = mix_faces([one, narrow], Mix([0.5, 0.5])).meshes[0].blend_shape_targets
    assert [int(t.blend_shape_channel_index) for t in mixed] == order


@pytest.mark.parametrize("sign", [1, -1])
def test_the_mean_of_two_turns_lies_on_the_short_way(faces, sign):
    """The mean of 170 and -170 degrees is 180 degrees, not 0."""
    parents = [copy.copy(faces[0]), copy.copy(faces[0])]
    for dna, angle in zip(parents, (170.0, -170.0), strict=True):
        turns = np.array(dna.neutral_joint_rotations)
        turns[-1] = [0, 0, sign * angle]
        dna.neutral_joint_rotations = turns
    mixed = np.asarray(mix_faces(parents, Mix([0.5, 0.5])).neutral_joint_rotations)
    np.testing.assert_allclose([*mixed[-1, :2], abs(mixed[-1, 2])], [0, 0, 180], atol=1e-4)


def test_levels_keep_their_rows(faces):
    mixed = mix_faces(faces[:2], Mix([0.5, 0.5]))
    for lod in range(3):
        counts = [sum(int(g.lods[lod]) for g in d.joint_groups) for d in (mixed, *faces[:2])]
        assert counts[0] >= max(counts[1:])
        pose = risorius.Rig(mixed).evaluate(
            np.ones(len(mixed.raw_control_names), np.float32) * 0.3, lod=lod
        )
        assert np.isfinite(pose.joints).all()


def test_a_region_takes_the_other_ones_form_to_its_own_place(faces):
    one, _, high = faces
    mixed = mix_faces([one, high], Mix([1, 0], {"mouth": {1: 1}}))
    masks = Masks(one).meshes[0]
    mouth = masks[:, REGIONS.index("mouth")]
    before, after = (np.asarray(d.meshes[0].positions, np.float64) for d in (one, mixed))
    np.testing.assert_allclose(after[mouth < 1e-9], before[mouth < 1e-9], atol=1e-6)
    # The other face is 30 units higher and a fifth larger, otherwise equal, so that its mouth at
    # the size of the first face differs in nothing.
    np.testing.assert_allclose(after, before, atol=1e-4)
    other = copy.deepcopy(high)
    mesh = other.meshes[0]
    # One half of the other face's mouth is moved forward. The mix contains this movement at the
    # size of the first face.
    left = before[:, 0] > 0
    mesh.positions = np.asarray(mesh.positions) + np.outer(0.6 * (left & (mouth > 0.5)), [0, 0, 1])
    other.meshes = [mesh, *other.meshes[1:]]
    halved = mix_faces([one, other], Mix([1, 0], {"mouth": {1: 1}}))
    moved = np.asarray(halved.meshes[0].positions, np.float64)[:, 2] - before[:, 2]
    inside = mouth > 0.75
    step = moved[inside & left].mean() - moved[inside & ~left].mean()
    share = (mouth[inside & left]).mean()
    assert step == pytest.approx(share * 0.6 / 1.2, rel=0.1)


def test_half_of_a_region_is_half_as_far(faces):
    one, narrow, _ = faces
    whole = mix_faces([one, narrow], Mix([1, 0], {"jaw": {1: 1}}))
    half = mix_faces([one, narrow], Mix([1, 0], {"jaw": {1: 0.5}}))
    a, b, c = (np.asarray(d.meshes[0].positions, np.float64) for d in (one, half, whole))
    np.testing.assert_allclose(b - a, (c - a) / 2, atol=1e-5)
    assert np.abs(c - a).max() > 0.05


def test_masks_are_shares(faces):
    masks = Masks(faces[0])
    for part, mesh in zip(masks.meshes, faces[0].meshes, strict=True):
        assert part.shape == (len(mesh.positions), len(REGIONS))
        np.testing.assert_allclose(part.sum(axis=1), 1, atol=1e-9)
        assert part.min() >= 0
    assert masks.is_empty("neck")
    assert not masks.is_empty("mouth")


@pytest.mark.parametrize(
    ("mix", "sentence"),
    [
        (Mix([0, 0]), "one of them above 0"),
        (Mix([-1, 2]), "shares from 0 on"),
        (Mix([1, float("nan")]), "shares from 0 on"),
        (Mix([1, 0], {"mouth": {1: 1.5}}), "mouth: shares from 0 to 1, and at most 1 together"),
        (Mix([1, 0], {"mouth": {0: 0.6, 1: 0.6}}), "at most 1 together"),
        (Mix([1, 0], {"toe": {1: 1}}), "a region of brow, eyes, nose"),
        (Mix([1, 0], {"neck": {1: 1}}), "no vertex of one is of the region neck"),
    ],
)
def test_shares_that_make_no_sense_are_one_sentence(faces, mix, sentence):
    with pytest.raises(ArgumentError, match=sentence):
        mix_faces(faces[:2], mix)


def _rename(field, index, name):
    def change(dna):
        names = list(getattr(dna, field))
        names[index] = name
        setattr(dna, field, names)

    return change


def _exchanged(field):
    def change(dna):
        names = list(getattr(dna, field))
        setattr(dna, field, [names[1], names[0], *names[2:]])

    return change


def _fewer_faces(dna):
    mesh = dna.meshes[0]
    mesh.face_layouts = np.asarray(mesh.face_layouts)[: mesh.face_offsets[-2]]
    mesh.face_offsets = np.asarray(mesh.face_offsets)[:-1]
    dna.meshes = [mesh, *dna.meshes[1:]]


def _turned_faces(dna):
    mesh = dna.meshes[0]
    mesh.face_layouts = np.roll(np.asarray(mesh.face_layouts), 4)
    dna.meshes = [mesh, *dna.meshes[1:]]


def _metres(dna):
    dna.translation_unit = "m"


def _hung_elsewhere(dna):
    parents = [int(p) for p in dna.joint_parents]
    parents[-1] = 0
    dna.joint_parents = parents


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (_rename("raw_control_names", 0, "CTRL_expressions.other"), "it has no raw control CTRL"),
        (_rename("joint_names", -1, "other"), "it has no joint FACIAL"),
        (_rename("mesh_names", 0, "other"), "it has no mesh"),
        (_exchanged("raw_control_names"), "its raw controls are in another order"),
        (_fewer_faces, "faces, not"),
        (_turned_faces, "has its faces in another order"),
        (_metres, "translation_unit is m, not cm"),
        (_hung_elsewhere, "a joint hangs on another one"),
    ],
)
def test_what_does_not_go_together_is_said(faces, change, why):
    other = copy.deepcopy(faces[1])
    change(other)
    assert why in difference(faces[0], other)
    with pytest.raises(ArgumentError, match=r"b\.dna cannot be mixed with a\.dna: "):
        check_compatible([faces[0], other], ["a.dna", "b.dna"])
    assert difference(faces[0], faces[1]) is None


@pytest.fixture
def files(faces, tmp_path):
    """A folder with the faces' files, each with a one-coloured skin texture and a wrinkle mask."""
    for number, dna in enumerate(faces):
        own = copy.copy(dna)
        own.metadata = {f"texture:{dna.mesh_names[0]}:color": "skin.png"}
        own.save(tmp_path / f"{dna.name}.dna")
        folder = tmp_path / f"{dna.name}_textures"
        folder.mkdir()
        folder.joinpath("skin.png").write_bytes(png(np.full((4, 8, 3), 0.2 * (number + 1))))
        folder.joinpath("head_wm1_blink_L_msk.png").write_bytes(png(np.full((4, 4), 0.4 * number)))
    return tmp_path


def test_the_command_writes_a_face_with_its_textures(files, faces, capsys):
    out = files / "child.dna"
    command = ["mix", f"{files / 'one.dna'}=3", f"{files / 'narrow.dna'}=1", "-o", str(out)]
    assert main([*command, "--mouth", f"{files / 'high.dna'}=1"]) == 0
    said = capsys.readouterr().out
    assert "one 75%, narrow 25%" in said
    assert "mouth: high 100%" in said
    child = risorius.load(out)
    assert child.name == "child"
    regions = {"mouth": {2: 1}}
    expected = mix_faces(faces, Mix([3, 1, 0], regions))
    np.testing.assert_array_equal(child.meshes[0].positions, expected.meshes[0].positions)
    skin = read_png((files / "child_textures" / "skin.png").read_bytes())
    np.testing.assert_allclose(skin, 0.75 * 0.2 + 0.25 * 0.4, atol=0.003)
    mask = read_png((files / "child_textures" / "head_wm1_blink_L_msk.png").read_bytes())
    np.testing.assert_allclose(mask, 0.25 * 0.4, atol=0.003)
    assert main(["info", str(out), "--mix-with", str(files / "one.dna")]) == 0
    assert "mixes with" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("ours", "theirs", "why"),
    [
        (b"a picture of another program", None, "Risorius mixes its own kind of PNG alone"),
        (png(np.full((4, 8, 4), 0.5)), None, "they have opacity, as hair has"),
        (None, png(np.full((8, 8, 3), 0.5)), "the faces have them in different sizes"),
        (None, png(np.full((4, 8, 3), 0.5))[:-40], "Risorius mixes its own kind of PNG alone"),
        (None, b"", "not every face has them"),
    ],
    ids=["another program's", "opacity", "size", "damaged", "missing"],
)
def test_a_picture_that_is_not_mixed_is_taken_as_it_is_and_why_is_said(
    files, capsys, ours, theirs, why
):
    pictures = [files / f"{name}_textures" / "skin.png" for name in ("one", "narrow")]
    for picture, data in zip(pictures, (ours, theirs), strict=True):
        if data is not None:
            picture.write_bytes(data)
    if theirs == b"":
        pictures[1].unlink()
    out = files / "child.dna"
    command = ["mix", str(files / "one.dna"), f"{files / 'narrow.dna'}=0.5", "-o", str(out)]
    assert main(command) == 0
    assert f"  pictures of one, as {why}: skin.png\n" in capsys.readouterr().out
    assert (files / "child_textures" / "skin.png").read_bytes() == pictures[0].read_bytes()


@pytest.mark.skipif(os.name == "nt", reason="Windows has no files of these names")
def test_names_of_pictures_lead_nowhere_and_two_of_one_file_are_one(files, capsys):
    dna = risorius.load(files / "one.dna")
    hostile = ["../up.png", "..\\up.png", "CON.png", "x:y.png", ".hid.png", str(files / "abs.png")]
    names = [*hostile, "Two.png", "two.png"]
    dna.metadata = {f"texture:{dna.mesh_names[0]}:{n}": name for n, name in enumerate(names)}
    dna.save(files / "one.dna")
    for name in names:
        (files / "one_textures" / name).write_bytes(b"a picture")
    before = {path for path in files.rglob("*")}
    command = ["mix", str(files / "one.dna"), str(files / "one.dna"), "-o", str(files / "new.dna")]
    assert main(command) == 0
    new = {path.relative_to(files).as_posix() for path in set(files.rglob("*")) - before}
    assert new == {
        "new.dna", "new_textures", "new_textures/Two.png",
        "new_textures/head_wm1_blink_L_msk.png",
    }  # fmt: skip
    mine = files / "new_textures" / "Two.png"
    mine.write_bytes(b"mine")
    (files / "new.dna").unlink()
    capsys.readouterr()
    assert main(command) == 1
    assert f"{mine}: a picture of this name is there, and no new.dna" in capsys.readouterr().err
    assert mine.read_bytes() == b"mine"
    assert not (files / "new.dna").exists()


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (["one.dna", "absent.dna"], 1, "absent.dna: No such file"),
        (["one.dna=x"], 1, "one.dna=x"),
        (["one.dna", "--mouth", "narrow.dna"], 2, "--mouth: FILE=SHARE was expected"),
        (["one.dna=0"], 1, "one of them above 0"),
        (["one.dna", "--neck", "narrow.dna=1"], 1, "no vertex of one is of the region neck"),
        (["child.dna", "one.dna"], 2, "child.dna: the output is the input itself: choose another"),
        (["one.dna", "other.dna"], 1, "other.dna cannot be mixed with one.dna: it has no joint"),
    ],
)
def test_bad_input_is_one_sentence_and_no_file(
    files, faces, monkeypatch, capsys, arguments, code, sentence
):
    monkeypatch.chdir(files)
    other = copy.deepcopy(faces[1])
    _rename("joint_names", -1, "other")(other)
    other.save("other.dna")
    is_there = "child.dna" in arguments
    if is_there:
        faces[0].save("child.dna")
    assert main(["mix", *arguments, "-o", "child.dna"]) == code
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1
    assert Path("child.dna").exists() == is_there
    assert not Path("child_textures").exists()


def test_check_and_info_say_what_mixes(files, faces, monkeypatch, capsys):
    monkeypatch.chdir(files)
    other = copy.deepcopy(faces[1])
    _rename("joint_names", -1, "other")(other)
    other.save("other.dna")
    assert main(["check", "--mix", "one.dna", "narrow.dna", "other.dna"]) == 1
    said = capsys.readouterr().out
    assert "narrow.dna: mixes with one.dna" in said
    assert "other.dna: cannot be mixed: it has no joint" in said
    assert main(["check", "--mix", "--json", "one.dna", "narrow.dna"]) == 0
    assert json.loads(capsys.readouterr().out)["files"][1]["mixes"] is True
    assert main(["info", "one.dna", "--mix-with", "narrow.dna", "other.dna", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["narrow.dna"] is None
    assert "it has no joint" in found["other.dna"]


def test_pictures_are_read_back_or_refused():
    random = np.random.default_rng(1)
    image = np.rint(random.random((6, 5, 3)) * 255) / 255
    data = png(image)
    np.testing.assert_allclose(read_png(data), image, atol=1e-9)
    np.testing.assert_allclose(read_png(png(image[..., 0])), image[..., 0], atol=1e-9)
    slope = np.rint(np.linspace(0, 1, 48).reshape(6, 8) * 255) / 255
    for whole in (slope, slope[..., None] * [1, 0.2, 0], slope.T, random.random((6, 8)) > 0.5):
        exact = np.rint(np.asarray(whole, float) * 255) / 255
        np.testing.assert_allclose(read_png(png(exact)), exact, atol=1e-9)
    level = np.rint(255 * np.add.outer(np.arange(64) / 90, np.arange(64) / 300)) / 255
    assert len(png(level)) < 0.6 * len(zlib.compress(np.uint8(np.rint(level * 255)).tobytes(), 6))
    for _ in range(300):
        broken = bytearray(data)
        for at in random.integers(len(data), size=3):
            broken[at] ^= 1 << random.integers(8)
        if random.random() < 0.3:
            broken = broken[: random.integers(len(data))]
        found = read_png(bytes(broken))
        assert found is None or found.shape[0] * found.shape[1] <= 1 << 26


def test_extra_mixed_sample_people_have_round_eyes_and_no_flipped_faces():
    """Mixes of the man and the girl, the most different person, as a whole and by region.

    Their eyes are as round as the parents' eyes, and no polygon is flipped against both parents.
    """
    both = [sample_people.assembled(name)[0] for name in ("man", "girl")]
    masks = Masks(both[0])
    mixes = [Mix([1.0, 1.0])]
    mixes += [Mix([1, 0], {region: {1: 1.0}}) for region in REGIONS if not masks.is_empty(region)]
    assert len(mixes) == 1 + len(REGIONS)
    for mix in mixes:
        dna = mix_faces(both, mix, masks=masks)
        assert dna.validate() == []
        for name in ("eyeLeft_lod0_mesh", "eyeRight_lod0_mesh"):
            off = [_roundness(d.meshes[list(d.mesh_names).index(name)]) for d in (dna, *both)]
            assert off[0] <= 1.05 * max(off[1:])
        head = list(dna.mesh_names).index("head_lod0_mesh")
        own, *parents = (_normals(d.meshes[head]) for d in (dna, *both))
        # Normals are compared with both parents, whose normals are opposite deep in nostrils and
        # lips.
        flipped = np.all([(own * p).sum(axis=1) < 0 for p in parents], axis=0)
        assert flipped.sum() == 0, mix.regions


def _roundness(mesh):
    """Standard deviation of the radii of an eye's vertices, relative to their mean radius."""
    points = np.asarray(mesh.positions, np.float64)
    rows = np.column_stack([2 * points, np.ones(len(points))])
    solved, *_ = np.linalg.lstsq(rows, (points**2).sum(axis=1), rcond=None)
    radius = np.linalg.norm(points - solved[:3], axis=1)
    return float(radius.std() / radius.mean())


def _normals(mesh):
    corners = np.asarray(mesh.layout_positions)[np.asarray(mesh.face_layouts)].reshape(-1, 4)
    a, b, c, d = (np.asarray(mesh.positions, np.float64)[corners[:, k]] for k in range(4))
    return np.cross(c - a, d - b)
