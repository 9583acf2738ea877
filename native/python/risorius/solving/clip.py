# SPDX-License-Identifier: MIT
"""Finds the control curves that reproduce a moving mesh.

First each frame is solved alone, starting from the solution of an earlier frame: few controls
within their limits that bring the face nearest to the mesh. A control's value has a price, so that
noise alone does not set controls. Then the selected controls are solved with a far smaller price,
all frames together, with a price on sudden changes of speed. The noise is measured, so that curves
of a clean mesh are exact, and curves of a noisy mesh are smooth.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import NamedTuple, Unpack

import numpy as np
import numpy.typing as npt

from .._native import descend
from ..anim.clip import Clip
from ..base.errors import ArgumentError, RisoriusError
from ..base.given import MOST, checked, finite, shown, whole
from .controls import Bounds, ControlLimits, LimitFields, check_keywords, structure
from .surface import Doubles, Floats, Surface, numbers

Progress = Callable[[float], object]
_CHUNK = 24  # number of frames that are solved in sequence, starting from the frame before
_AROUND = 8  # frames before and after a chunk that are smoothed with it
_FLOOR_MM = 0.004  # mm: smallest noise that is assumed
_WORTH = 3.0  # price of a control in standard errors of its value
# A control that never differs from its initial value by more than this number is not used; if
# `sparse` is 0, every control that differs is used.
_LEAST = 0.01
# Lower and upper limit of the typical second difference of a control's curve at 30 frames per
# second; an estimate outside these limits is replaced by the nearer limit.
_SUDDEN = (0.004, 0.5)
_SOON = 0.1  # change of a control above which derivatives are recomputed
# A smaller change of all controls ends an iteration. A control that never differs from its initial
# value by more gets no curve.
_ENOUGH = 5e-4


class CancelledError(RisoriusError):
    """The solve was cancelled because progress returned False."""

    code = "cancelled"


class SolvedClip(NamedTuple):
    """The curves that reproduce a moving mesh, and the remaining errors."""

    clip: Clip
    frame_residual: Floats
    """float32[F]: root mean square distance of the vertices per frame, in the file's unit."""
    vertex_residual: dict[int, Floats]
    """Mesh -> float32[V]: root mean square distance of each vertex over all frames, in the file's
    unit."""
    largest: float
    """Largest distance of a vertex in any frame, in the file's unit."""
    noise: float
    """Measured noise of the mesh: a standard deviation in the file's unit."""


@dataclass
class _Job:
    """The input of a solve, equal for all frames, and the progress of the solve."""

    surface: Surface
    points: npt.NDArray[np.int64]  # [P, 2]: mesh and vertex of each compared point
    targets: Floats  # [F, P, 3]: target positions
    low: Doubles  # [R]: limits of the controls
    high: Doubles
    free: npt.NDArray[np.bool_]  # [R]: whether a control may change
    rest: Doubles  # [R]: initial values
    sparse: float  # price factors, see solve_clip
    smooth: float
    rate: float
    sigma: float  # expected error of a coordinate, in the file's unit
    told: Progress | None
    share: float  # fraction of the work that one frame is in one pass
    done: float = 0.0  # fraction of the work done
    stop: list[bool] = field(default_factory=list)  # not empty after a cancellation

    def tell(self) -> None:
        self.done += self.share
        if self.stop or (self.told is not None and self.told(min(1.0, self.done)) is False):
            self.stop.append(True)
            raise CancelledError("the solve was cancelled")


