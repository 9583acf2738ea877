# SPDX-License-Identifier: MIT
"""Measures errors between a lighter face and its source, and the speed of a face."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from .. import Dna, Rig
from .._native import Probe, Skins
from ..author.geometry.skeleton import Doubles
from ..author.work import listed_meshes
from .poses import Pose

_ACTIVE = 60  # number of active controls in a timed pose, typical of captures
_TIMED = 400  # evaluations of which the median is taken

Told = Callable[[float], None]


class Vertices:
    """All vertices of a LOD, posed by the evaluator.

    Attributes:
        meshes: indices of the LOD's meshes.
        counts: number of vertices of each of these meshes.
        count: number of all these vertices.
    """

    def __init__(self, dna: Dna, rig: Rig, lod: int) -> None:
        """Args:
        dna: the face.
        rig: compiled from it.
        lod: number of the LOD.
        """
        self.meshes = [m for m in listed_meshes(dna, lod) if m < len(dna.meshes)]
        self.counts = [len(dna.meshes[m].positions) for m in self.meshes]
        pairs = [
            np.stack([np.full(n, m), np.arange(n)], axis=1)
            for m, n in zip(self.meshes, self.counts, strict=True)
        ]
        points = np.concatenate([*pairs, np.zeros((0, 2), np.int64)])
        self.count = len(points)
        self._skins = Skins(dna, rig, lod)
        self._probe = Probe(self._skins, points.astype(np.uint32))

    def at(self, raw: npt.NDArray[np.float32]) -> Doubles:
        """float64[V, 3]: positions at these raw controls, in the file's unit."""
        return np.asarray(self._probe.positions(raw))


def errors(
    before: Dna, after: Dna, rigs: tuple[Rig, Rig], poses: Sequence[Pose], told: Told
) -> tuple[Doubles, Doubles]:
    """The largest and the root mean square distance between the vertices of two faces, each
    float64[poses, LODs], in the file's unit; 0 for a LOD without vertices.

    Args:
        before: one face.
        after: the other face, with the same LODs and meshes.
        rigs: rigs compiled from the two faces.
        poses: poses of both faces.
        told: called with the fraction of the work done, 0 to 1.
    """
    levels = max(1, before.lod_count)
    largest, square = np.zeros((2, len(poses), levels))
    for lod in range(levels):
        old, new = (Vertices(d, r, lod) for d, r in zip((before, after), rigs, strict=True))
        if not old.count:
            continue
        for at, pose in enumerate(poses):
            way = ((old.at(pose.raw) - new.at(pose.raw)) ** 2).sum(axis=1)
            largest[at, lod], square[at, lod] = np.sqrt(way.max()), np.sqrt(way.mean())
            if at % 32 == 0:
                told((lod + at / len(poses)) / levels)
    return largest, square


def microseconds(rig: Rig) -> float:
    """Median duration in microseconds of one evaluation at LOD 0, with sixty active controls, or
    with all controls if there are fewer.

    Args:
        rig: the rig to time.
    """
    rng = np.random.default_rng(0)
    raw = rig.initial_raw_controls
    times = []
    for _ in range(_TIMED):
        posed = raw.copy()
        moving = rng.choice(len(raw), min(_ACTIVE, len(raw)), replace=False)
        posed[moving] = rng.random(len(moving))
        begin = time.perf_counter()
        rig.evaluate(posed)
        times.append(time.perf_counter() - begin)
    return 1e6 * float(np.median(times))
