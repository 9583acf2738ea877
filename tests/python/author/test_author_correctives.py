# SPDX-License-Identifier: MIT
"""Tests correctives from sculpts and from the search, evaluated by an independent reader."""

import itertools
import json
import time
from types import SimpleNamespace

import command_line
import dna_bytes
import face_shapes
import numpy as np
import pytest
import risorius
from risorius.author import RigOptions, combinations, make_joint_rig
from risorius.author.correctives import (
    CorrectiveOptions,
    add_correctives,
    correct_again,
    find_correctives,
)
from risorius.author.correctives.poser import make_checker, worst
from risorius.author.correctives.search import fairest_of, triples_of
from risorius.author.fitting import FitOptions

PREFIX = "CTRL_expressions."
SCULPT = "jawOpen+mouthSmileLeft"
THREE = "jawOpen + mouthSmileLeft + mouthSmileRight"


def sculpts(positions):
    """Sculpted displacements in cm of two combinations, which weaken a smile; one adds a bulge.

    Args:
        positions: float64[V, 3], the egg's vertices in cm.
    """
    single = face_shapes.expressions(positions)
    bulge = face_shapes.bump(positions, 3, -5, 3)[:, None] * [0, 0, 0.4]
    two = single["jawOpen"] + 0.6 * single["mouthSmileLeft"] + bulge
    both = single["jawOpen"] + 0.5 * (single["mouthSmileLeft"] + single["mouthSmileRight"])
    return {SCULPT: two, THREE: both}


@pytest.fixture(scope="module")
def egg(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sculpted")
    face_shapes.write_all(folder)
    positions, faces = face_shapes.head()
    for name, delta in sculpts(positions).items():
        face_shapes.write_obj(folder / "shapes" / f"{name}.obj", positions + delta, faces)
    spec, out = folder / "spec.toml", folder / "egg.dna"
    done = command_line.run("author", spec, "-o", out, "--json", text=True)
    assert done.returncode == 0, done.stderr
    return folder, dna_bytes.Face(out.read_bytes()), json.loads(done.stdout)


def at_one(*names):
    return {PREFIX + name: 1.0 for name in names}


CONTROLS = {
    SCULPT: ("jawOpen", "mouthCornerPullL"),
    THREE: ("jawOpen", "mouthCornerPullL", "mouthCornerPullR"),
}


@pytest.mark.parametrize("name", CONTROLS)
def test_a_sculpt_of_several_is_met_where_all_are_1(egg, name):
    _, face, said = egg
    positions, _ = face_shapes.head()
    goal = positions + sculpts(positions)[name]
    error = np.linalg.norm(face.vertices(at_one(*CONTROLS[name])) - goal, axis=1)
    # Number of active expressions and correctives; each may have an error up to the tolerance.
    parts = len(CONTROLS[name]) + (1 if name == SCULPT else 2)
    assert 10 * error.max() < 1.02 * said["tolerance"]["mm"] * parts


def test_single_expressions_stay_what_they_are(egg):
    _, face, said = egg
    positions, _ = face_shapes.head()
    delta = face_shapes.expressions(positions)["jawOpen"]
    error = np.linalg.norm(face.vertices(at_one("jawOpen")) - positions - delta, axis=1)
    assert 10 * error.max() < 1.01 * said["tolerance"]["mm"]


def test_joints_do_most_of_it_and_the_command_says_so(egg):
    folder, _, said = egg
    rows = {row["name"]: row for row in said["combinations"]}
    assert list(rows) == [
        "jawOpen x mouthCornerPullL",
        "jawOpen x mouthCornerPullL x mouthCornerPullR",
    ]
    for row in rows.values():
        assert row["joints_largest_mm"] < 0.25 * row["without_mm"]
        assert row["largest_mm"] <= 1.01 * said["tolerance"]["mm"]
    dna = risorius.load(folder / "egg.dna")
    inputs = {int(i) for group in dna.joint_groups for i in group.input_indices}
    assert len(dna.raw_control_names) in inputs  # the first corrective moves joints


def test_a_sculpt_of_what_is_not_there_is_one_sentence(tmp_path):
    spec = face_shapes.write_all(tmp_path)
    positions, faces = face_shapes.head()
    face_shapes.write_obj(tmp_path / "shapes" / "jawOpen+grin.obj", positions, faces)
    done = command_line.run("author", spec, "-o", tmp_path / "x.dna", text=True)
    assert done.returncode == 1
    assert "combination jawOpen+grin: one of " in done.stderr
    assert "found 'grin'" in done.stderr
    assert not (tmp_path / "x.dna").exists()


def test_a_sculpt_of_another_topology_is_one_sentence(tmp_path):
    spec = face_shapes.write_all(tmp_path)
    positions, faces = face_shapes.head()
    last = len(positions) - 1
    rest = [face for face in faces if max(face) < last]
    sculpt = tmp_path / "shapes" / "jawOpen+mouthSmileLeft.obj"
    face_shapes.write_obj(sculpt, positions[:last], rest)
    done = command_line.run("author", spec, "-o", tmp_path / "x.dna", text=True)
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        f"risorius: {sculpt}: {last + 1} vertices were expected, as the neutral mesh has, "
        f"found {last}"
    ]
    assert not (tmp_path / "x.dna").exists()


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ('most = "many"', "correctives.most: a whole number was expected, found 'many'"),
        ("most = -1", "correctives.most: 0 to 65535 was expected, found -1"),
        (
            "depth = 3",
            "correctives.depth: one of most, again, solids, triples, together was expected",
        ),
        ("solids = [3]", "correctives.solids: text was expected, found 3"),
        ('together = ["jawOpen"]', "correctives.together: a list was expected, found 'jawOpen'"),
        ('together = [["jawOpen", "grin"]]', "correctives: there is no control grin"),
    ],
)
def test_a_wrong_table_is_one_sentence(tmp_path, table, sentence):
    spec = face_shapes.write_all(tmp_path, more=f"[correctives]\n{table}\n")
    done = command_line.run("author", spec, "-o", tmp_path / "x.dna", text=True)
    assert done.returncode == 1
    assert sentence in done.stderr


