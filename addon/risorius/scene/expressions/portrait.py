# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws small pictures of a face with an expression, in NumPy.

A Sitter contains all data for drawing and no Blender data. So a thread can draw the pictures, and
the user's scene does not change. File space has the axes and the unit of the DNA file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.space import euler_matrices, world_matrices
from ..character import runtime

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SIZE = 160  # width and height of a picture in pixels
VERSION = 1  # version of the drawing code; cached pictures of other versions are not used
_SMOOTH = 2  # samples per pixel in each direction
_KEY = np.array([-0.45, 0.55, 0.70])  # direction to the key light at the upper left
_FILL = np.array([0.75, 0.05, 0.65])  # direction to the fill light
_TOP = np.array([0.42, 0.42, 0.43])  # background colour at the top
_BOTTOM = np.array([0.27, 0.27, 0.28])  # background colour at the bottom
_STILL_GLOSS = 0.07  # gloss of a mesh that belongs to no character
_FAR = 15.0  # distance of the viewpoint, in half heights of the picture


@dataclass(frozen=True)
class Piece:
    """One mesh to draw.

    Attributes:
        index: index of the mesh in the DNA.
        triangles: int64[F, 3], vertex indices.
        uvs: float64[F, 3, 2], UV coordinates of the triangles' corners.
        colors: float64[F, 3] in [0, 1], colours of triangles without an image, and of hairs.
        image: float32[h, w, 4] in [0, 1], row 0 at v = 0; or None.
        gloss: strength of the highlight, 0 to 1.
        hairs: True: transparent hair cards, such as lashes, whose alpha comes from the image.
        weights: float32[V, J], skin weights of the joints.
        shapes: (channel, vertex indices, deltas in file units) of each blend shape target.
    """

    index: int
    triangles: Ints
    uvs: Floats
    colors: Floats
    image: NDArray[np.float32] | None
    gloss: float
    hairs: bool
    weights: NDArray[np.float32]
    shapes: tuple[tuple[int, Ints, Floats], ...]


@dataclass(frozen=True)
class Sitter:
    """The data for drawing pictures of a character.

    Attributes:
        live: Runtime of the character.
        pieces: meshes of the character, each in the level of detail to draw.
    """

    live: runtime.Runtime
    pieces: tuple[Piece, ...]


def skin_of(mesh: native.Mesh, joint_count: int) -> NDArray[np.float32]:
    """The skin weights of a mesh, float32[V, J]; rows of vertices without weights are 0.

    Args:
        mesh: mesh of the DNA file.
        joint_count: number of joints in the DNA file.
    """
    offsets = np.asarray(mesh.skin_offsets, np.int64)
    count = len(mesh.positions)
    table = np.zeros((count, joint_count), np.float32)
    if len(offsets) == count + 1:
        owner = np.repeat(np.arange(count), np.diff(offsets))
        joints = np.asarray(mesh.skin_joint_indices, np.int64)
        np.add.at(table, (owner, joints), np.asarray(mesh.skin_weights, np.float32))
    return table


def shapes_of(mesh: native.Mesh) -> tuple[tuple[int, Ints, Floats], ...]:
    """(channel, vertex indices, deltas in file units) of each blend shape target of a mesh."""
    return tuple(
        (
            int(target.blend_shape_channel_index),
            np.asarray(target.vertex_indices, np.int64),
            np.asarray(target.deltas, np.float64),
        )
        for target in mesh.blend_shape_targets
    )


def draw(sitter: Sitter, sliders: Mapping[str, float], size: int = SIZE) -> Floats:
    """Draw a face with given slider values, seen from the front.

    Args:
        sitter: the face.
        sliders: values by property name; other sliders are at rest.
        size: width and height in pixels.

    Returns:
        float64[size, size, 3] in [0, 1], row 0 at the bottom.
    """
    return draw_places(sitter, places(sitter, sliders), size)


def places(sitter: Sitter, sliders: Mapping[str, float]) -> list[Floats]:
    """float64[V, 3] for each piece: its posed vertices in file space.

    Args:
        sitter: the face.
        sliders: values by property name; other sliders are at rest.
    """
    live = sitter.live
    rests = dict(zip(live.labels, live.rests, strict=True))
    raw = np.array([sliders.get(name, rests[name]) for name in live.labels], np.float32)
    pose = live.rig.evaluate(raw)
    moves = _moves(live, np.asarray(pose.joints, np.float64))
    return [_posed(live, piece, moves, pose.blend_shapes) for piece in sitter.pieces]


def draw_places(sitter: Sitter, placed: Sequence[Floats], size: int = SIZE) -> Floats:
    """Draw a face with given vertices, seen from the front.

    Args:
        sitter: the face.
        placed: vertices of each piece, from `places`.
        size: width and height in pixels.

    Returns:
        float64[size, size, 3] in [0, 1], row 0 at the bottom.
    """
    view, scale = _frame(sitter)
    high = size * _SMOOTH
    picture = _Picture(high)
    pairs = zip(sitter.pieces, placed, strict=True)
    for piece, points in sorted(pairs, key=lambda pair: pair[0].hairs):
        picture.add(piece, _on_screen(sitter.live.space.points(points), view, scale, high))
    return _averaged(picture.lit(), _SMOOTH)


