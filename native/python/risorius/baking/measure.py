# SPDX-License-Identifier: MIT
"""Measures the effect of an animation on a face."""

from __future__ import annotations

from typing import Any

import numpy as np

import risorius

from .face import Chunk, Face, Floats, missing


class Measure:
    """Finds a clip's largest joint translation and active correctives, chunk by chunk, and the
    ranges of its curves at the end."""

    def __init__(self, clip: risorius.Clip, face: Face) -> None:
        self.clip, self.face = clip, face
        self._squared, self._joint, self._frame = -1.0, 0, 0
        first, end = face.psd_range
        self._psds = slice(first, end)
        self._fired = np.zeros(end - first, bool)

    def add(self, chunk: Chunk) -> None:
        moves = chunk.pose.joints[:, :, :3]
        squared = np.einsum("fjx,fjx->fj", moves, moves)
        if squared.size:
            largest = int(np.argmax(squared))
            if not np.isfinite(squared.flat[largest]):  # argmax treats NaN as the largest
                squared = np.nan_to_num(squared, nan=-1.0, posinf=-1.0)
                largest = int(np.argmax(squared))
            if squared.flat[largest] > self._squared:
                frame, self._joint = divmod(largest, squared.shape[1])
                self._squared, self._frame = float(squared.flat[largest]), chunk.first + frame
        self._fired |= (chunk.pose.controls[:, self._psds] != 0).any(axis=0)

    def finish(self) -> None:
        """Do nothing; part of the Sink protocol."""

    def facts(self) -> dict[str, Any]:
        """The results as plain values; docs/batch.md describes each."""
        driven = set(self.face.rig.raw_control_names)
        rows = [i for i, name in enumerate(self.clip.names) if name in driven]
        curves = self.clip.curves[rows]
        names = [self.clip.names[i] for i in rows]
        ranges = _ranges(names, curves)
        turns = self._turns()
        outside = [n for n, (a, b) in ranges.items() if (a < 0 or b > 1) and n not in turns]
        joints = self.face.names["joints"]
        return {
            "frames": self.clip.frame_count,
            "seconds": self.clip.duration,
            "largest_move": max(self._squared, 0.0) ** 0.5,
            "largest_move_joint": joints[self._joint] if self._squared > 0 else "",
            "largest_move_frame": self._frame,
            "translation_unit": self.face.translation_unit,
            "correctives": len(self._fired),
            "correctives_fired": int(self._fired.sum()),
            "control_ranges": ranges,
            "out_of_range": outside,
            "not_finite": int(curves.size - np.isfinite(curves).sum()),
            "ignored_layers": self.face.rig.ignored_layers,
            "missing_controls": missing(self.clip, self.face),
        }

    def _turns(self) -> set[str]:
        """Raw controls that are components of a quaternion, whose range is -1 to 1."""
        names = self.face.rig.raw_control_names
        rests = np.flatnonzero(self.face.rig.initial_raw_controls)
        bases = {names[i].rpartition(".")[0] for i in rests}
        return {name for name in names if name.rpartition(".")[0] in bases}


def _ranges(names: list[str], curves: Floats) -> dict[str, tuple[float, float]]:
    """Smallest and largest finite number of each curve; 0 and 0 if no number is finite."""
    finite = np.where(np.isfinite(curves), curves, np.float32(np.nan))
    low = np.nan_to_num(np.fmin.reduce(finite, axis=1))
    high = np.nan_to_num(np.fmax.reduce(finite, axis=1))
    return {n: (float(a), float(b)) for n, a, b in zip(names, low, high, strict=True)}
