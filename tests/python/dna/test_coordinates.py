# SPDX-License-Identifier: MIT
"""Compares conversions of axes and units with matrices, the reference's reader and posed faces.

The reference is OpenRigLogic, which computed the values of tests/data/golden.
"""

import gzip
import itertools
import json
import warnings

import coordinates_oracle as oracle
import numpy as np
import oracle_behavior
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra
from coordinates_oracle import System

EPS = float(np.finfo(np.float32).eps)
FILES = ["tiny_v28", "units", "quatjoints", "medium"]
# ANGLE is the largest rotation error in radians if angles up to 180 degrees are rounded to float32.
# DEPTH is the largest number of joints in a chain, whose errors add up.
ANGLE = 180 * EPS * np.pi / 180
DEPTH = 40

pytestmark = pytest.mark.filterwarnings("ignore:.*:UserWarning")


def load(name):
    return risorius.load(GOLDEN / f"{name}.dna")


def targets(count, seed):
    rng = np.random.default_rng(seed)
    return [oracle.random_system(rng) for _ in range(count)]


def keeping_order(source, count, seed):
    """Random target systems that rotate about the same axes in the same order as the source."""
    rng = np.random.default_rng(seed)
    out = []
    while len(out) < count:
        target = oracle.random_system(rng)
        if oracle.order_stays(source, target):
            out.append(target)
    return out


def size_of(matrices):
    return DEPTH * max(1.0, float(np.abs(matrices).max()))


def caught(dna, **arguments):
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        out = dna.convert(**arguments)
    return out, [str(w.message) for w in found]


# ---- geometry and neutral pose


@pytest.mark.parametrize("name", FILES)
def test_says_the_system_that_it_is_in(name):
    for target in targets(20, 1):
        assert oracle.system_of(load(name).convert(**target.arguments())) == target


@pytest.mark.parametrize("name", FILES)
def test_joints_in_neutral_map(name):
    dna = load(name)
    source, world = oracle.system_of(dna), oracle.world_matrices(dna)
    for target in targets(40, 2):
        converted = oracle.world_matrices(dna.convert(**target.arguments()))
        expected = oracle.mapped_world(source, target, world)
        assert np.abs(converted - expected).max() <= ANGLE * size_of(expected), target


@pytest.mark.parametrize("axes", oracle.ALL_AXES)
def test_every_target_of_axes_and_order(axes):
    dna = load("tiny_v28")
    source, world = oracle.system_of(dna), oracle.world_matrices(dna)
    for sequence in oracle.ALL_SEQUENCES:
        target = System(axes, sequence, (1, -1, 1))
        converted = oracle.world_matrices(dna.convert(**target.arguments()))
        expected = oracle.mapped_world(source, target, world)
        assert np.abs(converted - expected).max() <= ANGLE * size_of(expected), sequence


@pytest.mark.parametrize("name", FILES)
def test_positions_normals_and_deltas_map(name):
    dna = load(name)
    source = oracle.system_of(dna)
    for target in targets(8, 3):
        converted = dna.convert(**target.arguments())
        c, unit = oracle.change(source, target), oracle.scale_of_unit(source, target)
        for before, after in zip(dna.meshes, converted.meshes, strict=True):
            pairs = [
                (before.positions, after.positions, unit),
                (before.normals, after.normals, 1),
                *(
                    (a.deltas, b.deltas, unit)
                    for a, b in zip(
                        before.blend_shape_targets, after.blend_shape_targets, strict=True
                    )
                ),
            ]
            for a, b, factor in pairs:
                expected = (a.astype(float) @ c) * factor
                np.testing.assert_allclose(b, expected, rtol=EPS, atol=0)


def signed_faces(mesh):
    """For each face, 1 or -1 if its winding agrees or disagrees with the mean of its normals."""
    out = []
    offsets = mesh.face_offsets.tolist()
    for begin, end in itertools.pairwise(offsets):
        layouts = mesh.face_layouts[begin:end]
        p = mesh.positions[mesh.layout_positions[layouts]].astype(float)
        n = mesh.normals[mesh.layout_normals[layouts]].astype(float).mean(0)
        turn = sum(np.cross(p[i] - p[0], p[i + 1] - p[0]) for i in range(1, len(p) - 1))
        out.append(int(np.sign(np.round(turn @ n, 9))))
    return np.array(out)


