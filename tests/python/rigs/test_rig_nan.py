# SPDX-License-Identifier: MIT
"""Tests that a NaN control affects only outputs that depend on it, directly or indirectly.

The test finds these outputs by following the lists of the file, without arithmetic.
"""

import numpy as np
import oracle_behavior
import pytest
import risorius
from conftest import GOLDEN
from test_rig_behavior import random_raw
from test_rig_golden import SIMD

FACES = ("core", "medium", "units", "rbf", "ml", "mlbase", "mlquat", "twistswing", "quatjoints")


def feeds(dna, lod):
    """(inputs, outputs) of all correctives, networks and solvers at a LOD, as sets of controls."""
    psds = dna.psds
    pairs = [
        ({int(c)}, {int(r)}) for r, c in zip(psds.rows.tolist(), psds.columns.tolist(), strict=True)
    ]
    ml = dna.machine_learned_behavior
    if dna.machine_learned_behavior_ext.types:
        for kind in dna.machine_learned_behavior_ext.types:
            pairs += graph_feeds(kind, lod)
    else:
        for n in oracle_behavior.listed(ml.lod_neural_network_mapping, lod):
            network = ml.neural_networks[n]
            pairs.append(
                (set(network.input_indices.tolist()), set(network.output_indices.tolist()))
            )
    return pairs + solver_feeds(dna, lod)


def graph_feeds(kind, lod):
    """(inputs, outputs) of each operation that writes controls, as sets of controls."""
    reads, pairs = {}, []
    for s, operations in enumerate(kind.operations):
        for o in oracle_behavior.listed(kind.lod_operation_mappings[s], lod):
            op = operations[o]
            before = zip(
                op.operation_set_dependency_indices, op.operation_dependency_indices, strict=True
            )
            mine = set().union(*(reads[int(a), int(b)] for a, b in before))
            if op.operation_type == 1:
                mine |= set(op.parameters.tolist())
            if op.operation_type == 2:
                pairs.append((mine, set(op.parameters.tolist())))
            reads[s, o] = mine
    return pairs


def solver_feeds(dna, lod):
    poses, pairs = dna.rbf_behavior_ext.poses, []
    for i in oracle_behavior.listed(dna.rbf_behavior.lod_solver_mapping, lod):
        solver = dna.rbf_behavior.solvers[i]
        for p in solver.pose_indices:
            inputs = {
                *solver.raw_control_indices.tolist(),
                *poses[p].input_control_indices.tolist(),
            }
            pairs.append((inputs, set(poses[p].output_control_indices.tolist())))
    return pairs


def driven_controls(dna, lod, control):
    out, pairs = {control}, feeds(dna, lod)
    while True:
        more = set().union(*(outputs for inputs, outputs in pairs if inputs & out)) - out
        if not more:
            return sorted(out)
        out |= more


