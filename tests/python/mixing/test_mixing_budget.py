# SPDX-License-Identifier: MIT
"""Tests that mixing, solving and authoring use memory in proportion to the size of their input.

Large counts in a file must not lead to dense tables.
"""

import copy
import struct
import tracemalloc

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius import BlendShapeTarget, Dna, JointGroup, Mesh
from risorius.author import make_joint_rig
from risorius.base.budget import Budget, BudgetError
from risorius.base.errors import ArgumentError
from risorius.cli import main
from risorius.files.png import png
from risorius.mixing import Masks, Mix, mix_faces
from risorius.mixing.textures import mix_textures

MB = 1 << 20
BASE, BYTES_PER_BYTE = (
    64 * MB,
    64,
)  # limit for the peaks below; dense tables take twice as much


def peak_of(work):
    """Run work(). Returns its result and the largest memory in use, in bytes."""
    tracemalloc.start()
    try:
        return work(), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def large_face(joints=8, controls=8, vertices=64, targets=0):
    """A face with one mesh; each vertex has one joint, and each target moves one vertex."""
    dna = Dna()
    dna.name, dna.lod_count = "large", 1
    dna.raw_control_names = [f"CTRL_expressions.jaw{i}" for i in range(controls)]
    dna.joint_names = [f"joint{i}" for i in range(joints)]
    dna.joint_parents = np.zeros(joints, np.uint16)
    dna.neutral_joint_translations = np.tile(np.float32([0, 1, 0]), (joints, 1))
    dna.neutral_joint_rotations = np.zeros((joints, 3), np.float32)
    dna.lod_joint_mapping = [np.arange(joints)]
    dna.mesh_names, dna.lod_mesh_mapping = ["head_mesh"], [[0]]
    dna.blend_shape_channel_names = [f"shape{i}" for i in range(targets)]
    dna.lod_blend_shape_mapping = [np.arange(targets)]
    channels = copy.copy(dna.blend_shape_channels)
    channels.lods = [targets]
    channels.input_indices = channels.output_indices = np.arange(targets)
    dna.blend_shape_channels = channels
    mesh = Mesh()
    mesh.positions = np.random.default_rng(1).normal(size=(vertices, 3)).astype(np.float32)
    mesh.skin_offsets = np.arange(vertices + 1)
    mesh.skin_joint_indices = np.arange(vertices) % joints
    mesh.skin_weights = np.ones(vertices, np.float32)
    mesh.maximum_influence_per_vertex = 1
    mesh.blend_shape_targets = [
        BlendShapeTarget(
            deltas=np.ones((1, 3), np.float32), vertex_indices=[i], blend_shape_channel_index=i
        )
        for i in range(targets)
    ]
    dna.meshes = [mesh]
    dna.joint_groups = [group([9], [0]), group([19], [1])]
    return dna


