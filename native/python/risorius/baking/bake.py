# SPDX-License-Identifier: MIT
"""Evaluates a clip on a character and writes the poses to files."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import risorius

from ..files.fileio import replacing
from .face import PARTS, Chunk, Face, played
from .measure import Measure
from .writing import CsvWriter, NpzWriter, about, find_moving

KINDS = ("npz", "csv", "rzc")
DEFAULT_PARTS = PARTS[:3]


class Sink(Protocol):
    """Receives the evaluated frames of a clip, chunk by chunk in order of time."""

    def add(self, chunk: Chunk) -> None: ...
    def finish(self) -> None: ...


def bake(
    clip: risorius.Clip,
    face: Face,
    lod: int,
    outputs: dict[str, Path],
    *,
    parts: Sequence[str] = DEFAULT_PARTS,
    compress: bool = False,
    threads: int = 1,
    progress: Callable[[int], None] = lambda frame: None,
) -> dict[str, Any]:
    """Evaluate every frame in bounded memory, and write the requested files atomically.

    Args:
        clip: clip that is already resampled and cut, a result of `prepared`.
        face: the character, from `load_face`.
        lod: the LOD, from 0.
        outputs: "npz", "csv" or "rzc" (the clip itself) -> path; empty to write no file.
            Temporary files of killed processes in these folders are not deleted.
        parts: parts of the pose to write: some of "joints", "shapes", "maps" and "controls".
        compress: True: the .npz is smaller, but writing it takes several times longer.
        threads: number of threads; 0: all cores.
        progress: called with the number of finished frames.

    Returns:
        The facts of Measure, such as the largest joint translation, and "evaluation_seconds", the
        time inside the evaluator. For a .csv all frames are evaluated twice; the time of the first
        evaluation does not count.

    Raises:
        ValueError: the character lacks this LOD.
        OSError: a file cannot be written.
    """
    face.check_lod(lod)
    measure = Measure(clip, face)
    evaluation = 0.0
    with contextlib.ExitStack() as stack:
        sinks: list[Sink] = [measure]
        for kind, path in outputs.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            file = stack.enter_context(replacing(path, sweep=False))
            if kind == "npz":
                npz = NpzWriter(file, about(clip, face, lod, parts), face, parts, compress)
                sinks.append(stack.enter_context(npz))
            elif kind == "csv":
                moving = find_moving(face, played(clip, face, lod, threads), parts)
                sinks.append(CsvWriter(file, face, clip.frame_times(), moving))
            else:
                file.write(clip.to_bytes())
        chunks = played(clip, face, lod, threads)
        while True:
            started = time.perf_counter()
            chunk = next(chunks, None)
            evaluation += time.perf_counter() - started
            if chunk is None:
                break
            for sink in sinks:
                sink.add(chunk)
            progress(chunk.first + len(chunk.pose.joints))
        for sink in sinks:
            sink.finish()
    return measure.facts() | {"evaluation_seconds": evaluation}