class _Frame:
    """Derivatives of the points' positions at a pose near a frame's pose, and the residuals."""

    def __init__(self, job: _Job) -> None:
        self._job = job
        self._probe = job.surface.probe(job.points)
        self._at: Doubles | None = None
        self.matrix = np.zeros((0, 0))

    def linearise(self, raw: Doubles, within: float) -> bool:
        """Computes derivatives at the pose `raw`, unless they exist for a pose near it.

        Returns: whether they were computed. Args: raw: float64[R]; within: largest difference of
            a control's value between two poses that count as near."""
        if self._at is not None and np.abs(raw - self._at).max() <= within:
            return False
        self._probe.linearise(raw, self._job.high, self._job.free)
        self.matrix = self._probe.normal_matrix()
        self._at = raw.copy()
        return True

    def is_at(self, raw: Doubles) -> bool:
        """Whether the derivatives were computed at exactly this pose."""
        return self._at is not None and bool((raw == self._at).all())

    def forget(self) -> None:
        """Discards the derivatives, so that the next call of linearise computes new ones."""
        self._at = None

    def missing(self, raw: Doubles, frame: int) -> Doubles:
        return np.asarray(self._job.targets[frame] - self._probe.positions(raw))

    def pull(self, missing: Doubles) -> Doubles:
        """float64[R]: J^T * missing, the effect of each control on the missing displacements."""
        return self._probe.gradient(missing)


def solve_clip(
    surface: Surface,
    frames: npt.ArrayLike | Mapping[int, npt.ArrayLike],
    *,
    rate: float,
    start: float = 0.0,
    neutral: npt.ArrayLike | Mapping[int, npt.ArrayLike] | None = None,
    sparse: float = 1.0,
    smooth: float = 1.0,
    limits: ControlLimits | None = None,
    most_points: int = 4000,
    threads: int = 0,
    progress: Progress | None = None,
    **keywords: Unpack[LimitFields],
) -> SolvedClip:
    """Finds the control curves that reproduce a moving mesh.

    Args:
        surface: surface of the face.
        frames: index in dna.meshes -> float32[F, V, 3], vertices of the moving mesh; a single array
            is the first mesh of the LOD. In the file's unit and axes, without motion of the head.
        rate: frames per second.
        start: time of the first frame in seconds.
        neutral: float[V, 3], the moving mesh with a neutral face, as a mapping like frames: its
            displacements are then used instead of its shape, for another face with the same
            topology. None: the face's own neutral.
        sparse: factor of the price of a control's value; 0 means no price, 1 is the default.
        smooth: factor of the price of a sudden change; 0 means no price, 1 is the default.
        limits: the controls that may change, and their ranges; None: all except rotation
            components, from 0 to 1.
        most_points: largest number of compared vertices; residuals cover all vertices.
        threads: number of threads, which does not influence the result; 0: all cores.
        progress: called with the fraction of the work done, 0 to 1; returning False cancels.
        keywords: fields of ControlLimits, if `limits` is None.

    Returns:
        The clip with a curve for each control that changes, and the errors.

    Raises:
        ValueError: an invalid argument; the message names it.
        CancelledError: progress returned False.
    """
    check_keywords("solve_clip", keywords, ControlLimits)
    limits = structure("limits", limits, ControlLimits, keywords)
    wanted = _meshes("frames", surface, frames, 3)
    surface.check_size(min(most_points, sum(surface.vertex_counts[m] for m in wanted)))
    count = _frame_count(wanted)
    _check_numbers(rate, start, sparse, smooth)
    checked("most_points", whole, most_points, 1, MOST)
    checked("threads", whole, threads, 0, 1024)
    moved = _moved(surface, wanted, neutral)
    rest = surface.rig.initial_raw_controls.astype(np.float64)
    bounds = limits.around(rest, _usual(surface))
    points = _points(surface, wanted, bounds, most_points)
    targets = _targets(moved, points)
    noise = _noise(targets)
    sigma, share = float(np.hypot(noise, _FLOOR_MM / surface.mm)), 1 / (3 * count)
    job = _Job(
        surface, points, targets, *bounds, rest, sparse, smooth, rate, sigma, progress, share
    )
    return _result(job, _curves(job, count, threads or os.cpu_count() or 1), moved, start, noise)


def _check_numbers(rate: float, start: float, sparse: float, smooth: float) -> None:
    checked("rate", finite, rate, 0.01, 1e6)
    checked("start", finite, start, -1e9, 1e9)
    for name, price in (("sparse", sparse), ("smooth", smooth)):
        checked(name, finite, price, 0.0, 1e9)


