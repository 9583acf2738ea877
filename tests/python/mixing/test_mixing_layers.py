# SPDX-License-Identifier: MIT
"""Tests mixing of faces with all layers: equal data stay equal, and errors name differences."""

import copy

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius.base.errors import ArgumentError
from risorius.cli import main
from risorius.mixing import Mix, difference, mix_faces

FACES = sorted(path.stem for path in GOLDEN.glob("*.dna"))
LAYERED = ["mlquat", "rbf", "tiny_v28", "twistswing"]


def moved(dna):
    """The face 1 unit higher: vertices of its meshes, and its root joint."""
    out = copy.copy(dna)
    meshes = []
    for mesh in out.meshes:
        mesh.positions = np.asarray(mesh.positions) + np.float32([0, 1, 0])
        meshes.append(mesh)
    out.meshes = meshes
    shifts = np.array(out.neutral_joint_translations)
    shifts[0] += [0, 1, 0]
    out.neutral_joint_translations = shifts
    return out


@pytest.mark.parametrize("name", FACES)
def test_every_face_mixes_with_a_moved_copy_and_keeps_what_they_share(name):
    face = risorius.load(GOLDEN / f"{name}.dna")
    other = moved(face)
    assert difference(face, other) is None
    assert mix_faces([face, other], Mix([0, 1])).to_bytes() == other.to_bytes()
    mixed = mix_faces([face, other], Mix([0.5, 0.5]))
    half = np.asarray(face.neutral_joint_translations)[0] + [0, 0.5, 0]
    np.testing.assert_allclose(mixed.neutral_joint_translations[0], half, atol=1e-6)
    for m, mesh in enumerate(mixed.meshes):
        before = np.asarray(face.meshes[m].positions)
        np.testing.assert_allclose(mesh.positions, before + np.float32([0, 0.5, 0]), atol=1e-5)
    # Without the vertices and joint translations, the mix equals the face byte for byte.
    meshes = []
    for mesh, own in zip(mixed.meshes, face.meshes, strict=True):
        mesh.positions = own.positions
        meshes.append(mesh)
    mixed.meshes = meshes
    mixed.neutral_joint_translations = face.neutral_joint_translations
    assert mixed.to_bytes() == face.to_bytes()


@pytest.mark.parametrize("name", ["medium", *LAYERED, "quatjoints"])
def test_a_mix_with_one_that_moves_three_times_as_far_moves_twice_as_far(name):
    face = risorius.load(GOLDEN / f"{name}.dna")
    other, groups = copy.copy(face), []
    for group in other.joint_groups:
        group.values = 3 * np.asarray(group.values)
        groups.append(group)
    other.joint_groups = groups
    mixed = mix_faces([face, other], Mix([0.5, 0.5]))
    for group, own in zip(mixed.joint_groups, face.joint_groups, strict=True):
        np.testing.assert_allclose(group.values, 2 * own.values, rtol=1e-6)
    posed = []
    for dna in (face, mixed, other):
        rig = risorius.Rig(risorius.load(dna.to_bytes()))
        raw = np.full(len(rig.raw_control_names), 0.05, np.float32)
        posed.append(np.asarray(rig.evaluate(raw).joints)[:, :3])
    np.testing.assert_allclose(posed[1], (posed[0] + posed[2]) / 2, atol=1e-4)


def _other_radius(dna):
    layer = copy.copy(dna.rbf_behavior)
    solvers = list(layer.solvers)
    solvers[0].radius += 1
    layer.solvers = solvers
    dna.rbf_behavior = layer


def _other_swing(dna):
    layer = copy.copy(dna.twist_swing_behavior)
    twists = list(layer.twists)
    twists[0].blend_weights = np.asarray(twists[0].blend_weights) / 2
    layer.twists = twists
    dna.twist_swing_behavior = layer


def _other_network(dna):
    layer = copy.copy(dna.machine_learned_behavior)
    networks = list(layer.neural_networks)
    layers = list(networks[0].layers)
    layers[0].weights = np.asarray(layers[0].weights) + 1
    networks[0].layers = layers
    layer.neural_networks = networks
    dna.machine_learned_behavior = layer


def _other_channels(dna):
    channels = copy.copy(dna.blend_shape_channels)
    channels.input_indices = np.asarray(channels.input_indices)[::-1]
    dna.blend_shape_channels = channels


