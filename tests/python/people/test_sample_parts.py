# SPDX-License-Identifier: MIT
"""Tests teeth, lips and shirt of the sample people, and differences of their left and right side.

Tests of the real data are skipped if the data are missing.
"""

import numpy as np
import pytest
import risorius
import sample_people
from risorius.author.geometry import rigid
from risorius.author.geometry.polygon_mesh import polygon_mesh
from risorius_people import askew, build, clothes, people, proportions, source
from risorius_people.eyes import with_eyeballs
from risorius_people.mouth import lips, teeth, tongue
from risorius_people.paint.layout import islands
from risorius_people.polygons import edges_of

MM = 0.01  # in the data's unit, decimetres


@pytest.fixture(scope="module")
def data():
    return sample_people.data()


@pytest.fixture(scope="module")
def base(data):
    return data.base_mesh()


@pytest.fixture(scope="module")
def man():
    return sample_people.body("man")


def _pieces(polygons):
    """The number of connected pieces of a mesh, counted as its UV islands."""
    return len(np.unique(islands(polygons)))


def test_extra_there_are_28_single_teeth_as_large_as_those_of_people(base):
    crowns, gums = teeth.mouth_parts(base, 0)
    assert _pieces(crowns.polygons) == 28
    assert _pieces(gums.polygons) == 4  # an outer and an inner side for each jaw
    points = crowns.carry(base.positions) / MM
    size = len(points) // 28
    first = points[:size]  # a middle upper incisor
    assert 7.5 < np.ptp(first[:, 0]) < 9.0
    assert 9.0 < np.ptp(first[:, 1]) < 13.7  # with a part of the root
    assert np.allclose(crowns.operators[0].apply(np.ones((len(base.positions), 1))), 1)


def test_a_jaw_turns_on_everybody_as_it_does_on_the_man():
    """Parts that the jaw moves keep their form on every person, even if their lips are small."""
    rng = np.random.default_rng(5)
    before = rng.uniform(-1, 1, (60, 3))
    before[:20] *= 0.2
    faces = [[(i, i), ((i + 1) % 60, i), ((i + 7) % 60, i), ((i + 9) % 60, i)] for i in range(60)]
    base = source.BaseMesh(before, np.zeros((60, 2)), {"body": faces})
    groups = {"body": np.arange(20, 60), "helper-lower-teeth": np.arange(20)}
    after = before * [0.7, 0.5, 0.9] + rng.uniform(-0.05, 0.05, (60, 3))
    turn = rigid.part_rotation(np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0.0]]), 0.3)
    way = proportions.Proportions(base, groups, before, after).carried(
        before @ turn.T + [0.0, -0.1, 0.05] - before
    )
    found, shift = rigid.rigid_fit(after, after + way)
    assert found == pytest.approx(turn, abs=1e-3)
    # Vertices that the jaw moves by less than 0.5 mm get no jaw motion, so that they may differ by
    # 0.5 mm.
    assert np.abs(after @ found.T + shift - after - way).max() < 0.006


def test_extra_teeth_and_eyeballs_keep_their_form_in_every_expression(man):
    for name, unit in man.units.items():
        for group in ("helper-upper-teeth", "helper-lower-teeth", "eyeball-l"):
            if "Pupil" in name and "eye" in group:
                continue
            before = man.positions[man.groups[group]]
            after = before + unit.displacement[man.groups[group]]
            apart = np.linalg.norm(before - before[:1], axis=1)
            assert np.allclose(np.linalg.norm(after - after[:1], axis=1), apart, atol=1e-9), name
    upper = man.units["teethLeftU"].displacement[man.groups["helper-upper-teeth"]]
    assert np.allclose(np.linalg.norm(upper, axis=1), 2 * MM, atol=0.05 * MM)
    assert not man.units["teethLeftU"].displacement[man.groups["helper-lower-teeth"]].any()


def test_extra_lips_rest_on_each_other(data, base, man):
    full = with_eyeballs(base)
    count = len(full.positions)
    mouth = lips.Mouth(full, data.face_unit("mouthPucker", count), data.face_unit("jawOpen", count))
    gaps = lips.gap_across(mouth, mouth.operator.apply(man.positions))[1]
    assert len(gaps) > 15
    assert gaps.max() < 0.25 * MM
    assert gaps.min() > -0.6 * MM
    # The lips of the unchanged data are open.
    raw = lips.gap_across(mouth, mouth.operator.apply(full.positions))[1]
    assert raw.max() > 0.5 * MM