def _targets(moved: dict[int, Floats], points: npt.NDArray[np.int64]) -> Floats:
    """float32[F, P, 3]: target positions of the points (mesh, vertex) in `points`.

    Args:
        moved: index of a mesh -> float32[F, V, 3], its target positions.
        points: int64[P, 2], mesh and vertex of each point, sorted by mesh.
    """
    return np.concatenate(
        [moved[mesh][:, points[points[:, 0] == mesh, 1]] for mesh in sorted(moved)], axis=1
    )


def _curves(job: _Job, count: int, workers: int) -> Doubles:
    """float64[F, R]: controls of all frames, solved frame by frame, then together.

    Args:
        job: input of the solve; its expected error is raised to the remaining error.
        count: number of frames F.
        workers: number of threads.
    """
    begins = _begins(job, count)
    left = np.mean([_left(job, raw, f) for f, raw in begins.items()])
    # The remaining error counts as noise, because the motion of another face is never
    # reproduced exactly.
    job.sigma = max(job.sigma, float(np.sqrt(left)))
    return _together(job, _alone(job, count, begins, workers), workers)


def _begins(job: _Job, count: int) -> dict[int, Doubles]:
    """Index of the first frame of each chunk of _CHUNK (24) frames -> float64[R], the controls in
    this frame."""
    frame, at, out = _Frame(job), job.rest, {}
    for begin in range(0, count, _CHUNK):
        at = out[begin] = _nearest(job, frame, begin, at, 12)
        job.tell()
    return out


def _alone(job: _Job, count: int, begins: dict[int, Doubles], workers: int) -> Doubles:
    """float64[F, R]: controls of all frames, each frame solved alone.

    Args:
        job: input of the solve.
        count: number of frames F.
        begins: first frame of each chunk -> float64[R], the controls in this frame.
        workers: number of threads.
    """
    curves = np.tile(job.rest, (count, 1))

    def chunk(begin: int) -> None:
        frame, at = _Frame(job), begins[begin]
        for f in range(begin, min(begin + _CHUNK, count)):
            at = curves[f] = _nearest(job, frame, f, at, 8)
            job.tell()

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(chunk, begins))
    return curves


def _prices(job: _Job, matrix: Doubles) -> Doubles:
    """float64[R]: price per unit of each control, a multiple of the gradient from noise alone.

    Args:
        job: input of the solve.
        matrix: float64[R, R], normal matrix J^T J of the derivatives.
    """
    return job.sparse * _WORTH * np.sqrt(np.maximum(np.diag(matrix), 0)) / job.sigma


def _nearest(job: _Job, frame: _Frame, index: int, start: Doubles, rounds: int) -> Doubles:
    """float64[R]: the controls of one frame, solved alone.

    Args:
        job: input of the solve.
        frame: derivatives at a near pose; they are computed again if the pose is not near.
        index: index of the frame.
        start: float64[R], the pose where the iteration starts.
        rounds: largest number of Newton steps.
    """
    at, missing = start, frame.missing(start, index)
    scale = job.sigma**-2
    for _ in range(rounds):
        frame.linearise(at, _SOON)
        prices = _prices(job, frame.matrix)

        def worth(raw: Doubles, left: Doubles, prices: Doubles = prices) -> float:
            return float(scale / 2 * (left**2).sum() + prices @ np.abs(raw - job.rest))

        aim = scale * (frame.pull(missing) + frame.matrix @ at)
        goal = descend(scale * frame.matrix, aim, job.low, job.high, job.rest, prices, at)
        step, before = goal - at, worth(at, missing)
        for share in (1.0, 0.5, 0.2):
            left = frame.missing(at + share * step, index)
            if worth(at + share * step, left) < before:
                at, missing = at + share * step, left
                break
        else:
            if frame.is_at(at):
                break
            frame.forget()
            continue
        if np.abs(step).max() <= _ENOUGH:
            break
    return at


