# SPDX-License-Identifier: MIT
"""Compares risorius.explain with the evaluator and with an oracle, also for faces made by hand.

The oracle (oracle.py, oracle_behavior.py) evaluates faces in double precision without native code.
"""

import json

import numpy as np
import oracle
import oracle_behavior
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra
from risorius.cli import main
from risorius.explain import UnknownControlError, explain, find_controls, page

FILES = sorted(GOLDEN.glob("*.dna"))
SEEDS = (1, 2)


def some_controls(dna, rig, seed):
    """Raw controls of which about a third are active; rotations are unit quaternions."""
    random = np.random.default_rng(seed)
    raw = np.where(random.random(len(rig.raw_control_names)) < 0.35, random.random(), 0)
    raw = (raw * random.random(len(raw))).astype(np.float32)
    layer = dna.twist_swing_behavior
    fours = [s.input_control_indices for s in (*layer.twists, *layer.swings)]
    for solver in dna.rbf_behavior.solvers:
        if solver.distance_method != 0:
            fours += list(solver.raw_control_indices.reshape(-1, 4))
    for four in fours:
        if len(four) == 4 and max(four) < len(raw):
            q = random.normal(loc=[0, 0, 0, 2], size=4)
            raw[four] = q / np.linalg.norm(q)
    return raw


def tolerance(dna, sizes):
    """Allowed float32 error of each of 9 attributes: 2e-5 times (size + 1 unit).

    The unit of rotations is a radian, because values may be converted through quaternions.

    Args:
        dna: the face, with the unit of rotations.
        sizes: float[..., 9], sum of the absolute contributions to each attribute.
    """
    turn = 1.0 if dna.rotation_unit == "radians" else 57.3
    return 2e-5 * np.add(sizes, [1, 1, 1, turn, turn, turn, 1, 1, 1])


def check_sums(dna, rig, raw, lod):
    """Check that contributions sum to the pose, shares to 1, and all moving joints are listed."""
    facts = explain(dna, rig, raw, lod=lod)
    pose = rig.evaluate(raw, lod=lod)
    moving = set(np.flatnonzero(np.any(pose.joints != 0, axis=1)).tolist())
    assert {row["index"] for row in facts["joints"]} == moving
    for row in facts["joints"]:
        parts = np.array([part["values"] for part in row["by"]])
        bound = tolerance(dna, np.abs(parts).sum(axis=0))
        difference = np.abs(parts.sum(axis=0) - pose.joints[row["index"]])
        assert (difference <= bound).all(), (row["name"], difference / bound)
        assert sum(part["share"] for part in row["by"]) == pytest.approx(1, abs=1e-3)
        assert row["distance"] == pytest.approx(np.linalg.norm(pose.joints[row["index"], :3]))
    return facts


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_contributions_of_every_golden_add_up_to_the_pose(file, seed):
    dna = risorius.load(file)
    rig = risorius.Rig(dna)
    raw = some_controls(dna, rig, seed)
    for lod in range(rig.lod_count):
        check_sums(dna, rig, raw, lod)


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_rest_is_explained(file):
    dna = risorius.load(file)
    rig = risorius.Rig(dna)
    for lod in range(rig.lod_count):
        facts = check_sums(dna, rig, rig.initial_raw_controls, lod)
        assert facts["raw_controls"] == []
        assert "every raw control is at rest" in page(facts)
        assert json.loads(json.dumps(facts, allow_nan=False)) == facts


