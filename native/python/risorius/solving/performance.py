# SPDX-License-Identifier: MIT
"""Reads moving meshes from files, and aligns them with a face."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..base import signatures
from ..base.budget import BudgetError
from ..base.errors import RisoriusError
from ..base.npz import DAMAGED, hold_arrays
from .surface import Doubles, Floats

_SCALES = 10.0 ** np.arange(-3, 4)  # scales that a difference of units explains
_FARTHEST = 1e9  # largest coordinate; squares of larger values would overflow
# Fraction of the face's size: an axis-aligned placement with a smaller error than this is used
# instead of the placement with the smallest error.
_NEAR = 0.03


class PerformanceError(RisoriusError):
    """A file with a moving mesh that cannot be used."""

    code = "performance"


class Performance(NamedTuple):
    """The vertex positions of one moving mesh in each frame."""

    frames: Floats
    """float32[F, V, 3]: positions in each frame, in the file's unit and axes, or after `fitted` in
    the face's."""
    rate: float
    """Frames per second of the file; 30 if it states none."""
    start: float
    """Time of the first frame in seconds; 0 for an .npz file."""
    neutral: Floats | None
    """float32[V, 3]: the mesh at rest; None for an Alembic file or if an .npz file has none."""
    note: str = ""
    """A note on the alignment by `fitted`, or ""."""