def draw_still(
    points: Floats,
    triangles: Ints,
    colors: Floats,
    frame: tuple[Floats, float],
    size: int = SIZE,
) -> Floats:
    """Draw a mesh that belongs to no character, seen from the front.

    Args:
        points: float64[V, 3] in Blender's axes; the face looks along -y.
        triangles: int64[F, 3], vertex indices.
        colors: float64[F, 3] in [0, 1], colours of the triangles.
        frame: the centre of the picture, and half its height, in the units of points.
        size: width and height in pixels.

    Returns:
        float64[size, size, 3] in [0, 1], row 0 at the bottom.
    """
    high = size * _SMOOTH
    uvs, none = np.zeros((*triangles.shape, 2)), np.zeros((len(points), 0), np.float32)
    piece = Piece(0, triangles, uvs, colors, None, _STILL_GLOSS, False, none, ())
    picture = _Picture(high)
    picture.add(piece, _on_screen(points, *frame, high))
    return _averaged(picture.lit(), _SMOOTH)


def _moves(live: runtime.Runtime, deltas: Floats) -> Floats:
    """float64[J, 4, 4]: transforms of joints from neutral to posed, in file space."""
    dna, space = live.dna, live.space
    turns = np.asarray(dna.neutral_joint_rotations, np.float64)
    places = np.asarray(dna.neutral_joint_translations, np.float64)
    parents = np.asarray(dna.joint_parents)
    units = space.radians * space.signs
    rest = world_matrices(euler_matrices(turns * units, space.sequence), places, parents)
    rotations = euler_matrices((turns + deltas[:, 3:6]) * units, space.sequence)
    rotations = rotations * (1.0 + deltas[:, None, 6:9])
    return world_matrices(rotations, places + deltas[:, :3], parents) @ np.linalg.inv(rest)


def _posed(
    live: runtime.Runtime, piece: Piece, moves: Floats, channels: NDArray[np.float32]
) -> Floats:
    """float64[V, 3]: vertices of a mesh after blend shapes and skinning, in file space.

    Args:
        live: Runtime of the character.
        piece: the mesh.
        moves: float64[J, 4, 4], skinning matrices of the joints.
        channels: float32[C], weights of the blend shape channels.
    """
    points = np.asarray(live.dna.meshes[piece.index].positions, np.float64).copy()
    for channel, vertices, deltas in piece.shapes:
        if channel < len(channels) and channels[channel]:
            points[vertices] += float(channels[channel]) * deltas
    blended = (piece.weights @ moves.reshape(len(moves), 16)).reshape(-1, 4, 4)
    moved = np.einsum("nij,nj->ni", blended[:, :3, :3], points) + blended[:, :3, 3]
    free = ~piece.weights.any(axis=1)
    moved[free] = points[free]
    return moved


def _frame(sitter: Sitter) -> tuple[Floats, float]:
    """The centre of the picture in Blender's axes, and half its height, to frame the face."""
    live = sitter.live
    eyes = [live.rest[joint][:3, 3] for joint in live.anchors.eyes.values()]
    if len(eyes) == 2:
        apart = float(np.linalg.norm(eyes[0] - eyes[1]))
        if apart > 0.0:
            return (eyes[0] + eyes[1]) / 2 + np.array([0.0, 0.0, -0.62 * apart]), 1.42 * apart
    largest = max(sitter.pieces, key=lambda piece: (not piece.hairs, len(piece.triangles)))
    points = live.space.points(live.dna.meshes[largest.index].positions)
    low, high = points.min(axis=0), points.max(axis=0)
    half = max(float((high - low)[[0, 2]].max()) / 2, 1e-6)
    return (low + high) / 2, 1.05 * half


def _on_screen(points: Floats, middle: Floats, half: float, high: int) -> Floats:
    """float64[V, 3]: pixels to the right, pixels down, and depth towards the viewer in pixels.

    Args:
        points: float64[V, 3] in Blender's axes.
        middle, half: the centre of the picture and half its height, in the unit of `points`.
        high: height and width of the picture in samples.
    """
    seen = (points - middle)[:, [0, 2, 1]] / half
    seen[:, 2] *= -1.0  # the face looks along -y
    seen[:, :2] *= (_FAR / (_FAR - seen[:, 2]).clip(1.0))[:, None]
    screen = seen * (high / 2)
    screen[:, 0] += (high - 1) / 2
    screen[:, 1] = (high - 1) / 2 - screen[:, 1]
    return screen


