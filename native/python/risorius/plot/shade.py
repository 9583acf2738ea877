# SPDX-License-Identifier: MIT
"""Meshes as a softly lit picture: a small depth-buffer renderer in NumPy.

One array operation handles all triangles of a similar size, so a head of 50,000 triangles takes
about a second, and nothing has to be thinned out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import risorius

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_KEY = np.array([-0.35, 0.55, 0.76])  # light from above and a little from the left
_FILL = np.array([0.8, 0.1, 0.6])
_BATCH = 1 << 21  # candidate pixels at a time, which bounds the memory at some 200 MB


@dataclass(frozen=True)
class Surface:
    """float64[V, 3] points and normals in view axes, int64[F, 3] triangles, float64[V] paint."""

    points: Floats
    normals: Floats
    triangles: Ints
    paint: Floats


def triangles_of(mesh: risorius.Mesh) -> Ints:
    """The faces of a mesh as fans of triangles: int64[F, 3] of position indices."""
    offsets = np.asarray(mesh.face_offsets, np.int64)
    layouts = np.asarray(mesh.face_layouts, np.int64)
    if len(offsets) < 2:
        return np.zeros((0, 3), np.int64)
    fans = np.maximum(np.diff(offsets) - 2, 0)
    first = np.repeat(offsets[:-1], fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    corners = layouts[np.stack([first, first + step + 1, first + step + 2], axis=1)]
    return np.asarray(mesh.layout_positions, np.int64)[corners]


def surface(meshes: list[risorius.Mesh], paints: list[Floats], axes: Floats) -> Surface:
    """Meshes as one surface in view axes.

    Args:
        meshes: to join.
        paints: float64[V] of each mesh, the lightness of its vertices; 1 is clay.
        axes: float64[3, 3] from file axes to right, up, front.
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
    return Surface(places, _normals(places, faces), faces, np.concatenate([*paint, np.zeros(0)]))


def _normals(points: Floats, triangles: Ints) -> Floats:
    """Area-weighted vertex normals; the file's own may be missing or split along seams."""
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
    """The surface seen along -z.

    Args:
        shape: x to the right, y up, z towards who looks.
        frame: left, right, bottom, top of the picture in the surface's units.
        height: of the picture in pixels; the width follows from the frame.
        smooth: this many samples a pixel each way, averaged, so that edges are soft.

    Returns:
        uint8[h, w, 4], RGBA, transparent where there is nothing.
    """
    left, right, bottom, top = frame
    scale = height * smooth / (top - bottom)
    high, wide = height * smooth, max(1, round(height * (right - left) / (top - bottom))) * smooth
    screen = np.empty_like(shape.points)
    screen[:, 0] = (shape.points[:, 0] - left) * scale - 0.5
    screen[:, 1] = (top - shape.points[:, 1]) * scale - 0.5
    screen[:, 2] = shape.points[:, 2] * scale
    face, weights = _depth_buffer(screen, shape.triangles, (high, wide))
    hit = np.flatnonzero(face >= 0)
    picture = np.zeros((high * wide, 4))
    corners = shape.triangles[face[hit]]
    blend = weights[hit]
    normals = np.einsum("nk,nkd->nd", blend, shape.normals[corners])
    paint = np.einsum("nk,nk->n", blend, shape.paint[corners])
    picture[hit, :3] = _lit(normals, paint)
    picture[hit, 3] = 1
    return _averaged(picture.reshape(high, wide, 4), smooth)