@pytest.mark.parametrize("name", ["medium", "units"])
def test_faces_turn_with_handedness_and_winding(name):
    dna = load(name)
    before = [signed_faces(m) for m in dna.meshes]
    assert all((signs != 0).any() for signs in before)
    source = oracle.system_of(dna)
    for target in targets(12, 4):
        converted = dna.convert(**target.arguments())
        same = -1 if source.face_winding_order != target.face_winding_order else 1
        mirrored = np.linalg.det(oracle.change(source, target)) < 0
        for mesh, after, signs in zip(dna.meshes, converted.meshes, before, strict=True):
            assert np.array_equal(signed_faces(after), signs * same)
            assert np.array_equal(after.layout_normals, mesh.layout_normals)
            kept = np.array_equal(after.face_layouts, mesh.face_layouts)
            assert kept == (mirrored == (same == -1))


# ---- evaluated poses


def raw_controls(dna, rng):
    """Random raw controls. Controls of quaternions give the identity, because the axes of a
    quaternion depend on the coordinate system.
    """
    raw = rng.uniform(-0.2, 1.2, len(dna.raw_control_names)).astype(np.float32)
    for i, name in enumerate(dna.raw_control_names):
        part = name.rpartition(".")[2]
        if part.lstrip("q") in {"x", "y", "z", "w"}:
            raw[i] = part.endswith("w")
    return raw


def assert_pose_maps(dna, converted, raw, lod):
    """Check that posed joints of two rigs have mapped world matrices and all other outputs agree.

    Without solvers, other outputs must be equal bit for bit.
    """
    source, target = oracle.system_of(dna), oracle.system_of(converted)
    before = risorius.Rig(dna).evaluate(raw, lod=lod)
    after = risorius.Rig(converted).evaluate(raw, lod=lod)
    for field in ("blend_shapes", "animated_maps", "controls"):
        tolerance = 1e-5 if dna.rbf_behavior.solvers else 0  # other order of sums
        assert np.abs(getattr(before, field) - getattr(after, field)).max(initial=0) <= tolerance, (
            field
        )
    world = oracle.world_matrices(dna, before.joints)
    expected = oracle.mapped_world(source, target, world)
    result = oracle.world_matrices(converted, after.joints)
    # Angles are float32 sums of about a hundred products, so that large angles have large errors.
    size = max(180.0, float(np.abs(before.joints).max())) / 180
    assert np.abs(result - expected).max() <= 100 * size * ANGLE * size_of(expected)


@pytest.mark.parametrize("name", ["tiny_v28", "units", "medium"])
def test_every_pose_maps_where_the_order_of_rotation_stays(name):
    dna = load(name)
    dna.joint_behavior_metadata.joint_representations = np.zeros((0, 3), np.uint16)
    for solver in dna.rbf_behavior.solvers:
        solver.solver_type = 0  # interpolation between two equal targets is undefined
    rng = np.random.default_rng(5)
    for target in keeping_order(oracle.system_of(dna), 6, 6):
        converted, found = caught(dna, **target.arguments())
        assert not [w for w in found if "joint_groups: " in w and "axes:" in w]
        for lod in range(dna.lod_count):
            assert_pose_maps(dna, converted, raw_controls(dna, rng), lod)


def random_rig(seed, joints=7, raw=5):
    """A chain of joints with random neutral poses and axes, and raw controls without effect.

    Returns: the face, and the random generator.
    """
    rng = np.random.default_rng(seed)
    dna = risorius.Dna(
        lod_count=1,
        raw_control_names=[f"raw{i}" for i in range(raw)],
        joint_names=[f"joint{i}" for i in range(joints)],
        joint_parents=[max(0, i - 1) for i in range(joints)],
        neutral_joint_translations=rng.uniform(-9, 9, (joints, 3)),
        neutral_joint_rotations=rng.uniform(-1.5, 1.5, (joints, 3)),
        rotation_unit="radians",
    )
    dna.coordinate_system = oracle.ALL_AXES[rng.integers(48)]
    dna.rotation_sequence = oracle.ALL_SEQUENCES[rng.integers(6)]
    dna.rotation_signs = oracle.ALL_SIGNS[rng.integers(8)]
    return dna, rng


