# SPDX-License-Identifier: MIT
"""Tests that double vertices along seams are merged, but not vertices of lips that touch."""

import command_line
import face_shapes
import numpy as np
import pytest
import risorius
from risorius.author.input.obj import ObjMesh
from risorius.author.input.welding import welded


def parted(column=11):
    """The head of face_shapes with duplicated vertices along a column, as at a texture seam.

    Returns: positions in cm, polygons, expressions, and the original index of each vertex.
    """
    positions, faces = face_shapes.head()
    number = np.arange(len(positions)).reshape(face_shapes.DOWN, -1)
    seam = number[:, column]
    right = number[:-1, column:-1].ravel()
    other = dict(zip(seam.tolist(), range(len(positions), len(positions) + len(seam)), strict=True))
    cut = np.array(
        [[other.get(v, v) if face[0] in right else v for v in face] for face in faces.tolist()]
    )
    was = np.concatenate([np.arange(len(positions)), seam])
    moved = {name: delta[was] for name, delta in face_shapes.expressions(positions).items()}
    return positions[was], cut, moved, was


def test_a_seam_is_closed_and_its_texture_coordinates_stay():
    positions, faces, moved, was = parted()
    noise = np.random.default_rng(5).uniform(-5e-7, 5e-7, positions.shape)  # like float32's
    uvs = np.random.default_rng(6).random((len(positions), 2))
    mesh = ObjMesh(positions + noise, uvs, faces.tolist(), faces.tolist())
    found, shapes = welded(mesh, list(moved.values()))
    whole, polygons = face_shapes.head()
    np.testing.assert_allclose(found.positions, whole, atol=1e-6)
    assert found.faces == polygons.tolist()
    assert found.uv_faces == faces.tolist()
    for delta, expected in zip(shapes, face_shapes.expressions(whole).values(), strict=True):
        np.testing.assert_array_equal(delta, expected)
    assert (was[np.array(found.uv_faces)] == np.array(found.faces)).all()


def test_what_moves_apart_and_what_is_closed_stays_two():
    positions, faces, moved, was = parted()
    mesh = ObjMesh(positions, np.zeros((0, 2)), faces.tolist(), [])
    opened = moved["jawOpen"].copy()
    opened[506:] *= 1.01  # moving vertices on the other side of the cut move 1 % further
    found, _ = welded(mesh, [opened])
    still = ~moved["jawOpen"][506:].any(axis=1)
    assert len(found.positions) == len(positions) - still.sum()
    twice = ObjMesh(
        np.concatenate([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]] * 2).astype(float),
        np.zeros((0, 2)),
        [[a + 4 * n, b + 4 * n, c + 4 * n] for n in (0, 1)
         for a, b, c in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))],
        [],
    )  # fmt: skip
    assert welded(twice, [])[0] is twice  # two closed bodies in one place
    assert was.max() == 505


def test_a_polygon_that_would_become_a_line_is_left_out_or_stays_as_it_is():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 1, 0], [2, 0, 0]], float)
    faces = [[0, 1, 2, 3], [2, 4, 1], [4, 5, 1]]
    mesh = ObjMesh(points, points[:, :2], faces, faces)
    found, _ = welded(mesh, [], all_polygons=False)
    assert found.faces == [[0, 1, 2, 3], [2, 4, 1]]
    assert found.uv_faces == [[0, 1, 2, 3], [4, 5, 1]]
    assert welded(mesh, [])[0].faces == faces


def test_a_cut_head_of_obj_files_becomes_one_surface(tmp_path):
    positions, faces, moved, _ = parted()
    (tmp_path / "shapes").mkdir()
    face_shapes.write_obj(tmp_path / "neutral.obj", positions, faces)
    for name, delta in moved.items():
        face_shapes.write_obj(tmp_path / "shapes" / f"{name}.obj", positions + delta, faces)
    spec = tmp_path / "spec.toml"
    spec.write_text(
        '[source]\nneutral = "neutral.obj"\nexpressions = "shapes"\n'
        "[joints]\ncount = 8\nrounds = 2\n[lods]\ncount = 1\n",
        encoding="utf-8",
    )
    done = command_line.run("author", spec, "-o", tmp_path / "egg.dna", text=True)
    assert done.returncode == 0, done.stderr
    assert len(risorius.load(tmp_path / "egg.dna").meshes[0].positions) == 506


@pytest.mark.parametrize("count", [0, 1])
def test_a_mesh_without_an_open_edge_is_as_it_was(count):
    points = np.zeros((3, 3)) if not count else np.eye(3)
    mesh = ObjMesh(points, np.zeros((0, 2)), [[0, 1, 2]] * count, [])
    assert welded(mesh, [])[0] is mesh
