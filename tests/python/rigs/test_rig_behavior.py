# SPDX-License-Identifier: MIT
"""Compares networks, RBF solvers, twist and swing setups, and quaternions with the reference.

Each LOD is compared. The reference is OpenRigLogic, which computed the values of tests/data/golden.

Values in which the reference is known to deviate are not compared:

- Networks that move joints by Euler angles, evaluated as Euler angles: the reference takes their
  rotation and first scale for a quaternion.
- Networks whose joints have another system of axes: the reference overwrites the network's controls
  with converted values, and loses the sign of their scale.
- Several twists that share a rotation with a swing: the reference moves the joints of the first
  twist by the weights of the last one, and does not move the joints of the others.
- A twist that shares a rotation with a swing about another axis: the reference rotates the joints
  of the twist about the axis of the swing.
- A rotation of 0 0 0 0: the reference gives NaN, Risorius the identity.
- Solvers that interpolate between equal targets: any weights of these targets are correct.
"""

import numpy as np
import oracle
import oracle_behavior
import pytest
import risorius
from conftest import GOLDEN, GOLDEN_SET, evaluations, lods_of
from test_rig_golden import SIMD, Golden

EVALUATIONS = evaluations()
FACES = [name for name, tag, _ in EVALUATIONS if tag == ""]
CASES = [(name, tag) for name, tag, _ in EVALUATIONS if tag in ("", ".quat")]
# Faces of which the reference gave only Euler angles, not quaternions.
EULER_ONLY = [name for name in FACES if (name, ".quat") not in CASES]
SEQUENCES = [(name, tag) for name, tag, _ in EVALUATIONS if tag in (".seq", ".quat.seq")]
FILTERED = [
    (name, tag, lods_of(about)) for name, tag, about in EVALUATIONS if lods_of(about) is not None
]
# Interpolation multiplies the float32 error by the condition number of its matrix, so that solvers
# above WELL_CONDITIONED are not compared. ARC is the error of an arc cosine near 0: sqrt(8 eps).
WELL_CONDITIONED = 1e3
ARC = 1e-3


