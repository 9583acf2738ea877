# SPDX-License-Identifier: MIT
"""Vertices of a face as a function of its raw controls, and what each control does to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .._native import Dna, Probe, Rig, Skins
from ..base.budget import Budget
from ..base.errors import ArgumentError
from ..base.given import LARGEST, MOST, shown

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
MM = {"cm": 10.0, "m": 1000.0}
_LOOKED_AT = 2000  # about so many vertices tell what a control moves most


class Surface:
    """The meshes of a face, skinned and shaped as the evaluated rig says.

    Positions are in the file's units and axes. What turns the neck or the head outside of the
    face's own controls takes no part: it is the head's own space.

    Attributes:
        rig: the compiled face.
        lod: the level of detail that is evaluated.
        mesh_indices: the meshes of that LOD, indices into dna.meshes.
        vertex_counts: of each mesh of the file.
        mm: millimetres of the file's unit.
        side, up: which axis goes from side to side, and which up or down.
        front: float64[3], the direction in which the face looks.
    """

    def __init__(self, dna: Dna, rig: Rig, lod: int = 0) -> None:
        """Take a copy of what is needed of a face.

        Args:
            dna: the file, with its geometry.
            rig: compiled from it, with Euler angles as rotation.
            lod: from 0, below the number of LODs.

        Raises:
            DnaError: lists that do not fit each other, a rig that does not fit the file.
            ValueError: a LOD that is not there.
        """
        _below("lod: a LOD", lod, max(1, rig.lod_count))
        self._skins = Skins(dna, rig, lod)
        self.rig, self.lod = rig, lod
        self.vertex_counts = [len(mesh.positions) for mesh in dna.meshes]
        mapping = dna.lod_mesh_mapping
        listed = mapping[lod].tolist() if lod < len(mapping) else []
        # A file may name meshes and not hold them.
        self.mesh_indices = [m for m in listed if m < len(self.vertex_counts)]
        self._size = dna.size_in_bytes()
        self.mm = MM.get(dna.translation_unit, 10.0)
        self._moved: Doubles | None = None
        self._look_at_axes(dna.coordinate_system)

    def _look_at_axes(self, directions: Sequence[str]) -> None:
        """What the file's axes are: left and right, up, and float64[3] to the front."""
        kinds = {"left": 0, "right": 0, "up": 1, "down": 1, "front": 2, "back": 2}
        axes = [kinds.get(name, -1) for name in directions]
        if sorted(axes) != [0, 1, 2]:
            axes, directions = [0, 1, 2], ("left", "up", "front")
        self.side, self.up = axes.index(0), axes.index(1)
        self.front = np.zeros(3)
        self.front[axes.index(2)] = 1.0 if directions[axes.index(2)] == "front" else -1.0

    def positions(
        self, raw: npt.ArrayLike, mesh: int, vertices: npt.ArrayLike | None = None
    ) -> Floats:
        """Where raw controls bring vertices: float32[V, 3].

        Args:
            raw: float[R].
            mesh: an index into dna.meshes.
            vertices: int[V]; None is all.

        Raises:
            ValueError: an index that is out of range, a value that is no number.
        """
        at = self.controls(raw)
        probe = self.probe(self._points(mesh, vertices))
        return probe.positions(at).astype(np.float32)

    def jacobian(
        self,
        raw: npt.ArrayLike,
        mesh: int,
        vertices: npt.ArrayLike,
        lowest: npt.ArrayLike | None = None,
        highest: npt.ArrayLike | None = None,
    ) -> Floats:
        """What each control does to vertices at a pose, per unit of it: float32[V, 3, R].

        By differences of the evaluated rig, so correctives, solvers and networks count; to the side
        that the limits leave.

        Args:
            raw: float[R], the pose.
            mesh: an index into dna.meshes.
            vertices: int[V].
            lowest, highest: float[R] or one number; None is 0 and 1.

        Raises:
            ValueError: an index that is out of range, a value that is no number.
        """
        at = self.controls(raw)
        _, high = limits(len(at), lowest, highest)
        points = self._points(mesh, vertices)
        self.check_size(len(points))
        probe = self.probe(points)
        probe.linearise(at, high, np.ones(len(at), bool))
        return probe.jacobian()

    def strongest(self) -> Doubles:
        """How far each control moves what it moves most, per unit of it from rest: float64[R].

        Of some thousand vertices, spread evenly over the meshes of the level; found once.
        """
        return self._far().max(axis=0, initial=0.0)

    def spread(self) -> Doubles:
        """Root of the mean square of how far each control moves those vertices: float64[R]."""
        far = self._far()
        return np.asarray(np.sqrt(np.square(far).sum(axis=0) / max(1, len(far))))

    def _far(self) -> Doubles:
        """float64[V, R]: how far each control moves some thousand vertices."""
        if self._moved is None:
            count = self.control_count
            every = max(1, sum(self.vertex_counts[m] for m in self.mesh_indices) // _LOOKED_AT)
            rows = [
                (m, v) for m in self.mesh_indices for v in range(0, self.vertex_counts[m], every)
            ]
            self.check_size(len(rows))
            probe = self.probe(np.asarray(rows, np.int64).reshape(len(rows), 2))
            probe.linearise(np.zeros(count), np.ones(count), np.ones(count, bool))
            self._moved = np.linalg.norm(probe.jacobian(), axis=1).astype(np.float64)
        return self._moved

    def probe(self, points: npt.NDArray[np.int64]) -> Probe:
        """Points of the surface that can be asked often.

        Args:
            points: int64[P, 2], mesh and vertex.

        Raises:
            ValueError: an index that is out of range.
        """
        counts = np.array([*self.vertex_counts, 0])
        mesh, vertex = points.T
        known = (mesh >= 0) & (mesh < len(self.vertex_counts))
        good = known & (vertex >= 0) & (vertex < counts[np.where(known, mesh, -1)])
        if not good.all():
            at = int(np.argmin(good))
            _below(f"points[{at}]: a mesh", int(mesh[at]), len(self.vertex_counts))
            _below(f"points[{at}]: a vertex", int(vertex[at]), self.vertex_counts[mesh[at]])
        return Probe(self._skins, points.astype(np.uint32))

    def check_size(self, points: int) -> None:
        """Before derivatives of some points by all controls are held, and their products.

        Args:
            points: how many.

        Raises:
            BudgetError: that is far more than the face, as of one with very many raw controls.
        """
        count = self.control_count
        place = f"what {count:,} raw controls do to {points:,} points"
        Budget.of(self._size).hold(12 * points * count + 8 * count**2, place)

    def controls(self, raw: npt.ArrayLike) -> Floats:
        """float32[R] of what a caller gave.

        Raises:
            ValueError: another shape, a value that is no number.
        """
        return vector("raw", raw, self.control_count).astype(np.float32)

    @property
    def control_count(self) -> int:
        """R, the raw controls."""
        return len(self.rig.initial_raw_controls)

    def _points(self, mesh: int, vertices: npt.ArrayLike | None) -> npt.NDArray[np.int64]:
        _below("mesh: an index", mesh, len(self.vertex_counts))
        each = np.arange(self.vertex_counts[mesh]) if vertices is None else vertices
        rows = wholes("vertices", each)
        if rows.ndim != 1:
            raise ArgumentError("vertices: a list of whole numbers was expected")
        return np.stack([np.full(len(rows), mesh, np.int64), rows], axis=1)


def _below(what: str, found: object, end: int) -> None:
    if not isinstance(found, int | np.integer) or not 0 <= found < end:
        raise ArgumentError(f"{what} below {end} was expected, found {shown(found)}")


def numbers(name: str, values: npt.ArrayLike) -> Doubles:
    """float64[...] of what a caller gave.

    Args:
        name: of the argument.
        values: numbers of any shape.

    Raises:
        ValueError: no numbers, or some that a float32 does not hold.
    """
    try:
        out = np.asarray(values, np.float64)
    except (TypeError, ValueError, OverflowError):  # NumPy raises each of them
        raise ArgumentError(f"{name}: numbers were expected") from None
    if not (np.abs(out) <= LARGEST).all():
        raise ArgumentError(f"{name}: finite numbers were expected")
    return out


def wholes(name: str, values: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """int64[...] of what a caller gave.

    Args:
        name: of the argument.
        values: whole numbers of any shape.

    Raises:
        ValueError: no whole numbers, or larger ones.
    """
    if isinstance(values, np.ndarray) and values.dtype.kind in "iu" and values.dtype != np.uint64:
        return values.astype(np.int64, copy=False)
    out = numbers(name, values)
    if not (np.abs(out) <= MOST).all() or (out != np.round(out)).any():
        raise ArgumentError(f"{name}: whole numbers were expected")
    return out.astype(np.int64)


def vector(name: str, values: npt.ArrayLike, count: int) -> Doubles:
    """float64[count] of what a caller gave.

    Args:
        name: of the argument.
        values: one number for all, or one for each.
        count: how many there must be.

    Raises:
        ValueError: another shape, a value that is no number.
    """
    out = numbers(name, values)
    if out.shape not in ((), (count,)):
        raise ArgumentError(f"{name}: {count} numbers were expected, found {list(out.shape)}")
    return np.array(np.broadcast_to(out, (count,)))


def limits(
    count: int, lowest: npt.ArrayLike | None, highest: npt.ArrayLike | None
) -> tuple[Doubles, Doubles]:
    """float64[R] twice: between which values each control may be.

    Args:
        count: R.
        lowest: float[R] or one number; None is 0.
        highest: float[R] or one number; None is 1.

    Raises:
        ValueError: another shape, no number, a lowest above its highest.
    """
    low = vector("lowest", 0.0 if lowest is None else lowest, count)
    high = vector("highest", 1.0 if highest is None else highest, count)
    if (low > high).any():
        at = int(np.argmax(low > high))
        raise ArgumentError(
            f"lowest[{at}]: at most highest[{at}] {high[at]:g} was expected, found {low[at]:g}"
        )
    return low, high