def _depth_buffer(screen: Floats, triangles: Ints, size: tuple[int, int]) -> tuple[Ints, Floats]:
    """The nearest triangle at each pixel, or -1, and the weights of its corners there."""
    high, wide = size
    nearest = np.full(high * wide, -np.inf)
    face = np.full(high * wide, -1)
    weights = np.zeros((high * wide, 3))
    corners = screen[triangles][:, :, :2]
    low = np.ceil(np.clip(corners.min(axis=1), -1, [wide, high])).astype(np.int64)
    last = np.floor(np.clip(corners.max(axis=1), -1, [wide, high])).astype(np.int64)
    low = np.maximum(low, 0)
    spans = np.minimum(last, [wide - 1, high - 1]) - low + 1
    for chosen, span in _classes(spans):
        pixel, inside, owner = _covered(corners, low, chosen, span, size)
        depth = np.einsum("nk,nk->n", inside, screen[triangles[owner], 2])
        # The last write wins, so the nearest of each pixel goes last.
        order = np.argsort(depth, kind="stable")
        pixel, inside, owner, depth = pixel[order], inside[order], owner[order], depth[order]
        kept = depth > nearest[pixel]
        pixel = pixel[kept]
        nearest[pixel], face[pixel], weights[pixel] = depth[kept], owner[kept], inside[kept]
    return face, weights


def _classes(spans: Ints) -> list[tuple[Ints, int]]:
    """Triangles of a similar size on the screen, in batches: (their indices, the size)."""
    size = spans.max(axis=1, initial=0)
    seen = (spans > 0).all(axis=1)
    batches: list[tuple[Ints, int]] = []
    below, limit = 0, 2
    while below < size.max(initial=0):
        chosen = np.flatnonzero(seen & (size > below) & (size <= limit))
        step = max(1, _BATCH // (limit * limit))
        batches += [(chosen[i : i + step], limit) for i in range(0, len(chosen), step)]
        below, limit = limit, limit * 2
    return batches


def _covered(
    corners: Floats, low: Ints, chosen: Ints, span: int, size: tuple[int, int]
) -> tuple[Ints, Floats, Ints]:
    """The pixels that triangles cover: flat index, weights of the corners, triangle."""
    high, wide = size
    dy, dx = np.divmod(np.arange(span * span), span)
    x = (low[chosen, :1] + dx).astype(float)
    y = (low[chosen, 1:] + dy).astype(float)
    a, b, c = (corners[chosen, i, :, None] for i in range(3))
    ab, ac = b - a, c - a
    area: Floats = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    area = np.where(np.abs(area) > 1e-12, area, np.inf)  # a sliver covers nothing
    v = ((x - a[:, 0]) * ac[:, 1] - (y - a[:, 1]) * ac[:, 0]) / area
    w = (ab[:, 0] * (y - a[:, 1]) - ab[:, 1] * (x - a[:, 0])) / area
    u = 1 - v - w
    flat = np.isinf(area)
    within = (u >= -1e-9) & (v >= -1e-9) & (w >= -1e-9) & (x < wide) & (y < high) & ~flat
    which, place = np.nonzero(within)
    pixel = y[which, place].astype(np.int64) * wide + x[which, place].astype(np.int64)
    inside = np.stack([u[within], v[within], w[within]], axis=1)
    return pixel, inside, chosen[which]


def _lit(normals: Floats, paint: Floats) -> Floats:
    """Clay under two soft lights: float64[N, 3]. Faces are lit on both sides."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0, length, 1)
    normals = normals * np.where(normals[:, 2:] < 0, -1, 1)
    key = np.clip(normals @ (_KEY / np.linalg.norm(_KEY)), 0, 1)
    fill = np.clip(normals @ (_FILL / np.linalg.norm(_FILL)), 0, 1)
    light = 0.3 + 0.52 * key + 0.16 * fill + 0.08 * normals[:, 2]
    clay = np.array([0.88, 0.86, 0.84])
    return np.asarray(np.clip(light[:, None] * paint[:, None] * clay, 0, 1))


def _averaged(picture: Floats, smooth: int) -> npt.NDArray[np.uint8]:
    """Blocks of samples as one pixel; the colour is the mean of what was hit, not of the void."""
    high, wide = picture.shape[0] // smooth, picture.shape[1] // smooth
    blocks = picture.reshape(high, smooth, wide, smooth, 4)
    alpha = blocks[..., 3].mean(axis=(1, 3))
    colour = (blocks[..., :3] * blocks[..., 3:]).mean(axis=(1, 3))
    colour /= np.where(alpha > 0, alpha, 1)[..., None]
    joined = np.concatenate([colour, alpha[..., None]], axis=-1)
    return np.asarray(np.rint(joined * 255), np.uint8)