class Face:
    """A rig with comparisons of its poses, and with controls and joints that are not compared."""

    def __init__(self, name, rotation, simd=None, folder=GOLDEN_SET, **load):
        self.name, self.rotation = name, rotation
        self.dna = dna = risorius.load(folder / f"{name}.dna", **load)
        self.rig = risorius.Rig(dna, rotation=rotation, simd=simd)
        assert simd in (None, self.rig.simd)
        self.raw, self.psd = len(dna.raw_control_names), dna.psd_count
        self.ml = len(dna.machine_learned_behavior.ml_control_names)
        self.joint_count = len(dna.joint_names)
        joints = dna.machine_learned_behavior_ext.joints
        stride = oracle_behavior.ml_stride(dna)
        self.ml_joints = sorted({int(o) // stride for o in joints.output_indices})
        self.ml_euler = stride == 9
        self.converted = len(joints.parameter_keys) == 10
        self.ml_joint_controls = joints.input_indices
        self.vague = self.vague_controls()
        self.vague_joints = np.zeros(self.joint_count, bool)
        self.vague_joints[self.mixed_twists()] = True

    def vague_controls(self):
        """bool[controls]: controls written by solvers with a singular or nearly singular matrix."""
        out = np.zeros(self.rig.control_count, bool)
        poses = self.dna.rbf_behavior_ext.poses
        first = self.rig.control_count - len(self.dna.rbf_behavior.poses)
        for solver in oracle_behavior.solvers_of(self.dna):
            if solver.condition < WELL_CONDITIONED:
                continue
            for p in solver.solver.pose_indices:
                out[poses[p].output_control_indices if poses else [first + p]] = True
        return out

    def stretched(self, record):
        """Joints of setups whose input quaternion has not unit length.

        For these, Risorius and the reference compute different angles.
        """
        layer, controls = self.dna.twist_swing_behavior, self.expected_controls(record)
        out = []
        for s in (*layer.twists, *layer.swings):
            if abs(np.linalg.norm(controls[s.input_control_indices]) - 1) > 1e-3:
                out += s.output_joint_indices.tolist()
        return out

    def expected_controls(self, record):
        parts = ("rawControls", "psdControls", "mlControls", "rbfControls")
        return np.concatenate([record.get(p, []) for p in parts])

    def check(self, pose, record, lod, what, joints=None):
        wanted = self.expected_controls(record)
        sure = ~self.vague
        if self.converted:
            sure[self.ml_joint_controls] = False
        rbf = self.raw + self.psd + self.ml
        loose = np.where(np.arange(len(wanted)) < rbf, 1e-6, 2 * ARC)
        error = np.abs(pose.controls - wanted)
        bad = np.nonzero(sure & (error > loose * np.maximum(1, np.abs(wanted))))[0]
        assert bad.size == 0, f"{what}: control {bad[0]}: {pose.controls[bad]} {wanted[bad]}"
        if "joints" in record:
            self.check_joints(pose, record, lod, what, joints)
            np.testing.assert_allclose(
                pose.blend_shapes[: len(record["blendShapes"])] if joints is None else [],
                record["blendShapes"] if joints is None else [],
                rtol=1e-6,
                atol=1e-6,
                err_msg=what,
            )

    def bounds(self, pose, record, lod):
        """float64[J, 9]: allowed error of each joint attribute.

        It contains the rounding of sums, and the effect of the controls' deviations.
        """
        wanted = self.expected_controls(record)
        error = np.abs(pose.controls - wanted)
        if self.converted:
            error[self.ml_joint_controls] = 0
        out = np.zeros(self.joint_count * 9)
        for group in self.dna.joint_groups:
            rows = int(group.lods[lod]) if len(group.lods) else 0
            matrix = np.abs(np.asarray(group.values, float)[:rows])
            i = group.input_indices
            terms = (matrix.shape[1] + oracle.FACTORS + 2) * oracle.EPS
            out[group.output_indices[:rows]] = matrix @ (2 * terms * np.abs(wanted[i]) + error[i])
        return out.reshape(-1, 9) + 1e-6

    def mixed_twists(self):
        """Joints of twists that share a rotation with another twist or a swing of another axis."""
        layer = self.dna.twist_swing_behavior
        axes = {}
        for s in layer.swings:
            axes.setdefault(s.input_control_indices.tobytes(), set()).add(s.twist_axis)
        out = set()
        for t in layer.twists:
            key = t.input_control_indices.tobytes()
            twists = [u for u in layer.twists if u.input_control_indices.tobytes() == key]
            if key in axes and (len(twists) > 1 or axes[key] != {t.twist_axis}):
                out |= set(t.output_joint_indices.tolist())
        return sorted(out)

    def check_joints(self, pose, record, lod, what, chosen):
        stride = 9 if self.rotation == "euler" else 10
        chosen = np.arange(self.joint_count) if chosen is None else np.asarray(chosen)
        actual = pose.joints[chosen].astype(float)
        wanted = record["joints"].reshape(-1, stride).astype(float)
        bounds = self.bounds(pose, record, lod)[chosen]
        moved = np.isin(chosen, self.ml_joints)
        here = ~moved if self.ml_euler or self.converted else np.ones(len(chosen), bool)
        for columns, bound, rows in (
            (slice(0, 3), bounds[:, :3], ~moved | True),
            (slice(stride - 3, stride), bounds[:, 6:], here),
        ):
            excess = (np.abs(actual[:, columns] - wanted[:, columns]) - bound)[rows]
            assert excess.size == 0 or excess.max() <= 0, f"{what}: {excess.max()}"
        vague = self.vague_joints[chosen]
        if self.ml_euler and self.rotation == "euler":
            vague = vague | moved
        scale = oracle_behavior.radians_per_unit(self.dna)
        vague = vague | ~np.isfinite(wanted).all(axis=1)
        sure = np.nonzero(~vague)[0]
        a, b = self.quaternions(actual[sure]), self.quaternions(wanted[sure])
        error = np.minimum(np.abs(a - b).max(1), np.abs(a + b).max(1))
        # If the cosine of the middle Euler angle is near 0, half of the digits are lost.
        pole = np.where(self.near_pole(wanted[sure]), 1e-3, 0)
        bad = np.nonzero(error > 0.5 * scale * bounds[sure, 3:6].sum(1) + 5e-6 + pole)[0]
        assert bad.size == 0, (
            f"{what} joint {chosen[sure[bad[0]]]}: {a[bad[0]]} against {b[bad[0]]}"
        )
        self.compared += np.count_nonzero(~vague)

    compared = 0

    def quaternions(self, rows):
        """Quaternions [n, 4] of joints [n, 9] with Euler angles, or [n, 10] with quaternions."""
        if rows.shape[1] == 10:
            return rows[:, 3:7]
        scale = oracle_behavior.radians_per_unit(self.dna)
        return oracle_behavior.from_euler(
            self.dna.rotation_sequence, self.dna.rotation_signs, rows[:, 3:6] * scale
        )

    def near_pole(self, rows):
        if rows.shape[1] == 10:
            return np.zeros(len(rows), bool)
        middle = "xyz".index(self.dna.rotation_sequence[1])
        scale = oracle_behavior.radians_per_unit(self.dna)
        return np.abs(np.cos(rows[:, 3 + middle] * scale)) < 0.05


def rotation_of(tag):
    return "quaternion" if ".quat" in tag else "euler"


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize(("name", "tag"), CASES)
def test_first_frame_of_every_case(name, tag, simd):
    face = Face(name, rotation_of(tag), simd)
    golden = Golden(GOLDEN_SET, name, tag)
    rig = face.rig
    assert rig.ignored_layers == []
    initial = golden.slice(golden.about["initialRawControls"])
    np.testing.assert_array_equal(rig.initial_raw_controls, initial)
    neutral = golden.slice(golden.about["neutralJointValues"])
    np.testing.assert_allclose(rig.neutral_joints.ravel(), neutral, rtol=0, atol=2e-7)
    records = 0
    for case in golden.about["cases"]:
        for lod, offset in enumerate(case["lodRecordOffsets"]):
            record = golden.record(offset)
            pose = rig.evaluate(record["rawControls"], lod=lod, settle=False)
            face.check(pose, record, lod, f"{name}{tag} case {case['index']} lod {lod}")
            records += 1
    assert records == len(golden.about["cases"]) * rig.lod_count > 0
    assert face.compared > records * face.joint_count * 0.5


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize("name", EULER_ONLY)
def test_first_frame_as_quaternions_where_the_reference_gave_angles(name, simd):
    face = Face(name, "quaternion", simd)
    golden = Golden(GOLDEN_SET, name)
    for case in golden.about["cases"]:
        for lod, offset in enumerate(case["lodRecordOffsets"]):
            record = golden.record(offset)
            rows = record["joints"].reshape(-1, 9)
            turns = face.quaternions(rows.astype(float))
            face.vague_joints[:] = False
            face.vague_joints[face.mixed_twists() + face.stretched(record)] = True
            record["joints"] = np.concatenate([rows[:, :3], turns, rows[:, 6:]], axis=1).ravel()
            pose = face.rig.evaluate(record["rawControls"], lod=lod, settle=False)
            face.check(pose, record, lod, f"{name} case {case['index']} lod {lod}")
    assert face.compared > 0


@pytest.mark.parametrize("name", FACES)
def test_raw_to_gui_of_every_case(name):
    golden = Golden(GOLDEN_SET, name)
    rig = risorius.Rig(risorius.load(GOLDEN_SET / f"{name}.dna"))
    seen = 0
    for case in golden.about["cases"]:
        if "mapRawToGUI" not in case:
            continue
        part = case["mapRawToGUI"]
        wanted = golden.slice(part) if isinstance(part, dict) else np.asarray(part, np.float32)
        raw = golden.record(case["lodRecordOffsets"][0])["rawControls"]
        np.testing.assert_allclose(rig.raw_to_gui(raw), wanted, rtol=0, atol=4 * oracle.EPS)
        seen += np.count_nonzero(wanted)
    assert seen > 0


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize(("name", "tag"), SEQUENCES)
def test_a_face_through_time(name, tag, simd):
    face = Face(name, rotation_of(tag), simd)
    golden = Golden(GOLDEN_SET, name, tag)
    instance = face.rig.instance()
    masks = instance.masks
    np.testing.assert_array_equal(masks, 1)
    for number, step in enumerate(golden.about["steps"]):
        if "setLOD" in step:
            instance.lod = step["setLOD"]
        if "setMaskIndex" in step:
            masks[step["setMaskIndex"]] = step["setMaskValue"]
            instance.masks = masks
        record = golden.record(step["recordOffset"])
        pose = instance.evaluate(record["rawControls"])
        if step["call"] != "calculate":  # the generator did not run networks and joints
            continue
        face.check(pose, record, instance.lod, f"{name}{tag} step {number}")
    assert face.compared > 0


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize(("name", "tag", "lods"), FILTERED)
def test_filtered_loads_are_our_lods(name, tag, lods, simd):
    """Compare filtered loads of the reference with the same LODs of a complete load.

    A filtered load has the joints of its LODs and the joints of no LOD. Quaternions are not
    compared, because the order of their columns depends on the load.
    """
    face = Face(name, "euler", simd)
    golden = Golden(GOLDEN_SET, name, tag)
    listed = set().union(*(set(face.dna.lod_joint_mapping[lod].tolist()) for lod in lods))
    unlisted = set(range(face.joint_count)) - set(face.dna.lod_joint_mapping[0].tolist())
    face.vague_joints |= [oracle.is_quaternion(face.dna, j) for j in range(face.joint_count)]
    joints = sorted(listed | unlisted) if lods[0] else list(range(face.joint_count))
    for case in golden.about["cases"]:
        for lod, offset in zip(lods, case["lodRecordOffsets"], strict=True):
            record = golden.record(offset)
            pose = face.rig.evaluate(record["rawControls"], lod=lod, settle=False)
            face.check(pose, record, lod, f"{name}{tag} case {case['index']} lod {lod}", joints)


@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize(("name", "tag", "lods"), FILTERED)
def test_filtered_loads_are_what_the_reference_loads(name, tag, lods, simd):
    face = Face(name, "euler", simd, lods=lods)
    golden = Golden(GOLDEN_SET, name, tag)
    joints, records = reference_joints(name, lods, face.dna), 0
    for case in golden.about["cases"]:
        for lod, offset in enumerate(case["lodRecordOffsets"]):
            record = golden.record(offset)
            pose = face.rig.evaluate(record["rawControls"], lod=lod, settle=False)
            face.check(pose, record, lod, f"{name}{tag} case {case['index']} lod {lod}", joints)
            records += 1
    assert face.compared > 0.5 * len(record["joints"]) / 9 * records


def reference_joints(name, lods, loaded):
    """Indices in Risorius' filtered face of the joints that the reference keeps.

    Risorius also keeps ancestors of these joints. None if both keep the same joints.
    """
    whole = risorius.load(GOLDEN_SET / f"{name}.dna")
    kept = set(range(len(whole.joint_names))) - set(whole.lod_joint_mapping[0].tolist())
    kept |= set().union(*(whole.lod_joint_mapping[lod].tolist() for lod in lods))
    names = {whole.joint_names[j] for j in kept}
    found = [j for j, joint in enumerate(loaded.joint_names) if joint in names]
    return None if len(found) == len(loaded.joint_names) else found


@pytest.mark.parametrize("rotation", ["euler", "quaternion"])
@pytest.mark.parametrize("name", ["rbf", "ml", "mlquat", "mlbase", "twistswing", "quatjoints"])
def test_oracle_agrees_and_settled_is_what_repeats_itself(name, rotation):
    face = Face(name, rotation, folder=GOLDEN)
    dna, rig = face.dna, face.rig
    solvers = oracle_behavior.solvers_of(dna)
    rng = np.random.default_rng(7)
    for lod in range(rig.lod_count):
        raw = random_raw(rng, dna)
        settled = rig.evaluate(raw, lod=lod)
        wanted = oracle_behavior.settled(dna, solvers, raw, lod, rig.control_count)
        sure = ~face.vague
        np.testing.assert_allclose(settled.controls[sure], wanted[sure], rtol=1e-6, atol=1e-6)
        joints = oracle_behavior.joints(dna, settled.controls.astype(float), lod, rotation)
        if rotation == "quaternion":
            flip = np.sum(joints[:, 3:7] * settled.joints[:, 3:7], axis=1) < 0
            joints[flip, 3:7] *= -1
        scale = max(1.0, np.abs(joints).max())
        np.testing.assert_allclose(settled.joints, joints, rtol=0, atol=3e-6 * scale)


@pytest.mark.parametrize("rotation", ["euler", "quaternion"])
def test_euler_angles_of_networks_are_read_by_their_own_system(rotation):
    """Euler angles of networks may have their own order, signs and axes, unlike the face's."""
    dna = risorius.load(GOLDEN / "ml.dna")
    joints = dna.machine_learned_behavior_ext.joints
    assert oracle_behavior.ml_stride(dna) == 9
    own = {3: 0, 4: 5, 5: 2, 6: 1, 7: 0, 8: 1, 9: 3}  # left, back, up; + - +; y, z, x
    joints.parameter_keys = [*joints.parameter_keys.tolist(), *own]
    joints.parameter_values = [*joints.parameter_values.tolist(), *own.values()]
    rig = risorius.Rig(dna, rotation=rotation)
    pose = rig.evaluate(random_raw(np.random.default_rng(11), dna))
    controls = pose.controls.astype(float)
    angles = controls[joints.input_indices[joints.output_indices % 9 // 3 == 1]]
    assert np.abs(angles).max() > 0.1
    wanted = oracle_behavior.joints(dna, controls, 0, rotation)
    actual = pose.joints.astype(float)
    if rotation == "quaternion":
        actual[np.sum(actual[:, 3:7] * wanted[:, 3:7], axis=1) < 0, 3:7] *= -1
    np.testing.assert_allclose(actual, wanted, rtol=0, atol=3e-6 * max(1.0, np.abs(wanted).max()))


@pytest.mark.parametrize("rotation", ["euler", "quaternion"])
@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize("name", ["rbf", "ml", "mlquat", "twistswing", "quatjoints", "tiny_v28"])
def test_batch_rows_are_single_evaluations(name, simd, rotation):
    dna = risorius.load(GOLDEN / f"{name}.dna")
    rig = risorius.Rig(dna, rotation=rotation, simd=simd)
    rng = np.random.default_rng(3)
    raw = np.array([random_raw(rng, dna) for _ in range(19)])
    for settle in (True, False):
        batch = rig.evaluate_batch(raw, lod=1, settle=settle, threads=1)
        for row, values in enumerate(raw):
            single = rig.evaluate(values, lod=1, settle=settle)
            for field in ("joints", "blend_shapes", "animated_maps", "controls"):
                np.testing.assert_array_equal(getattr(batch, field)[row], getattr(single, field))


def random_raw(rng, dna):
    """Random controls, in 30 % of calls zeros; controls of a quaternion always have unit length."""
    raw = rng.uniform(0, 1, len(dna.raw_control_names)) * (rng.random() < 0.7)
    names = list(dna.raw_control_names)
    for i, name in enumerate(names):
        if name.endswith((".w", ".qw")) and i >= 3:
            raw[i - 3 : i + 1] = oracle_behavior.unit(rng.normal(size=4))
    return raw.astype(np.float32)


def test_nan_spoils_what_it_drives_and_nothing_else():
    dna = risorius.load(GOLDEN / "rbf.dna")
    rig = risorius.Rig(dna, rotation="quaternion")
    raw = random_raw(np.random.default_rng(1), dna)
    clean = rig.evaluate(raw)
    spoiled = raw.copy()
    spoiled[8] = np.nan
    pose = rig.evaluate(spoiled)
    assert np.isnan(pose.controls).any()
    same = ~np.isnan(pose.controls)
    assert np.count_nonzero(same) > 50
    untouched = [i for i in range(len(raw)) if i != 8]
    np.testing.assert_array_equal(pose.controls[untouched], clean.controls[untouched])
    again = rig.evaluate(raw)
    np.testing.assert_array_equal(again.joints, clean.joints)


@pytest.mark.parametrize("rotation", ["euler", "quaternion"])
def test_bytes_are_the_rig(rotation):
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    rig = risorius.Rig(dna, rotation=rotation)
    raw = random_raw(np.random.default_rng(2), dna)
    wanted = rig.evaluate(raw)
    data = rig.to_bytes()
    assert data == bytes(rig.block())
    for again in (
        risorius.Rig.from_bytes(data),
        risorius.Rig.from_bytes(data, trusted=True),
        risorius.Rig.from_bytes(rig.block()),
        risorius.Rig.from_bytes(np.frombuffer(data, np.uint8).copy(), simd=rig.simd),
    ):
        assert again.rotation == rotation
        np.testing.assert_array_equal(again.evaluate(raw).joints, wanted.joints)
    block = rig.block()
    assert block.readonly
    shared = risorius.Rig.from_bytes(block, trusted=True)
    del rig, block
    np.testing.assert_array_equal(shared.evaluate(raw).joints, wanted.joints)


def test_a_read_only_view_of_what_others_may_write_is_copied():
    dna = risorius.load(GOLDEN / "tiny_v28.dna")
    rig = risorius.Rig(dna)
    raw = random_raw(np.random.default_rng(3), dna)
    data = np.frombuffer(rig.to_bytes(), np.uint8)
    space = np.empty(len(data) + 64, np.uint8)
    owner = space[-space.ctypes.data % 64 :][: len(data)]  # aligned: a view is possible
    owner[:] = data
    again = risorius.Rig.from_bytes(memoryview(owner).toreadonly())
    owner[:] = 0
    np.testing.assert_array_equal(again.evaluate(raw).joints, rig.evaluate(raw).joints)
    assert again.to_bytes() == rig.to_bytes()


def test_damaged_bytes_are_refused():
    data = bytearray(risorius.Rig(risorius.load(GOLDEN / "core.dna")).to_bytes())
    data[-1] ^= 1
    with pytest.raises(risorius.DnaError, match="changed or cut"):
        risorius.Rig.from_bytes(data)
    with pytest.raises(risorius.DnaError):
        risorius.Rig.from_bytes(b"")


def test_masks_are_one_per_region_and_checked():
    instance = risorius.Rig(risorius.load(GOLDEN / "ml.dna")).instance()
    assert instance.masks.shape == (9,)
    with pytest.raises(ValueError, match="masks"):
        instance.masks = [1.0]


def test_rotation_is_one_of_two():
    with pytest.raises(ValueError, match="euler or quaternion"):
        risorius.Rig(risorius.load(GOLDEN / "core.dna"), rotation="matrix")


def one_pose_solver(threshold):
    """A rig with a solver of one pose at 0: it writes 1 - x to a control that moves a joint.

    Args:
        threshold: weight threshold of the solver.
    """
    dna = risorius.Dna()
    dna.lod_count, dna.rotation_unit = 1, "radians"
    dna.raw_control_names, dna.joint_names, dna.joint_parents = ["x"], ["joint"], [0]
    dna.neutral_joint_translations = dna.neutral_joint_rotations = [[0, 0, 0]]
    dna.joint_groups = [
        risorius.JointGroup(lods=[1], input_indices=[1], output_indices=[0], values=[[1]])
    ]
    dna.rbf_behavior.lod_solver_mapping = [[0]]
    dna.rbf_behavior.solvers = [
        risorius.RbfSolver(
            name="s", raw_control_indices=[0], pose_indices=[0], raw_control_values=[0],
            radius=1, automatic_radius=1, function_type=2, weight_threshold=threshold,
        )
    ]  # fmt: skip
    dna.rbf_behavior.poses = [risorius.RbfPose(name="p", scale=1)]
    dna.rbf_behavior_ext.pose_control_names = ["pose"]
    dna.rbf_behavior_ext.poses = [
        risorius.RbfPoseControls(output_control_indices=[1], output_control_weights=[1])
    ]
    return risorius.Rig(dna)


def test_a_pose_must_be_above_the_threshold_and_not_at_it():
    for threshold, wanted in ((0.5, 0), (np.nextafter(np.float32(0.5), np.float32(0)), 0.5)):
        rig = one_pose_solver(threshold)
        pose = rig.evaluate([0.5])
        assert pose.controls.tolist() == [0.5, wanted]
        assert pose.joints[0, 0] == wanted
        _, weights = rig.solver_poses(0, pose.controls)
        assert weights.tolist() == [wanted]