def group(rows, columns):
    joints = sorted({int(row) // 9 for row in rows})
    values = np.ones((len(rows), len(columns)), np.float32)
    return JointGroup(
        lods=[len(rows)], input_indices=columns, output_indices=rows, values=values,
        joint_indices=joints,
    )  # fmt: skip


def _stated_columns(dna):
    dna.joint_column_count = 65535


def _other_skin(dna):
    mesh = dna.meshes[0]
    mesh.skin_joint_indices = np.roll(mesh.skin_joint_indices, 1)
    dna.meshes = [mesh]


def _groups_that_share_a_joint(dna):
    """Replace the joint groups by two whose union has many empty cells.

    One group has one column and all rows except the first; the other has one row and all columns.
    """
    rows, columns = np.arange(9 * len(dna.joint_names)), np.arange(len(dna.raw_control_names))
    dna.joint_groups = [group(rows[1:], columns[:1]), group(rows[:1], columns)]


@pytest.mark.parametrize(
    ("sizes", "change"),
    [
        ({"joints": 500}, _stated_columns),
        ({"joints": 600, "controls": 3000}, lambda dna: None),
        ({"joints": 3000, "vertices": 6000}, _other_skin),
        ({"vertices": 8000, "controls": 800, "targets": 800}, lambda dna: None),
        ({"joints": 600, "controls": 4000}, _groups_that_share_a_joint),
    ],
    ids=["stated columns", "controls", "skin", "targets", "groups"],
)
def test_mixing_holds_no_more_than_some_times_the_faces(sizes, change):
    face = large_face(**sizes)
    other = copy.copy(face)
    change(other)
    by_region = change is not _groups_that_share_a_joint
    mix = Mix([0.5, 0.5], {"jaw": {1: 1}} if by_region else {})
    mixed, peak = peak_of(lambda: mix_faces([other, face], mix))
    assert peak < BASE + BYTES_PER_BYTE * (face.size_in_bytes() + other.size_in_bytes())
    values = sum(g.values.size for dna in (face, other) for g in dna.joint_groups)
    assert sum(g.values.size for g in mixed.joint_groups) <= 4 * values
    assert mixed.validate() == []


def test_groups_of_others_rows_are_joined_row_by_row():
    """Groups of two faces with different rows become groups in which each row occurs once.

    Their values are the weighted sums of the faces' values.
    """
    face = large_face(joints=40, controls=60)
    other = copy.copy(face)
    _groups_that_share_a_joint(other)
    mixed = mix_faces([face, other], Mix([0.25, 0.75]))
    found, wanted = (np.zeros((360, 60)) for _ in range(2))
    for own in mixed.joint_groups:
        found[np.ix_(own.output_indices, own.input_indices)] += own.values
    for dna, share in ((face, 0.25), (other, 0.75)):
        for own in dna.joint_groups:
            wanted[np.ix_(own.output_indices, own.input_indices)] += share * own.values
    np.testing.assert_allclose(found, wanted, atol=1e-6)
    rows = np.concatenate([own.output_indices for own in mixed.joint_groups])
    assert len(rows) == len(set(rows.tolist()))


def test_regions_that_take_too_many_steps_are_one_sentence():
    face = large_face(joints=3000, controls=3000)
    face.joint_groups = [group([9], np.arange(3000))]
    budget = Budget(1 << 40, 1000)
    with pytest.raises(BudgetError, match="joints that controls move: .* steps more than"):
        _ = Masks(face, budget).meshes


def test_a_face_of_shapes_that_asks_for_large_tables_is_refused():
    face = large_face(joints=1000, controls=4000)
    with pytest.raises(BudgetError, match="1,000 joints that 4,000 inputs move"):
        make_joint_rig(face)


@pytest.mark.parametrize("name", ["core", "tiny_v28"])
def test_a_face_that_nothing_moves_is_refused(name):
    face = risorius.load(GOLDEN / f"{name}.dna", layers="geometry")
    with pytest.raises(ArgumentError, match="controls that move it was expected, found none"):
        make_joint_rig(face)


def test_derivatives_of_very_many_controls_are_refused():
    face = large_face(controls=20000)
    surface = risorius.Surface(face, risorius.Rig(face))
    for work in (surface.strongest, lambda: surface.jacobian(np.zeros(20000), 0, [0])):
        with pytest.raises(BudgetError, match=r"what 20,000 raw controls do to \d+ points"):
            work()
    with pytest.raises(BudgetError, match="what 20,000 raw controls do to 64 points"):
        risorius.solve_clip(surface, np.zeros((2, 64, 3)), rate=24)


def test_a_performance_that_unfolds_to_gigabytes_is_refused(tmp_path, capsys):
    face, take = tmp_path / "face.dna", tmp_path / "take.npz"
    large_face().save(face)
    np.savez_compressed(take, vertices=np.zeros((2, 64, 3)))
    data = take.read_bytes()
    stated = struct.pack("<I", 2 * 64 * 3 * 8 + 128)
    assert stated in data
    take.write_bytes(data.replace(stated, struct.pack("<I", 0xF0000000)))
    assert main(["solve", str(face), str(take), "-o", str(tmp_path / "out.rzc")]) == 1
    assert "vertices.npy: 4,026,531,840 bytes more than" in capsys.readouterr().err


def test_pictures_that_say_they_are_huge_are_refused(tmp_path):
    face = large_face()
    face.metadata = {"texture:head_mesh:color": "skin.png"}
    data = bytearray(png(np.zeros((4, 4, 3))))
    data[16:24] = struct.pack(">II", 8000, 8000)
    paths = []
    for name in ("a", "b"):
        (tmp_path / f"{name}_textures").mkdir()
        (tmp_path / f"{name}_textures" / "skin.png").write_bytes(data)
        paths.append(tmp_path / f"{name}.dna")
    with pytest.raises(BudgetError, match="pictures of the faces: 384,000,000 bytes more than"):
        mix_textures([face, face], paths, Mix([0.5, 0.5]), Masks(face))
