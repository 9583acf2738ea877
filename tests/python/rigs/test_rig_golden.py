# SPDX-License-Identifier: MIT
"""Compares the evaluator at every LOD with values of an independent implementation.

The reference is OpenRigLogic, which computed the values of tests/data/golden. The oracle is
tests/python/support/oracle.py, which evaluates a file in double precision.
"""

import gzip
import json

import numpy as np
import oracle
import pytest
import risorius
from conftest import GOLDEN_SET, SHARED, evaluations, lods_of, require_extra
from risorius import _native

SIMD = _native.available_simd().split(", ")
BEYOND = ("rbfSolvers", "twists", "swings", "mlControls", "mlTypes")


def is_plain(name, about):
    """Whether the oracle of this test can evaluate a file quickly.

    The file has no networks, solvers or setups, and at most a quarter of its joints are
    quaternions. test_rig_behavior tests all files.
    """
    if any(about["counts"][part] for part in BEYOND):
        return False
    dna = risorius.load(GOLDEN_SET / f"{name}.dna", layers="joint_behavior_metadata")
    joints = range(len(dna.joint_names))
    return sum(oracle.is_quaternion(dna, j) for j in joints) <= len(joints) / 4


PLAIN = [e for e in evaluations() if is_plain(e[0], e[2])]
RIGS = [name for name, tag, _ in PLAIN if tag == ""]
SEQUENCES = [name for name, tag, _ in PLAIN if tag == ".seq"]
# Files that the reference loaded with a LOD filter: (file, tag, LODs of the file that it kept).
FILTERED = [
    (name, tag, lods_of(about) or list(range(about["counts"]["lods"])))
    for name, tag, about in PLAIN
    if tag not in ("", ".quat", ".seq", ".quat.seq")
]


class Golden:
    """The reference's values of a rig: <rig>.eval<tag>.json describes the values in .bin.gz."""

    def __init__(self, folder, name, tag=""):
        self.about = json.loads((folder / f"{name}.eval{tag}.json").read_text())
        data = gzip.decompress((folder / f"{name}.eval{tag}.bin.gz").read_bytes())
        self.values = np.frombuffer(data, "<f4")

    def slice(self, part):
        return self.values[part["offset"] : part["offset"] + part["count"]]

    def record(self, offset):
        out = {}
        for name, count in self.about["record"]:
            out[name] = self.values[offset : offset + count]
            offset += count
        return out


def assert_within(actual, expected, bound, what):
    """Check that |actual - expected| <= 2 * bound, because both values may be rounded."""
    excess = np.abs(actual.astype(float) - expected) - 2 * bound
    worst = int(np.argmax(excess)) if excess.size else 0
    assert excess.size == 0 or excess[worst] <= 0, (
        f"{what}[{worst}]: {actual[worst]} against {expected[worst]}, bound {2 * bound[worst]}"
    )


def check_pose(dna, pose, expected, bounds, what):
    joints, shapes, maps, controls = bounds
    raw = len(dna.raw_control_names)
    assert_within(pose.joints.ravel(), expected["joints"], joints[1], what + " joints")
    assert_within(pose.blend_shapes, expected["blendShapes"], shapes[1], what + " shapes")
    assert_within(pose.animated_maps, expected["animatedMaps"], maps[1], what + " maps")
    np.testing.assert_array_equal(pose.controls[:raw], expected["rawControls"])
    psds = slice(raw, raw + dna.psd_count)
    assert_within(
        pose.controls[psds], expected["psdControls"], controls[1][psds], what + " correctives"
    )


def raw_of_case(golden, rig, case):
    if case["kind"] == "default":
        return golden.slice(golden.about["initialRawControls"])
    values = golden.slice(case["input"])
    if case["kind"] == "raw":
        return values
    raw = rig.gui_to_raw(values)
    # The program that made the reference's values then set the w of quaternion inputs to 1.
    raw[[name.endswith((".w", ".qw")) for name in rig.raw_control_names]] = 1
    return raw