def _together(job: _Job, curves: Doubles, workers: int) -> Doubles:
    """float64[F, R]: controls of all frames, solved together in overlapping chunks, with a price on
    sudden changes.

    A chunk starts from the frames solved alone, so that chunks can be solved in parallel. Only
    controls that differ from their initial values by more than _LEAST in some frame solved alone
    may change; the price of a change is only job.sparse per unit of the control. Without such
    controls, `curves` is returned.

    Args:
        job: input of the solve.
        curves: float64[F, R], the frames solved alone.
        workers: number of threads.
    """
    count = len(curves)
    used = np.flatnonzero(np.abs(curves - job.rest).max(axis=0) > (_LEAST if job.sparse else 0))
    if not len(used):
        return curves
    out = np.tile(job.rest, (count, 1))
    stiff = _stiffness(job, curves, used)

    def chunk(begin: int) -> None:
        first, end = max(0, begin - _AROUND), min(count, begin + _CHUNK + _AROUND)
        frame = _Frame(job)
        near = curves[first:end, used]
        matrices: list[Doubles] = []
        aims: list[Doubles] = []
        for f in range(first, end):
            at = np.where(np.isin(np.arange(len(job.rest)), used), curves[f], job.rest)
            if frame.linearise(at, _SOON) or not matrices:
                matrix = frame.matrix[np.ix_(used, used)] / job.sigma**2
            matrices.append(matrix)
            pull = frame.pull(frame.missing(at, f))[used] / job.sigma**2
            aims.append(pull + matrix @ near[f - first])
            if begin <= f < begin + _CHUNK:
                job.tell()
        near = _smoothed(job, near.copy(), used, stiff[first : end - 2], matrices, aims)
        out[begin : begin + _CHUNK, used] = near[begin - first : begin - first + _CHUNK]

    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(chunk, range(0, count, _CHUNK)))
    return out


def _stiffness(job: _Job, curves: Doubles, used: npt.NDArray[np.intp]) -> Doubles:
    """float64[F - 2, used]: price of a sudden change of each control, at each frame.

    The price is job.smooth / d^2, where d is the typical second difference of the control's curve
    without noise. Near a frame whose own second difference is clearly above the noise, d is at
    least that local value. A blink therefore stays sharp while a slow jaw is smoothed.

    Args:
        job: input of the solve.
        curves: float64[F, R], the frames solved alone.
        used: indices of the controls that may change.
    """
    if len(curves) < 3:
        return np.zeros((0, len(used)))
    frame = _Frame(job)
    frame.linearise(np.median(curves, axis=0), 0.0)
    matrix = frame.matrix[np.ix_(used, used)]
    ridge = 1e-9 * max(float(np.trace(matrix)), 1e-30)
    noise = 6 * job.sigma**2 * np.diag(np.linalg.inv(matrix + ridge * np.eye(len(used))))
    sudden = np.diff(curves[:, used], 2, axis=0) ** 2
    plain = np.where(sudden > 9 * noise, sudden, 0)
    near = plain.copy()
    near[1:] = np.maximum(near[1:], plain[:-1])
    near[:-1] = np.maximum(near[:-1], plain[1:])
    # 0.455 is the median of a squared standard normal variable
    usual = np.median(sudden, axis=0) / 0.455 - noise
    least, most = (limit * (30.0 / job.rate) ** 2 for limit in _SUDDEN)
    return job.smooth / np.clip(np.maximum(near, usual), least**2, most**2)


