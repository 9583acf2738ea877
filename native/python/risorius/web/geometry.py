# SPDX-License-Identifier: MIT
"""Packs meshes, weights and shapes in few bytes, for native/web/geometry.js.

Numbers are integer steps, stored as differences to an earlier number, with low and high bytes
in separate runs, because gzip compresses them best in this form."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._native import Dna, Mesh
from .kinds import kind_of

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

# Steps in which numbers are stored: of positions (_PLACE) and of shapes (_SHAPE) as fractions of
# the face's size, of texture coordinates, and of skin weights. A step is rounded down to a power of
# two before it is used, so that multiples of the step are stored exactly. Other values are rounded:
# for a bust of 500 mm by up to 2 um in positions and 15 um in shapes, which is less than a
# sixteenth of a pixel if the bust fills a picture of 1024 pixels.
_PLACE, _SHAPE, _TEXTURE, _WEIGHT = 2.0**-17, 2.0**-14, 2.0**-13, 2.0**-10
_DIRECTION = 127.0


class _Streams:
    """Appends integer arrays to one byte stream; callers keep each array's layout in `about`."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []

    def add(self, values: npt.ArrayLike, stride: int = 1) -> list[int]:
        """Appends numbers, and returns [count, bytes per number, stride].

        Args:
            values: whole numbers of any shape.
            stride: each number is stored as the difference to the number `stride` places before; 0:
                numbers are stored unchanged.
        """
        whole = np.asarray(values, np.int64).ravel()
        if stride:
            whole = np.concatenate([whole[:stride], whole[stride:] - whole[:-stride]])
        even = np.where(whole < 0, -2 * whole - 1, 2 * whole).astype("<u4")
        most = int(even.max(initial=0))
        width = 1 if most < 1 << 8 else 2 if most < 1 << 16 else 4
        planes = even.view(np.uint8).reshape(-1, 4)[:, :width]
        self.parts.append(planes.T.tobytes())
        return [len(even), width, stride]


class Packed(NamedTuple):
    """The packed meshes of a face.

    Attributes:
        about: for each mesh with vertices, the table that geometry.js needs to read it.
        data: bytes of all numbers.
    """

    about: list[dict[str, Any]]
    data: bytes


def pack(dna: Dna) -> Packed:
    """Packs all meshes that have vertices, with their shapes and weights.

    Args:
        dna: face with geometry.
    """
    streams = _Streams()
    found = [len(mesh.positions) for mesh in dna.meshes]
    places = [mesh.positions for mesh, count in zip(dna.meshes, found, strict=True) if count]
    size = float(max(np.ptp(np.asarray(p, np.float64), axis=0).max() for p in places)) or 1.0
    about = [
        {"index": i, "kind": kind_of(name), **_mesh(mesh, kind_of(name), size, streams)}
        for i, (name, mesh) in enumerate(zip(dna.mesh_names, dna.meshes, strict=True))
        if found[i]
    ]
    return Packed(about, b"".join(streams.parts))


def _mesh(mesh: Mesh, kind: str, size: float, streams: _Streams) -> dict[str, Any]:
    source, textures, corners, begins = _welded(mesh)
    about: dict[str, Any] = {}
    _steps(about, "positions", mesh.positions, size * _PLACE, streams)
    _steps(about, "uv", mesh.texture_coordinates[textures], _TEXTURE, streams)
    about["source"] = streams.add(source)
    about["sides"] = streams.add(np.diff(begins))
    about["corners"] = streams.add(corners)
    about["influences"], about["joints"], about["weights"] = _skin(mesh, streams)
    if kind in ("hair", "lashes") and len(mesh.normals):
        # Hair cards have the normals of the skin below. The page cannot compute these from the
        # cards' polygons, so they are stored.
        about["normals"] = streams.add(np.rint(_normals(mesh) * _DIRECTION))
    about.update(_targets(mesh, size, streams))
    return about


