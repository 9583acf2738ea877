# SPDX-License-Identifier: MIT
"""Tests the generator of a DNA file with the size and structure of a real head."""

import sys

import numpy as np
import oracle_behavior
import pytest
import risorius
from conftest import PROJECT
from risorius.rigs.joint_controls import head_turns, joint_controls

sys.path.insert(0, str(PROJECT / "tests" / "fullscale"))
import generate


@pytest.fixture(scope="module")
def dna():
    return generate.generate(seed=3)


def test_the_file_has_the_size_and_the_shape_of_a_real_head(dna):
    assert dna.validate() == []
    counts = (dna.gui_control_names, dna.raw_control_names, dna.joint_names, dna.meshes)
    assert [len(c) for c in counts] == [174, 263, 870, 50]
    assert (dna.psd_count, len(dna.blend_shape_channel_names)) == (545, 782)
    sizes = np.bincount(dna.psds.rows)[263:]
    assert (sizes.min(), sizes.max()) == (2, 20)
    assert 3.5 < dna.psds.values.max() <= 4
    assert (dna.psds.columns >= 808).sum() == 54  # outputs of the solver are factors
    assert (len(dna.joint_groups), dna.joint_row_count, dna.joint_column_count) == (122, 7830, 826)
    filled = sum(np.count_nonzero(group.values) for group in dna.joint_groups)
    assert filled / (7830 * 826) == pytest.approx(0.149, abs=0.004)
    most = [dna.meshes[i].maximum_influence_per_vertex for lod in dna.lod_mesh_mapping for i in lod]
    assert sorted(set(most)) == [4, 8, 12]
    assert len(dna.meshes[0].positions) == 24000
    moved = [len(t.vertex_indices) for t in dna.meshes[0].blend_shape_targets]
    assert 700 < np.mean(moved) < 900
    assert generate.generate(seed=3).to_bytes() == dna.to_bytes()


def test_it_holds_content_on_which_readers_fail(dna):
    spaces = (dna.joint_names, dna.blend_shape_channel_names, dna.raw_control_names)
    assert max(len(name) for space in spaces for name in space) == 100
    assert any(len(set(space)) < len(space) for space in spaces)
    assert set(dna.gui_to_raw.output_indices.tolist()) < set(range(263))
    assert set(dna.gui_to_raw.input_indices.tolist()) < set(range(174))


def test_its_neck_poses_are_those_of_a_real_head(dna):
    solver = dna.rbf_behavior.solvers[0]
    assert [pose.name for pose in dna.rbf_behavior.poses][:4:3] == ["default", "turnDown_50"]
    targets = np.reshape(solver.raw_control_values, (18, 3, 4))
    up = [(0, 0, 0.0872, 0.9962), (0, 0, 0.1736, 0.9848), (0, 0, 0.2164, 0.9763)]
    np.testing.assert_allclose(targets[1], up, atol=2e-3)
    turning, said = joint_controls(dna)
    assert ([item.name for item in turning], said) == (["neck_01", "neck_02", "head"], [])
    # If the head looks up, each joint rotates about its own z axis.
    for item in turning:
        x, y, z, w = item.values(head_turns(np.radians([[0.0, 25.0, 0.0]])))[0]
        assert (x, y, z, w) == pytest.approx((0, 0, 0.2164, 0.9763), abs=2e-4)


def test_it_evaluates_as_the_rules_of_the_format_say(dna):
    rig, random = risorius.Rig(dna), np.random.default_rng(5)
    raw = rig.initial_raw_controls.copy()
    raw[random.choice(251, 60, replace=False)] = random.random(60)
    target = dna.rbf_behavior.solvers[0].raw_control_values[12:24]  # turnUp_55
    raw[251:] = target
    pose = rig.evaluate(raw)
    solvers = oracle_behavior.solvers_of(dna)
    controls = oracle_behavior.settled(dna, solvers, raw, 0, rig.control_count)
    assert pose.controls[809] == pytest.approx(1.0, abs=4e-3)
    np.testing.assert_allclose(pose.controls, controls, atol=4e-3)
    wanted = oracle_behavior.joints(dna, pose.controls.astype(float), 0, "euler")
    np.testing.assert_allclose(pose.joints, wanted, atol=1e-4)
    assert np.abs(pose.joints).max() > 0.1