def test_extra_full_scale():
    path = require_extra(SHARED / "data" / "golden" / "fullscale.dna", "the full-scale rig")
    dna = risorius.load(path)
    rig = risorius.Rig(dna)
    raw = some_controls(dna, rig, 3)
    for lod in (0, rig.lod_count - 1):
        check_sums(dna, rig, raw, lod)


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_what_fires_is_what_the_oracle_says(file):
    """explain() lists the active correctives and maps that the tests' own evaluator computes."""
    dna = risorius.load(file)
    rig = risorius.Rig(dna)
    raw = some_controls(dna, rig, 1)
    solvers = oracle_behavior.solvers_of(dna)
    for lod in range(rig.lod_count):
        facts = explain(dna, rig, raw, lod=lod)
        c = oracle_behavior.settled(dna, solvers, raw.astype(float), lod, rig.control_count)
        first, last = len(raw), len(raw) + dna.psd_count
        fires = {f["index"]: f["value"] for f in facts["correctives"]["fire"]}
        expected = {i: c[i] for i in range(first, last) if c[i] != 0}
        assert fires == pytest.approx(expected, abs=1e-5)
        for row in facts["correctives"]["fire"]:
            product = row["weight"] * np.prod([f["used"] for f in row["factors"]])
            assert row["value"] == pytest.approx(min(1.0, product), abs=1e-5)
        maps = dna.animated_maps
        rows = int(maps.lods[lod]) if len(maps.lods) else 0
        values, _ = oracle.table(maps.conditionals, rows, c, len(dna.animated_map_names))
        on = {i: v for i, v in enumerate(values) if v != 0}
        assert {r["index"]: r["value"] for r in facts["animated_maps"]} == pytest.approx(
            on, abs=1e-4
        )
        for row in facts["animated_maps"]:
            gives = sum(by["gives"] for by in row["by"])
            assert row["value"] == pytest.approx(min(1.0, max(0.0, gives)), abs=1e-5)
        for row in facts["blend_shapes"]:
            assert row["value"] == pytest.approx(row["by"]["value"], abs=0)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", ["rbf", "tiny_v24", "tiny_v28"])
def test_weights_of_poses_give_what_the_evaluator_writes(name, seed):
    dna = risorius.load(GOLDEN / f"{name}.dna")
    rig = risorius.Rig(dna)
    raw = some_controls(dna, rig, seed)
    checked = 0
    for lod in range(rig.lod_count):
        pose = rig.evaluate(raw, lod=lod)
        facts = explain(dna, rig, raw, lod=lod)
        written = {}
        for solver in facts["solvers"]:
            fresh = {}
            for p in solver["poses"]:
                factor = float(np.prod(pose.controls[p["inputs"]]))
                for o in p["outputs"]:
                    value = p["weight"] * o["weight"] * factor
                    fresh[o["control"]] = fresh.get(o["control"], 0.0) + value
            written |= fresh  # if two solvers write a control, the later one is used
        for control, value in written.items():
            assert pose.controls[control] == pytest.approx(value, abs=1e-4), control
            checked += value != 0
    assert checked > 3


def hand_made():
    """Two controls and a corrective move one joint; LOD 1 has only its x translation."""
    dna = risorius.load(GOLDEN / "core.dna")
    group = dna.joint_groups[0].__copy__()
    group.input_indices = [0, 2, 4]
    group.output_indices = [9, 10, 9 + 5]
    group.values = [[3, 1, 0], [0, 0, 2], [0, 90, 0]]
    group.lods, group.joint_indices = [3, 1], [1]
    dna.joint_groups = [group]
    psds = dna.psds.__copy__()
    psds.rows, psds.columns, psds.values = [4, 4, 5, 5, 5], [0, 2, 0, 2, 3], [1, 1, 1, 1, 0.5]
    dna.psds = psds
    return dna


def test_the_parts_of_a_joint_made_by_hand():
    dna = hand_made()
    rig = risorius.Rig(dna)
    facts = explain(dna, rig, [0.5, 0, 0.5, 0])
    (joint,) = facts["joints"]
    assert joint["distance"] == pytest.approx(np.hypot(2.0, 0.5))
    assert joint["degrees"] == pytest.approx(45, abs=1e-4)
    by = {part["control"]: part for part in joint["by"]}
    assert by[0]["values"] == [1.5, 0, 0, 0, 0, 0, 0, 0, 0]
    assert by[2]["values"] == [0.5, 0, 0, 0, 0, 45, 0, 0, 0]
    assert by[4]["values"] == [0, 0.5, 0, 0, 0, 0, 0, 0, 0]
    lever = facts["bone_length"] * np.pi / 4
    whole = 2.0**2 + 0.5**2 + lever**2
    assert by[0]["share"] == pytest.approx(1.5 * 2 / whole)
    assert by[2]["share"] == pytest.approx((0.5 * 2 + lever**2) / whole)
    assert by[4]["share"] == pytest.approx(0.25 / whole)
    coarse = check_sums(dna, rig, np.array([0.5, 0, 0.5, 0], np.float32), 1)
    (joint,) = coarse["joints"]
    assert joint["values"] == [2, 0, 0, 0, 0, 0, 0, 0, 0]
    assert {part["control"]: part["share"] for part in joint["by"]} == {0: 0.75, 2: 0.25}


