# SPDX-License-Identifier: MIT
"""Compares the size of an animation stored as controls and stored as joints and blend shapes.

    python tests/bench/animation_sizes.py FACE.dna [FACE.dna ...]

The animation is the demo's acting, smoothed between its keyframes: at 30 and 60 fps, and at
30 with the noise of a capture on all controls. The size of joints and blend shapes counts only
curves that change: of the three translations and three rotations of each joint, and of the blend
shape weights. Sizes are given for plain float32, and for the lossless clip format.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import risorius
from risorius.anim.clip import Clip
from risorius.base.easing import smooth_step

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "packaging" / "films"))
import acting

NOISE = 0.004


def controls_clip(names, rate):
    """The demo's acting as a clip.

    Args:
        names: names of the face's raw controls.
        rate: frames per second.
    """
    tracks, _ = acting.tracks(set(names))
    times = np.arange(round(acting.LAST_FRAME / acting.FRAME_RATE * rate)) / rate
    curves = np.zeros((len(tracks), len(times)), np.float32)
    for row, keys in zip(curves, tracks.values(), strict=True):
        frames, values = (np.array(x, float) for x in zip(*keys, strict=True))
        at = 1 + times * acting.FRAME_RATE
        right = np.clip(np.searchsorted(frames, at, side="right"), 1, len(frames) - 1)
        span = np.maximum(frames[right] - frames[right - 1], 1e-9)
        share = smooth_step((at - frames[right - 1]) / span)
        row[:] = values[right - 1] + share * (values[right] - values[right - 1])
    return Clip(list(tracks), curves, rate=rate)


def captured(clip, names, noise):
    """The clip as a capture would record it: all controls, with noise, rounded to thousandths.

    Args:
        clip: clip of raw controls.
        names: names of all raw controls.
        noise: standard deviation of the noise.
    """
    random = np.random.default_rng(7)
    curves = random.normal(0, noise, (len(names), clip.frame_count)).astype(np.float32)
    for name, curve in zip(clip.names, clip.curves, strict=True):
        curves[list(names).index(name)] += curve
    curves = np.round(np.clip(curves, 0, 1), 3).astype(np.float32)
    return Clip(list(names), curves, rate=clip.rate)


def baked_clips(rig, clip):
    """Two clips of a baked animation: changing joint curves, and changing blend shape weights.

    Args:
        rig: a risorius.Rig.
        clip: clip of raw controls.
    """
    raw, _ = clip.raw_controls(rig.raw_control_names)
    poses = [rig.evaluate(row) for row in np.ascontiguousarray(raw)]
    joints = np.array([pose.joints[:, :6].ravel() for pose in poses]).T
    shapes = np.array([pose.blend_shapes for pose in poses]).T
    out = []
    for curves in (joints, shapes):
        moving = np.flatnonzero(np.ptp(curves, axis=1) > 1e-7)
        names = [str(i) for i in moving]
        out.append(Clip(names, np.ascontiguousarray(curves[moving]), rate=clip.rate))
    return out


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("faces", nargs="+", type=Path)
    for path in parser.parse_args().faces:
        dna = risorius.load(path)
        rig = risorius.Rig(dna)
        print(f"{path.name}: {len(dna.joint_names)} joints, {len(dna.raw_control_names)} controls")
        for rate, noise in ((30, 0.0), (60, 0.0), (30, NOISE)):
            clip = controls_clip(dna.raw_control_names, rate)
            if noise:
                clip = captured(clip, dna.raw_control_names, noise)
            kinds = {"controls": [clip]}
            joints, shapes = baked_clips(rig, clip)
            kinds["joints"], kinds["joints, shapes"] = [joints], [joints, shapes]
            base = None
            for kind, clips in kinds.items():
                plain = sum(c.curves.nbytes for c in clips)
                packed = sum(len(c.to_bytes()) for c in clips)
                base = base or (plain, packed)
                count = sum(len(c.names) for c in clips)
                print(
                    f"  {rate} fps {'captured' if noise else 'keyed':9} {kind:14} {count:5} curves "
                    f"{plain / 1000:8.1f} kB {plain / base[0]:6.1f} times "
                    f"packed {packed / 1000:8.1f} kB {packed / base[1]:6.1f} times"
                )


if __name__ == "__main__":
    main()
