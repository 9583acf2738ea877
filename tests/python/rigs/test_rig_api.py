# SPDX-License-Identifier: MIT
"""Tests Rig and Morph as callers use them: wrong arguments, edited files, choice of SIMD."""

import copy
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius import _native


@pytest.fixture
def dna():
    return risorius.load(GOLDEN / "core.dna")


@pytest.fixture
def rig(dna):
    return risorius.Rig(dna)


# ---- wrong arguments


@pytest.mark.parametrize("method", ["evaluate", "gui_to_raw"])
@pytest.mark.parametrize("shape", [(0,), (99,), (1, 4), ()])
def test_wrong_shape_names_argument_wanted_and_given(rig, method, shape):
    argument = {"evaluate": "raw", "gui_to_raw": "gui"}[method]
    with pytest.raises(ValueError, match=f"^{argument}: .*shape.*{re.escape(str(shape))}"):
        getattr(rig, method)(np.zeros(shape, np.float32))


def test_batch_of_wrong_width_is_a_value_error(rig):
    with pytest.raises(ValueError, match=r"^raw: .*\(n, 4\).*\(3, 5\)"):
        rig.evaluate_batch(np.zeros((3, 5)))


def test_text_is_no_array(rig):
    with pytest.raises(ValueError, match=r"^raw: "):
        rig.evaluate(["a", "b", "c", "d"])


def test_other_number_types_and_strides_are_taken(rig):
    raw = np.array([0.25, 9, 0.5, 9, 0.75, 9, 1, 9])[::2]
    expected = rig.evaluate(np.ascontiguousarray(raw, np.float32))
    np.testing.assert_array_equal(rig.evaluate(raw).joints, expected.joints)
    np.testing.assert_array_equal(rig.evaluate(raw.tolist()).joints, expected.joints)


def test_lod_beyond_the_last_is_the_last(rig):
    raw = np.ones(4, np.float32)
    last = rig.evaluate(raw, lod=rig.lod_count - 1)
    np.testing.assert_array_equal(rig.evaluate(raw, lod=99).joints, last.joints)


def test_poses_do_not_share_memory(rig):
    a = rig.evaluate(np.ones(4, np.float32))
    kept = a.joints.copy()
    rig.evaluate(np.zeros(4, np.float32))
    np.testing.assert_array_equal(a.joints, kept)


def test_faces_in_turn_and_in_threads_do_not_see_each_other(dna):
    rigs = []
    for times in range(1, 13):  # more rigs than one thread keeps memory for
        one, groups = copy.copy(dna), list(dna.joint_groups)
        groups[0] = copy.copy(groups[0])
        groups[0].values = np.asarray(groups[0].values) * times
        one.joint_groups = groups
        rigs.append(risorius.Rig(one))
    raw = np.float32([0.5, 0.25, 0, 1])
    # The wanted values are from batches, which use other memory than single frames, so a fault in
    # the memory of single frames cannot change them.
    wanted = [rig.evaluate_batch(raw[None]).joints[0] for rig in rigs]
    assert not np.array_equal(wanted[0], wanted[1])

    def in_turn(_):
        got = [[rig.evaluate(raw).joints for rig in rigs] for _ in range(3)]
        return all(np.array_equal(a, b) for row in got for a, b in zip(row, wanted, strict=True))

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(in_turn, range(4)))


def test_neutral_pose_comes_from_the_definition(dna, rig):
    np.testing.assert_array_equal(rig.neutral_joints[:, :3], dna.neutral_joint_translations)
    np.testing.assert_array_equal(rig.neutral_joints[:, 3:6], dna.neutral_joint_rotations)
    np.testing.assert_array_equal(rig.neutral_joints[:, 6:], 1)


