# SPDX-License-Identifier: MIT
"""Tests that rebuilt joint groups give the same poses, apart from the values that were removed.

With a threshold, regroup removes small values by which controls move joints of foreign regions.

The test reads the joint groups of a file independently of the package: a dense matrix for each LOD,
in which the last group that writes a row is used.
"""

import copy
import json
import re
import subprocess
import sys

import command_line
import numpy as np
import oracle
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra
from risorius import _native
from risorius.author.joint_rig import grouped
from risorius.cli import main
from risorius.rigs import edit
from test_rig_random import assert_near, random_face, random_group, random_raw

FILES = sorted(GOLDEN.glob("*.dna"))
NAMES = [path.stem for path in FILES]
MM = {"cm": 10.0, "m": 1000.0}
DEGREES = {"degrees": 1.0, "radians": 180 / np.pi}


def control_count(dna):
    used = [np.asarray(g.input_indices, int).max(initial=-1) + 1 for g in dna.joint_groups]
    return max([len(dna.raw_control_names) + dna.psd_count, *used])


def turned(dna):
    """Indices of joints whose rotation is a quaternion, as the layer jbmd declares."""
    flags = np.asarray(dna.joint_behavior_metadata.joint_representations).reshape(-1, 3)[:, 1]
    return {int(j) for j in np.flatnonzero(flags == 1) if j < len(dna.joint_names)}


def matrix(dna, lod, width=None):
    """Joint values at a LOD, float64[joints * 9, controls]; rotations of quaternion joints: 0."""
    out = np.zeros((len(dna.joint_names) * 9, width or control_count(dna)))
    quaternions = turned(dna)
    for group in dna.joint_groups:
        for row in range(int(group.lods[lod]) if len(group.lods) else 0):
            output = int(group.output_indices[row])
            if output // 9 in quaternions and 3 <= output % 9 <= 5:
                continue
            out[output] = 0
            np.add.at(out[output], np.asarray(group.input_indices), group.values[row].astype(float))
    return out


