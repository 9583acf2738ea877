# SPDX-License-Identifier: MIT
"""Renders softly lit meshes: a small depth-buffer renderer in NumPy.

Triangles are split into rows of pixels, all at once, so the duration depends on the number of
covered pixels: a head of 50,000 triangles takes about a second.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

import risorius

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_KEY = np.array([-0.35, 0.55, 0.76])  # light from above and a little from the left
_FILL = np.array([0.8, 0.1, 0.6])  # light from the right
_BATCH = 1 << 20  # pixels per batch, which limits the memory to about 150 MB


@dataclass(frozen=True)
class Surface:
    """Triangles to render, with points and normals in view axes.

    paint: float64[V], a lightness per vertex, or float64[V, 3], a colour per vertex. The colour of
    clay is multiplied by this value, so that 1 means plain clay.
    """

    points: Floats
    normals: Floats
    triangles: Ints
    paint: Floats


def triangles_of(mesh: risorius.Mesh) -> Ints:
    """int64[F, 3]: the faces of a mesh as triangle fans, as indices of positions."""
    return np.asarray(mesh.layout_positions, np.int64)[corners_of(mesh)]


def corners_of(mesh: risorius.Mesh) -> Ints:
    """int64[F, 3]: the faces of a mesh as triangle fans, as indices of its vertex layouts (a
    layout is a position with a texture coordinate and a normal)."""
    offsets = np.asarray(mesh.face_offsets, np.int64)
    layouts = np.asarray(mesh.face_layouts, np.int64)
    if len(offsets) < 2:
        return np.zeros((0, 3), np.int64)
    fans = np.maximum(np.diff(offsets) - 2, 0)
    first = np.repeat(offsets[:-1], fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return layouts[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def surface(meshes: list[risorius.Mesh], paints: list[Floats], axes: Floats) -> Surface:
    """Combines meshes to one surface in view axes.

    Args:
        meshes: the meshes.
        paints: for each mesh, float64[V], a lightness per vertex, or float64[V, 3], a colour per
            vertex; the colour of clay is multiplied by it.
        axes: float64[3, 3], from skeleton.view_axes: maps file axes to right, up, front.
    """
    points, triangles, paint, first = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], [], 0
    for mesh, tone in zip(meshes, paints, strict=True):
        own = np.asarray(mesh.positions, float).reshape(-1, 3)
        points.append(own @ axes)
        triangles.append(triangles_of(mesh) + first)
        paint.append(tone)
        first += len(own)
    places, faces = np.concatenate(points), np.concatenate(triangles)
    faces = faces[np.all(np.isfinite(places[faces]).reshape(len(faces), 9), axis=1)]
    whole = np.concatenate(paint) if paint else np.ones(0)
    return Surface(places, vertex_normals(places, faces), faces, whole)


def vertex_normals(points: Floats, triangles: Ints) -> Floats:
    """Area-weighted vertex normals; the file's normals may be missing or split along seams.

    Args:
        points: float64[V, 3].
        triangles: int64[F, 3].

    Returns:
        float64[V, 3] of length 1, or 0 for a vertex whose triangles have no area.
    """
    a, b, c = (points[triangles[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(
                triangles[:, corner], across[:, axis], minlength=len(points)
            )
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(length > 0, length, 1))


def render(
    shape: Surface, frame: tuple[float, float, float, float], height: int, smooth: int = 2
) -> npt.NDArray[np.uint8]:
    """Renders a surface that is seen along -z.

    Args:
        shape: the surface: x to the right, y up, z towards the viewer.
        frame: left, right, bottom, top of the picture in the surface's units.
        height: height of the picture in pixels; the width follows from the frame.
        smooth: samples per pixel in each direction, which are averaged.

    Returns:
        uint8[h, w, 4], RGBA, transparent outside the surface.
    """
    left, right, bottom, top = frame
    scale = height * smooth / (top - bottom)
    high, wide = height * smooth, max(1, round(height * (right - left) / (top - bottom))) * smooth
    screen = np.empty_like(shape.points)
    screen[:, 0] = (shape.points[:, 0] - left) * scale - 0.5
    screen[:, 1] = (top - shape.points[:, 1]) * scale - 0.5
    screen[:, 2] = shape.points[:, 2] * scale
    face, weights = depth_buffer(screen, shape.triangles, (high, wide))
    hit = np.flatnonzero(face >= 0)
    picture = np.zeros((high * wide, 4))
    corners = shape.triangles[face[hit]]
    blend = weights[hit]
    normals = np.einsum("nk,nkd->nd", blend, shape.normals[corners])
    paint = np.einsum("nk,nk...->n...", blend, shape.paint[corners])
    picture[hit, :3] = _lit(normals, paint)
    picture[hit, 3] = 1
    return _averaged(picture.reshape(high, wide, 4), smooth)


def depth_buffer(screen: Floats, triangles: Ints, size: tuple[int, int]) -> tuple[Ints, Floats]:
    """The nearest triangle at each pixel, or -1, and the barycentric weights of its corners.

    Args:
        screen: float64[V, 3], x to the right and y down in pixels, z towards the viewer.
        triangles: int64[F, 3].
        size: height and width in pixels.

    Returns:
        int64[h * w] and float64[h * w, 3].
    """
    nearest = np.full(size[0] * size[1], -np.inf)
    face = np.full(len(nearest), -1)
    weights = np.zeros((len(nearest), 3))
    slopes = _slopes(screen[triangles][:, :, :2])
    for owners, rows, low, count in _batches(*_rows(screen, triangles, slopes, size)):
        which = np.repeat(np.arange(len(owners)), count)
        x = low[which] + np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        owner, y = owners[which], rows[which]
        inside = np.einsum("nkd,nd->nk", slopes[owner], np.stack([x, y, np.ones(len(x))], axis=1))
        depth = np.einsum("nk,nk->n", inside, screen[triangles[owner], 2])
        pixel = y * size[1] + x
        np.maximum.at(nearest, pixel, depth)
        won = depth == nearest[pixel]
        face[pixel[won]], weights[pixel[won]] = owner[won], inside[won]
    return face, weights


def _slopes(corners: Floats) -> Floats:
    """float64[F, 3, 3]: a, b, c of a corner's barycentric weight a x + b y + c; NaN for slivers."""
    ahead, behind = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
    along = ahead[:, :, 1] - behind[:, :, 1]
    across = behind[:, :, 0] - ahead[:, :, 0]
    offset = ahead[:, :, 0] * behind[:, :, 1] - behind[:, :, 0] * ahead[:, :, 1]
    area = offset.sum(axis=1)
    area[np.abs(area) < 1e-9] = np.nan
    return np.asarray(np.stack([along, across, offset], axis=-1) / area[:, None, None])