# A sheet of 40 x 40 mm with SIDE x SIDE vertices is 1 mm above a ball with a diameter of 40 mm, at
# two LODs, with lashes above the sheet. Controls a, b and d push the middle of the sheet down
# softly, by less than 1 mm each; control c pushes a place 14 mm from the middle.
SIDE = 41
BALL = np.array([0.0, -21.0, 0.0])
RADIUS = 20.0


def sheet(side):
    x, z = np.meshgrid(np.linspace(-20, 20, side), np.linspace(20, -20, side))
    at = np.arange(side * side).reshape(side, side)
    faces = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1)
    positions = np.stack([x.ravel(), np.zeros(side * side), z.ravel()], axis=1)
    return positions, faces.reshape(-1, 4)


def push(positions, depth, reach, middle=0.0):
    d = ((positions[:, 0] - middle) ** 2 + positions[:, 2] ** 2) / reach**2
    return np.where(d < 1, (1 - d) ** 2, 0.0)[:, None] * [0.0, -depth, 0.0]


PUSHES = {"a": (0.9, 9.0), "b": (0.8, 14.0), "c": (0.9, 5.0, 14.0), "d": (0.9, 9.0)}


def ball():
    tilt, turn = np.meshgrid(np.linspace(0, np.pi, 41), np.linspace(0, 2 * np.pi, 40, False))
    way = [np.sin(tilt) * np.cos(turn), np.cos(tilt), -np.sin(tilt) * np.sin(turn)]
    positions = BALL + RADIUS * np.stack(way, axis=-1).reshape(-1, 3)
    at = np.arange(40 * 41).reshape(40, 41)
    after = np.roll(at, -1, axis=0)
    faces = np.stack([at[:, :-1], at[:, 1:], after[:, 1:], after[:, :-1]], axis=-1)
    return positions, faces.reshape(-1, 4)


