# SPDX-License-Identifier: MIT
"""Tests that joints, weights and LODs of a joint rig can be used for another person."""

import copy
import importlib.util
from pathlib import Path

import face_shapes
import numpy as np
import pytest
import risorius
from risorius.author import (
    FitOptions,
    LodOptions,
    Reference,
    RigOptions,
    find_reference,
    make_joint_rig,
)
from risorius.author.input import spec
from risorius.base.errors import ArgumentError

# oracle.py of the Blender tests computes skinning and morphing without risorius.author.
_ORACLE = Path(__file__).parents[3] / "blender_tests" / "support" / "oracle.py"
_SPEC = importlib.util.spec_from_file_location("blender_oracle_like", _ORACLE)
oracle = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(oracle)

OPTIONS = RigOptions(FitOptions(joints=24, rounds=6), 0.05, lighter=False, lods=LodOptions(count=4))


def other_person(dna):
    """The face with 0.85 times the width and a longer chin; its expressions are scaled alike."""
    out = copy.deepcopy(dna)
    meshes = []
    for mesh in out.meshes:
        positions = np.asarray(mesh.positions, np.float64)
        low = np.clip(-positions[:, 1] / 10, 0, 1)
        stretch = np.column_stack([np.full(len(low), 0.85), 1 + 0.3 * low, np.ones(len(low))])
        mesh.positions = positions * stretch
        for target in (targets := mesh.blend_shape_targets):
            target.deltas = np.asarray(target.deltas) * stretch[np.asarray(target.vertex_indices)]
        mesh.blend_shape_targets = targets
        meshes.append(mesh)
    out.meshes = meshes
    return out


@pytest.fixture(scope="module")
def people(tmp_path_factory):
    """Blend shape face and joint rig of a person, then of another person.

    The second rig reuses the joints of the first.
    """
    folder = tmp_path_factory.mktemp("like")
    face_shapes.write_all(folder)
    dna = spec.read_face(spec.read_spec(folder / "spec.toml")).dna
    first = make_joint_rig(dna, OPTIONS)
    reference = Reference.from_bytes(first.reference.to_bytes())
    second = other_person(dna)
    return dna, first, second, make_joint_rig(second, OPTIONS, like=reference)


def test_both_have_the_same_joints_meshes_and_weights(people):
    _, first, _, second = people
    for name in ("joint_names", "mesh_names", "raw_control_names"):
        assert list(getattr(first.dna, name)) == list(getattr(second.dna, name))
    for name in ("joint_parents", "lod_joint_mapping", "lod_mesh_mapping"):
        one, other = getattr(first.dna, name), getattr(second.dna, name)
        assert [np.asarray(x).tolist() for x in one] == [np.asarray(x).tolist() for x in other]
    assert second.dna.lod_count == 4
    assert second.dna.validate() == []
    for one, other in zip(first.dna.meshes, second.dna.meshes, strict=True):
        for name in ("face_layouts", "face_offsets", "layout_positions", "skin_joint_indices"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        np.testing.assert_allclose(one.skin_weights, other.skin_weights, atol=1e-6)
        np.testing.assert_allclose(
            np.asarray(other.positions)[:, 0], 0.85 * np.asarray(one.positions)[:, 0], atol=1e-5
        )


def test_joints_lie_where_they_move_the_other_one(people):
    _, first, _, second = people
    places = [r.dna.neutral_joint_translations for r in (first, second)]
    assert not np.allclose(*places)
    assert second.levels[0].rms < 1.3 * first.levels[0].rms
    assert second.levels[0].largest < 2 * first.levels[0].largest


@pytest.mark.parametrize("name", ["mouthCornerPullL", "jawOpen", "eyeBlinkR"])
def test_a_control_at_1_is_the_other_ones_expression(people, name):
    """The second rig, posed by an independent reader at LOD 0, shows the second person's shape."""
    _, _, before, rig = people
    dna = rig.dna
    values = np.zeros(len(dna.raw_control_names), np.float32)
    values[list(dna.raw_control_names).index(f"CTRL_expressions.{name}")] = 1
    channel = list(before.blend_shape_channel_names).index(name)
    mesh = before.meshes[0]
    goal = np.array(mesh.positions, np.float64)
    for target in mesh.blend_shape_targets:
        if target.blend_shape_channel_index == channel:
            goal[np.asarray(target.vertex_indices)] += target.deltas
    assert np.abs(goal - mesh.positions).max() > 0.1
    pose = risorius.Rig(dna).evaluate(values)
    apart = oracle.vertices(dna, 0, pose) - oracle.to_blender(dna, goal)
    assert np.linalg.norm(apart, axis=1).max() * 1000 < 0.051


def test_taking_over_ones_own_joints_changes_little(people):
    dna, first, _, _ = people
    again = make_joint_rig(dna, OPTIONS, like=first.reference)
    assert again.levels[0].rms < 1.1 * first.levels[0].rms
    assert [e.name for e in again.errors] == [e.name for e in first.errors]


def test_a_reference_can_be_had_without_the_rig(people):
    dna, first, _, _ = people
    assert find_reference(dna, OPTIONS).to_bytes() == first.reference.to_bytes()


def without_a_vertex(dna):
    mesh = dna.meshes[0]
    mesh.face_layouts = np.asarray(mesh.face_layouts)[: mesh.face_offsets[-2]]
    mesh.face_offsets = np.asarray(mesh.face_offsets)[:-1]
    dna.meshes = [mesh, *dna.meshes[1:]]


def other_joint(dna):
    dna.joint_names = ["trunk", *list(dna.joint_names)[1:]]


def other_control(dna):
    names = list(dna.raw_control_names)
    names[names.index("CTRL_expressions.jawOpen")] = "CTRL_expressions.jawShut"
    dna.raw_control_names = names


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (without_a_vertex, "corners were expected"),
        (other_joint, "other joints than the one whose joints it is to have, such as"),
        (other_control, "other expressions .* such as CTRL_expressions.jawOpen"),
    ],
)
def test_another_topology_is_one_sentence(people, change, sentence):
    dna, first, _, _ = people
    other = copy.deepcopy(dna)
    change(other)
    with pytest.raises(ArgumentError, match=sentence):
        make_joint_rig(other, OPTIONS, like=first.reference)


def test_a_damaged_reference_is_refused_or_read(people):
    data = people[1].reference.to_bytes()
    random = np.random.default_rng(3)
    refused = 0
    for _ in range(120):
        broken = bytearray(data)
        if random.random() < 0.3:
            broken = broken[: random.integers(len(data))]
        else:
            for at in random.integers(len(data), size=4):
                broken[at] ^= 1 << random.integers(8)
        try:
            Reference.from_bytes(bytes(broken))
        except ArgumentError as error:
            refused += 1
            assert str(error).startswith("no reference of a joint rig")
    assert refused > 60