def _rows(
    screen: Floats, triangles: Ints, slopes: Floats, size: tuple[int, int]
) -> tuple[Ints, Ints, Ints, Ints]:
    """The rows of pixels of all triangles: triangle, y, first x and number of pixels per row.

    Args:
        screen: float64[V, 3], vertices in pixels, y down.
        triangles: int64[F, 3], vertices of the triangles.
        slopes: float64[F, 3, 3], coefficients of the barycentric weights.
        size: height and width of the picture in pixels.
    """
    high, wide = size
    y = screen[triangles, 1]
    first = np.clip(np.ceil(y.min(axis=1, initial=high)), 0, high).astype(np.int64)
    last = np.clip(np.floor(y.max(axis=1, initial=-1)), -1, high - 1).astype(np.int64)
    count = np.where(np.isnan(slopes[:, 0, 0]), 0, np.maximum(0, last - first + 1))
    owner = np.repeat(np.arange(len(triangles)), count)
    row = first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    low, end = np.zeros(len(owner)), np.full(len(owner), wide - 1.0)
    for corner in range(3):
        along, across, offset = slopes[owner, corner].T
        rest = across * row + offset
        with np.errstate(divide="ignore", invalid="ignore"):
            edge = -rest / along
        low = np.where(along > 0, np.maximum(low, edge), low)
        end = np.where(along < 0, np.minimum(end, edge), end)
        end = np.where((along == 0) & (rest < -1e-9), -1.0, end)
    # Each row extends by 1e-6 pixels beyond the edge, so that adjacent triangles leave no gap.
    low = np.ceil(np.minimum(low, wide) - 1e-6).astype(np.int64)
    pixels = np.floor(np.maximum(end, -1) + 1e-6).astype(np.int64) - low + 1
    kept = pixels > 0
    return owner[kept], row[kept], low[kept], pixels[kept]


def _batches(
    owner: Ints, row: Ints, low: Ints, count: Ints
) -> Iterator[tuple[Ints, Ints, Ints, Ints]]:
    """Splits the rows into batches with a limited number of pixels."""
    runs = np.cumsum(count) // _BATCH
    edges = [0, *(np.flatnonzero(np.diff(runs)) + 1).tolist(), len(owner)]
    for first, last in pairwise(edges):
        part = slice(first, last)
        yield owner[part], row[part], low[part], count[part]


def _lit(normals: Floats, paint: Floats) -> Floats:
    """float64[N, 3]: colours of clay under two soft lights, on both sides of a surface.

    Args:
        normals: float64[N, 3], normals in view axes, of any length.
        paint: float64[N] or float64[N, 3], factor on the colour of clay.
    """
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0, length, 1)
    normals = normals * np.where(normals[:, 2:] < 0, -1, 1)
    key = np.clip(normals @ (_KEY / np.linalg.norm(_KEY)), 0, 1)
    fill = np.clip(normals @ (_FILL / np.linalg.norm(_FILL)), 0, 1)
    light = 0.3 + 0.52 * key + 0.16 * fill + 0.08 * normals[:, 2]
    clay = np.array([0.88, 0.86, 0.84])
    return np.asarray(
        np.clip(light[:, None] * (paint[:, None] if paint.ndim == 1 else paint) * clay, 0, 1)
    )


def _averaged(picture: Floats, smooth: int) -> npt.NDArray[np.uint8]:
    """Averages blocks of samples to pixels; only covered samples count for the colour.

    Args:
        picture: float64[h, w, 4], samples as RGBA.
        smooth: samples per pixel in each direction.
    """
    high, wide = picture.shape[0] // smooth, picture.shape[1] // smooth
    blocks = picture.reshape(high, smooth, wide, smooth, 4)
    alpha = blocks[..., 3].mean(axis=(1, 3))
    colour = (blocks[..., :3] * blocks[..., 3:]).mean(axis=(1, 3))
    colour /= np.where(alpha > 0, alpha, 1)[..., None]
    joined = np.concatenate([colour, alpha[..., None]], axis=-1)
    return np.asarray(np.rint(joined * 255), np.uint8)
