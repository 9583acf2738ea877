# SPDX-License-Identifier: MIT
"""Registers a template onto a head of any topology, by the native registration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .. import _native
from ..author.geometry.skeleton import Doubles, Ints
from ..base.errors import RisoriusError
from .surface import Surface

Progress = Callable[[float], bool | None]
Pair = tuple[int, Sequence[float]]


class RegistrationError(RisoriusError):
    """Surfaces, pairs or options cannot be used, or the target is not near the start positions."""

    code = "registration"


class StoppedError(RegistrationError):
    """The progress function of the caller returned False."""

    code = "stopped"


@dataclass(frozen=True)
class RegisterOptions:
    """Options of a registration."""

    mm: float = 10.0
    """Millimetres per unit of the template. Lengths on the target are scaled to the template's size
    before they are compared with limits in mm."""
    trusted: npt.NDArray[np.bool_] | None = None
    """bool[V]: True for vertices with a counterpart on every head. None: all vertices outside
    cavities."""
    mirrored: Ints | None = None
    """int[V]: the mirror vertex of each vertex, in the middle the vertex itself. None: no symmetry.
    """
    symmetry: float = 0.0
    """Weight of the result of one side for the mirrored side; 1: the weight of its own result."""
    nodes: int = 2000
    """Number of deformation nodes of the coarse steps."""
    noise: float = 2.0
    """Expected error of the points of pairs in mm."""
    threads: int = 0
    """Number of threads; 0: one for each core. The result does not depend on it."""


@dataclass(frozen=True)
class Registered:
    """The positions of a template's vertices on a target."""

    points: Doubles
    """float64[V, 3]: vertex positions in the unit of the target."""
    triangle: npt.NDArray[np.int32]
    """int32[V]: the nearest triangle of the target with a similar normal, or the nearest triangle
    of any direction if it is more than 0.5 mm closer. -1: none."""
    shares: Doubles
    """float64[V, 3], barycentric coordinates in the triangle."""
    distance: Doubles
    """float64[V]: distances from the target, in its unit."""
    trusted: npt.NDArray[np.bool_]
    """bool[V]: True for vertices with a counterpart on the target; others follow their neighbours.
    """


def register(
    template: Surface,
    target: Surface,
    pairs: Sequence[Pair] = (),
    options: RegisterOptions | None = None,
    start: Doubles | None = None,
    progress: Progress | None = None,
) -> Registered:
    """Register a template onto a target; 26,000 vertices take about a minute.

    Args:
        template: the skin of a head, without eyes and teeth.
        target: a head of any topology; it may have hair, a collar, holes and a body.
        pairs: vertices of the template and their points on the target.
        options: options of the registration; None: the defaults.
        start: float64[V, 3], the template's vertices near the target; None: computed from the
            pairs, of which at least three must not lie on a line.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        RegistrationError: a value is not finite, there are too few or too many triangles, pairs or
            options cannot be used, or no surface of the target is near the start.
        StoppedError: `progress` returned False.
    """
    chosen = options or RegisterOptions()
    ended = False

    def tell(done: float) -> bool:
        nonlocal ended
        ended = progress is not None and progress(done) is False
        return not ended

    try:
        found = _native.register_surface(
            template.points,
            _corners(template),
            target.points,
            _corners(target),
            np.array([vertex for vertex, _ in pairs], np.int32),
            np.array([point for _, point in pairs], np.float64).reshape(-1, 3),
            np.ones(len(pairs)),
            start,
            _settings(chosen),
            tell,
        )
    except ValueError as error:
        raise (StoppedError if ended else RegistrationError)(str(error)) from None
    return Registered(*found)


def _corners(surface: Surface) -> npt.NDArray[np.int32]:
    """int32[T, 3]: corners of the triangles; an invalid index becomes -1, which the native code
    refuses."""
    corners = np.asarray(surface.triangles).reshape(-1, 3)
    known = (corners >= 0) & (corners < len(surface.points))
    return np.where(known, corners, -1).astype(np.int32)


def _settings(options: RegisterOptions) -> _native.RegisterOptions:
    trusted, mirrored = options.trusted, options.mirrored
    return _native.RegisterOptions(
        mm=options.mm,
        trusted=[] if trusted is None else np.asarray(trusted, bool).astype(np.uint8).tolist(),
        mirrored=[] if mirrored is None else np.asarray(mirrored, np.int64).tolist(),
        symmetry=options.symmetry,
        nodes=options.nodes,
        noise=options.noise,
        threads=options.threads,
    )
