# SPDX-License-Identifier: MIT
"""Tests of Surface, of closest points and of sparse systems."""

from __future__ import annotations

import numpy as np
import pytest
from risorius import _native
from risorius.anyhead.surface import Surface

CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
SIDES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def test_a_cube_of_polygons() -> None:
    cube = Surface.of_polygons(CUBE, SIDES)
    assert cube.triangles.shape == (12, 3)
    assert np.linalg.norm(cube.face_normals(), axis=1).sum() == pytest.approx(12)  # twice the area
    assert ((cube.normals() * (CUBE - 0.5)).sum(axis=1) > 0.5).all()  # normals point outward
    assert len(cube.edges()) == 18
    assert not cube.border().any()
    assert Surface(CUBE, cube.triangles[2:]).border()[[0, 1, 2, 3]].all()


def test_points_of_the_surface_are_the_closest_ones() -> None:
    cube = Surface.of_polygons(CUBE, SIDES)
    closest = _native.ClosestPoints(cube.points, cube.triangles)
    triangle, shares, distance = closest.nearest([[0.5, 0.25, 3], [0.5, 0.5, 0.5]])
    assert cube.at(triangle, shares)[0] == pytest.approx([0.5, 0.25, 1])
    assert distance == pytest.approx([2, 0.5])
    with pytest.raises(ValueError, match=r"\(n, 3\) was expected"):
        closest.nearest([0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match="vertex below 8"):
        _native.ClosestPoints(CUBE, [[0, 1, -1]])


def test_a_sparse_system() -> None:
    solver = _native.SparseCholesky([0, 1, 1], [0, 0, 1], [2.0, 1.0, 2.0], 2)
    assert solver.solve([[3.0], [3.0]]) == pytest.approx(np.array([[1.0], [1.0]]))
    with pytest.raises(ValueError, match="positive definite"):
        _native.SparseCholesky([0, 1, 1], [0, 0, 1], [1.0, 2.0, 1.0], 2)