def turns(dna, lod):
    """{joint: [(control, x, y, z), ...]}: rotations whose product is the joint's quaternion.

    They are listed in the order of multiplication. x, y and z are the Euler angles if the control
    is 1, in the file's unit.
    """
    out = {}
    for group in dna.joint_groups:
        found, order = {}, oracle.column_order(dna, group)
        for row, output in enumerate(np.asarray(group.output_indices).tolist()):
            if output // 9 in turned(dna) and 3 <= output % 9 <= 5:
                found.setdefault(output // 9, {})[output % 9] = row
        for joint, rows in found.items():
            if min(rows.values()) >= int(group.lods[lod]):
                continue
            zero = np.zeros(len(group.input_indices), np.float32)
            angles = [(group.values[rows[a]] if a in rows else zero)[order] for a in (3, 4, 5)]
            controls = group.input_indices[order].tolist()
            factors = zip(controls, *(a.tolist() for a in angles), strict=True)
            out[joint] = [f for f in factors if any(f[1:])]
    return out


def giant(dna):
    """The face with all rows in one joint group, sorted so that coarser LODs use leading rows."""
    out = copy.deepcopy(dna)
    width = control_count(dna)
    rows = []
    for group in dna.joint_groups:
        for row, output in enumerate(group.output_indices.tolist()):
            dense = np.zeros(width, np.float32)
            dense[group.input_indices] = group.values[row]
            rows.append((-sum(int(n) > row for n in group.lods), output, dense))
    rows.sort(key=lambda row: row[:2])
    out.joint_groups = [
        risorius.JointGroup(
            lods=[sum(-levels > lod for levels, _, _ in rows) for lod in range(dna.lod_count)],
            input_indices=list(range(width)),
            output_indices=[output for _, output, _ in rows],
            values=np.array([dense for _, _, dense in rows]),
            joint_indices=sorted({output // 9 for _, output, _ in rows}),
        )
    ]
    return out


def scattered(dna, seed):
    """The face with each joint group divided into seven by rows; shuffles groups and columns."""
    rng = np.random.default_rng(seed)
    out, groups = copy.deepcopy(dna), []
    for group in dna.joint_groups:
        columns = rng.permutation(len(group.input_indices))
        for part in range(7):
            kept = np.flatnonzero(np.arange(len(group.output_indices)) % 7 == part)
            groups.append(
                risorius.JointGroup(
                    lods=[int(np.count_nonzero(kept < int(n))) for n in group.lods],
                    input_indices=group.input_indices[columns],
                    output_indices=group.output_indices[kept],
                    values=group.values[kept][:, columns],
                    joint_indices=group.joint_indices,
                )
            )
    out.joint_groups = [groups[i] for i in rng.permutation(len(groups))]
    return out


def random_poses(dna, count=12):
    rng = np.random.default_rng(len(dna.joint_names))
    raw = rng.uniform(-0.25, 1.25, (count, len(dna.raw_control_names)))
    return np.asarray(raw * (rng.random(raw.shape) < 0.5), np.float32)


def assert_same_poses(before, after, **options):
    """Check that two faces give the same joints, shapes and maps at every LOD, bit for bit."""
    rigs = [risorius.Rig(dna, simd="scalar", **options) for dna in (before, after)]
    raw = random_poses(before)
    for lod in range(before.lod_count):
        poses = [rig.evaluate_batch(raw, lod=lod) for rig in rigs]
        np.testing.assert_array_equal(poses[0].joints, poses[1].joints)
        np.testing.assert_array_equal(poses[0].blend_shapes, poses[1].blend_shapes)
        np.testing.assert_array_equal(poses[0].animated_maps, poses[1].animated_maps)
    assert rigs[0].joint_indices_written.tolist() == rigs[1].joint_indices_written.tolist()


def assert_same_matrices(before, after):
    for lod in range(before.lod_count):
        wide = max(control_count(before), control_count(after))
        np.testing.assert_array_equal(matrix(before, lod, wide), matrix(after, lod, wide))
        assert turns(before, lod) == turns(after, lod)


def effects(dna, coefficients):
    """Sizes of coefficients in mm, degrees or scale, float64[joints * 9, controls]."""
    units = [MM[dna.translation_unit]] * 3 + [DEGREES[dna.rotation_unit]] * 3 + [1.0] * 3
    return np.abs(coefficients) * np.tile(units, len(dna.joint_names))[:, None]


def stored(dna):
    return sum(group.values.size for group in dna.joint_groups)


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_without_a_threshold_the_face_is_the_same(path):
    dna = risorius.load(path)
    out, report = edit.regroup(dna, timed=0)
    assert report.removed == 0
    assert_same_matrices(dna, out)
    assert_same_poses(dna, out)
    assert_same_poses(dna, out, rotation="quaternion")
    changes = (report.translation_mm, report.rotation_degrees, report.scale, report.position_mm)
    assert [change.value for change in changes] == [0.0] * 4
    assert out.validate() == dna.validate()
    for group in out.joint_groups:
        assert np.all(np.diff(np.asarray(group.lods, int)) <= 0)
        assert np.any(group.values != 0, axis=0).all()


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_everything_but_the_joint_groups_stays(path):
    dna = risorius.load(path)
    data = dna.to_bytes()
    out, _ = edit.regroup(dna, threshold=1, timed=0)
    assert dna.to_bytes() == data
    out.joint_groups = dna.joint_groups
    assert out.to_bytes() == data


@pytest.mark.parametrize("width", [0, 1, 7, 8, 9, 16, 100])
def test_random_faces_with_repeated_rows_and_columns(width):
    dna = random_face(width + 1, width)
    out, _ = edit.regroup(dna, timed=0)
    for lod in range(dna.lod_count):
        wide = control_count(dna)
        # A rebuilt group has one column for columns of the same control: their sum, rounded once.
        np.testing.assert_allclose(
            matrix(dna, lod, wide), matrix(out, lod, wide), rtol=2**-23, atol=0
        )
    for simd in _native.available_simd().split(", "):
        rig = risorius.Rig(out, simd=simd)
        for raw in random_raw(width, len(dna.raw_control_names)):
            for lod in range(dna.lod_count):
                joints, *_ = oracle.evaluate(dna, raw.astype(float), lod, settle=True)
                assert_near(rig.evaluate(raw, lod=lod).joints, joints, f"{simd}, LOD {lod}: joints")


def overlapping_face(seed):
    """A face with few joints in many groups.

    Some groups write a row twice, repeat a control, skip a LOD or rotate quaternion joints, and
    some correctives read correctives.
    """
    rng = np.random.default_rng(seed)
    dna = random_face(seed, 5)
    joints, groups = int(rng.integers(3, 12)), []
    for _ in range(int(rng.integers(2, 8))):
        rows, columns = int(rng.integers(0, joints * 9)), int(rng.integers(0, 14))
        group = random_group(rng, dna, 21, rows, columns)
        lods = rng.permutation(group.lods) if rng.random() < 0.15 else group.lods
        groups.append(
            risorius.JointGroup(
                lods=lods,
                input_indices=np.sort(group.input_indices)
                if rng.random() < 0.5
                else group.input_indices,
                output_indices=rng.integers(0, joints * 9, rows)
                if rng.random() < 0.2
                else rng.permutation(joints * 9)[:rows],
                values=group.values * (rng.random(group.values.shape) < rng.choice([0.2, 1])),
            )
        )
    dna.joint_groups = groups
    metadata = risorius.JointBehaviorMetadata()
    metadata.joint_representations = np.outer(rng.random(60) < 0.4, [0, 1, 0]).astype(np.uint16)
    dna.joint_behavior_metadata = metadata
    return dna


@pytest.mark.parametrize("seed", range(30))
def test_faces_whose_groups_overlap(seed):
    dna = overlapping_face(seed)
    out, _ = edit.regroup(dna, timed=0, combinations=20)
    raw = random_raw(seed, len(dna.raw_control_names))
    for rotation in ("euler", "quaternion"):
        rigs = [risorius.Rig(d, simd="scalar", rotation=rotation) for d in (dna, out)]
        assert rigs[0].joint_indices_written.tolist() == rigs[1].joint_indices_written.tolist()
        for lod in range(dna.lod_count):
            a, b = (rig.evaluate_batch(raw, lod=lod) for rig in rigs)
            # The rebuilt groups store the sum of the columns with the same control, rounded to
            # float32; the original groups store these columns separately. So results may differ
            # by the rounding of at most 14 additions. A sum has at most 14 terms below 4.5:
            # values are below 3 and controls below 1.5.
            np.testing.assert_allclose(a.joints, b.joints, rtol=0, atol=14 * 4.5 * 14 * oracle.EPS)
            np.testing.assert_array_equal(a.animated_maps, b.animated_maps)
    assert edit.regroup(out, timed=0, combinations=0)[0].to_bytes() == out.to_bytes()


@pytest.mark.parametrize("seed", range(30))
def test_correctives_that_others_read_are_computed_as_before(seed):
    dna = overlapping_face(seed)
    options = {"threshold": (3, 0.5, 1), "foreign_share": 1, "timed": 0, "combinations": 0}
    out, _ = edit.regroup(dna, **options)
    factors = sorted(set(dna.psds.columns.tolist()))
    raw = random_raw(seed, len(dna.raw_control_names))
    for lod in range(dna.lod_count):
        a, b = (risorius.Rig(d).evaluate_batch(raw, lod=lod) for d in (dna, out))
        np.testing.assert_array_equal(a.controls[:, factors], b.controls[:, factors])
    assert edit.regroup(out, **options)[0].to_bytes() == out.to_bytes()


def without_turns(dna):
    """The face with Euler angles instead of quaternions, so that the order of columns is free."""
    out = copy.deepcopy(dna)
    out.joint_behavior_metadata = risorius.JointBehaviorMetadata()
    return out


@pytest.mark.parametrize("storage", [giant, lambda dna: scattered(dna, 1)], ids=["one", "many"])
@pytest.mark.parametrize("name", ["medium", "quatjoints", "units", "ml", "core"])
def test_the_storage_does_not_matter(name, storage):
    dna = without_turns(risorius.load(GOLDEN / f"{name}.dna"))
    other = storage(dna)
    assert len(other.joint_groups) != len(dna.joint_groups)
    wanted, _ = edit.regroup(dna, timed=0)
    out, report = edit.regroup(other, timed=0)
    assert_same_matrices(dna, out)
    assert_same_poses(other, out)
    assert report.before.coefficients == stored(other)
    assert report.after.coefficients == stored(out) == stored(wanted)
    assert report.after.groups == len(out.joint_groups) == len(wanted.joint_groups)


@pytest.mark.parametrize("name", ["quatjoints"])
def test_quaternions_come_out_of_one_group_whole(name):
    dna = risorius.load(GOLDEN / f"{name}.dna")
    whole = giant(dna)
    out, report = edit.regroup(whole, threshold=1e6, foreign_share=1, timed=0)
    for lod in range(dna.lod_count):
        assert turns(out, lod) == turns(whole, lod) != {}
    assert report.after.coefficients < report.before.coefficients


def turning_face(*groups):
    """A face with two quaternion joints and two LODs.

    Args:
        groups: joint groups: (rows of each LOD, control indices, output indices, values).
    """
    dna = risorius.Dna()
    dna.lod_count = 2
    dna.raw_control_names = [f"raw{i}" for i in range(4)]
    dna.joint_names, dna.joint_parents = ["coarse", "fine"], [0, 0]
    dna.neutral_joint_translations = dna.neutral_joint_rotations = np.zeros((2, 3))
    dna.joint_groups = [
        risorius.JointGroup(lods=lods, input_indices=inputs, output_indices=outputs, values=values)
        for lods, inputs, outputs, values in groups
    ]
    metadata = risorius.JointBehaviorMetadata()
    metadata.joint_representations = np.array([[0, 1, 0]] * 2, np.uint16)
    dna.joint_behavior_metadata = metadata
    return dna


COARSE, FINE = [0, 0, 20], [[30, 0, 10], [0, 25, 5]]
TURNING = {
    # If both groups were joined, the rotation of control 3, which both LODs have, would be applied
    # first.
    "apart": [([1, 1], [3], [4], [[20]]), ([2, 0], [1, 2, 3], [12, 13], FINE)],
    "together": [([3, 1], [1, 2, 3], [4, 12, 13], [COARSE, *FINE])],
    # Angles of one joint belong to different LODs, so that the order of its columns must not
    # change.
    "mixed": [([3, 1], [1, 2, 3], [12, 4, 13], [FINE[0], COARSE, FINE[1]])],
}


@pytest.mark.parametrize("case", TURNING)
def test_products_of_quaternions_stay_in_their_order(case):
    dna = turning_face(*TURNING[case])
    for regions in (None, [["coarse", "fine"]], [["coarse"], ["fine"]]):
        out, _ = edit.regroup(dna, regions=regions, timed=0)
        for lod in range(2):
            assert turns(out, lod) == turns(dna, lod) != {}
        assert_same_poses(dna, out)
        assert edit.regroup(out, regions=regions, timed=0)[0].to_bytes() == out.to_bytes()


def face_of_regions(seed, regions=6, joints=12, controls=20):
    """A face with one group: dense regions of joints, in random order, and small other values.

    Args:
        seed: seed of all random values.
        regions: number of regions.
        joints: number of joints per region.
        controls: number of controls that move the joints of a region, of 60 in all.

    Returns:
        (the face, float32[rows, 60]: its values without the small ones, region of each joint).
    """
    rng = np.random.default_rng(seed)
    count = regions * joints
    owner = rng.permutation(np.repeat(np.arange(regions), joints))
    reads = [rng.choice(60, controls, replace=False) for _ in range(regions)]
    values = np.zeros((count * 9, 60), np.float32)
    for joint, region in enumerate(owner):
        part = rng.uniform(0.2, 2, (9, controls)) * rng.choice([-1, 1], (9, controls))
        values[joint * 9 : joint * 9 + 9, reads[region]] = part
    clean = values.copy()
    for region in range(regions):
        # Small values are in 3 of 12 joints of the region: a quarter, which still counts as
        # foreign.
        for column in np.setdiff1d(np.arange(60), reads[region])[::2]:
            for joint in rng.choice(np.flatnonzero(owner == region), 3, replace=False):
                values[joint * 9 + rng.integers(9), column] = rng.uniform(0.0001, 0.0009)
    dna = risorius.Dna()
    dna.lod_count = 1
    dna.raw_control_names = [f"raw{i}" for i in range(60)]
    dna.joint_names = [f"joint{i}" for i in range(count)]
    dna.joint_parents = [0] * count
    dna.neutral_joint_translations = rng.uniform(-5, 5, (count, 3))
    dna.neutral_joint_rotations = np.zeros((count, 3))
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[count * 9],
            input_indices=range(60),
            output_indices=range(count * 9),
            values=values,
        )
    ]
    return dna, clean, owner


@pytest.mark.parametrize("seed", range(5))
def test_planted_outliers_go_and_nothing_else(seed):
    dna, clean, owner = face_of_regions(seed)
    planted = np.count_nonzero(dna.joint_groups[0].values) - np.count_nonzero(clean)
    out, report = edit.regroup(dna, threshold=(0.01, 0.001, 0.001), timed=0)
    np.testing.assert_array_equal(matrix(out, 0, 60), clean)
    assert report.removed == planted == 6 * 20 * 3
    assert sorted(map(sorted, report.regions)) == sorted(
        np.flatnonzero(owner == region).tolist() for region in range(6)
    )
    assert report.after.coefficients == report.after.nonzero == np.count_nonzero(clean)
    assert report.after.groups == 6


@pytest.mark.parametrize("threshold", [0.02, 0.3, 3.0, 1e9])
@pytest.mark.parametrize("name", ["medium", "units", "quatjoints", "tiny_v28"])
def test_what_goes_is_below_the_threshold(name, threshold):
    dna = risorius.load(GOLDEN / f"{name}.dna")
    out, report = edit.regroup(dna, threshold=threshold, timed=0, combinations=50)
    limits = np.tile([threshold] * 6 + [threshold / 100] * 3, len(dna.joint_names))[:, None]
    gone = 0
    for lod in reversed(range(dna.lod_count)):
        wide = control_count(dna)
        before, after = matrix(dna, lod, wide), matrix(out, lod, wide)
        changed = before != after
        assert np.all(after[changed] == 0)
        assert np.all((effects(dna, before) < limits)[changed])
        gone = np.count_nonzero(changed)
        assert turns(out, lod) == turns(dna, lod)
    assert report.removed == gone == report.before.nonzero - report.after.nonzero
    # Controls are at most 1, so that a joint changes by at most the sum of its removed values.
    lost = effects(dna, matrix(dna, 0, wide) - matrix(out, 0, wide)).sum(axis=1).reshape(-1, 9)
    assert report.translation_mm.value <= np.linalg.norm(lost[:, :3], axis=1).max() * 1.001
    assert report.rotation_degrees.value <= lost[:, 3:6].sum(axis=1).max() * 1.001
    assert report.scale.value <= lost[:, 6:].max() * 1.001


def test_the_report_is_what_the_poses_say():
    dna = risorius.load(GOLDEN / "medium.dna")
    out, report = edit.regroup(dna, threshold=2.0, foreign_share=1, combinations=0, timed=0)
    assert report.removed > 100
    assert (report.expressions, report.combinations) == (len(dna.raw_control_names), 0)
    worst = {"translation_mm": (0, "", "", 0), "scale": (0, "", "", 0)}
    rigs = [risorius.Rig(d, simd="scalar") for d in (dna, out)]
    for lod in range(dna.lod_count):
        raw = np.eye(len(dna.raw_control_names), dtype=np.float32)
        a, b = (rig.evaluate_batch(raw, lod=lod).joints.astype(float) for rig in rigs)
        found = {
            "translation_mm": np.linalg.norm(a[..., :3] - b[..., :3], axis=2) * 10,
            "scale": np.abs(a[..., 6:] - b[..., 6:]).max(axis=2),
        }
        for key, amounts in found.items():
            control, joint = np.unravel_index(np.argmax(amounts), amounts.shape)
            if amounts[control, joint] > worst[key][0]:
                names = (dna.joint_names[joint], dna.raw_control_names[control], lod)
                worst[key] = (amounts[control, joint], *names)
    for key, (value, *where) in worst.items():
        change = getattr(report, key)
        assert change.value == pytest.approx(value, rel=1e-5)
        assert [change.joint, change.expression, change.lod] == where


def test_the_same_seed_gives_the_same_report():
    dna = risorius.load(GOLDEN / "medium.dna")

    def told(*seed):
        given = {"seed": seed[0]} if seed else {}
        out, report = edit.regroup(dna, threshold=2.0, foreign_share=1, timed=0, **given)
        change = report.translation_mm
        return out.to_bytes(), change.value, change.joint, change.expression, change.lod

    assert told(1) == told(1)
    assert told() == told(0) != told(1)
    assert told(1)[0] == told(2)[0]
    assert told(1)[1] != told(2)[1]


@pytest.mark.parametrize("threshold", [0, 0.5, 5])
@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_once_is_enough(path, threshold):
    once, _ = edit.regroup(risorius.load(path), threshold=threshold, timed=0, combinations=0)
    twice, report = edit.regroup(once, threshold=threshold, timed=0, combinations=0)
    assert report.removed == 0
    assert twice.to_bytes() == once.to_bytes()


def test_times_are_measured():
    dna = risorius.load(GOLDEN / "medium.dna")
    _, report = edit.regroup(dna, combinations=0, timed=20)
    assert report.microseconds_before > 0
    assert report.microseconds_after > 0
    _, report = edit.regroup(dna, combinations=0, timed=0)
    assert (report.microseconds_before, report.microseconds_after) == (0, 0)


def test_regions_by_name_and_index():
    dna = risorius.load(GOLDEN / "medium.dna")
    moved = sorted({int(o) // 9 for g in dna.joint_groups for o in g.output_indices})
    halves = [moved[::2], moved[1::2]]
    out, report = edit.regroup(dna, regions=halves, timed=0)
    assert [list(g.joint_indices) for g in out.joint_groups] == report.regions == halves
    assert_same_matrices(dna, out)
    named = {str(i): [dna.joint_names[j] for j in half] for i, half in enumerate(halves)}
    assert edit.regroup(dna, regions=named, timed=0)[0].to_bytes() == out.to_bytes()
    # Joints that belong to no given region form groups of their own.
    out, report = edit.regroup(dna, regions=[halves[0]], timed=0)
    assert report.regions[0] == halves[0]
    assert sorted(j for region in report.regions[1:] for j in region) == halves[1]
    assert_same_matrices(dna, out)


def test_a_name_stands_for_all_its_joints():
    dna, *_ = face_of_regions(0)
    dna.joint_names = ["same", "same", *dna.joint_names[2:]]
    _, report = edit.regroup(dna, regions=[["same"]], timed=0)
    assert report.regions[0] == [0, 1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"regions": [["nobody"]]}, "there is no joint 'nobody'"),
        ({"regions": {"eye": ["nobody"]}}, "eye: there is no joint 'nobody'"),
        ({"regions": [[72]]}, "there is no joint 72"),
        ({"regions": [[-1]]}, "there is no joint -1"),
        ({"regions": ["joint1"]}, "a list of joints was expected"),
        ({"regions": [[1, 2], ["joint1"]]}, "is in regions[0] already"),
        ({"regions": [[1], []]}, "a region without joints"),
        ({"threshold": -1}, "a number from 0"),
        ({"threshold": float("nan")}, "a number from 0"),
        ({"threshold": (1, 2)}, "(mm, degrees, scale)"),
        ({"foreign_share": 2}, "0 to 1"),
        ({"combinations": 1_000_001}, "more than 1000000"),
    ],
)
def test_what_makes_no_sense_is_refused(options, words):
    dna, *_ = face_of_regions(0)
    with pytest.raises(ValueError, match=re.escape(words)):
        edit.regroup(dna, **options)


