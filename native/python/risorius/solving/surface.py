# SPDX-License-Identifier: MIT
"""Computes positions of a face's vertices from its raw controls, and their derivatives."""

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
MM = {"cm": 10.0, "m": 1000.0}  # millimetres per unit
_LOOKED_AT = 2000  # number of vertices that is enough to find a control's largest displacement


class Surface:
    """The meshes of a face, as the evaluated rig moves them.

    Positions are in the file's unit and axes, and relative to the head: rotations of neck and head
    by bones are not included.

    Attributes:
        rig: rig of the face.
        lod: the level of detail that is evaluated.
        mesh_indices: the meshes of that LOD, as indices into dna.meshes.
        vertex_counts: vertex count of each mesh of the file.
        mm: millimetres per unit of the file.
        side, up: index of the axis from left to right, and of the vertical axis.
        front: float64[3], unit vector from the face to the front.
    """

    def __init__(self, dna: Dna, rig: Rig, lod: int = 0) -> None:
        """Copies the needed parts of a face.

        Args:
            dna: the face with its geometry.
            rig: compiled from it, with rotations as Euler angles.
            lod: number of the LOD, from 0.

        Raises:
            DnaError: inconsistent lists, or a rig that does not fit the file.
            ValueError: an unknown LOD.
        """
        _below("lod: a LOD", lod, max(1, rig.lod_count))
        self._skins = Skins(dna, rig, lod)
        self.rig, self.lod = rig, lod
        self.vertex_counts = [len(mesh.positions) for mesh in dna.meshes]
        mapping = dna.lod_mesh_mapping
        listed = mapping[lod].tolist() if lod < len(mapping) else []
        # A file may list meshes whose geometry it lacks.
        self.mesh_indices = [m for m in listed if m < len(self.vertex_counts)]
        self._size = dna.size_in_bytes()
        self.mm = MM.get(dna.translation_unit, 10.0)
        self._moved: Doubles | None = None
        self._look_at_axes(dna.coordinate_system)

    def _look_at_axes(self, directions: Sequence[str]) -> None:
        """Sets side, up and front from the names of the file's axes."""
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
        """float32[V, 3]: positions of vertices at a pose.

        Args:
            raw: float[R], values of the raw controls.
            mesh: index in dna.meshes.
            vertices: int[V], indices of vertices; None: all.

        Raises:
            ValueError: an index out of range, a value that is not a number.
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
        """float32[V, 3, R]: derivatives of vertex positions by each control at a pose.

        The derivatives are differences of evaluated poses, so that correctives, solvers and
        networks are included; controls at their upper limit are decreased.

        Args:
            raw: float[R], the pose.
            mesh: index in dna.meshes.
            vertices: int[V], indices of vertices.
            lowest, highest: float[R] or one number, limits of the controls; None: 0 and 1.

        Raises:
            ValueError: an index out of range, a value that is not a number.
        """
        at = self.controls(raw)
        _, high = limits(len(at), lowest, highest)
        points = self._points(mesh, vertices)
        self.check_size(len(points))
        probe = self.probe(points)
        probe.linearise(at, high, np.ones(len(at), bool))
        return probe.jacobian()

    def strongest(self) -> Doubles:
        """float64[R]: largest displacement of a vertex from the pose with all controls at 0, per
        unit of each control, in the file's unit.

        The displacements are measured once, for about two thousand vertices spread evenly over the
        meshes of the LOD.
        """
        return self._far().max(axis=0, initial=0.0)

    def spread(self) -> Doubles:
        """float64[R]: root mean square displacement of the vertices that strongest() measures, per
        unit of each control, in the file's unit."""
        far = self._far()
        return np.asarray(np.sqrt(np.square(far).sum(axis=0) / max(1, len(far))))

    def _far(self) -> Doubles:
        """float64[V, R]: displacement of each of about two thousand vertices per unit of each
        control, in the file's unit."""
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
        """A Probe, which evaluates the given points repeatedly.

        Args:
            points: int64[P, 2], (mesh, vertex) of each point.

        Raises:
            ValueError: an index out of range.
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
        """Checks the memory for derivatives of points by all controls, and for their products.

        Args:
            points: number of points.

        Raises:
            BudgetError: the derivatives by all controls need far more memory than the face.
        """
        count = self.control_count
        place = f"what {count:,} raw controls do to {points:,} points"
        Budget.of(self._size).hold(12 * points * count + 8 * count**2, place)

    def controls(self, raw: npt.ArrayLike) -> Floats:
        """Checks raw controls, and returns them as float32[R].

        Raises:
            ValueError: a wrong shape, a value that is not a number.
        """
        return vector("raw", raw, self.control_count).astype(np.float32)

    @property
    def control_count(self) -> int:
        """Number of raw controls R."""
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
    """Converts an argument to float64[...].

    Args:
        name: name of the argument.
        values: numbers of any shape.

    Raises:
        ValueError: not numbers, not finite, or beyond float32.
    """
    try:
        out = np.asarray(values, np.float64)
    # NumPy raises each of these errors for arguments that are no numbers
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(f"{name}: numbers were expected") from None
    if not (np.abs(out) <= LARGEST).all():
        raise ArgumentError(f"{name}: finite numbers were expected")
    return out


def wholes(name: str, values: npt.ArrayLike) -> npt.NDArray[np.int64]:
    """Converts an argument to int64[...].

    Args:
        name: name of the argument.
        values: integers of any shape.

    Raises:
        ValueError: not integers, or too large.
    """
    if isinstance(values, np.ndarray) and values.dtype.kind in "iu" and values.dtype != np.uint64:
        return values.astype(np.int64, copy=False)
    out = numbers(name, values)
    if not (np.abs(out) <= MOST).all() or (out != np.round(out)).any():
        raise ArgumentError(f"{name}: whole numbers were expected")
    return out.astype(np.int64)


def vector(name: str, values: npt.ArrayLike, count: int) -> Doubles:
    """Converts an argument to float64[count].

    Args:
        name: name of the argument.
        values: one number for all elements, or count numbers.
        count: number of elements.

    Raises:
        ValueError: a wrong shape, or a value that is not a finite number.
    """
    out = numbers(name, values)
    if out.shape not in ((), (count,)):
        raise ArgumentError(
            f"{name}: {count} numbers were expected, found the shape {list(out.shape)}"
        )
    return np.array(np.broadcast_to(out, (count,)))


def limits(
    count: int, lowest: npt.ArrayLike | None, highest: npt.ArrayLike | None
) -> tuple[Doubles, Doubles]:
    """Checks ranges of controls, and returns lowest and highest as float64[R].

    Args:
        count: number of controls R.
        lowest: float[R] or one number; None: 0.
        highest: float[R] or one number; None: 1.

    Raises:
        ValueError: a wrong shape, not a number, a lowest above its highest.
    """
    low = vector("lowest", 0.0 if lowest is None else lowest, count)
    high = vector("highest", 1.0 if highest is None else highest, count)
    if (low > high).any():
        at = int(np.argmax(low > high))
        raise ArgumentError(
            f"lowest[{at}]: at most highest[{at}] {high[at]:g} was expected, found {low[at]:g}"
        )
    return low, high