def test_joints_written_are_those_of_the_groups(dna, rig):
    written = {int(o) // 9 for g in dna.joint_groups for o in g.output_indices}
    assert rig.joint_indices_written.tolist() == sorted(written)


def test_instance_outlives_the_name_of_its_rig(dna):
    instance = risorius.Rig(dna).instance()
    assert instance.evaluate(np.ones(4, np.float32)).joints.shape == (5, 9)


# ---- edited files


def edit_group(**changes):
    def edit(dna):
        for name, value in changes.items():
            setattr(dna.joint_groups[0], name, value)

    return edit


def edit_psds(dna):
    dna.psds.columns = np.full(len(dna.psds.columns), 60000)


def edit_maps(dna):
    dna.animated_maps.conditionals.output_indices = np.full(
        len(dna.animated_maps.conditionals.output_indices), 7
    )


def edit_names(dna):
    dna.raw_control_names = dna.raw_control_names[:1]


def edit_joints(dna):
    dna.joint_names = dna.joint_names[:2]


@pytest.mark.parametrize(
    ("edit", "where"),
    [
        (edit_group(input_indices=[65535] * 4), "behavior.joint_groups[0]"),
        (edit_group(output_indices=[65535]), "behavior.joint_groups[0]"),
        (edit_group(lods=[60000, 0]), "behavior.joint_groups[0].lods[0]"),
        (edit_group(lods=[]), "behavior.joint_groups[0].lods"),
        (edit_group(values=np.zeros((1, 1))), "behavior.joint_groups[0].values"),
        (edit_psds, "behavior.psds.columns[0]"),
        (edit_maps, "behavior.animated_maps"),
        (edit_names, "behavior."),
        (edit_joints, "definition."),
    ],
)
def test_edited_file_is_an_error_with_the_field(dna, edit, where):
    edit(dna)
    with pytest.raises(risorius.DnaError) as caught:
        risorius.Rig(dna)
    assert caught.value.where.startswith(where)
    assert caught.value.code.startswith("invalid_")


def test_rig_does_not_see_later_edits(dna):
    rig = risorius.Rig(dna)
    before = rig.evaluate(np.ones(4, np.float32)).joints
    dna.joint_groups[0].values = np.zeros_like(dna.joint_groups[0].values)
    np.testing.assert_array_equal(rig.evaluate(np.ones(4, np.float32)).joints, before)


# ---- SIMD


@pytest.mark.parametrize("name", ["avx9", "SCALAR", "neon"])
def test_unknown_simd_lists_what_there_is(dna, name):
    with pytest.raises(ValueError, match=f"{name}.*{_native.available_simd()}"):
        risorius.Rig(dna, simd=name)


def run_with(simd):
    code = (
        "import sys, risorius; "
        "print(risorius.Rig(risorius.load(sys.argv[1])).simd)"
    )  # fmt: skip
    return subprocess.run(
        [sys.executable, "-c", code, str(GOLDEN / "core.dna")],
        env=os.environ | {"RISORIUS_SIMD": simd},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("name", _native.available_simd().split(", "))
def test_environment_forces_simd(name):
    assert run_with(name).stdout.strip() == name


def test_wrong_simd_in_the_environment_is_an_error():
    done = run_with("fast")
    assert done.returncode == 1
    assert "RISORIUS_SIMD" in done.stderr
    assert "scalar" in done.stderr


# ---- Morph


def random_mesh_dna(rng, vertices=50, channels=9):
    dna = risorius.Dna()
    dna.blend_shape_channel_names = [f"shape{i}" for i in range(channels)]
    dna.mesh_names = ["face"]
    targets = []
    for channel in [3, 0, 3, 7]:
        chosen = rng.permutation(vertices)[: rng.integers(1, vertices)]
        targets.append(
            risorius.BlendShapeTarget(
                deltas=rng.normal(size=(len(chosen), 3)),
                vertex_indices=chosen,
                blend_shape_channel_index=channel,
            )
        )
    mesh = risorius.Mesh(positions=rng.normal(size=(vertices, 3)), blend_shape_targets=targets)
    dna.meshes = [mesh]
    return dna


def test_morph_is_the_sum_of_transformed_deltas():
    rng = np.random.default_rng(1)
    dna = random_mesh_dna(rng)
    matrix = rng.normal(size=(3, 3)).astype(np.float32)
    weights = rng.normal(size=9).astype(np.float32)
    base = rng.normal(size=(50, 3)).astype(np.float32)
    morph = risorius.Morph(dna, 0, matrix=matrix)
    expected = base.astype(float)
    size = np.abs(expected)
    for target in dna.meshes[0].blend_shape_targets:
        weight = float(weights[target.blend_shape_channel_index])
        moved = np.asarray(target.deltas, float) @ matrix.T.astype(float)
        moved_size = np.abs(np.asarray(target.deltas, float)) @ np.abs(matrix.T.astype(float))
        np.add.at(expected, target.vertex_indices, weight * moved)
        np.add.at(size, target.vertex_indices, abs(weight) * moved_size)
    # Number of roundings of a vertex: 3 for products with the matrix, 1 for the weight, 5 for the
    # sum.
    bound = 9 * np.finfo(np.float32).eps * size
    assert (np.abs(morph.evaluate(weights, base) - expected) <= bound).all()
    assert morph.channel_indices.tolist() == [0, 3, 7]
    assert morph.vertex_count == 50


def test_morph_writes_the_callers_array():
    morph = risorius.Morph(random_mesh_dna(np.random.default_rng(2)), 0)
    out = np.full((50, 3), 99, np.float32)
    weights = np.ones(9, np.float32)
    assert morph.evaluate(weights, out=out) is out
    np.testing.assert_array_equal(out, morph.evaluate(weights))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"blend_shapes": np.ones(8)}, r"^blend_shapes: .*\(9,\).*\(8,\)"),
        ({"blend_shapes": np.full(9, np.nan)}, "^blend_shapes: finite"),
        ({"base": np.ones((49, 3))}, r"^base: .*\(50, 3\).*\(49, 3\)"),
        ({"base": np.full((50, 3), np.inf)}, "^base: finite"),
        ({"out": np.ones((50, 3))}, "^out: .*float32"),
        ({"out": np.ones((3, 50), np.float32).T}, "^out: .*C-contiguous"),
        ({"out": np.ones((50, 4), np.float32)}, r"^out: .*\(50, 3\).*\(50, 4\)"),
        ({"out": np.broadcast_to(np.float32(1), (50, 3))}, "^out: "),
    ],
)
def test_morph_refuses_wrong_arrays(arguments, message):
    morph = risorius.Morph(random_mesh_dna(np.random.default_rng(3)), 0)
    with pytest.raises(ValueError, match=message):
        morph.evaluate(**{"blend_shapes": np.ones(9), **arguments})