def mesh_of(positions, faces):
    mesh = risorius.Mesh()
    mesh.positions, mesh.normals = positions / 10, np.tile([0.0, 1.0, 0.0], (len(positions), 1))
    mesh.texture_coordinates = positions[:, [0, 2]]
    every = np.arange(len(positions))
    mesh.layout_positions = mesh.layout_texture_coordinates = mesh.layout_normals = every
    mesh.face_offsets, mesh.face_layouts = 4 * np.arange(len(faces) + 1), faces.ravel()
    mesh.skin_offsets = np.arange(len(positions) + 1)
    mesh.skin_weights, mesh.skin_joint_indices = np.ones(len(positions)), 0 * every
    mesh.maximum_influence_per_vertex = 1
    return mesh


def make_face(pushes, turning=None, first="head_lod0_mesh"):
    """A face whose controls push the sheet.

    Args:
        pushes: control -> arguments of push.
        turning: control that also rotates everything about x by 25 degrees, or None.
        first: name of the mesh that is first in the file.
    """
    count = len(pushes)
    parts = {
        "head_lod0_mesh": sheet(SIDE),
        "eye_lod0_mesh": ball(),
        "eyelashes_lod0_mesh": (sheet(7)[0] * [0.3, 1, 0.3] + [0, 1.5, 0], sheet(7)[1]),
        "hat_lod0_mesh": (sheet(7)[0] * [0.3, 1, 0.3] + [0, 15, 0], sheet(7)[1]),
        "head_lod1_mesh": sheet(21),
    }
    parts = {first: parts[first], **parts}
    dna = risorius.Dna()
    dna.joint_names, dna.joint_parents = ["root"], [0]
    dna.neutral_joint_translations = dna.neutral_joint_rotations = np.zeros((1, 3))
    dna.coordinate_system = ("right", "up", "front")
    dna.raw_control_names = [PREFIX + name for name in pushes]
    dna.blend_shape_channel_names = list(pushes)
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[count] * 2, input_indices=range(count), output_indices=range(count)
    )
    dna.lod_count = 2
    dna.joint_row_count, dna.joint_column_count = 9, count
    meshes, mapping = [], []
    for m, (name, (positions, faces)) in enumerate(parts.items()):
        mesh = mesh_of(positions, faces)
        if not name.startswith("eye_"):
            mesh.blend_shape_targets = [
                risorius.BlendShapeTarget(
                    deltas=push(positions, *how) / 10,
                    vertex_indices=np.arange(len(positions)),
                    blend_shape_channel_index=channel,
                )
                for channel, how in enumerate(pushes.values())
            ]
            mapping += [(m, channel) for channel in range(count)]
        meshes.append(mesh)
    dna.meshes, dna.mesh_names = meshes, list(parts)
    dna.mesh_blend_shape_channel_mapping = np.array(mapping)
    dna.lod_mesh_mapping = [[0, 1, 2, 3], [4]]
    dna.lod_joint_mapping = [[0], [0]]
    dna.lod_blend_shape_mapping = [range(count)] * 2
    if turning is not None:
        dna.joint_groups = [
            risorius.JointGroup(
                lods=[1, 1],
                input_indices=[list(pushes).index(turning)],
                output_indices=[3],
                values=np.array([[25.0]], np.float32),
                joint_indices=[0],
            )
        ]
    return dna


@pytest.fixture(scope="module")
def face():
    return make_face(PUSHES)


@pytest.fixture(scope="module")
def corrected(face):
    shares = []
    found = find_correctives(face, CorrectiveOptions(apart=(("a", "d"),)), shares.append)
    rows = [(one.controls, one.shape) for one in found.correctives]
    assert shares == sorted(shares)
    return found, dna_bytes.Face(add_correctives(face, found.skin, rows).to_bytes())