def with_group(dna, rng, joints):
    """Add a joint group with nine rows per joint in random order, and a column per raw control."""
    raw = len(dna.raw_control_names)
    outputs = rng.permutation(np.concatenate([np.arange(9) + 9 * j for j in joints]))
    values = rng.uniform(-1, 1, (len(outputs), raw))
    dna.joint_groups = [
        risorius.JointGroup(
            lods=[len(outputs)],
            input_indices=np.arange(raw),
            output_indices=outputs,
            values=values,
            joint_indices=joints,
        )
    ]
    return dna


@pytest.mark.parametrize("seed", range(30))
def test_deltas_of_one_control_map_in_any_order_of_rotation(seed):
    dna, rng = random_rig(seed)
    with_group(dna, rng, [1, 2, 4])
    source, target = oracle.system_of(dna), oracle.random_system(rng)
    converted, found = caught(dna, **target.arguments())
    assert any("approximate" in w for w in found) != oracle.order_stays(source, target)
    c, unit = oracle.change(source, target), oracle.scale_of_unit(source, target)
    for raw in np.eye(len(dna.raw_control_names), dtype=np.float32):
        before = risorius.Rig(dna).evaluate(raw).joints.astype(float)
        after = risorius.Rig(converted).evaluate(raw).joints.astype(float)
        np.testing.assert_allclose(after[:, :3], before[:, :3] @ c * unit, rtol=2 * EPS)
        np.testing.assert_array_equal(after[:, 6:], before[:, 6:] @ np.abs(c))
        expected = oracle.mapped_rotation(c, oracle.rotation(source, before[:, 3:6]))
        result = oracle.rotation(target, after[:, 3:6])
        assert np.abs(result - expected).max() <= 8 * ANGLE


@pytest.mark.parametrize("seed", range(20))
def test_quaternion_joints_map_for_all_controls_at_once(seed):
    dna, rng = random_rig(100 + seed)
    with_group(dna, rng, [1, 2, 4])
    flags = np.zeros((7, 3), np.uint16)
    flags[:, 1] = 1
    dna.joint_behavior_metadata.joint_representations = flags
    source, target = oracle.system_of(dna), oracle.random_system(rng)
    converted, found = caught(dna, **target.arguments())
    assert not [w for w in found if "approximate" in w]
    raw = rng.uniform(0, 1, len(dna.raw_control_names)).astype(np.float32)
    before = risorius.Rig(dna).evaluate(raw).joints.astype(float)
    after = risorius.Rig(converted).evaluate(raw).joints.astype(float)
    c = oracle.change(source, target)
    expected = oracle.mapped_rotation(c, oracle.rotation(source, before[:, 3:6]))
    result = oracle.rotation(target, after[:, 3:6])
    # The evaluator's arc sine has an error of about sqrt(EPS) if the middle angle is near 90
    # degrees.
    assert np.abs(result - expected).max() <= 4 * np.sqrt(EPS)
    np.testing.assert_allclose(
        after[:, :3],
        before[:, :3] @ c * oracle.scale_of_unit(source, target),
        rtol=0,
        atol=16 * EPS * np.abs(after[:, :3]).max(),
    )