def driven_joints(dna, lod, controls, stride):
    """bool[J, stride]: attributes that the controls may change; of a rotation, all attributes."""
    out = np.zeros((len(dna.joint_names), stride), bool)
    rotation = slice(3, stride - 3)
    for group in dna.joint_groups:
        if not np.isin(group.input_indices, controls).any():
            continue
        rows = int(group.lods[lod]) if len(group.lods) else 0
        for joint, attribute in (divmod(int(o), 9) for o in group.output_indices[:rows]):
            if 3 <= attribute <= 5:
                out[joint, rotation] = True
            else:
                out[joint, attribute + (stride - 9) * (attribute > 5)] = True
    setups = dna.twist_swing_behavior
    for setup in [*setups.twists, *setups.swings]:
        if np.isin(setup.input_control_indices, controls).any():
            out[setup.output_joint_indices, rotation] = True
    joints, width = dna.machine_learned_behavior_ext.joints, oracle_behavior.ml_stride(dna)
    for i, o in zip(joints.input_indices.tolist(), joints.output_indices.tolist(), strict=True):
        if i in controls:
            out[o // width] = True
    return out


def driven_maps(dna, lod, controls):
    rows = int(dna.animated_maps.lods[lod]) if len(dna.animated_maps.lods) else 0
    table = dna.animated_maps.conditionals
    out = np.zeros(len(dna.animated_map_names), bool)
    out[table.output_indices[:rows][np.isin(table.input_indices[:rows], controls)]] = True
    return out


def driven_shapes(dna, lod, controls):
    rows = int(dna.blend_shape_channels.lods[lod]) if len(dna.blend_shape_channels.lods) else 0
    channels = dna.blend_shape_channels
    out = np.zeros(len(dna.blend_shape_channel_names), bool)
    out[channels.output_indices[:rows][np.isin(channels.input_indices[:rows], controls)]] = True
    return out


def surely_spoiled(dna, lod, control, stride):
    """int[K, 2]: (joint, attribute) of translations and scales that the control drives directly."""
    out = []
    for group in dna.joint_groups:
        rows = int(group.lods[lod]) if len(group.lods) else 0
        columns = np.asarray(group.values)[:rows, group.input_indices == control]
        for o, values in zip(group.output_indices[:rows].tolist(), columns, strict=True):
            if np.any(values != 0) and not 3 <= o % 9 <= 5:
                out.append((o // 9, o % 9 + (stride - 9) * (o % 9 > 5)))
    return np.array(out, int).reshape(-1, 2)


def check(dna, rig, raw, lod, control, bad):
    clean = rig.evaluate(raw, lod=lod)
    spoiled = raw.copy()
    spoiled[control] = bad
    pose = rig.evaluate(spoiled, lod=lod)
    controls = driven_controls(dna, lod, control)
    stride = pose.joints.shape[1]
    driven = {
        "controls": np.isin(np.arange(rig.control_count), controls),
        "joints": driven_joints(dna, lod, controls, stride),
        "blend_shapes": driven_shapes(dna, lod, controls),
        "animated_maps": driven_maps(dna, lod, controls),
    }
    for field, touched in driven.items():
        np.testing.assert_array_equal(
            getattr(pose, field)[~touched], getattr(clean, field)[~touched], field
        )
    joints, attributes = surely_spoiled(dna, lod, control, stride).T
    assert not np.isfinite(pose.joints[joints, attributes]).any()
    assert not np.isfinite(pose.controls[control])
    again = rig.evaluate(raw, lod=lod)
    np.testing.assert_array_equal(again.joints, clean.joints)
    # In a batch, only the frame with NaN is affected.
    batch = rig.evaluate_batch(np.array([raw, spoiled, raw]), lod=lod)
    for n, wanted in enumerate((clean, pose, clean)):
        np.testing.assert_array_equal(batch.joints[n], wanted.joints, f"frame {n} of a batch")
        np.testing.assert_array_equal(batch.controls[n], wanted.controls)
    return len(joints), sum(np.count_nonzero(~touched) for touched in driven.values())


@pytest.mark.parametrize("rotation", ["euler", "quaternion"])
@pytest.mark.parametrize("simd", SIMD)
@pytest.mark.parametrize("name", FACES)
def test_no_number_spoils_what_it_drives_and_nothing_else(name, simd, rotation):
    dna = risorius.load(GOLDEN / f"{name}.dna")
    rig = risorius.Rig(dna, rotation=rotation, simd=simd)
    rng = np.random.default_rng(9)
    sure = untouched = 0
    for control in range(0, len(dna.raw_control_names), 1 + len(dna.raw_control_names) // 24):
        for lod, bad in ((0, np.nan), (rig.lod_count - 1, np.inf), (0, -np.inf)):
            counts = check(dna, rig, random_raw(rng, dna), lod, control, bad)
            sure, untouched = sure + counts[0], untouched + counts[1]
    assert untouched > 0
    assert sure > 0
