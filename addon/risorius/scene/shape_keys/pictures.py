# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws pictures of shape keys on their head, and of possible assignments on the sample man.

A thread draws the pictures without a window (scene/expressions/portrait.py). The pictures are
cached as files, named by a hash of the drawn data. Vertices that a shape key moves are orange.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ..base import parts, session
from ..base.blender_types import MeshObject
from ..character import runtime
from ..expressions import library, portrait, thumbnails
from . import assigned

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

VERSION = 2  # version of the drawing style; pictures of another version are drawn again
_SKIN = np.array([0.62, 0.60, 0.58])
_CLAY = 0.82  # factor of the sample man's colours, which are plain clay
_MOVED = np.array([0.95, 0.45, 0.10])
_STRONG = 0.8  # amount of orange where a head moves furthest
_FAINT = 0.15  # sqrt(motion / largest motion): vertices below it get no orange
_MOVES = 0.5  # motion / largest motion of a key: vertices below it are not framed
_NOTHING = 0.01  # largest motion of a key / largest motion of all keys: keys below it do not count
_MARGIN = 1.25  # size of a picture / size of the moving part
_LEAST = 0.3  # smallest height of a picture / extent of the mesh
_SAMPLE = "man"


@dataclass(frozen=True)
class Model:
    """The data of a head for its pictures, without Blender data.

    Attributes:
        points: float64[V, 3], the face looks along -y.
        ways: name of a shape key -> float32[V, 3], displacements from the neutral head.
        triangles: int64[F, 3], vertex indices.
        frame: centre of the pictures, and half their height, in the unit of `points`.
        paths: name of a key -> file of its picture.
    """

    points: Floats
    ways: Mapping[str, NDArray[np.float32]]
    triangles: Ints
    frame: tuple[Floats, float]
    paths: Mapping[str, Path]


class Job(NamedTuple):
    """Pictures to draw.

    Attributes:
        model: the head.
        keys: names of keys.
        samples: values of assigned.Choice, drawn on the sample man.
    """

    model: Model
    keys: Sequence[str]
    samples: Sequence[str]


# Pictures of the heads of this file: session uid of the mesh -> name of a shape key -> path.
_paths: dict[int, Mapping[str, Path]] = session.table("shape_keys.paths", ("undo", "load"))


def paths_of(item: MeshObject) -> Mapping[str, Path] | None:
    """Name of a key -> path of its picture, which may not exist; None before the first `model_of`.

    Panels call this function often, so it computes no hashes: edited shape keys keep their old
    pictures until new pictures are drawn.

    Args:
        item: the head.
    """
    return _paths.get(item.data.session_uid)


def model_of(item: MeshObject) -> Model:
    """Read the data for the pictures of a head, and store the paths for `paths_of`.

    Args:
        item: mesh with shape keys.
    """
    keys, mesh = parts.keys_there(item), item.data
    turn = np.array(item.matrix_world.to_3x3(), np.float64)

    def points(key: bpy.types.ShapeKey) -> NDArray[np.float32]:
        out = np.empty(3 * len(mesh.vertices), np.float32)
        key.data.foreach_get("co", out)
        return out.reshape(-1, 3)

    places = {key.name: points(key) for key in keys.key_blocks}
    ways = {
        key.name: ((places[key.name] - places[key.relative_key.name]) @ turn.T).astype(np.float32)
        for key in keys.key_blocks
        if key != keys.reference_key
    }
    rest = places[keys.reference_key.name].astype(np.float64) @ turn.T
    mesh.calc_loop_triangles()
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    corners = triangles.reshape(-1, 3).astype(np.int64)
    far = _shares(ways, len(rest))
    front = _to_front(rest, far)
    rest = rest @ front.T
    ways = {name: (way @ front.T).astype(np.float32) for name, way in ways.items()}
    frame = _frame(rest, far)
    view = np.array([*frame[0], frame[1], VERSION, portrait.VERSION], np.float32).tobytes()
    look = _digest(view, rest.astype(np.float32).tobytes(), corners.tobytes()).encode()
    paths = {name: _file(_digest(look, way.tobytes())) for name, way in ways.items()}
    _paths[mesh.session_uid] = paths
    return Model(rest, ways, corners, frame, paths)


def _file(digest: str) -> Path:
    return library.own_folder("thumbnails") / f"{digest}.png"


def _digest(*parts_of_it: bytes) -> str:
    return hashlib.sha1(b"".join(parts_of_it), usedforsecurity=False).hexdigest()


def _shares(ways: Mapping[str, NDArray[np.float32]], count: int) -> Floats:
    """float64[V]: largest relative motion of each vertex by any shape key, 0 to 1.

    A motion is divided by the largest motion of the same shape key, so that a brow counts as much
    as a jaw. Shape keys with almost no motion do not count."""
    lengths = [np.nan_to_num(np.linalg.norm(way, axis=1), posinf=0.0) for way in ways.values()]
    furthest = [float(length.max(initial=0.0)) for length in lengths]
    share = np.zeros(count)
    for length, most in zip(lengths, furthest, strict=True):
        if most > _NOTHING * max(furthest):
            np.maximum(share, length / most, out=share)
    return share