def test_correctives_that_fire_lack_one_and_rest():
    dna = hand_made()
    group = dna.joint_groups[0].__copy__()
    group.input_indices = [0, 2, 5]  # nothing reads corrective 4
    dna.joint_groups = [group]
    shapes, maps = dna.blend_shape_channels.__copy__(), dna.animated_maps.__copy__()
    shapes.lods, maps.lods = [0, 0], [0, 0]
    dna.blend_shape_channels, dna.animated_maps = shapes, maps
    rig = risorius.Rig(dna)
    c = explain(dna, rig, [0.5, 0, 0.5, 0])["correctives"]
    assert c["fire"] == []
    (miss,) = c["lack_one"]
    assert (miss["index"], miss["missing"]["index"], miss["would_be"]) == (5, 3, 0.125)
    (rest,) = c["rest_at_this_lod"]
    assert (rest["index"], rest["reason"]) == (4, "nothing reads it")
    (fires,) = explain(dna, rig, [0.5, 0, 1.5, 0.5])["correctives"]["fire"]
    assert fires["value"] == 0.125
    assert [f["used"] for f in fires["factors"]] == [0.5, 1, 0.5]
    assert fires["weight"] == 0.5


def test_two_groups_that_write_a_row_give_it_to_the_later_one():
    dna = hand_made()
    late = dna.joint_groups[0].__copy__()
    late.input_indices, late.output_indices, late.values = [3], [9], [[4]]
    late.lods = [1, 1]
    dna.joint_groups = [dna.joint_groups[0], late]
    rig = risorius.Rig(dna)
    for last in (0.0, 0.5):
        raw = np.array([0.5, 0, 0.5, last], np.float32)
        (joint,) = check_sums(dna, rig, raw, 0)["joints"]
        assert joint["values"][0] == 4 * last


def test_gui_controls_are_named_with_their_interval():
    dna = risorius.load(GOLDEN / "core.dna")
    rig = risorius.Rig(dna)
    gui = np.zeros(len(rig.gui_control_names), np.float32)
    gui[2] = 0.5
    facts = explain(dna, rig, rig.gui_to_raw(gui), gui=gui)
    assert facts["raw_controls"]
    for row in facts["raw_controls"]:
        assert sum(g["gives"] for g in row["from_gui"]) == pytest.approx(row["value"])
        for g in row["from_gui"]:
            assert g["name"] == rig.gui_control_names[2]
            assert g["from"] <= 0.5 <= g["to"]


def test_of_a_run_only_the_first_interval_that_holds_counts():
    dna = hand_made()
    maps = dna.animated_maps.__copy__()
    table = maps.conditionals.__copy__()
    table.input_indices, table.output_indices = [0, 0, 2, 0], [1, 1, 1, 1]
    table.from_values, table.to_values = [0.75, 0, 0, 1], [1, 1, 1, 0]
    table.slope_values, table.cut_values = [1, 0.25, 0.5, 0.5], [0, 0.125, 0, 0]
    maps.conditionals, maps.lods = table, [4, 4]
    dna.animated_maps = maps
    rig = risorius.Rig(dna)
    for value, slopes in ((0.5, [0.25, 0.5, 0.5]), (0.875, [1, 0.5, 0.5])):
        (row,) = explain(dna, rig, [value, 0, 0.25, 0])["animated_maps"]
        assert [by["slope"] for by in row["by"]] == slopes
        assert row["by"][-1]["from"] == 0  # the file has these bounds in the wrong order
        gives = sum(by["gives"] for by in row["by"])
        assert row["value"] == pytest.approx(min(1, gives))
        assert row["at_rest"] == 0.125