def check_rig(folder, name, simd):
    dna = risorius.load(folder / f"{name}.dna")
    rig = risorius.Rig(dna, simd=simd)
    assert rig.simd == simd
    assert rig.ignored_layers == []
    golden = Golden(folder, name)
    np.testing.assert_array_equal(
        rig.neutral_joints.ravel(), golden.slice(golden.about["neutralJointValues"])
    )
    records = 0
    for case in golden.about["cases"]:
        raw = raw_of_case(golden, rig, case)
        for lod, offset in enumerate(case["lodRecordOffsets"]):
            expected = golden.record(offset)
            if case["kind"] == "gui":  # two roundings per row of the table
                np.testing.assert_allclose(
                    raw, expected["rawControls"], rtol=0, atol=8 * oracle.EPS
                )
                raw = expected["rawControls"]
            pose = rig.evaluate(raw, lod=lod, settle=False)
            bounds = oracle.evaluate(
                dna, raw.astype(float), lod, settle=False, control_count=rig.control_count
            )
            check_pose(dna, pose, expected, bounds, f"{name} case {case['index']} lod {lod}")
            records += 1
    assert records >= rig.lod_count * 3


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize("name", RIGS)
def test_every_case_at_every_lod(name, simd):
    check_rig(GOLDEN_SET, name, simd)


@pytest.mark.parametrize("simd", SIMD)
def test_extra_full_scale(simd):
    folder = SHARED / "data" / "golden"
    require_extra(folder / "fullscale.dna", "golden data of the full-scale rig")
    check_rig(folder, "fullscale", simd)


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize("name", SEQUENCES)
def test_a_face_through_time_has_the_reference_latency(name, simd):
    dna = risorius.load(GOLDEN_SET / f"{name}.dna")
    rig = risorius.Rig(dna, simd=simd)
    golden = Golden(GOLDEN_SET, name, ".seq")
    instance = rig.instance()
    raw = golden.slice(golden.about["initialRawControls"]).copy()
    state = np.zeros(rig.control_count)
    lod = 0
    for number, step in enumerate(golden.about["steps"]):
        if "setLOD" in step:
            if step["setLOD"] != lod:
                state[len(raw) :] = 0
            lod = instance.lod = step["setLOD"]
            lod = min(lod, rig.lod_count - 1)
        assert instance.lod == step["lodAfter"]
        raw[step.get("setRawIndices", [])] = step.get("setRawValues", [])
        if "setGUIThenMapToRaw" in step:
            gui = step["setGUIThenMapToRaw"]
            values = golden.slice(gui) if isinstance(gui, dict) else np.asarray(gui, np.float32)
            raw = rig.gui_to_raw(values)
        expected = golden.record(step["recordOffset"])
        np.testing.assert_allclose(raw, expected["rawControls"], rtol=0, atol=8 * oracle.EPS)
        pose = instance.evaluate(raw)
        bounds = oracle.evaluate(
            dna, expected["rawControls"].astype(float), lod, settle=False, controls=state
        )
        expected["rawControls"] = raw
        if step["call"] != "calculate":  # the generator ran all stages except joints
            assert "joints not recalculated" in step["call"]
            expected["joints"] = pose.joints.ravel()
        check_pose(dna, pose, expected, bounds, f"{name} step {number}")


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize(("name", "tag", "lods"), FILTERED)
def test_what_the_reference_loads_filtered_is_our_lod_by_name(name, tag, lods, simd):
    """Compare filtered loads of the reference with the same LODs of a complete load.

    A filter keeps the joints of its LODs in order. Quaternions are not compared, because the order
    of their columns depends on the load.
    """
    dna = risorius.load(GOLDEN_SET / f"{name}.dna")
    rig = risorius.Rig(dna, simd=simd)
    golden = Golden(GOLDEN_SET, name, tag)
    kept = len(golden.about["record"]) and dict(golden.about["record"])["joints"] // 9
    listed = set().union(*(set(dna.lod_joint_mapping[lod].tolist()) for lod in lods))
    unlisted = set(range(len(dna.joint_names))) - set(dna.lod_joint_mapping[0].tolist())
    joints = sorted(listed | unlisted) if lods[0] else list(range(len(dna.joint_names)))
    assert len(joints) == kept
    for case in golden.about["cases"]:
        raw = raw_of_case(golden, rig, case)
        for lod, offset in zip(lods, case["lodRecordOffsets"], strict=True):
            expected = golden.record(offset)
            pose = rig.evaluate(expected["rawControls"], lod=lod, settle=False)
            np.testing.assert_allclose(raw, expected["rawControls"], rtol=0, atol=8 * oracle.EPS)
            (_, bound), *_ = oracle.evaluate(
                dna, expected["rawControls"].astype(float), lod, settle=False
            )
            angles = np.array([not oracle.is_quaternion(dna, j) for j in joints])
            assert_within(
                pose.joints[joints][angles].ravel(),
                expected["joints"].reshape(-1, 9)[angles].ravel(),
                bound.reshape(-1, 9)[joints][angles].ravel(),
                f"{name} {tag} case {case['index']} lod {lod}",
            )