class _Picture:
    """Buffers of a square picture: colour, normal, depth and gloss of each sample (pixel)."""

    def __init__(self, high: int) -> None:
        self.high = high
        self.color = np.zeros((high * high, 3))
        self.normal = np.zeros((high * high, 3))
        self.depth = np.full(high * high, -np.inf)
        self.gloss = np.zeros(high * high)
        self.shade = native.part("plot.drawing.shade")

    def add(self, piece: Piece, screen: Floats) -> None:
        """Draw a mesh over the picture.

        Args:
            piece: the mesh.
            screen: float64[V, 3] in pixels: to the right, down, and depth towards the viewer.
        """
        normals = self.shade.vertex_normals(screen * [1.0, -1.0, 1.0], piece.triangles)
        kept = _in_sight(screen[piece.triangles], self.high)
        triangles = piece.triangles[kept]
        face, weights = self.shade.depth_buffer(screen, triangles, (self.high, self.high))
        hit = np.flatnonzero(face >= 0)
        corners, share = triangles[face[hit]], weights[hit]
        depth = np.einsum("nk,nk->n", share, screen[corners, 2])
        front = depth > self.depth[hit]
        hit, corners, share, depth = hit[front], corners[front], share[front], depth[front]
        which = kept[face[hit]]
        color, alpha = _paint(piece, which, share)
        self.color[hit] += alpha[:, None] * (color - self.color[hit])
        if piece.hairs:
            return  # hair cards change only the colour; normals and depth below them stay
        normal = np.einsum("nk,nkd->nd", share, normals[corners])
        normal *= np.where(normal[:, 2:] < 0, -1.0, 1.0)
        self.normal[hit], self.depth[hit], self.gloss[hit] = normal, depth, piece.gloss

    def lit(self) -> Floats:
        """The lit picture over its background, float64[h, w, 3] in [0, 1], row 0 at the bottom."""
        ground = np.linspace(_TOP, _BOTTOM, self.high)
        picture = np.repeat(ground[:, None], self.high, axis=1).reshape(-1, 3)
        hit = np.flatnonzero(np.isfinite(self.depth))
        normal = self.normal[hit]
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-9)
        key, fill = _KEY / np.linalg.norm(_KEY), _FILL / np.linalg.norm(_FILL)
        light = 0.34 + 0.66 * (normal @ key).clip(0.0) + 0.14 * (normal @ fill).clip(0.0)
        light *= 1.0 - 0.6 * self._hollows()[hit]
        half = key + np.array([0.0, 0.0, 1.0])
        half /= np.linalg.norm(half)
        shine = self.gloss[hit] * (normal @ half).clip(0.0) ** 40
        picture[hit] = (self.color[hit] * light[:, None] + shine[:, None]).clip(0.0, 1.0)
        return picture.reshape(self.high, self.high, 3)[::-1]

    def _hollows(self) -> Floats:
        """float64[h * w]: how far a sample lies behind the mean depth around it, 0 to 1.

        The value is 1 from a distance of 6 % of the picture's height.
        """
        depth = self.depth.reshape(self.high, self.high)
        there = np.isfinite(depth)
        held, reach = np.where(there, depth, 0.0), max(self.high // 24, 1)
        around = _blurred(held, reach) / _blurred(there.astype(float), reach).clip(1e-6)
        behind = np.where(there, around - held, 0.0) / (0.06 * self.high)
        return behind.clip(0.0, 1.0).ravel()


def _in_sight(corners: Floats, high: int) -> Ints:
    """Indices of the finite triangles that may overlap the picture.

    Args:
        corners: float64[F, 3, 3] in pixels, the corners of the triangles.
        high: height of the picture in pixels.
    """
    low, top = corners[:, :, :2].min(axis=1), corners[:, :, :2].max(axis=1)
    inside = (top >= 0).all(axis=1) & (low <= high - 1).all(axis=1)
    return np.flatnonzero(inside & np.isfinite(corners).all(axis=(1, 2)))


def _paint(piece: Piece, which: Ints, share: Floats) -> tuple[Floats, Floats]:
    """Colour and alpha of samples: float64[n, 3] and [n].

    Args:
        piece: mesh of the samples.
        which: triangle of each sample, int64[n].
        share: barycentric coordinates, float64[n, 3].
    """
    if piece.image is None:
        solid = 0.0 if piece.hairs else 1.0
        return piece.colors[which], np.full(len(which), solid)
    height, width = piece.image.shape[:2]
    uv = np.einsum("nk,nkd->nd", share, piece.uvs[which]) % 1.0
    column = (uv[:, 0] * width).astype(np.int64).clip(0, width - 1)
    row = (uv[:, 1] * height).astype(np.int64).clip(0, height - 1)
    texel = piece.image[row, column].astype(np.float64)
    if piece.hairs:
        return piece.colors[which], texel[:, 3]
    return texel[:, :3], np.ones(len(which))


def _blurred(values: Floats, reach: int) -> Floats:
    """Means over squares with sides of 2 * reach + 1 samples; the edge is repeated outwards."""
    for axis in (0, 1):
        edges = [(0, 0), (0, 0)]
        edges[axis] = (reach + 1, reach)
        total = np.cumsum(np.pad(values, edges, mode="edge"), axis=axis)
        width, count = 2 * reach + 1, values.shape[axis]
        low = np.take(total, range(count), axis=axis)
        values = (np.take(total, range(width, width + count), axis=axis) - low) / width
    return values


def _averaged(picture: Floats, smooth: int) -> Floats:
    high = len(picture) // smooth
    return picture.reshape(high, smooth, high, smooth, 3).mean(axis=(1, 3))