def _other_columns(dna):
    groups = list(dna.joint_groups)
    for group in groups:
        group.input_indices = np.asarray(group.input_indices)[::-1]
        group.values = np.asarray(group.values)[:, ::-1]
    dna.joint_groups = groups


@pytest.mark.parametrize(
    ("name", "change", "why"),
    [
        ("rbf", _other_radius, "its RBF solvers are others"),
        ("twistswing", _other_swing, "its twists and swings are others"),
        ("ml", _other_network, "its neural networks are others"),
        ("core", _other_channels, "its drivers of blend shapes are others"),
        ("quatjoints", _other_columns, "joints that turn by quaternions have their controls in"),
    ],
)
def test_other_layers_are_one_sentence(name, change, why, tmp_path, capsys):
    face = risorius.load(GOLDEN / f"{name}.dna")
    other = copy.copy(face)
    change(other)
    other.save(tmp_path / "other.dna")
    one, two = str(GOLDEN / f"{name}.dna"), str(tmp_path / "other.dna")
    assert main(["mix", one, two, "-o", str(tmp_path / "out.dna")]) == 1
    error = capsys.readouterr().err
    assert why in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out.dna").exists()
    assert main(["info", one, "--mix-with", two]) == 1
    assert main(["check", "--mix", one, two]) == 1
    assert capsys.readouterr().out.count(f"cannot be mixed: {why}") == 2


@pytest.mark.parametrize("name", LAYERED)
def test_the_commands_mix_faces_of_all_layers(name, tmp_path, capsys):
    one, two = str(GOLDEN / f"{name}.dna"), str(tmp_path / "moved.dna")
    moved(risorius.load(one)).save(two)
    out = tmp_path / "out.dna"
    assert main(["info", one, "--mix-with", two]) == 0
    assert main(["check", "--mix", one, two]) == 0
    assert main(["mix", one, two, "-o", str(out)]) == 0
    assert risorius.load(out).layers == risorius.load(one).layers
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("layers", ["descriptor", "definition", "behavior", "geometry"])
def test_faces_without_some_layers_mix_with_their_like_alone(layers, tmp_path, capsys):
    one, two, whole = tmp_path / "one.dna", tmp_path / "two.dna", GOLDEN / "core.dna"
    face = risorius.load(whole, layers=layers)
    face.save(one)
    (moved(face) if face.joint_names else face).save(two)
    out = tmp_path / "out.dna"
    assert main(["check", "--mix", str(one), str(two)]) == 0
    assert main(["mix", str(one), str(two), "-o", str(out)]) == 0
    assert len(risorius.load(out).meshes) == len(face.meshes)
    assert main(["info", str(one), "--mix-with", str(whole)]) == 1
    assert "cannot be mixed: " in capsys.readouterr().out
    if not face.meshes:
        command = ["mix", str(one), str(two), "--mouth", f"{two}=1", "-o", str(out)]
        assert main(command) == 1
        assert "is of the region mouth" in capsys.readouterr().err


def test_a_region_of_teeth_alone_has_a_size():
    """A region without vertices of the skin can be mixed, although no skin shows its size."""
    face = risorius.load(GOLDEN / "ml.dna", layers="geometry")
    mixed = mix_faces([face, moved(face)], Mix([0.5, 0.5], {"mouth": {1: 1}}))
    for mesh, own in zip(mixed.meshes, face.meshes, strict=True):
        apart = np.asarray(mesh.positions) - own.positions
        assert (apart[:, 1] >= 0.4).all()
        assert (apart[:, 1] <= 1.1).all()


def test_a_neutral_pose_that_is_no_number_is_said():
    face = risorius.load(GOLDEN / "core.dna")
    other = copy.copy(face)
    turns = np.array(other.neutral_joint_rotations)
    turns[2, 1] = np.inf
    other.neutral_joint_rotations = turns
    assert f"neutral_joint_rotations of {face.joint_names[2]}" in difference(face, other)


def test_shares_of_a_face_without_meshes_have_no_regions():
    face = risorius.load(GOLDEN / "core.dna", layers="behavior")
    with pytest.raises(ArgumentError, match="no vertex of core is of the region jaw"):
        mix_faces([face, moved(face)], Mix([1, 0], {"jaw": {1: 1}}))
