# SPDX-License-Identifier: MIT
"""Where a face wants to be dragged: few vertices, where the controls reach most.

The idea of optimal handles: Jin Huat Kim and Karan Singh, "Optimizing UI Layouts for Deformable
Face-Rig Manipulation", ACM Transactions on Graphics 40 (4), 2021. Here by a greedy choice.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..base.errors import ArgumentError
from .surface import Surface


def place_handles(surface: Surface, mesh: int, count: int = 24) -> npt.NDArray[np.int64]:
    """int64[n], n at most count: vertices of a mesh that make good handles, best first.

    Args:
        surface: the face.
        mesh: an index into dna.meshes.
        count: how many at most.

    Raises:
        ValueError: a mesh that is not there, a count below 1.
    """
    if count < 1:
        raise ArgumentError(f"count: 1 or more was expected, found {count}")
    rest = surface.rig.initial_raw_controls
    places = surface.positions(rest, mesh).astype(np.float64)
    chosen: list[int] = []
    reach = np.zeros(len(places))
    for part in np.array_split(np.arange(len(places)), max(1, len(places) // 2000)):
        reach[part] = np.linalg.norm(surface.jacobian(rest, mesh, part), axis=(1, 2))
    size = float(np.ptp(places, axis=0).max(initial=0)) / 12
    near = np.full(len(places), np.inf)
    for _ in range(count):
        score = reach * np.minimum(1, near / max(size, 1e-30))
        best = int(np.argmax(score)) if len(score) else 0
        if not len(score) or score[best] <= 0:
            break
        chosen.append(best)
        near = np.minimum(near, np.linalg.norm(places - places[best], axis=1))
    return np.array(chosen, np.int64)