def skin_of(read, controls, lod=0):
    """float64[V, 3]: posed vertices of the sheet in mm; the sheet is the first mesh of each LOD."""
    side = SIDE if lod == 0 else 21
    return 10 * read.vertices(controls, lod)[: side * side]


def depth(positions):
    """float64[V]: depth inside the ball in mm; negative outside.

    Args:
        positions: float64[V, 3], mm.
    """
    return RADIUS - np.linalg.norm(positions - BALL, axis=1)


def test_pairs_that_go_into_the_ball_are_found_and_no_others(corrected):
    found, _ = corrected
    pairs = {one.controls for one in found.correctives if len(one.controls) == 2}
    assert pairs == {(0, 1), (1, 3)}  # a and d are opposites, c moves no common vertices
    assert found.skin == 0
    assert found.faulty == 2
    assert found.before["volume"] > 10
    assert found.after == {"volume": 0.0, "stretched": 0.0, "folded": 0.0}


def test_what_has_a_corrective_is_as_somebody_wanted_it(face):
    # The face has a sculpt for the pair (a, b), which pushes the sheet deeper into the ball. The
    # search does not change this pair, and repairs the pairs (a, d) and (b, d).
    sculpt = push(sheet(SIDE)[0], 0.5, 9.0) / 10
    found = find_correctives(add_correctives(face, 0, [((0, 1), sculpt)]))
    assert {one.controls for one in found.correctives} == {(0, 3), (1, 3)}


@pytest.mark.parametrize("names", [("a", "b"), ("b", "d")])
def test_the_written_file_stays_out_of_the_ball_at_every_level(corrected, names):
    _, read = corrected
    for lod in (0, 1):
        posed = skin_of(read, at_one(*names), lod)
        assert depth(posed).max() < 0.15
        plain, _ = sheet(SIDE if lod == 0 else 21)
        linear = plain + sum(push(plain, *PUSHES[name]) for name in names)
        assert depth(linear).max() > 0.6
        # Vertices away from the ball move by the sum of both pushes. No vertex moves
        # less far down than the weaker of its two pushes would move it alone.
        away = np.hypot(plain[:, 0], plain[:, 2]) > 17
        assert np.abs(posed[away] - linear[away]).max() < 1e-3
        least = np.min([push(plain, *PUSHES[name])[:, 1] for name in names], axis=0)
        assert (posed[:, 1] <= least + 0.05).all()


@pytest.mark.parametrize("names", [("a", "b"), ("b", "d")])
def test_what_stays_out_of_the_ball_keeps_nine_tenths_of_its_way(corrected, names):
    _, read = corrected
    plain, _ = sheet(SIDE)
    way = sum(push(plain, *PUSHES[name]) for name in names)[:, 1]
    free = (depth(plain + way[:, None] * [0, 1, 0]) <= 0.1) & (way < -0.2)
    assert free.sum() > 200
    kept = (skin_of(read, at_one(*names)) - plain)[free, 1] / way[free]
    assert kept.min() > 0.9


def test_undoing_one_part_does_not_bring_what_the_other_has_alone(face):
    checker, (plain, _), (solid, _) = make_checker(face, 0, [1]), sheet(SIDE), ball()

    def look(skin):
        return checker.look(skin / 10, [solid / 10])

    # The two expressions together enter the ball by 0.35 mm. Near this fault, one expression
    # balances a rise of 6 mm by the other one, so undoing it would uncover the rise.
    rest = plain + push(plain, -15.0, 5.0, -7.0)
    alone, both = rest + push(plain, 6.0, 2.5, 4.0), rest + push(plain, 1.35, 4.0)
    allowed = worst([look(plain), look(alone)])
    moved, before, after = checker.repair(both / 10, [solid / 10], allowed, [alone / 10])
    assert before.volume > 0
    assert after.volume == 0
    assert np.asarray(look(alone).depth).max() > 4
    assert (
        np.asarray(look(both + 10 * moved).depth).max() < np.asarray(look(both).depth).max() + 0.1
    )