def _steps(
    about: dict[str, Any], name: str, values: npt.ArrayLike, most: float, streams: _Streams
) -> None:
    """Appends values as integer multiples of a step up to `most`, axis by axis; `about` gets the
    step and the layout.

    Args:
        about: table of the mesh; changed.
        name: key in `about`.
        values: float[n, k].
        most: largest step.
        streams: receives the numbers.
    """
    exact = np.asarray(values, np.float64)
    step = _step(exact, most)
    about[name] = [step, *streams.add(np.rint(exact.T / step))]


def _step(values: Floats, most: float) -> float:
    """The step in which values are stored, a power of two.

    The usual step is the largest power of two up to `most`. It is 16, 8, 4 or 2 times as large if
    all values are multiples of the larger step.
    """
    for coarser in (16.0, 8.0, 4.0, 2.0):
        steps = values / (_power(most) * coarser)
        if np.array_equal(steps, np.rint(steps)):
            return _power(most) * coarser
    return _power(most)


def _power(most: float) -> float:
    return float(2.0 ** np.floor(np.log2(most)))


def _welded(mesh: Mesh) -> tuple[Ints, Ints, Ints, Ints]:
    """Makes one vertex from layouts with equal position and texture coordinate.

    Returns indices: the position of each vertex, the texture coordinate of each vertex, the vertex
    of each polygon corner, and the first corner of each polygon.
    """
    layouts = mesh.face_layouts.astype(np.int64)
    places = mesh.layout_positions.astype(np.int64)
    if not len(mesh.texture_coordinates):
        return places, np.zeros(0, np.int64), layouts, mesh.face_offsets.astype(np.int64)
    textures = mesh.layout_texture_coordinates.astype(np.int64)
    key = places * (int(textures.max(initial=0)) + 1) + textures
    _, first, turn = np.unique(key, return_index=True, return_inverse=True)
    return places[first], textures[first], turn[layouts], mesh.face_offsets.astype(np.int64)


def _skin(mesh: Mesh, streams: _Streams) -> tuple[list[int], list[int], list[int]]:
    begins = mesh.skin_offsets.astype(np.int64)
    counts = np.diff(begins) if len(begins) else np.zeros(0, np.int64)
    vertex = np.repeat(np.arange(len(counts)), counts)
    # Neighbouring vertices share joints. If each vertex lists its joints in ascending order, the
    # rows of neighbours look alike and compress better.
    order = np.lexsort((mesh.skin_joint_indices, vertex))
    joints = mesh.skin_joint_indices.astype(np.int64)[order]
    weights = np.rint(np.asarray(mesh.skin_weights, np.float64)[order] / _WEIGHT)
    most = int(counts.max(initial=1)) or 1
    even = most if len(counts) and (counts == most).all() else 1
    return streams.add(counts), streams.add(joints, even), streams.add(weights, 0)


def _normals(mesh: Mesh) -> Floats:
    """float64[positions, 3]: the mean direction of the corner normals at each position."""
    sums = np.zeros((len(mesh.positions), 3))
    np.add.at(sums, mesh.layout_positions, mesh.normals[mesh.layout_normals].astype(np.float64))
    return sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-12)


def _targets(mesh: Mesh, size: float, streams: _Streams) -> dict[str, Any]:
    targets = [t for t in mesh.blend_shape_targets if len(t.deltas)]
    if not targets:
        return {"shapes": []}
    step = _power(size * _SHAPE)
    about: dict[str, Any] = {"shapes": [int(t.blend_shape_channel_index) for t in targets]}
    whole, vertices, counts = [], [], []
    for target in targets:
        order = np.argsort(target.vertex_indices, kind="stable")
        steps = np.rint(np.asarray(target.deltas, np.float64)[order] / step)
        moved = steps.any(axis=1)
        whole.append(steps[moved])
        vertices.append(np.diff(target.vertex_indices.astype(np.int64)[order][moved], prepend=0))
        counts.append(int(moved.sum()))
    about["moved"] = streams.add(counts, 0)
    about["vertices"] = streams.add(np.concatenate(vertices), 0)
    about["deltas"] = [step, *streams.add(np.concatenate(whole).T)]
    return about