def _smoothed(
    job: _Job,
    curves: Doubles,
    used: npt.NDArray[np.intp],
    stiff: Doubles,
    matrices: list[Doubles],
    aims: list[Doubles],
) -> Doubles:
    """float64[n, used]: curves after sweeps forwards and backwards through the frames, until no
    control changes by more than _ENOUGH (at most 20 sweeps).

    Args:
        job: input of the solve.
        curves: float64[n, used], values of the used controls; changed in place.
        used: indices of the used controls.
        stiff: float64[n - 2, used], prices of the squared second differences.
        matrices: per frame float64[used, used], normal matrix / job.sigma^2.
        aims: per frame float64[used], the right side of the normal equations / job.sigma^2.
    """
    count = len(curves)
    bend = np.diff(np.eye(count), 2, axis=0) if count > 2 else np.zeros((0, count))
    bends = np.einsum("ti,tc,tj->ijc", bend, stiff, bend)  # [n, n, used]
    diagonal = np.arange(len(used))
    low, high, rest = job.low[used], job.high[used], job.rest[used]
    price = np.full(len(used), job.sparse)
    for _ in range(20):
        before = curves.copy()
        for f in [*range(count), *reversed(range(count - 1))]:
            matrix = matrices[f].copy()
            matrix[diagonal, diagonal] += bends[f, f]
            pull = aims[f] - (bends[f] * curves).sum(axis=0) + bends[f, f] * curves[f]
            curves[f] = descend(matrix, pull, low, high, rest, price, curves[f])
        if np.abs(curves - before).max() < _ENOUGH:
            break
    return curves


def _result(
    job: _Job, curves: Doubles, moved: dict[int, Floats], start: float, noise: float
) -> SolvedClip:
    surface = job.surface
    frame_sum, largest, total = np.zeros(len(curves)), 0.0, 0
    by_vertex: dict[int, Floats] = {}
    for mesh, target in moved.items():
        count = surface.vertex_counts[mesh]
        probe = surface.probe(np.stack([np.full(count, mesh), np.arange(count)], axis=1))
        vertex_sum = np.zeros(count)
        for f, raw in enumerate(curves):
            square = ((target[f] - probe.positions(raw)) ** 2).sum(axis=1)
            vertex_sum += square
            frame_sum[f] += square.sum()
            largest = max(largest, float(square.max(initial=0)))
            if mesh == min(moved):
                job.tell()
        by_vertex[mesh] = np.sqrt(vertex_sum / len(curves)).astype(np.float32)
        total += count
    used = np.flatnonzero(np.abs(curves - job.rest).max(axis=0) > _ENOUGH)
    names = surface.rig.raw_control_names
    clip = Clip([names[i] for i in used], curves.T[used], job.rate, start=start)
    frame = np.sqrt(frame_sum / max(1, total)).astype(np.float32)
    return SolvedClip(clip, frame, by_vertex, float(np.sqrt(largest)), noise)


def _left(job: _Job, raw: Doubles, frame: int) -> float:
    """The mean squared residual per coordinate of a frame at the pose `raw`, in the file's unit
    squared."""
    probe = job.surface.probe(job.points)
    return float(((job.targets[frame] - probe.positions(raw)) ** 2).mean())


