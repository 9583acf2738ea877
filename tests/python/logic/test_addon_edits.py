# SPDX-License-Identifier: MIT
"""Tests the add-on's search, transfer and writing of edits without Blender."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from test_addon_logic import importlib, space  # registers the package of the logic

edits: Any = importlib.import_module("risorius_addon_logic.character.user_edits")
RANDOM = np.random.default_rng(11)


def _basis(count: int = 50) -> Any:
    return RANDOM.normal(0, 1.7, (count, 3)).astype(np.float32)


class TestKeyEdits:
    def test_what_an_import_gives_is_no_edit(self) -> None:
        basis, indices = _basis(), np.array([3, 7, 7])
        deltas = RANDOM.normal(0, 0.01, (3, 3)).astype(np.float32)
        points = edits.shaped(basis, indices, deltas)
        mask, difference = edits.key_edits(basis, points, basis, points.copy())
        assert not mask.any()
        assert not difference.any()

    def test_one_bit_is_an_edit_where_the_basis_is_the_files(self) -> None:
        basis = _basis()
        points = basis.copy()
        points[4, 1] = np.nextafter(points[4, 1], np.float32(9))
        mask, _ = edits.key_edits(basis, points, basis, basis)
        assert list(np.flatnonzero(mask)) == [4]

    def test_a_key_that_moved_along_with_its_basis_is_not(self) -> None:
        """A shape key that only follows an edit of its basis counts as unedited, despite rounding.

        Blender adds the basis's offset to each shape key in float32, in any order of sums.
        """
        imported = _basis(20000)
        deltas = RANDOM.normal(0, 0.02, imported.shape).astype(np.float32)
        offset = RANDOM.normal(0, 0.3, imported.shape).astype(np.float32)
        basis = imported + offset
        points = (imported + deltas) + offset
        mask, _ = edits.key_edits(basis, points, imported, basis + deltas)
        assert not mask.any()
        points[5, 0] += np.float32(1e-4)
        assert list(
            np.flatnonzero(edits.key_edits(basis, points, imported, basis + deltas)[0])
        ) == [5]

    def test_the_difference_is_exact(self) -> None:
        basis = _basis()
        points = basis.copy()
        points[4] += np.float32(0.25)
        mask, difference = edits.key_edits(basis, points, basis, basis)
        np.testing.assert_array_equal((basis + difference).astype(np.float32), points)
        assert list(np.flatnonzero(mask)) == [4]


def test_index_map() -> None:
    assert edits.index_map(["a", "b", "c"], ["c", "x", "a"]) == [2, -1, 0]


class TestBarycentric:
    def test_points_come_back(self) -> None:
        corners = RANDOM.normal(size=(200, 3, 3))
        weights = RANDOM.dirichlet([1, 1, 1], 200)
        points = np.einsum("nc,ncx->nx", weights, corners)
        np.testing.assert_allclose(edits.barycentric(points, corners), weights, atol=1e-9)

    def test_a_triangle_without_area(self) -> None:
        corners = np.zeros((1, 3, 3))
        np.testing.assert_allclose(edits.barycentric(np.ones((1, 3)), corners), [[1 / 3] * 3])


class TestReplaceTotals:
    def _dense(self, targets: Any) -> Any:
        dense = np.zeros((10, 3), np.float32)
        for indices, deltas in targets:
            np.add.at(dense, indices, deltas)
        return dense

    def test_sums_are_what_is_asked_for_and_the_rest_stays(self) -> None:
        targets = [
            (np.array([1, 4, 6], np.uint32), RANDOM.normal(size=(3, 3)).astype(np.float32)),
            (np.array([4, 9], np.uint32), RANDOM.normal(size=(2, 3)).astype(np.float32)),
        ]
        before = self._dense(targets)
        vertices, totals = np.array([2, 4]), np.ones((2, 3), np.float32)
        written = edits.replace_totals(targets, vertices, totals)
        after = self._dense(written)
        np.testing.assert_array_equal(after[[2, 4]], totals)
        rest = [0, 1, 3, 5, 6, 7, 8, 9]
        np.testing.assert_array_equal(after[rest], before[rest])
        assert list(written[0][0]) == [1, 2, 4, 6]
        assert written[0][0].dtype == np.uint32

    def test_an_unsorted_target_keeps_its_order(self) -> None:
        targets = [(np.array([6, 1], np.uint32), np.zeros((2, 3), np.float32))]
        written = edits.replace_totals(targets, np.array([2]), np.ones((1, 3), np.float32))
        assert list(written[0][0]) == [6, 1, 2]


class TestInverseOfSpace:
    @pytest.mark.parametrize("sequence", list(itertools.permutations(range(3))))
    def test_angles_come_back_also_where_the_middle_one_is_upright(self, sequence: Any) -> None:
        angles = RANDOM.uniform(-4, 4, (300, 3))
        angles[:40, sequence[1]] = np.pi / 2
        angles[40:80, sequence[1]] = -np.pi / 2
        matrices = space.euler_matrices(angles, sequence)
        found = space.euler_angles(matrices, sequence, angles)
        np.testing.assert_allclose(space.euler_matrices(found, sequence), matrices, atol=1e-12)
        np.testing.assert_allclose(found[80:], angles[80:], atol=1e-9)

    @pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, 1), (-1, -1, -1)])
    @pytest.mark.parametrize(
        "axes", [("right", "up", "front"), ("left", "up", "front"), ("front", "left", "up")]
    )
    def test_points_and_rotations_come_back(self, axes: Any, signs: Any) -> None:
        made = space.make_space(axes, "cm", "degrees", "zyx", signs, "ccw", 0.5)
        values = RANDOM.normal(0, 90, (40, 3))
        np.testing.assert_allclose(made.file_points(made.points(values)), values, rtol=1e-12)
        angles = RANDOM.uniform(-80, 80, (40, 3))
        near = angles + RANDOM.uniform(-3, 3, angles.shape)
        found = made.file_rotations(made.rotations(angles), near)
        np.testing.assert_allclose(found, angles, atol=1e-8)


def test_sizes_are_in_millimetres() -> None:
    moves = np.array([[0.001, 0, 0], [0, 0.003, 0]])
    assert edits.sizes(moves, 1.0) == pytest.approx((2, 3.0, 2.0))
    assert edits.sizes(moves, 0.01) == pytest.approx((2, 0.03, 0.02))
    assert edits.sizes(np.zeros((0, 3)), 1.0) == (0, 0.0, 0.0)