def read_performance(
    path: str | os.PathLike[str], name: str | None = None, counts: Mapping[int, int] | None = None
) -> Performance:
    """Reads an Alembic file (.abc), or an .npz with `vertices` [F, V, 3], and optionally `rate` and
    `neutral`.

    Args:
        path: path of the file.
        name: name of the mesh in an Alembic file; None: the first mesh that fits.
        counts: mesh of the face -> its number of vertices; a mesh of an Alembic file fits if its
            vertex count is one of these numbers. None: any mesh fits. Not used for an .npz file.

    Raises:
        PerformanceError: an unknown kind of file, a damaged file, an unknown mesh, or a coordinate
            that is not finite or above 1e9.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".abc", ".npz"):
        raise PerformanceError(f"{path}: a name ending in .abc or .npz was expected")
    fitting = None if counts is None else set(counts.values())
    kind = signatures.other_kind(signatures.ends_of(path), ("alembic", "npz", "zip"))
    if kind is not None:
        raise PerformanceError(f"{path}: vertices that move were expected, this is {kind}")
    take = _alembic(path, name, fitting) if suffix == ".abc" else _arrays(path)
    for points in (take.frames, take.neutral):
        if (
            points is not None
            and points.size
            and not -_FARTHEST < points.min() <= points.max() < _FARTHEST
        ):
            raise PerformanceError(f"{path}: finite vertices up to {_FARTHEST:g} were expected")
    return take


def _arrays(path: str | os.PathLike[str]) -> Performance:
    with open(path, "rb") as opened:
        try:
            hold_arrays(opened)
            with np.load(opened, allow_pickle=False) as file:
                values = {name: file[name] for name in file.files}
        except BudgetError as error:
            raise PerformanceError(f"{path}: {error}") from error
        except DAMAGED as error:
            raise PerformanceError(f"{path}: an .npz file was expected: {error}") from error
    frames = values.get("vertices")
    if frames is None or frames.ndim != 3 or frames.shape[2] != 3 or not len(frames):
        found = "none" if frames is None else list(frames.shape)
        raise PerformanceError(f"{path}: vertices of shape [F, V, 3] were expected, found {found}")
    neutral = values.get("neutral")
    if neutral is not None and neutral.shape != frames.shape[1:]:
        raise PerformanceError(
            f"{path}: neutral of shape {list(frames.shape[1:])} was expected, found "
            f"{list(neutral.shape)}"
        )
    for name in ("vertices", "neutral", "rate"):
        if name in values and values[name].dtype.kind not in "fiu":
            raise PerformanceError(
                f"{path}: an array {name} of numbers was expected, found {values[name].dtype}"
            )
    given = values.get("rate", np.float64(30.0))
    rate = float(given.item()) if given.size == 1 else np.nan
    if not (np.isfinite(rate) and rate > 0):
        raise PerformanceError(f"{path}: a rate above 0 was expected, found {given.tolist()}")
    # Values beyond float32 become infinite without a warning; read_performance refuses them.
    with np.errstate(over="ignore"):
        own = None if neutral is None else neutral.astype(np.float32)
        return Performance(frames.astype(np.float32), rate, 0.0, own)


def _alembic(
    path: str | os.PathLike[str], name: str | None, fitting: set[int] | None
) -> Performance:
    try:
        from alembic3d import Abc, AbcGeom  # type: ignore[import-not-found, unused-ignore]
    except ImportError as error:
        raise PerformanceError(
            f"{path}: Alembic needs the package alembic3d: pip install risorius[alembic]"
        ) from error
    if not Path(path).is_file():
        raise PerformanceError(f"{path}: there is no such file")
    try:
        archive = Abc.IArchive(os.fspath(path))
    except RuntimeError as error:
        raise PerformanceError(f"{path}: an Alembic file was expected") from error
    seen: list[str] = []
    chosen: list[Any] = []

    def visit(parent: Any) -> None:
        for number in range(parent.getNumChildren()):
            child = parent.getChild(number)
            if not AbcGeom.IPolyMesh.matches(child.getHeader()):
                visit(child)
                continue
            schema = AbcGeom.IPolyMesh(parent, child.getName()).getSchema()
            names = {child.getName(), parent.getName()}
            count = len(schema.getValue(Abc.ISampleSelector(0)).getPositions())
            seen.append(f"{parent.getName()} of {count} vertices")
            if (name is None or name in names) and (fitting is None or count in fitting):
                chosen.append(schema)

    visit(archive.getTop())
    if not chosen:
        wanted = name or " or ".join(str(count) for count in sorted(fitting or ())) + " vertices"
        found = ", ".join(seen) or "no mesh"
        raise PerformanceError(f"{path}: a mesh {wanted} was expected, found {found}")
    return _samples(path, chosen[0], Abc)


def _samples(path: str | os.PathLike[str], schema: Any, library: Any) -> Performance:
    count = schema.getNumSamples()
    rows = []
    for sample in range(count):
        value = schema.getValue(library.ISampleSelector(sample)).getPositions()
        rows.append(np.array([(p.x, p.y, p.z) for p in value], np.float32))
        if rows[-1].shape != rows[0].shape:
            raise PerformanceError(
                f"{path}: {len(rows[0])} vertices in every frame were expected, found "
                f"{len(rows[-1])} in frame {sample}"
            )
    sampling = schema.getTimeSampling()
    times = [float(sampling.getSampleTime(i)) for i in range(count)]
    rate = (count - 1) / (times[-1] - times[0]) if count > 1 and times[-1] > times[0] else 30.0
    return Performance(np.stack(rows), rate, times[0], None)


def fitted(take: Performance, positions: npt.ArrayLike) -> Performance:
    """Converts the performance to a face's unit and axes.

    Vertices correspond, so the rotation, scale and translation that bring the take's neutral mesh
    (or without one its first frame) nearest to the face can be computed. If right angles, a power
    of ten as scale and no translation fit almost as well, these are used.

    Args:
        take: performance with the face's topology.
        positions: float[V, 3], the face's vertices in the neutral pose.
    """
    own = np.asarray(positions, np.float64)
    first = np.asarray(take.frames[0] if take.neutral is None else take.neutral, np.float64)
    size = float(np.ptp(own, axis=0).max(initial=0))
    turn, scale, move = _similarity(first, own)
    even = np.zeros((3, 3))
    even[np.arange(3), np.abs(turn).argmax(axis=1)] = 1
    even *= np.sign(turn)
    near = float(_SCALES[np.abs(np.log(_SCALES) - np.log(max(scale, 1e-30))).argmin()])
    apart = float(np.sqrt((((near * first @ even.T) - own) ** 2).sum(axis=1).mean()))
    note = ""
    if abs(np.linalg.det(even)) > 0.5 and apart < _NEAR * size:
        turn, scale, move = even, near, np.zeros(3)
        if scale != 1 or not np.array_equal(even, np.eye(3)):
            note = f"{scale:g} times as large, axes turned"
    else:
        note = f"{scale:.4g} times as large, turned and moved to where it fits best"

    def brought(points: Floats) -> Floats:
        return (scale * points.astype(np.float64) @ turn.T + move).astype(np.float32)

    neutral = None if take.neutral is None else brought(take.neutral)
    return take._replace(frames=brought(take.frames), neutral=neutral, note=note)


def _similarity(source: Doubles, target: Doubles) -> tuple[Doubles, float, Doubles]:
    """The rotation, scale and translation that minimise |scale rotation source + translation -
    target| (Umeyama 1991).

    Args:
        source, target: float64[V, 3], positions of the same vertices on both meshes.
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, values, v = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ v)) or 1.0])
    turn = (u * signs) @ v
    spread = float((a**2).sum())
    scale = float((values * signs).sum()) / spread if spread > 0 else 1.0
    return turn, scale, target.mean(axis=0) - scale * turn @ source.mean(axis=0)