def command(*arguments):
    return command_line.run("edit", "regroup", *arguments, text=True)


def test_the_command_writes_a_file_without_findings(tmp_path, capsys):
    out = tmp_path / "out.dna"
    assert main(["edit", "regroup", str(GOLDEN / "medium.dna"), str(out)]) == 0
    text = capsys.readouterr().out
    for words in ("joint groups", "58,533", "44,052", "taken out: 0 coefficients", "none"):
        assert words in text
    assert main(["check", str(out)]) == 0
    assert capsys.readouterr().out.startswith(f"ok: {out}")
    assert out.read_bytes() == edit.regroup(risorius.load(GOLDEN / "medium.dna"))[0].to_bytes()
    assert "nothing to do" not in text
    assert main(["edit", "regroup", str(out), str(tmp_path / "again.dna")]) == 0
    assert "nothing to do" in capsys.readouterr().out


def test_the_report_for_a_program(tmp_path):
    source = GOLDEN / "medium.dna"
    done = command(
        source, tmp_path / "out.json", "--threshold", "2,2,0.02", "--foreign-share", "1", "--json"
    )
    assert (done.returncode, done.stderr) == (0, "")
    facts = json.loads(done.stdout)
    out = risorius.Dna.from_json((tmp_path / "out.json").read_text())
    assert facts["after"]["coefficients"] == stored(out)
    assert facts["before"]["coefficients"] == stored(risorius.load(source))
    assert facts["removed"] > 100
    assert facts["largest_changes"]["translation_mm"]["joint"] in out.joint_names
    moved = {out.joint_names[o // 9] for g in out.joint_groups for o in g.output_indices.tolist()}
    assert {name for region in facts["regions"] for name in region} == moved


@pytest.mark.parametrize("suffix", ["json", "toml"])
def test_regions_from_a_file(suffix, tmp_path):
    dna = risorius.load(GOLDEN / "core.dna")
    regions = tmp_path / f"regions.{suffix}"
    names = json.dumps(dna.joint_names)
    regions.write_text(
        f'{{"regions": {{"all": {names}}}}}' if suffix == "json" else f"[regions]\nall = {names}\n"
    )
    done = command(GOLDEN / "core.dna", tmp_path / "out.dna", "--regions", regions)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(risorius.load(tmp_path / "out.dna").joint_groups) == 1


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_before_and_after_as_a_picture(suffix, tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / f"picture.{suffix}"
    done = command(GOLDEN / "medium.dna", tmp_path / "out.dna", "--plot", picture, "--dpi", "40")
    assert (done.returncode, done.stderr) == (0, "")
    begin = picture.read_bytes()[:300]
    assert (
        begin.startswith(b"\x89PNG") if suffix == "png" else b"<svg" in begin or b"<?xml" in begin
    )


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--threshold", "much"], 2, "--threshold"),
        (["--threshold", "1,2"], 2, "MM,DEGREES,SCALE"),
        (["--threshold", "-1"], 2, "--threshold"),
        (["--plot", "picture.jpg"], 2, ".png or .svg"),
        (["--dpi", "3"], 2, "--dpi"),
        (["--combinations", "-1"], 2, "--combinations"),
        (["--foreign-share", "7"], 2, "--foreign-share"),
        (["--seed", "-1"], 2, "--seed"),
        (["--regions", "nowhere.json"], 1, "nowhere.json: cannot read it"),
        (["--what"], 2, "unrecognized arguments"),
    ],
)
def test_a_bad_command_line_writes_nothing(arguments, code, words, tmp_path):
    done = command(GOLDEN / "core.dna", tmp_path / "out.dna", *arguments)
    assert done.returncode == code
    assert words in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[", "regions.json: "),
        ("{}", "a list of joints for each region"),
        ("7", "a list of joints for each region"),
        ('{"eye": "FACIAL"}', "eye: a list of joints"),
        ('{"eye": [true]}', "eye: a list of joints"),
        ('{"eye": ["nobody"]}', "eye: there is no joint 'nobody'"),
        ("[[0], [0]]", "is in regions[0] already"),
        ("[[0], []]", "a region without joints"),
    ],
)
def test_bad_regions_write_nothing(text, words, tmp_path):
    regions = tmp_path / "regions.json"
    regions.write_text(text)
    done = command(GOLDEN / "core.dna", tmp_path / "out.dna", "--regions", regions)
    assert done.returncode == 1
    assert words in done.stderr
    assert not (tmp_path / "out.dna").exists()