def test_lashes_go_with_the_skin(corrected):
    found, read = corrected
    (one,) = [x for x in found.correctives if x.controls == (0, 1)]
    lashes = 10 * read.vertices(at_one("a", "b"))[-98:-49]
    plain = sheet(7)[0] * [0.3, 1, 0.3] + [0, 1.5, 0]
    linear = plain + push(plain, *PUSHES["a"]) + push(plain, *PUSHES["b"])
    middle = np.linalg.norm(plain[:, [0, 2]], axis=1).argmin()
    moved = 10 * one.displacement[np.linalg.norm(sheet(SIDE)[0], axis=1).argmin()]
    assert np.abs(lashes[middle] - linear[middle] - moved).max() < 1e-3


def test_lashes_go_with_the_skin_also_where_they_stand_before_it(face, corrected):
    rows = [(one.controls, one.shape) for one in corrected[0].correctives]
    before = add_correctives(make_face(PUSHES, first="eyelashes_lod0_mesh"), 1, rows).meshes[0]
    behind = add_correctives(face, 0, rows).meshes[2]
    assert len(before.blend_shape_targets) == len(PUSHES) + len(rows)
    for one, other in zip(before.blend_shape_targets, behind.blend_shape_targets, strict=True):
        np.testing.assert_array_equal(one.vertex_indices, other.vertex_indices)
        np.testing.assert_allclose(one.deltas, other.deltas, atol=1e-6)


def test_a_face_of_one_control_needs_none():
    found = find_correctives(make_face({"a": PUSHES["a"]}))
    assert (found.looked_at, found.correctives) == (0, [])


def test_what_is_far_from_the_skin_stays(corrected):
    _, read = corrected
    hat = 10 * read.vertices(at_one("a", "b"))[-49:]
    plain = sheet(7)[0] * [0.3, 1, 0.3] + [0, 15, 0]
    linear = plain + push(plain, *PUSHES["a"]) + push(plain, *PUSHES["b"])
    assert np.abs(hat - linear).max() < 1e-4


def test_what_one_does_alone_is_no_fault_of_a_pair():
    found = find_correctives(make_face({"deep": (3.0, 16.0), "c": PUSHES["c"]}))
    assert found.looked_at == 1
    assert found.faulty == 0
    assert found.correctives == []


def test_a_corrective_of_what_turns_is_written_before_the_joints():
    pushes = {"a": PUSHES["a"], "b": PUSHES["b"]}
    found = find_correctives(make_face(pushes, "b"))
    (one,) = found.correctives
    rows = [(one.controls, one.shape)]
    read = dna_bytes.Face(add_correctives(make_face(pushes, "b"), found.skin, rows).to_bytes())
    turn = np.radians(25.0)
    turned = np.array(
        [[1, 0, 0], [0, np.cos(turn), np.sin(turn)], [0, -np.sin(turn), np.cos(turn)]]
    )
    plain, _ = sheet(SIDE)
    linear = plain + push(plain, *pushes["a"]) + push(plain, *pushes["b"])
    posed = skin_of(read, at_one("a", "b"))
    assert (
        np.abs(posed - linear @ turned - 10 * one.displacement).max() < 0.02
    )  # smaller deltas are left out
    assert depth(posed @ turned.T).max() < 0.15
    assert depth(linear).max() > 0.6


def test_triples_are_those_of_repaired_pairs_the_worst_first():
    def fault(volume):
        return SimpleNamespace(volume=volume, stretched=0, folded=0)

    pairs = {(0, 1): 50.0, (1, 2): 40.0, (0, 2): 0.0, (1, 3): 90.0, (0, 3): 0.0, (4, 5): 70.0}
    sums = {on: fault(volume) for on, volume in pairs.items()}
    search = SimpleNamespace(found=dict.fromkeys([(0, 1), (1, 2), (1, 3), (4, 5)]))
    # The controls 2 and 3 have no pair, because they move no common vertices; so triples with both
    # are not tried. The controls 0 and 2 move common vertices, and their pair has no fault.
    assert triples_of(search, sums, 9) == [(0, 1, 3), (0, 1, 2)]
    assert triples_of(search, sums, 1) == [(0, 1, 3)]