def _noise(targets: Floats) -> float:
    """The standard deviation of the noise of a coordinate, in the file's unit.

    Fourth differences over the frames remove most of a movement and multiply the noise by sqrt(70).
    Fewer than 5 frames give 0.

    Args:
        targets: float32[F, P, 3], positions of the points.
    """
    if len(targets) < 5:
        return 0.0
    part = targets[:, :: max(1, targets.shape[1] // 500)]
    return float(np.median(np.abs(np.diff(part, 4, axis=0))) / 0.6745 / np.sqrt(70))


def _points(
    surface: Surface, wanted: dict[int, Floats], bounds: Bounds, most: int
) -> npt.NDArray[np.int64]:
    """int64[P, 2]: mesh and vertex of the compared vertices, at most `most`.

    They are selected evenly among the vertices that at least one control moves by more than 0.1 mm
    per unit.

    Args:
        surface: surface of the face.
        wanted: index of a mesh -> its target positions; only the indices are used.
        bounds: checked limits of the controls.
        most: largest number of vertices.
    """
    if most < 1:
        raise ArgumentError(f"most_points: 1 or more was expected, found {most}")
    rest = surface.rig.initial_raw_controls
    found = []
    for mesh in sorted(wanted):
        every = np.arange(surface.vertex_counts[mesh])
        for part in np.array_split(every, len(every) // 1024 + 1):
            points = np.stack([np.full(len(part), mesh), part], axis=1)
            probe = surface.probe(points)
            probe.linearise(rest, bounds.high, bounds.free)
            moves = np.abs(probe.jacobian()).max(axis=(1, 2), initial=0) * surface.mm > 0.1
            found.append(points[moves])
    points = np.concatenate(found)
    if not len(points):
        raise ArgumentError("frames: a mesh that controls move was expected, found none")
    return points[:: -(-len(points) // most)]


def _meshes(
    name: str, surface: Surface, values: npt.ArrayLike | Mapping[int, npt.ArrayLike], axes: int
) -> dict[int, Floats]:
    if not surface.mesh_indices:
        raise ArgumentError(f"{name}: a face with meshes at LOD {surface.lod} was expected")
    given = values if isinstance(values, Mapping) else {surface.mesh_indices[0]: values}
    out = {}
    for mesh, value in given.items():
        if not isinstance(mesh, int | np.integer) or not 0 <= mesh < len(surface.vertex_counts):
            end = len(surface.vertex_counts)
            raise ArgumentError(f"{name}: meshes below {end} were expected, found {shown(mesh)}")
        is_real = isinstance(value, np.ndarray) and value.dtype.kind == "f"
        # Values beyond float32 become infinite without a warning; the check below refuses them.
        with np.errstate(over="ignore"):
            array = np.asarray(value if is_real else numbers(name, value), np.float32)
        count = surface.vertex_counts[mesh]
        if array.ndim != axes or array.shape[-2:] != (count, 3):
            shape = f"[F, {count}, 3]" if axes == 3 else f"[{count}, 3]"
            raise ArgumentError(
                f"{name}: {shape} was expected for mesh {mesh}, found {list(array.shape)}"
            )
        if not np.isfinite(array).all():
            raise ArgumentError(f"{name}: finite numbers were expected for mesh {mesh}")
        out[int(mesh)] = array
    if not out:
        raise ArgumentError(f"{name}: one mesh at least was expected, found 0")
    return out


def _frame_count(frames: dict[int, Floats]) -> int:
    counts = {len(array) for array in frames.values()}
    if len(counts) > 1 or 0 in counts:
        raise ArgumentError(
            "frames: as many frames for each mesh, and at least one, were expected, found "
            f"{sorted(counts)}"
        )
    return counts.pop()


def _moved(
    surface: Surface,
    wanted: dict[int, Floats],
    neutral: npt.ArrayLike | Mapping[int, npt.ArrayLike] | None,
) -> dict[int, Floats]:
    """Mesh -> float32[F, V, 3]: target positions for the face's own vertices.

    Args:
        surface: surface of the face.
        wanted: mesh -> float32[F, V, 3], vertices of the moving mesh.
        neutral: mesh -> float[V, 3], the moving mesh with a neutral face, whose displacements are
            then added to the face's own neutral; None: `wanted` is returned.
    """
    if neutral is None:
        return wanted
    own = _meshes("neutral", surface, neutral, 2)
    if missing := sorted(set(wanted) - set(own)):
        raise ArgumentError(
            f"neutral: positions of mesh {missing[0]} were expected, because frames contains them"
        )
    rest = surface.rig.initial_raw_controls
    return {m: frames - own[m] + surface.positions(rest, m) for m, frames in wanted.items()}


def _usual(surface: Surface) -> npt.NDArray[np.bool_]:
    """bool[R]: the raw controls that may change by default: all except components of joint
    rotations."""
    parts = {f"{stem}{part}" for stem in (".", ".q") for part in "xyzw"}
    names = surface.rig.raw_control_names
    return np.array([not any(name.endswith(part) for part in parts) for name in names], bool)