def test_standard_input_and_output():
    data = (GOLDEN / "medium.dna").read_bytes()
    done = subprocess.run(
        [sys.executable, "-m", "risorius", "edit", "regroup", "-", "-"],
        input=data,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0
    assert b"coefficients stored" in done.stderr
    assert done.stdout == edit.regroup(risorius.load(data), timed=0)[0].to_bytes()


def test_names_say_what_the_files_are(tmp_path):
    done = command(GOLDEN / "core.dna", tmp_path / "out.txt")
    assert done.returncode == 2
    assert "a name ending in .dna or .json was expected, or -" in done.stderr


@pytest.mark.parametrize("minor", range(1, 9))
def test_the_version_stays(minor, tmp_path):
    face, out = tmp_path / "face.dna", tmp_path / "out.dna"
    risorius.load(GOLDEN / "medium.dna").save(face, version=f"2.{minor}", unknown_layers="ignore")
    assert main(["edit", "regroup", str(face), str(out)]) == 0
    assert risorius.load(out).version == minor


def test_values_that_are_no_numbers_stay():
    dna, *_ = face_of_regions(0)
    group = dna.joint_groups[0]
    values = group.values.copy()
    values[[3, 600], [1, 2]] = np.nan, np.inf
    group.values = values.ravel()
    out, report = edit.regroup(dna, threshold=1e9, foreign_share=1, timed=0)
    left = np.concatenate([g.values.ravel() for g in out.joint_groups])
    left = left[left != 0]
    assert np.isnan(left).sum() == np.isinf(left).sum() == 1
    assert len(left) == 2 == report.after.nonzero


def test_a_face_without_behavior_stays_one():
    dna = risorius.load(GOLDEN / "medium.dna", layers="definition")
    out, report = edit.regroup(dna, timed=0)
    assert report.after.groups == report.before.groups == 0
    assert out.to_bytes() == dna.to_bytes()


def test_the_input_is_replaced_only_by_force(tmp_path):
    face = tmp_path / "face.dna"
    data = (GOLDEN / "medium.dna").read_bytes()
    face.write_bytes(data)
    done = command(face, face)
    assert (done.returncode, face.read_bytes()) == (2, data)
    assert "--force" in done.stderr
    assert command(face, face, "--force").returncode == 0
    assert face.read_bytes() != data


def test_a_full_scale_face():
    path = require_extra(SHARED / "data" / "golden" / "fullscale.dna", "regroup of fullscale.dna")
    dna = risorius.load(path)
    out, report = edit.regroup(dna, timed=0)
    assert report.after.coefficients <= report.before.coefficients
    assert 20 <= report.after.groups <= 60
    assert_same_matrices(dna, out)
    assert_same_poses(dna, out)
    again, told = edit.regroup(giant(dna), timed=0)
    assert told.before.groups == 1
    assert again.to_bytes() == out.to_bytes()


def _face_of(values):
    """A face with one joint group.

    Args:
        values: float[joints, controls], effect of each control on the x translation of each joint.
    """
    joints, controls = values.shape
    dna = risorius.Dna()
    dna.joint_names = [f"j{i}" for i in range(joints)]
    dna.joint_parents = [0] * joints
    dna.neutral_joint_translations = dna.neutral_joint_rotations = np.zeros((joints, 3))
    dna.raw_control_names = [f"c{i}" for i in range(controls)]
    dna.lod_count, dna.lod_joint_mapping = 1, [range(joints)]
    dna.joint_row_count, dna.joint_column_count = 9 * joints, controls
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[joints],
            input_indices=range(controls),
            output_indices=9 * np.arange(joints),
            values=values.astype(np.float32),
            joint_indices=range(joints),
        )
    ]
    return dna


@pytest.mark.parametrize(
    ("values", "groups"),
    [
        # Each control drives one joint: one group by region would have 16 values with 4 nonzero,
        # but four groups by driving controls have one value each.
        (np.eye(4), 4),
        # Each pair of controls drives a pair of joints: half of the values are 0, which is allowed
        # in a group by region.
        (np.kron(np.eye(2), np.ones((2, 2))), 1),
        (np.ones((4, 4)), 1),
    ],
)
def test_a_new_face_has_groups_by_region_unless_these_are_mostly_empty(values, groups):
    dna = _face_of(values)
    made = grouped(dna, {"mouth": list(dna.joint_names)})
    assert len(made.joint_groups) == groups
    np.testing.assert_array_equal(matrix(made, 0), matrix(dna, 0))