def converted_columns(dna, target):
    """For each group, joint -> converted (translations, rotations, scales) of its columns.

    Shapes are [columns, 3], [columns, 3, 3] (matrices for row vectors) and [columns, 3].
    """
    source = oracle.system_of(dna)
    c, unit = oracle.change(source, target), oracle.scale_of_unit(source, target)
    out = []
    for group in dna.joint_groups:
        columns = {}
        for joint in sorted({int(o) // 9 for o in group.output_indices}):
            pose = np.zeros((9, len(group.input_indices)))
            for row, output in enumerate(group.output_indices):
                if output // 9 == joint:
                    pose[output % 9] = group.values[row]
            columns[joint] = (
                (pose[:3].T @ c) * unit,
                oracle.mapped_rotation(c, oracle.rotation(source, pose[3:6].T)),
                pose[6:].T @ np.abs(c),
            )
        out.append(columns)
    return out


@pytest.mark.parametrize("name", FILES)
def test_joint_matrices_convert_column_by_column(name):
    dna = load(name)
    for target in targets(6, 7):
        converted = dna.convert(**target.arguments())
        expected = converted_columns(dna, target)
        for group, columns in zip(converted.joint_groups, expected, strict=True):
            assert set(group.output_indices.tolist()) <= {
                9 * j + a for j in columns for a in range(9)
            }
            for joint, (translations, rotations, scales) in columns.items():
                pose = np.zeros((9, len(group.input_indices)))
                for row, output in enumerate(group.output_indices):
                    if output // 9 == joint:
                        pose[output % 9] = group.values[row]
                np.testing.assert_allclose(pose[:3].T, translations, rtol=EPS, atol=0)
                np.testing.assert_array_equal(pose[6:].T, scales)
                result = oracle.rotation(target, pose[3:6].T)
                size = max(1, np.abs(oracle.radians(target, pose[3:6].T)).max(initial=0))
                np.testing.assert_allclose(result, rotations, rtol=0, atol=4 * size * EPS)


# ---- rotations in raw controls


def matrix_of(q):
    """Rotation matrix for row vectors, by rotating the three axes with a quaternion."""
    q = np.asarray(q, float)
    conjugate = q * (-1, -1, -1, 1)
    product = oracle_behavior.multiply
    return np.array([product(product(q, np.array([*v, 0])), conjugate)[:3] for v in np.eye(3)])


def twist_of(q, axis):
    out = np.zeros(4)
    out[[axis, 3]] = np.asarray(q, float)[[axis, 3]]
    return out / np.linalg.norm(out)


@pytest.mark.parametrize("axes", oracle.ALL_AXES)
def test_targets_and_twist_axes_of_controls_map(axes):
    dna = load("tiny_v28")
    target = System(axes)
    c = oracle.change(oracle.system_of(dna), target)
    converted = dna.convert(axes=axes)
    pairs = zip(dna.rbf_behavior.solvers, converted.rbf_behavior.solvers, strict=True)
    for before, after in pairs:
        old = np.asarray(before.raw_control_values).reshape(-1, 4)
        new = np.asarray(after.raw_control_values).reshape(-1, 4)
        for q, mapped in zip(old, new, strict=True):
            expected = oracle.mapped_rotation(c, matrix_of(q))
            assert np.abs(matrix_of(mapped) - expected).max() <= 4 * EPS
            assert mapped[3] == q[3]  # of q and -q the same one
            expected = oracle.mapped_rotation(c, matrix_of(twist_of(q, before.twist_axis)))
            twist = matrix_of(twist_of(mapped, after.twist_axis))
            assert np.abs(twist - expected).max() <= 8 * EPS
    for kind in ("twists", "swings"):
        setups = getattr(dna.twist_swing_behavior, kind)
        for old, new in zip(setups, getattr(converted.twist_swing_behavior, kind), strict=True):
            assert new.twist_axis == int(np.argmax(np.abs(c[old.twist_axis])))


def test_other_controls_and_radii_in_degrees_stay():
    dna = load("tiny_v28")
    converted = dna.convert(axes=("front", "left", "down"), translation_unit="m")
    for before, after in zip(dna.rbf_behavior.solvers, converted.rbf_behavior.solvers, strict=True):
        assert after.radius == before.radius
    assert converted.gui_to_raw.slope_values.tobytes() == dna.gui_to_raw.slope_values.tobytes()
    assert converted.psds.values.tobytes() == dna.psds.values.tobytes()


def test_radii_follow_the_rotation_unit():
    dna = load("tiny_v28")
    converted = dna.convert(rotation_unit="radians")
    for before, after in zip(dna.rbf_behavior.solvers, converted.rbf_behavior.solvers, strict=True):
        assert after.radius == pytest.approx(np.radians(before.radius), rel=EPS)


# ---- unchanged systems, round trips, errors


@pytest.mark.parametrize("name", FILES)
def test_its_own_system_changes_no_bit(name):
    dna = load(name)
    same, found = caught(dna, **oracle.system_of(dna).arguments())
    assert same.to_bytes() == dna.to_bytes()
    assert dna.convert().to_bytes() == dna.to_bytes()
    assert found == []


@pytest.mark.parametrize("name", ["tiny_v28", "units", "quatjoints", "medium"])
def test_places_and_signs_come_back_exactly(name):
    dna = load(name)
    source = oracle.system_of(dna)
    # This Dna is read from the JSON of the same file, with 0 in place of -0.
    fresh = json.loads(dna.to_json().replace("-0.0,", "0.0,"))
    for target in keeping_order(source, 12, 8):
        arguments = target.arguments()
        arguments["translation_unit"], arguments["rotation_unit"] = (
            source.translation_unit,
            source.rotation_unit,
        )
        back = dna.convert(**arguments).convert(**source.arguments())
        assert json.loads(back.to_json()) == fresh


@pytest.mark.parametrize("name", FILES)
def test_units_come_back_within_two_roundings(name):
    dna = load(name)
    source = oracle.system_of(dna)
    there = dna.convert(
        translation_unit="m" if source.translation_unit == "cm" else "cm",
        rotation_unit="radians" if source.rotation_unit == "degrees" else "degrees",
    )
    back = there.convert(**source.arguments())
    for a, b in [
        (dna.neutral_joint_translations, back.neutral_joint_translations),
        (dna.neutral_joint_rotations, back.neutral_joint_rotations),
        *((a.values, b.values) for a, b in zip(dna.joint_groups, back.joint_groups, strict=True)),
        *((a.positions, b.positions) for a, b in zip(dna.meshes, back.meshes, strict=True)),
    ]:
        np.testing.assert_allclose(b, a, rtol=EPS, atol=0)


@pytest.mark.parametrize(
    "arguments",
    [
        {"axes": ("right", "left", "up")},
        {"axes": ("right", "up")},
        {"axes": ("right", "up", "north")},
        {"axes": ("right", "up", "#4")},
        {"rotation_sequence": "xyx"},
        {"rotation_signs": (1, 0, 1)},
        {"rotation_signs": (1, 1)},
        {"face_winding_order": "left"},
        {"translation_unit": "inch"},
        {"translation_unit": "#1"},
        {"rotation_unit": "turns"},
    ],
)
def test_a_wrong_target_names_the_argument(arguments):
    with pytest.raises(ValueError, match=next(iter(arguments))):
        load("tiny_v28").convert(**arguments)


def test_positions_of_arguments_are_not_guessed():
    with pytest.raises(TypeError):
        load("tiny_v28").convert(("right", "up", "front"))


@pytest.mark.parametrize(
    ("field", "value", "where"),
    [
        ("coordinate_system", ("right", "left", "up"), "descriptor.coordinate_system"),
        ("rotation_sequence", "#6", "descriptor_ext.rotation_sequence"),
        ("rotation_signs", (1, 7, 1), "descriptor_ext.rotation_sign"),
        ("translation_unit", "#2", "descriptor.translation_unit"),
    ],
)
def test_a_file_in_no_system_is_an_error_with_its_field(field, value, where):
    dna = load("tiny_v28")
    setattr(dna, field, value)
    with pytest.raises(risorius.DnaError) as caught_error:
        dna.convert(rotation_unit="radians")
    assert (caught_error.value.code, caught_error.value.where) == ("invalid_value", where)


def test_warnings_name_the_field_and_become_errors_on_demand():
    dna = load("tiny_v28")
    _, found = caught(dna, rotation_sequence="zyx")
    assert any(w.startswith("behavior.joint_groups: ") and "approximate" in w for w in found)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(UserWarning):
            dna.convert(rotation_sequence="zyx")


def test_the_source_is_left_alone_and_the_result_can_be_saved():
    dna = load("medium")
    before = dna.to_bytes()
    converted = dna.convert(axes=("left", "front", "up"), translation_unit="m")
    again = risorius.load(converted.to_bytes())
    assert dna.to_bytes() == before
    assert again.coordinate_system == ("left", "front", "up")
    assert np.array_equal(again.meshes[0].positions, converted.meshes[0].positions)


# ---- comparison with the reference


def golden(folder, name, tag):
    path = folder / f"{name}.decode.transform_{tag}.json"
    if path.exists():
        return json.loads(path.read_text())
    return json.loads(gzip.decompress(path.with_suffix(".json.gz").read_bytes()))


def planes(record, stem):
    return np.array([record[stem + p + "s"] for p in "XYZ"], np.float32).reshape(3, -1).T


def close_angles(system, actual, expected):
    result, wanted = oracle.rotation(system, actual), oracle.rotation(system, expected)
    np.testing.assert_allclose(result, wanted, rtol=0, atol=1e-5)


def check_groups(system, groups, expected):
    """Check that joint matrices equal the reference's where the reference keeps the values.

    The reference spreads a joint over nine rows in all LODs that use any of them, and loses the
    signs of scales. In Risorius each row keeps its LODs.
    """
    assert len(groups) == len(expected)
    for group, wanted in zip(groups, expected, strict=True):
        joints = {int(o) // 9 for o in wanted["outputIndices"]}
        ours, theirs = [
            {(j, int(i)): np.zeros(9) for j in joints for i in group.input_indices} for _ in "ab"
        ]
        width = len(wanted["inputIndices"])
        for r, c in zip(*np.nonzero(group.values), strict=True):
            output, control = int(group.output_indices[r]), int(group.input_indices[c])
            ours[output // 9, control][output % 9] = group.values[r, c]
        for n, value in enumerate(wanted["values"]):
            output, control = wanted["outputIndices"][n // width], wanted["inputIndices"][n % width]
            theirs[output // 9, control][output % 9] = np.float32(value)
        a = np.array(list(ours.values())).reshape(-1, 9)
        b = np.array(list(theirs.values())).reshape(-1, 9)
        np.testing.assert_array_equal(a[:, :3], b[:, :3])
        np.testing.assert_array_equal(np.abs(a[:, 6:]), b[:, 6:])
        close_angles(system, a[:, 3:6], b[:, 3:6])
        for lod, rows in enumerate(group.lods):
            mine = {int(o) // 9 for o in group.output_indices[:rows]}
            assert mine == {o // 9 for o in wanted["outputIndices"][: wanted["lods"][lod]]}


def check_meshes(meshes, expected):
    for mesh, wanted in zip(meshes, expected, strict=True):
        np.testing.assert_array_equal(mesh.positions, planes(wanted, "position"))
        np.testing.assert_array_equal(mesh.normals, planes(wanted, "normal"))
        offsets = mesh.face_offsets.tolist()
        faces = [mesh.face_layouts[a:b].tolist() for a, b in itertools.pairwise(offsets)]
        assert faces == wanted["faces"]
        for target, reference in zip(
            mesh.blend_shape_targets, wanted["blendShapeTargets"], strict=True
        ):
            np.testing.assert_array_equal(target.deltas, planes(reference, "delta"))


def check_solvers(dna, converted, expected):
    """Compare solvers' targets, ignoring signs; the reference does not convert twist axes."""
    c = oracle.change(oracle.system_of(dna), oracle.system_of(converted))
    for before, solver, wanted in zip(
        dna.rbf_behavior.solvers, converted.rbf_behavior.solvers, expected, strict=True
    ):
        ours = np.asarray(solver.raw_control_values, float).reshape(-1, 4)
        theirs = np.asarray(wanted["rawControlValues"]).reshape(-1, 4)
        dots = np.abs(np.sum(ours * theirs, axis=1))
        np.testing.assert_allclose(dots, np.linalg.norm(ours, axis=1) ** 2, atol=1e-5)
        assert solver.radius == np.float32(wanted["radius"])
        assert before.twist_axis == wanted["twistAxis"]
        assert solver.twist_axis == int(np.argmax(np.abs(c[before.twist_axis])))


def check_against_reference(folder, name, tag):
    expected = golden(folder, name, tag)
    numbers = [int(n) for n in expected["load"]["transform"].split(",")]
    words = list(oracle.DIRECTIONS)
    target = System(
        tuple(words[n] for n in numbers[:3]),
        oracle.ALL_SEQUENCES[numbers[3]],
        tuple(numbers[4:7]),
        ["ccw", "cw"][numbers[7]],
    )
    dna = risorius.load(folder / f"{name}.dna")
    arguments = target.arguments()
    del arguments["translation_unit"], arguments["rotation_unit"]
    converted = dna.convert(**arguments)
    system = oracle.system_of(converted)
    definition = expected["definition"]
    np.testing.assert_array_equal(
        converted.neutral_joint_translations, planes(definition, "neutralJointTranslation")
    )
    close_angles(
        system, converted.neutral_joint_rotations, planes(definition, "neutralJointRotation")
    )
    check_groups(system, converted.joint_groups, expected["behavior"]["jointGroups"])
    check_meshes(converted.meshes, expected["geometry"])
    check_solvers(dna, converted, expected["rbfBehavior"]["solvers"])


@pytest.mark.parametrize(
    ("name", "tag"),
    [("tiny_v28", "a"), ("tiny_v28", "b"), ("units", "a"), ("quatjoints", "a")],
)
def test_is_the_references_conversion(name, tag):
    check_against_reference(GOLDEN, name, tag)


@pytest.mark.parametrize("name", ["medium", "rbf", "twistswing"])
def test_extra_is_the_references_conversion(name):
    folder = SHARED / "data" / "golden"
    require_extra(folder / f"{name}.dna", "golden conversions")
    check_against_reference(folder, name, "a")
