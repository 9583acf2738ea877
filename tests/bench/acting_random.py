# SPDX-License-Identifier: MIT
"""Makes frames of random acting from a seed. Some are usual, others unusual.

A third of the frames are one or two expressions. A third are speech (of a clip, or blended visemes)
under an expression. A third are two random controls. Half of all frames get a gaze, and a third get
a blink. The rules of risorius.Mixer resolve controls that exclude each other, so all remaining
combinations are allowed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from risorius import expressions
from risorius.anim.mixer import Mixer

Pose = npt.NDArray[np.float32]

PREFIX = "CTRL_expressions."
KINDS = ("expression", "speech", "pair")
_LOOKS = (("eyeLookLeft", "eyeLookRight"), ("eyeLookUp", "eyeLookDown"))


@dataclass(frozen=True)
class Acting:
    """Frames of random acting: float32[frames, controls], and a description of each frame."""

    raw: Pose
    words: list[str]


def random_acting(names: Sequence[str], seed: int, frames: int, clip: Any = None) -> Acting:
    """Make random frames.

    Args:
        names: Rig.raw_control_names.
        seed: seed of the random numbers.
        frames: number of frames.
        clip: a risorius Clip of speech, or None.
    """
    actor = _Actor(names, seed, clip)
    found = [actor.frame() for _ in range(frames)]
    raw = np.array([pose for pose, _ in found], np.float32).reshape(frames, len(names))
    mixer = Mixer(names, exclusives="default")
    mixed = mixer.evaluate_batch(np.zeros(frames), raw.clip(0.0, 1.0))
    return Acting(mixed, [text for _, text in found])


class _Actor:
    """Draws random poses, which are values of a rig's controls. Each call of frame() draws one."""

    def __init__(self, names: Sequence[str], seed: int, clip: Any) -> None:
        self._random = np.random.default_rng(seed)
        self._names = list(names)
        self._where = {name: i for i, name in enumerate(names)}
        own = {n: e for n, e in expressions.load().items() if e.weights}
        self._poses = {n: expressions.pose_vector(e, self._names) for n, e in own.items()}
        self._faces = [n for n, e in own.items() if e.group != "viseme"]
        self._visemes = [n for n, e in own.items() if e.group == "viseme"]
        self._spoken = None if clip is None else self._of_clip(clip)

    def _of_clip(self, clip: Any) -> Pose:
        out = np.zeros((clip.curves.shape[1], len(self._names)), np.float32)
        for name, curve in zip(clip.names, clip.curves, strict=True):
            if name in self._where:
                out[:, self._where[name]] = curve
        return out

    def frame(self) -> tuple[Pose, str]:
        """A random pose and its description."""
        kind = KINDS[int(self._random.integers(len(KINDS)))]
        pose, text = getattr(self, f"_{kind}")()
        return self._looks(pose, text)

    def _pair(self) -> tuple[Pose, str]:
        pose = np.zeros(len(self._names), np.float32)
        both = self._random.choice(len(self._names), 2, replace=False)
        pose[both] = self._random.uniform(0.3, 1.0, 2)
        return pose, ", ".join(f"{_short(self._names[i])} {pose[i]:.2f}" for i in both)

    def _expression(self) -> tuple[Pose, str]:
        pose, text = self._face(0.3, 1.0)
        if self._random.random() < 0.5:
            other, more = self._face(0.0, 0.5)
            return pose + other, f"{text} + {more}"
        return pose, text

    def _speech(self) -> tuple[Pose, str]:
        pose, text = self._face(0.2, 0.6)
        if self._spoken is not None:
            frame = int(self._random.integers(len(self._spoken)))
            return pose + self._spoken[frame], f"frame {frame} of the clip + {text}"
        first, second = self._random.choice(self._visemes, 2)
        share = np.float32(self._random.random())
        said = (1 - share) * self._poses[first] + share * self._poses[second]
        return pose + said, f"{first} to {second} {share:.2f} + {text}"

    def _face(self, low: float, high: float) -> tuple[Pose, str]:
        name, weight = str(self._random.choice(self._faces)), self._random.uniform(low, high)
        return np.float32(weight) * self._poses[name], f"{name} {weight:.2f}"

    def _looks(self, pose: Pose, text: str) -> tuple[Pose, str]:
        """Add a gaze with probability 1/2, and a blink with 1/3, to a pose and its description."""
        if self._random.random() < 0.5:
            for pair in _LOOKS:
                look, value = str(self._random.choice(pair)), self._random.uniform(0.0, 0.9)
                self._raise(pose, look, value)
                text += f", {look} {value:.2f}"
        if self._random.random() < 1 / 3:
            value = self._random.random()
            self._raise(pose, "eyeBlink", value)
            text += f", eyeBlink {value:.2f}"
        return pose, text

    def _raise(self, pose: Pose, control: str, value: float) -> None:
        for side in "LR":
            at = self._where.get(PREFIX + control + side)
            if at is not None:
                pose[at] = max(pose[at], value)


def _short(name: str) -> str:
    return name.rpartition(".")[2]