def test_distances_of_rotations_are_in_degrees():
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    rig = risorius.Rig(dna)
    facts = explain(dna, rig, rig.initial_raw_controls)
    solver = dna.rbf_behavior.solvers[0]
    assert solver.distance_method == 1
    x = rig.initial_raw_controls[solver.raw_control_indices].astype(float)
    expected = {}
    for pose, target in zip(
        solver.pose_indices.tolist(), solver.raw_control_values.reshape(-1, 4), strict=True
    ):
        expected[pose] = np.degrees(2 * np.arccos(min(1, abs(float(target @ x)))))
    assert max(expected.values()) > 10
    found = {p["index"]: p["distance"] for p in facts["solvers"][0]["poses"]}
    assert found == pytest.approx(expected, abs=1e-2)


def test_names_that_run_out_are_numbers():
    dna = risorius.load(GOLDEN / "tiny_v28.dna", layers="behavior")
    for names in ("joint", "raw_control", "blend_shape_channel", "animated_map"):
        field = f"{names}_names"
        setattr(dna, field, [""] * len(getattr(dna, field)))
    rig = risorius.Rig(dna)
    raw = np.full(len(rig.raw_control_names), 0.5, np.float32)
    facts = check_sums(dna, rig, raw, 0)
    text = page(facts)
    for list_name, word in (
        ("joints", "joint"),
        ("raw_controls", "control"),
        ("blend_shapes", "channel"),
        ("animated_maps", "map"),
    ):
        first = facts[list_name][0]
        assert first["name"] == f"{word} {first['index']}"
        assert first["name"] in text


def test_quaternions_and_controls_that_are_not_finite_are_refused():
    dna = risorius.load(GOLDEN / "core.dna")
    with pytest.raises(ValueError, match="euler"):
        explain(dna, risorius.Rig(dna, rotation="quaternion"), [0] * 4)
    with pytest.raises(ValueError, match="finite"):
        explain(dna, risorius.Rig(dna), [0, np.nan, 0, 0])


@pytest.mark.parametrize("name", ["core", "mlquat", "quatjoints"])
def test_a_pose_that_is_not_finite_is_one_sentence(name, capsys):
    path = GOLDEN / f"{name}.dna"
    controls = [f"{control}=3e38" for control in risorius.load(path).raw_control_names]
    assert main(["eval", str(path), *controls, "--explain"]) == 1
    error = capsys.readouterr().err
    assert "explain: a pose of finite numbers was expected, found " in error
    assert error.count("\n") == 1


# ---- names of controls

NAMES = [
    "CTRL_expressions.jawOpen",
    "CTRL_expressions.jawOpenExtreme",
    "CTRL_expressions.mouthCornerPullL",
    "CTRL_expressions.mouthCornerPullR",
    "CTRL_expressions.eyeBlinkL",
]
LEFT, RIGHT = NAMES[2], NAMES[3]


@pytest.mark.parametrize(
    ("text", "controls", "exact"),
    [
        (NAMES[0], {NAMES[0]: 1}, True),
        ("jawOpen", {NAMES[0]: 1}, False),
        ("jawopen", {NAMES[0]: 1}, False),
        ("extreme", {NAMES[1]: 1}, False),
        ("cornerPullL", {LEFT: 1}, False),
        ("mouthCornerPull", {LEFT: 1, RIGHT: 1}, False),
        ("mouthSmileLeft", {LEFT: 1}, False),
        ("smile", {LEFT: 1, RIGHT: 1}, False),
    ],
)
def test_a_part_of_a_name_means_one_control_or_its_two_sides(text, controls, exact):
    meaning = find_controls(text, NAMES)
    assert (meaning.controls, meaning.is_exact) == (controls, exact)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("jaw", ["any of", "jawOpen", "jawOpenExtreme"]),
        ("l", ["any of", "mouthCornerPull", "eyeBlink"]),
        ("jawOpn", ["no control", "near", "jawOpen"]),
        ("mouthFrown", ["no control"]),  # an ARKit unit, but the file lacks its controls
    ],
)
def test_a_name_of_several_or_no_meanings_is_refused(text, words):
    with pytest.raises(UnknownControlError) as caught:
        find_controls(text, NAMES)
    for word in words:
        assert word in str(caught.value)


# ---- the command `risorius eval --explain`

CORE = str(GOLDEN / "core.dna")