def _to_front(rest: Floats, far: Floats) -> Floats:
    """float64[3, 3]: a rotation about z, a multiple of 90 degrees, that turns the moving part
    towards -y.

    A face moves at its front, so this works for every orientation of the head.

    Args:
        rest: float64[V, 3], vertices of the neutral head, z up.
        far: float64[V], how far shape keys move each vertex, relative to the largest motion, 0 to
            1.
    """
    middle = (rest.min(axis=0) + rest.max(axis=0)) / 2
    way = (far[:, None] * (rest - middle)).sum(axis=0)[:2]
    if np.abs(way).max(initial=0.0) <= 0.0:
        return np.eye(3)
    turns = [np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
             for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]  # fmt: skip
    best: Floats = min(turns, key=lambda turn: float((turn[:2, :2] @ way)[1]))
    return best


def _frame(rest: Floats, far: Floats) -> tuple[Floats, float]:
    """The centre and half the height of a picture that shows all moving vertices.

    Args:
        rest: float64[V, 3], vertices of the neutral head, which faces -y.
        far: float64[V], how far shape keys move each vertex, relative to the largest motion, 0 to
            1.
    """
    low, high = rest.min(axis=0), rest.max(axis=0)
    moved = rest[far > _MOVES]
    least = _LEAST * float((high - low)[[0, 2]].max()) / 2
    if len(moved):
        low, high = moved.min(axis=0), moved.max(axis=0)
    half = _MARGIN * float((high - low)[[0, 2]].max()) / 2
    return (low + high) / 2, max(half, least, 1e-6)


def draw(model: Model, key: str) -> Floats:
    """Draw a head with one shape key at value 1; the parts that the key moves are orange.

    Args:
        model: the head.
        key: name of the key.

    Returns:
        float64[portrait.SIZE, portrait.SIZE, 3] in [0, 1], row 0 at the bottom.
    """
    way = model.ways[key].astype(np.float64)
    length = np.linalg.norm(way, axis=1)
    skin = np.tile(_SKIN, (len(model.triangles), 1))
    colors = _marked(skin, length, model.triangles, float(length.max(initial=0.0)))
    return portrait.draw_still(model.points + way, model.triangles, colors, model.frame)


def _marked(colors: Floats, length: Floats, triangles: Ints, furthest: float) -> Floats:
    """The colours of triangles, with moving parts in orange.

    Args:
        colors: float64[F, 3].
        length: float64[V], motion of each vertex.
        triangles: int64[F, 3].
        furthest: motion that gets the full colour, in the unit of `length`.
    """
    share = np.sqrt(length / max(furthest, 1e-12))
    share = np.where(share > _FAINT, share, 0.0)[triangles].mean(axis=1)[:, None] * _STRONG
    marked: Floats = colors + share * (_MOVED - colors)
    return marked


def sample_path(value: str) -> Path:
    """The picture file of a possible assignment.

    Args:
        value: the member `value` of an assigned.Choice.
    """
    shown = sorted(assigned.weights_of(value).items())  # jawOpen and =jawOpen are one picture
    text = f"sample {VERSION} {portrait.VERSION} {native.addon_version()} {shown}"
    return _file(_digest(text.encode()))


def without_picture(values: Sequence[str]) -> list[str]:
    """The assignments whose picture file is missing.

    Only the first of several assignments with the same picture file is returned.

    Args:
        values: values of assigned.Choice.
    """
    found = {
        path: value for value in reversed(values) if not (path := sample_path(value)).is_file()
    }
    return list(reversed(found.values()))


def sample_sitter() -> portrait.Sitter | None:
    """The sample man, in plain clay; None if the add-on came without him."""
    path = native.bundled_sample(_SAMPLE)
    if path is None:
        return None
    live = runtime.compiled(path.read_bytes())
    return portrait.Sitter(live, tuple(thumbnails.plain_pieces(live)))


def _draw_sample(sitter: portrait.Sitter, rest: Sequence[Floats], value: str) -> Floats:
    """Draw the sample man with an assignment; moving parts are orange.

    Args:
        sitter: the sample man.
        rest: portrait.places of his neutral face.
        value: the member `value` of an assigned.Choice.
    """
    placed = portrait.places(sitter, assigned.weights_of(value))
    lengths = [np.linalg.norm(a - b, axis=1) for a, b in zip(placed, rest, strict=True)]
    furthest = max(float(length.max(initial=0.0)) for length in lengths)
    pieces = tuple(
        replace(piece, colors=_marked(_CLAY * piece.colors, length, piece.triangles, furthest))
        for piece, length in zip(sitter.pieces, lengths, strict=True)
    )
    return portrait.draw_places(replace(sitter, pieces=pieces), placed)


def make(
    job: Job,
    progress: Callable[[float], None] = lambda _share: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> int:
    """Draw the pictures of a job and write their files, without using Blender data.

    Args:
        job: pictures to draw.
        progress: function that is called with the progress, 0 to 1.
        cancelled: function that returns whether to stop.

    Returns:
        The number of drawn pictures.

    Raises:
        OSError: a file cannot be written.
    """
    png, write = native.part("files.png").png, native.part("files.fileio").write_bytes
    keys, samples = list(job.keys), list(job.samples)
    done, count = 0, len(keys) + len(samples)
    for key in keys:
        if cancelled():
            return done
        write(job.model.paths[key], png(draw(job.model, key)))
        done += 1
        progress(done / count)
    sitter = sample_sitter() if samples else None
    rest = portrait.places(sitter, {}) if sitter is not None else []
    for value in samples:
        if sitter is None or cancelled():
            return done
        write(sample_path(value), png(_draw_sample(sitter, rest, value)))
        done += 1
        progress(done / count)
    return done