def test_pairs_are_chosen_so_that_each_kind_of_fault_falls():
    # If faults were compared by one number, such as volume / 100 + folds / 5, all pairs with volume
    # would come first.
    sums = {(0, i): SimpleNamespace(volume=100.0 + i, stretched=0, folded=0) for i in range(1, 21)}
    sums |= {(1, i): SimpleNamespace(volume=0.0, stretched=0, folded=4) for i in range(30, 50)}
    sums[2, 50] = SimpleNamespace(volume=5.0, stretched=0, folded=0)  # too small to be repaired
    chosen = fairest_of(sums, 20)
    assert len(chosen) == len(set(chosen)) == 20
    folds = [on for on in chosen if on[0] == 1]
    assert 8 <= len(folds) <= 12
    # Of the pairs with volume, the ones with the largest volume are chosen.
    assert {on for on in chosen if on[0] == 0} == {(0, i) for i in range(len(folds) + 1, 21)}
    assert set(fairest_of(sums, 40)) == set(fairest_of(sums, 999)) == set(sums) - {(2, 50)}
    assert fairest_of(sums, 0) == []


def test_single_controls_and_zero_are_as_before(face, corrected):
    _, read = corrected
    plain, _ = sheet(SIDE)
    for name, how in PUSHES.items():
        assert np.abs(skin_of(read, at_one(name)) - plain - push(plain, *how)).max() < 1e-4
    assert face.psd_count == 0  # the input is unchanged


def test_half_of_both_undoes_a_quarter(corrected):
    _, read = corrected
    plain, _ = sheet(SIDE)
    whole = skin_of(read, at_one("a", "b")) - plain
    half = skin_of(read, {PREFIX + "a": 0.5, PREFIX + "b": 0.5}) - plain
    linear = push(plain, *PUSHES["a"]) + push(plain, *PUSHES["b"])
    assert np.abs((half - linear / 2) - (whole - linear) / 4).max() < 1e-4


def test_it_ends_where_it_is_told_to(face):
    with pytest.raises(risorius.DnaError, match="stopped"):
        find_correctives(face, progress=lambda share: False)


def test_a_triple_that_pairs_do_not_repair_gets_its_own(face):
    # Here a and d are no opposites: a, b and d together push the sheet by 2.6 mm, and each pair of
    # them is repaired.
    found = find_correctives(face, CorrectiveOptions())
    assert {one.controls for one in found.correctives} >= {(0, 1), (0, 3), (1, 3)}
    rows = [(one.controls, one.shape) for one in found.correctives]
    read = dna_bytes.Face(add_correctives(face, found.skin, rows).to_bytes())
    allowed = max(
        depth(skin_of(read, at_one(*pair))).max()
        for pair in itertools.combinations(("a", "b", "d"), 2)
    )
    assert depth(skin_of(read, at_one("a", "b", "d"))).max() < allowed + 0.15


def test_the_rig_of_joints_has_them_too(face, corrected):
    found, _ = corrected
    dna = add_correctives(face, found.skin, [(x.controls, x.shape) for x in found.correctives])
    rig = make_joint_rig(dna, RigOptions(FitOptions(joints=30), tolerance_mm=0.05))
    read = dna_bytes.Face(rig.dna.to_bytes())
    assert depth(skin_of(read, at_one("a", "b"))).max() < 0.2
    assert [c.name for c in rig.combinations] == ["a x b", "b x d"]