def test_the_command_says_what_it_took_a_name_for(capsys):
    assert main(["eval", CORE, "--explain", "jawOpen=0.75", "browRaiseInner=0.5"]) == 0
    captured = capsys.readouterr()
    assert "jawOpen=0.75 was taken for CTRL_expressions.jawOpen=0.75" in captured.err
    assert "CTRL_expressions.browRaiseInnerL=0.5, CTRL_expressions.browRaiseInnerR=0.5" in (
        captured.err
    )
    # By hand: corrective 6 is 1.5 * 0.5 * 0.75; corrective 5 is 0, because one of its controls is.
    assert "corrective 6 = 0.5625: browRaiseInnerR 0.5 * jawOpen 0.75, weight 1.5" in captured.out
    assert "corrective 5 lacks browRaiseOuterL" in captured.out


def test_a_corrective_has_the_name_of_its_shape_beside_it(tmp_path, capsys):
    dna = risorius.load(CORE)
    names = dna.blend_shape_channel_names
    names[0] = "head.jawOpen_x_browIn"
    dna.blend_shape_channel_names = names
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[3, 3], input_indices=[6, 5, 5], output_indices=[0, 1, 2]
    )
    dna.save(tmp_path / "face.dna")
    face = str(tmp_path / "face.dna")
    assert main(["eval", face, "--explain", "jawOpen=0.75", "browRaiseInner=0.5"]) == 0
    text = capsys.readouterr().out
    assert "corrective 6 (head.jawOpen_x_browIn) = 0.5625: " in text
    assert f"corrective 5 ({names[1]}, ...) lacks browRaiseOuterL" in text


def test_the_command_gives_json_and_cuts_lists(capsys):
    assert main(["eval", CORE, "jawOpen=1", "--explain", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert len(facts["joints"]) > 1
    assert main(["eval", CORE, "jawOpen=1", "--explain", "--top", "1"]) == 0
    out = capsys.readouterr().out
    assert facts["joints"][0]["name"] in out
    assert facts["joints"][1]["name"] not in out
    assert f"and {len(facts['joints']) - 1} more" in out
    assert main(["eval", CORE, "--explain", "--top", "-1"]) == 2


def test_a_name_of_several_meanings_is_exit_code_2(capsys):
    assert main(["eval", CORE, "--explain", "brow=1"]) == 2
    captured = capsys.readouterr()
    assert "browRaiseInner" in captured.err
    assert captured.out == ""


def test_rotations_of_the_file_rest_at_their_identity(capsys):
    assert main(["eval", str(GOLDEN / "twistswing.dna"), "--json"]) == 0
    rig = risorius.Rig(risorius.load(GOLDEN / "twistswing.dna"))
    given = {r["index"]: r["value"] for r in json.loads(capsys.readouterr().out)["raw_controls"]}
    ones = np.flatnonzero(rig.initial_raw_controls).tolist()
    assert ones
    assert given == dict.fromkeys(ones, 1.0)
    dna = risorius.load(GOLDEN / "twistswing.dna")
    beside = set(ones) - set(dna.gui_to_raw.output_indices.tolist())
    assert beside
    assert main(["eval", str(GOLDEN / "twistswing.dna"), "--gui", "--json"]) == 0
    given = {r["index"]: r["value"] for r in json.loads(capsys.readouterr().out)["raw_controls"]}
    assert {i: given.get(i) for i in beside} == dict.fromkeys(beside, 1.0)


@pytest.mark.parametrize("name", ["quatjoints", "mlquat"])
def test_a_rotation_order_that_nobody_knows_is_that_of_the_evaluator(name):
    """A rotation order or axis with an undefined number is read, and evaluated as the default.

    The defaults are xyz, right, up and front.
    """
    dna = risorius.load(GOLDEN / f"{name}.dna")
    dna.rotation_sequence, dna.rotation_signs, dna.rotation_unit = "#40", (0, 1, 65536), "#3"
    dna.coordinate_system = ("#7", "up", "#9")
    joints = dna.machine_learned_behavior_ext.joints
    if len(joints.parameter_keys):
        values = joints.parameter_values.copy()
        values[np.isin(joints.parameter_keys, [3, 9])] = [8, 40]
        joints.parameter_values = values
    dna = risorius.load(dna.to_bytes())
    rig = risorius.Rig(dna)
    moved = 0
    for lod in range(rig.lod_count):
        moved += len(check_sums(dna, rig, some_controls(dna, rig, 3), lod)["joints"])
    assert moved > 0
