# SPDX-License-Identifier: MIT
"""Generates curves of three kinds for measurements of `.rzc`, from a fixed seed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Curves = npt.NDArray[np.float32]  # [controls, frames]

SEED = 7
CONTROLS = 260
RATE = 60


def sparse(frames: int = 3600) -> Curves:
    """Hand-keyed animation sampled at 60 fps: 72 of 260 controls have keyframes, 8 to 39 frames
    apart; 80 % of the segments are Bezier with automatic handles, 12 % linear, 8 % constant. A
    quarter of the keyframes repeat the value before them. The other controls stay at 0."""
    rng = np.random.default_rng(SEED)
    curves = np.zeros((CONTROLS, frames), np.float32)
    for control in rng.choice(CONTROLS, 72, replace=False):
        at = np.cumsum(rng.integers(8, 40, frames // 8))
        at = np.concatenate([[0], at[at < frames], [frames]]).astype(np.float32)
        values = (rng.integers(0, 101, at.size) / np.float32(100)).astype(np.float32)
        rests = rng.random(at.size) < 0.25
        for i in range(1, at.size):
            if rests[i]:
                values[i] = values[i - 1]
        kinds = rng.choice(3, at.size, p=[0.8, 0.12, 0.08])
        for i in range(at.size - 1):
            time = np.arange(int(at[i]), int(at[i + 1]), dtype=np.float32)
            curves[control, int(at[i]) : int(at[i + 1])] = _segment(kinds[i], at, values, i, time)
    return curves


def _segment(kind: int, at: Curves, values: Curves, i: int, time: Curves) -> Curves:
    """Values at `time` (frames) from keyframe i to i + 1; kind 0 Bezier, 1 linear, 2 constant."""
    first, last = values[i], values[i + 1]
    if kind == 2 or first == last:
        return np.full(time.size, first, np.float32)
    part = (time - at[i]) / (at[i + 1] - at[i])
    if kind == 1:
        return first + part * (last - first)
    reach = np.float32(0.390464)  # length of automatic handles, as a fraction of the segment
    slope = [np.float32(0), np.float32(0)]
    for side, key in enumerate((i, i + 1)):  # clamped handles are horizontal at a local extremum
        if 0 < key < values.size - 1:
            before, after = values[key] - values[key - 1], values[key + 1] - values[key]
            if before * after > 0:
                slope[side] = (values[key + 1] - values[key - 1]) / (at[key + 1] - at[key - 1])
    length = (at[i + 1] - at[i]) * reach
    y1, y2 = first + slope[0] * length, last - slope[1] * length
    t = _bezier_parameter(part.astype(np.float64), float(reach)).astype(np.float32)
    c1, c2 = np.float32(3) * (y1 - first), np.float32(3) * (first - np.float32(2) * y1 + y2)
    c3 = last - first + np.float32(3) * (y1 - y2)
    return first + t * c1 + t * t * c2 + t * t * t * c3


def _bezier_parameter(x: npt.NDArray[np.float64], a: float) -> npt.NDArray[np.float64]:
    """The parameter of a Bezier segment at times x in 0..1, with handles at times a and 1 - a."""
    t = x.copy()
    b = 1.0 - a
    for _ in range(40):
        value = 3 * (1 - t) ** 2 * t * a + 3 * (1 - t) * t**2 * b + t**3 - x
        slope = 3 * (1 - t) ** 2 * a + 6 * (1 - t) * t * (b - a) + 3 * t**2 * (1 - b)
        t = np.clip(t - value / slope, 0.0, 1.0)
    return t


def capture(frames: int = 3600) -> Curves:
    """A take like those of Live Link Face: 61 columns at 60 Hz, smooth motion with noise, ten
    decimals. 52 columns are clipped to 0..1; nine columns are angles."""
    rng = np.random.default_rng(SEED + 1)
    time = np.arange(frames) / RATE
    curves = np.zeros((61, frames), np.float32)
    for control in range(61):
        motion = np.zeros(frames)
        for _ in range(12):
            hertz = 0.05 * 80 ** rng.random()
            motion += np.sin(2 * np.pi * (hertz * time + rng.random())) / (1 + hertz)
        size = 0.05 * 8 ** rng.random()
        motion *= size / np.std(motion)
        noise = size * 0.35 * rng.standard_normal(frames)
        if control < 52:
            motion = np.clip(motion + noise + size * rng.uniform(1.0, 3.0), 0.0, 1.0)
        else:
            motion = motion + noise
        curves[control] = [float(f"{value:.10f}") for value in motion]
    if not curves[60].any():
        curves[60, 0] = 0.0
    curves[[57, 60]] = 0.0  # the eyes do not roll
    return curves


def speech(frames: int = 3600) -> Curves:
    """Visemes of speech: 40 of 260 controls move, each in some of 15 sounds. Every sound rises and
    falls as a squared cosine; silence follows each phrase. Outside its sounds a control is 0."""
    rng = np.random.default_rng(SEED + 2)
    curves = np.zeros((CONTROLS, frames))
    shapes = rng.random((15, 40)) * (rng.random((15, 40)) < 0.28)
    controls = np.sort(rng.choice(CONTROLS, 40, replace=False))
    now = 0.3
    while now < frames / RATE:
        for _ in range(rng.integers(6, 25)):
            length = rng.uniform(0.05, 0.16)
            reach = length * 1.2
            first = max(int(np.ceil((now - reach) * RATE)), 0)
            times = np.arange(first, min(int((now + reach) * RATE) + 1, frames)) / RATE
            bell = np.cos(np.clip((times - now) / reach, -1.0, 1.0) * np.pi / 2) ** 2
            pose = shapes[rng.integers(15)] * rng.uniform(0.6, 1.0)
            part = curves[controls, first : first + times.size]
            curves[controls, first : first + times.size] = np.maximum(part, pose[:, None] * bell)
            now += length
        now += rng.uniform(0.4, 1.5)
    return curves.astype(np.float32)


KINDS = {"sparse": sparse, "capture": capture, "speech": speech}
