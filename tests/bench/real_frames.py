# SPDX-License-Identifier: MIT
"""Makes frames of speech and acting for the benchmarks, on the controls of a face.

    python tests/bench/real_frames.py FACE.dna VOICE.wav --text TEXT --out FOLDER

Writes frames.npz for `risorius bench FACE.dna --frames`, and a clip of each kind for Blender:
`active_20` (speech.rzc) is speech from the voice; `active_60` (acted.rzc) adds the demo's acting, a
smile and idle movement; `active_260` (captured.rzc) also adds the noise of a capture to every
control. The same controls are active together as in the acting of a face, unlike in random frames.
All clips have 60 frames a second. Prints the number of controls that are not 0.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import animation_sizes
import numpy as np
import risorius
from risorius.anim.clip import Clip
from risorius.anim.mixer import Layer, Mixer
from risorius.speech import animate, listen

RATE = 60
NAMES = {"active_20": "speech", "active_60": "acted", "active_260": "captured"}


def clips_of(names, voice, text):
    """Name of the frames, such as active_20 -> clip, for the three kinds of clips.

    Args:
        names: names of the face's raw controls.
        voice: a WAV file.
        text: transcript of the voice.
    """
    speech = animate(listen(voice, text), rate=RATE)
    last = (speech.frame_count - 1) / RATE
    acting = animation_sizes.controls_clip(names, RATE)
    layers = [
        Layer(risorius.idle(seed=1, duration=last + 1, rate=RATE)),
        Layer(acting, blend="additive", repeat=last / acting.duration + 1, weight=0.6),
        Layer(speech, blend="max"),
        Layer("joy", blend="additive", weight=([0, last / 3, last], [0.2, 0.7, 0.2])),
    ]
    acted = Mixer(names, layers, exclusives="default").bake(0, last, RATE)
    captured = animation_sizes.captured(acted, names, animation_sizes.NOISE)
    return dict(zip(NAMES, (speech, acted, captured), strict=True))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("face", type=Path)
    parser.add_argument("voice", type=Path)
    parser.add_argument("--text", required=True)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    names = list(risorius.load(args.face, layers="definition").raw_control_names)
    clips = clips_of(names, args.voice, args.text)
    args.out.mkdir(parents=True, exist_ok=True)
    frames = {}
    for name, clip in clips.items():
        raw, _ = clip.raw_controls(names)
        frames[name] = np.ascontiguousarray(raw)
        moving = np.flatnonzero(raw.any(axis=0))
        kept = Clip([names[i] for i in moving], np.ascontiguousarray(raw[:, moving].T), rate=RATE)
        (args.out / f"{NAMES[name]}.rzc").write_bytes(kept.to_bytes())
        active = (raw != 0).sum(axis=1)
        print(
            f"{NAMES[name]:9} {len(raw):5} frames, {active.mean():6.1f} of {len(names)} controls "
            f"not 0 in the mean, {active.max()} at most, {len(moving)} at some time"
        )
    np.savez_compressed(args.out / "frames.npz", **frames)


if __name__ == "__main__":
    main()
