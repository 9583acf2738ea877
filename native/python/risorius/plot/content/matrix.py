# SPDX-License-Identifier: MIT
"""Computes the image of the joint matrix: position and colour of each coefficient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import risorius

from .regions import REGIONS, majority

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Cells:
    """Row, column and joint group of each non-zero coefficient, int64[N], in a grid of `shape`."""

    rows: Ints
    columns: Ints
    groups: Ints
    shape: tuple[int, int]


@dataclass(frozen=True)
class Block:
    """The rectangle of a joint group in the regrouped matrix: its first row and its size."""

    group: int
    region: str
    top: int
    rows: int
    columns: int


def group_regions(dna: risorius.Dna, joint_regions: Sequence[str]) -> list[str]:
    """The region of each joint group: the region to which most joints of the group belong.

    Joints of the region "other" do not count, unless all joints of the group are of this region.

    Args:
        dna: the face.
        joint_regions: region of each joint.
    """
    found = []
    for group in dna.joint_groups:
        moved = np.unique(np.asarray(group.output_indices, np.int64) // 9)
        listed = np.asarray(group.joint_indices, np.int64)
        found.append(majority((moved if len(moved) else listed).tolist(), joint_regions))
    return found


def shape_of(dna: risorius.Dna, controls: int) -> tuple[int, int]:
    """(rows, columns) of a matrix that contains all coefficients of the joint groups.

    Args:
        dna: the face; the matrix has at least 9 rows per joint.
        controls: smallest number of columns.
    """
    rows, columns = 9 * len(dna.joint_names), controls
    for group in dna.joint_groups:
        # Indices are converted to 64 bits, because `initial`, -1, would be 65,535 in 16 bits.
        rows = max(rows, int(np.max(group.output_indices.astype(np.int64), initial=-1)) + 1)
        columns = max(columns, int(np.max(group.input_indices.astype(np.int64), initial=-1)) + 1)
    return rows, columns


def by_index(dna: risorius.Dna, controls: int) -> Cells:
    """The coefficients in a grid with row 9 * joint + attribute, and column = control.

    Args:
        dna: the face.
        controls: smallest number of columns.
    """
    parts = []
    for number, group in enumerate(dna.joint_groups):
        row, column = np.nonzero(group.values)
        at = (np.asarray(group.output_indices)[row], np.asarray(group.input_indices)[column])
        parts.append((*at, np.full(len(row), number)))
    return _joined(parts, shape_of(dna, controls))


def regrouped(dna: risorius.Dna, regions: Sequence[str]) -> tuple[Cells, list[Block]]:
    """The coefficients with the rows of each joint group together, groups ordered by region.

    The columns that a group reads are moved to the left without gaps.

    Args:
        dna: the face.
        regions: region of each joint group.

    Returns:
        The coefficients, and the rectangle of each non-empty group.
    """
    groups = dna.joint_groups
    order = sorted(range(len(groups)), key=lambda g: (REGIONS.index(regions[g]), g))
    parts, blocks, top = [], [], 0
    for number in order:
        values = groups[number].values
        if not values.size:
            continue
        row, column = np.nonzero(values)
        parts.append((row + top, column, np.full(len(row), number)))
        blocks.append(Block(number, regions[number], top, *values.shape))
        top += values.shape[0]
    width = max((block.columns for block in blocks), default=0)
    return _joined(parts, (top, width)), blocks


def _joined(parts: Sequence[tuple[npt.NDArray[Any], ...]], shape: tuple[int, int]) -> Cells:
    empty = np.zeros(0, np.int64)
    rows, columns, groups = (
        np.concatenate([empty, *(part[i] for part in parts)]).astype(np.int64) for i in range(3)
    )
    return Cells(rows, columns, groups, shape)


def image(cells: Cells, colors: Floats, limit: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """Paints the coefficients as a picture; empty cells are transparent.

    Args:
        cells: the coefficients.
        colors: float64[groups, 3], colour of each joint group in 0..1.
        limit: largest height and width in pixels. A smaller grid has one pixel per cell; otherwise
            a pixel has the mean colour of its cells, and is more opaque the more of them are
            filled.

    Returns:
        uint8[h, w, 4], RGBA.
    """
    high, wide = (max(1, min(n, most)) for n, most in zip(cells.shape, limit, strict=True))
    y = cells.rows * high // max(1, cells.shape[0])
    x = cells.columns * wide // max(1, cells.shape[1])
    flat, size = y * wide + x, high * wide
    count = np.bincount(flat, minlength=size).astype(float)
    picture = np.zeros((size, 4))
    for channel in range(3):
        shade = colors[cells.groups, channel] if len(cells.groups) else np.zeros(0)
        picture[:, channel] = np.bincount(flat, shade, minlength=size) / np.maximum(count, 1)
    area = np.outer(_spread(cells.shape[0], high), _spread(cells.shape[1], wide)).ravel()
    # A filled pixel is at least 0.3 opaque, so that one coefficient among fifty zeros is visible.
    fill = np.sqrt(np.minimum(1, count / area))
    picture[:, 3] = np.where(count > 0, 0.3 + 0.7 * fill, 0)
    return np.asarray(np.rint(picture * 255), np.uint8).reshape(high, wide, 4)


def _spread(cells: int, pixels: int) -> Floats:
    """float64[pixels]: the number of cells that each pixel covers."""
    places = np.arange(max(1, cells)) * pixels // max(1, cells)
    return np.bincount(places, minlength=pixels).astype(float)
