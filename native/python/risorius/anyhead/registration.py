# SPDX-License-Identifier: MIT
"""A template laid onto a head of any topology; the native registration and its options."""

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
    """Surfaces, pairs or options that cannot be used, or nothing of the target near the start."""

    code = "registration"


class StoppedError(RegistrationError):
    """Progress said that the work shall end."""

    code = "stopped"


@dataclass(frozen=True)
class RegisterOptions:
    """How a registration is made."""

    mm: float = 10.0
    """Millimetres of one unit of the template. The target is measured as if it were as large."""
    trusted: npt.NDArray[np.bool_] | None = None
    """bool[V]: the vertex has a counterpart on a whole head. None: each that is in no cavity."""
    mirrored: Ints | None = None
    """int[V], the vertex of the other side, itself in the middle. None: no symmetry."""
    symmetry: float = 0.0
    """How much what one side finds counts for the other; 1: as much as what that finds itself."""
    nodes: int = 2000
    """Of the coarse steps."""
    noise: float = 2.0
    """Millimetres by which points of pairs may be wrong."""
    threads: int = 0
    """0: one for each core. The result does not depend on it."""


@dataclass(frozen=True)
class Registered:
    """Where the vertices of a template lie on a target."""

    points: Doubles
    """float64[V, 3] in the unit of the target."""
    triangle: npt.NDArray[np.int32]
    """int32[V], of the target: the nearest one that looks the same way. -1: none."""
    shares: Doubles
    """float64[V, 3], barycentric coordinates in the triangle."""
    distance: Doubles
    """float64[V] from the target, in its unit."""
    trusted: npt.NDArray[np.bool_]
    """bool[V]: the target has this vertex; others were carried along."""


def register(
    template: Surface,
    target: Surface,
    pairs: Sequence[Pair] = (),
    options: RegisterOptions | None = None,
    start: Doubles | None = None,
    progress: Progress | None = None,
) -> Registered:
    """Lay a template onto a target, in about a minute for 26,000 vertices.

    Args:
        template: of one head, without eyes and teeth.
        target: a head of any topology; hair, a collar, holes and a body may be there.
        pairs: vertices of the template with the points of the target that they belong to.
        options: how.
        start: float64[V, 3], the template brought near the target; None: what the pairs tell, at
            least three that lie on no line.
        progress: told the share that is done; False stops the work.

    Raises:
        RegistrationError: a value that is not finite, too few or too many triangles, pairs or
            options that cannot be used, nothing of the target near the start.
        StoppedError: progress said False.
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
    """Corners as the native code takes them: what is no vertex becomes -1, which it refuses."""
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