def test_morph_refuses_to_write_over_its_base():
    morph = risorius.Morph(random_mesh_dna(np.random.default_rng(3)), 0)
    both = np.zeros((51, 3), np.float32)
    with pytest.raises(ValueError, match="overlap"):
        morph.evaluate(np.ones(9), both[1:], both[:-1])
    read_only = np.zeros((50, 3), np.float32)
    read_only.flags.writeable = False
    with pytest.raises(ValueError, match="read-only"):
        morph.evaluate(np.ones(9), out=read_only)


@pytest.mark.parametrize("matrix", [np.eye(4), [[1], [1, 2]], "x", np.full((3, 3), np.inf)])
def test_morph_refuses_wrong_matrices(matrix):
    with pytest.raises(ValueError, match=r"^matrix: "):
        risorius.Morph(random_mesh_dna(np.random.default_rng(4)), 0, matrix=matrix)


def test_morph_checks_an_edited_mesh():
    dna = random_mesh_dna(np.random.default_rng(5))
    with pytest.raises(risorius.DnaError):
        risorius.Morph(dna, 1)
    dna.meshes[0].blend_shape_targets[0].vertex_indices = np.full(
        len(dna.meshes[0].blend_shape_targets[0].vertex_indices), 50
    )
    with pytest.raises(risorius.DnaError, match="vertex"):
        risorius.Morph(dna, 0)