def test_what_joints_and_shapes_leave_is_mended_once_more(face, corrected):
    found, _ = corrected
    rows = {one.controls: one.shape for one in found.correctives}
    first = add_correctives(face, found.skin, [((0, 1), rows[0, 1])])
    # Few joints and a large tolerance approximate badly, so that the sheet enters the ball again.
    rig = make_joint_rig(first, RigOptions(FitOptions(joints=2, rounds=2), tolerance_mm=0.5)).dna
    options = CorrectiveOptions(apart=(("a", "d"),))
    again = correct_again(rig, face, options)
    before, after = (dna_bytes.Face(dna.to_bytes()) for dna in (rig, again))
    for names in (("a", "b"), ("b", "d")):
        assert depth(skin_of(before, at_one(*names))).max() > 0.35
        assert depth(skin_of(after, at_one(*names))).max() < 0.11
    # The corrective of one pair is improved, the other pair gets one; single controls stay the
    # same.
    assert (rig.psd_count, again.psd_count) == (1, 2)
    for name in PUSHES:
        assert (skin_of(before, at_one(name)) == skin_of(after, at_one(name))).all()
    # If the first corrective belongs to the input, like a sculpt, it is not changed.
    kept = dna_bytes.Face(correct_again(rig, first, options).to_bytes())
    assert (skin_of(before, at_one("a", "b")) == skin_of(kept, at_one("a", "b"))).all()


def _combinations(controls):
    found = object.__new__(combinations.Combinations)
    found.work = SimpleNamespace(combined=controls)
    found.order = sorted(controls, key=lambda c: (len(controls[c]), c))
    return found


def test_correctives_that_one_reads_are_solved_before_it():
    controls = {7: {0, 1}, 8: {1, 2}, 9: {0, 1}, 10: {3, 4}, 11: {0, 1, 2}, 12: {5, 6, 7}}
    assert _combinations(controls)._waves() == [[7, 8], [9, 10], [11, 12]]


def test_correctives_are_told_in_order_and_end_where_they_are_told_to():
    found, told, begun = _combinations({c: {c, c + 1} for c in range(200)}), [], []

    def tell(share):
        told.append(share)
        if len(told) == 3:
            raise risorius.DnaError("stopped")

    def work(column):
        begun.append(column)
        time.sleep(0.001)

    with pytest.raises(risorius.DnaError, match="stopped"):
        found._each(work, tell)
    assert told == [1 / 200, 2 / 200, 3 / 200]
    assert len(begun) < 100
    assert found._each(lambda column: 2 * column) == [2 * c for c in found.order]


def test_the_equations_of_a_corrective_are_those_of_every_vertex():
    """The normal equations from moments equal the ones from a matrix with 3 rows per vertex."""
    random = np.random.default_rng(7)
    joints, vertices = 9, 200
    turns = np.linalg.qr(random.normal(size=(joints, 3, 3)))[0]
    arms = random.normal(size=(joints, 3, 4))
    places = random.normal((0.0, 150.0, 0.0), size=(vertices, 3))  # a head, far from the ground
    held = random.random((vertices, joints)) * (random.random((vertices, joints)) < 0.4)
    left = random.normal(size=(vertices, 3))
    rows = np.zeros((joints, 6, vertices, 3))
    for joint in range(joints):
        away = places @ arms[joint, :, :3].T + arms[joint, :, 3]
        for axis, unit in enumerate(np.eye(3)):
            weight = held[:, joint, None]
            rows[joint, axis] = weight * (turns[joint] @ unit)
            rows[joint, 3 + axis] = weight * (np.cross(unit, away) @ turns[joint].T)
    flat = rows.reshape(6 * joints, -1)
    normal, asked = combinations._equations(turns, arms, places, held, left)
    np.testing.assert_allclose(normal, flat @ flat.T, rtol=0, atol=1e-12 * np.abs(normal).max())
    np.testing.assert_allclose(asked, flat @ left.ravel(), rtol=0, atol=1e-11 * np.abs(asked).max())