def _tongue_in_lip(dna, poses):
    """The largest height of the lower lip above the underside of the tongue in each pose, in mm.

    Args:
        dna: a sample person.
        poses: for each pose, raw control without prefix and side -> value.
    """
    rig = risorius.Rig(dna)
    surface = risorius.Surface(dna, rig)
    names = [name.removeprefix("CTRL_expressions.") for name in dna.raw_control_names]
    head, tongue = (list(dna.mesh_names).index(f"{n}_lod0_mesh") for n in ("head", "tongue"))

    def posed(mesh, values):
        raw = [values.get(name, values.get(name[:-1], 0.0)) for name in names]
        return surface.positions(np.array(raw, np.float32), mesh) * surface.mm

    rest = posed(head, {})
    wide, _, front = posed(tongue, {}).max(axis=0)
    near = (np.abs(rest[:, 0]) < 0.5 * wide) & (np.abs(rest[:, 2] - front) < 15)
    lower = near & (rest[:, 1] - posed(head, {"jawOpen": 1})[:, 1] > 10)  # moved by the jaw
    out = []
    for values in poses:
        lip, points = posed(head, values)[lower], posed(tongue, values)
        sinks = []
        for x in np.linspace(-0.4 * wide, 0.4 * wide, 9):
            column = lip[np.abs(lip[:, 0] - x) < 1.5]
            ridge = column[column[:, 1].argmax()]
            over = points[np.abs(points - ridge)[:, [0, 2]].max(axis=1) < 2.5]
            sinks.append(ridge[1] - over[:, 1].min())
        out.append(max(sinks))
    return out


def test_extra_a_tongue_that_is_put_out_lies_on_the_lip():
    """A smile raises the lower lip by 6 mm, but the lip must not come through the tongue."""
    dna = sample_people.assembled("man")[0]
    others = ("mouthLipsPress", "mouthLowerLipRollIn", "mouthDown")
    lifts = [{}, {"mouthCornerPull": 0.5}, *({n: 1} for n in (*tongue.LIFTING, *others))]
    for jaw, most in ((0.3, 6.8), (0.6, 5), (1, 2)):  # soft flesh may overlap by some millimetres
        poses = [lift | {"tongueOut": 1, "jawOpen": jaw} for lift in lifts]
        for lift, deep in zip(lifts, _tongue_in_lip(dna, poses), strict=True):
            assert -4 < deep < most, (lift, jaw)


def test_extra_a_shirt_has_a_collar_and_one_hem(base):
    part = clothes.shirt(base, 1)
    borders = clothes.rings(part.polygons)
    assert len(borders) == 2  # no hole at a shoulder
    assert max(len(owners) for owners in edges_of(part.polygons.faces).values()) == 2
    points = part.carry(base.positions)
    assert points[:, 1].max() < 6.1
    assert np.allclose(part.carry(np.ones((len(base.positions), 1))), 1)


def test_extra_skin_in_the_shirt_rests_in_every_expression(base, man):
    """No control except breath moves skin below the shirt.

    Otherwise the skin would come through the collar, for example in a shout.
    """
    skin = man.groups["body"]
    skin = skin[np.abs(base.positions[skin, 0]) < 1]
    heights = clothes.collar_heights(base.positions[skin])
    worn, bare = skin[heights < 0.06], skin[heights > 0.4]
    assert len(worn) > 500
    assert len(bare) > 3000
    for name, unit in man.units.items():
        if "neckThroat" not in name:
            assert not unit.displacement[worn].any(), name
    assert np.abs(man.units["neckStretchL"].displacement[bare]).max() > 2 * MM


def test_weights_are_even_shares_that_add_up():
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    mesh = polygon_mesh(square, square, [[0, 1, 2, 3]], square[:, :2], [[0, 1, 2, 3]])
    shares = np.random.default_rng(3).dirichlet(np.ones(5), 4)
    mesh.skin_offsets = 5 * np.arange(5)
    mesh.skin_weights = shares.ravel()
    mesh.skin_joint_indices = np.tile(np.arange(5), 4)
    build.even_weights(mesh)
    found = np.asarray(mesh.skin_weights, np.float64).reshape(4, 5)
    assert (found.sum(axis=1) == 1).all()
    assert np.abs(found - shares).max() <= 3 / build.WEIGHTS
    assert (found * build.WEIGHTS % 1 == 0).all()


def test_extra_sides_differ_but_what_is_hard_stays(data, man):
    person = people.PEOPLE["fighter"]
    shape = askew.askew(data, man, person)
    left = shape[man.groups["body"]]
    assert 1 * MM < np.abs(left).max() < 10 * MM
    for group in ("eyeball-l", "cornea-r", "helper-upper-teeth", "helper-tongue"):
        assert not shape[man.groups[group]].any()
