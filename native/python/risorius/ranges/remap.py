# SPDX-License-Identifier: MIT
"""Rescales controls by the ranges of a person: neutral becomes 0, extreme becomes 1.

    share = (value - neutral) / (extreme - neutral)         0 to 1
    result = share * (width + (1 - width) * share)          width = extreme - neutral

The slope is 1 at the neutral value, so that noise at rest is not amplified.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip
from ..base.errors import ArgumentError

Floats = npt.NDArray[np.float32]

NEUTRALS = (0.0, 0.9)
"""Smallest and largest neutral value of a range."""
WIDTHS = (0.1, 1.9)
"""Smallest and largest width (extreme - neutral); others would make the mapping descend."""


_APPLIED = "range"  # key in a rescaled clip's metadata, with the source of the ranges
_CAPTURES = ("live_link_face", "csv", "json")  # kinds of imported files that contain captures


def is_captured(clip: Clip) -> bool:
    """Whether a clip is a capture that was not rescaled; a clip made from speech is no capture."""
    is_capture = clip.metadata.get("kind") in _CAPTURES or "subject" in clip.metadata
    return is_capture and _APPLIED not in clip.metadata


def require_untouched(clip: Clip) -> None:
    """Checks a clip. Raises: ArgumentError: the clip was rescaled before."""
    if _APPLIED in clip.metadata:
        raise ArgumentError(
            "a capture as it came was expected, found one whose range was taken out before: "
            f"{clip.metadata[_APPLIED]}"
        )


class Range(NamedTuple):
    """The neutral and the extreme value of one control."""

    neutral: float
    """Value of the control for a face at rest, within NEUTRALS."""
    extreme: float
    """Largest value that the control reaches; neutral plus a width within WIDTHS."""

    @property
    def gain(self) -> float:
        """The factor that scales the width of the range to 1."""
        return 1.0 / (self.extreme - self.neutral)

    def calibrated(self) -> Range:
        """The range of the control in a capture whose values v were replaced by
        (v - neutral) / (1 - neutral)."""
        return Range(0.0, (self.extreme - self.neutral) / (1.0 - self.neutral))

    def trouble(self) -> tuple[str, str] | None:
        """(field, message) for an invalid range; None if it is valid."""
        low, high = NEUTRALS
        if not low <= self.neutral <= high:
            return "neutral", f"{low:g} to {high:g} was expected, found {self.neutral:g}"
        low, high = (self.neutral + width for width in WIDTHS)
        if not low - 1e-6 <= self.extreme <= high + 1e-6:
            return "extreme", (
                f"{low:g} to {high:g} was expected for the neutral {self.neutral:g}, "
                f"found {self.extreme:g}"
            )
        return None


class Learned(NamedTuple):
    """The range of one control that was measured in a take."""

    range: Range
    """The measured range, whether used or not."""
    reason: str = ""
    """Why the control is not rescaled; "" if its range is used."""


@dataclass(frozen=True)
class Ranges:
    """The ranges of a person's controls.

    Attributes:
        controls: name of a raw control in DNA spelling -> its measurement.
        source: the take in which the ranges were measured.
    """

    controls: Mapping[str, Learned] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        """Checks the ranges. Raises: ArgumentError: a used range is invalid."""
        for name, range_ in self.used().items():
            if trouble := range_.trouble():
                raise ArgumentError(f"{name}: {trouble[0]}: {trouble[1]}")

    def used(self) -> dict[str, Range]:
        """The ranges of the controls that are rescaled."""
        return {name: found.range for name, found in self.controls.items() if not found.reason}

    def apply(self, clip: Clip) -> Clip:
        """Rescales a clip of raw controls; other curves stay bitwise equal.

        Args:
            clip: the clip; returned itself if no curve has a range that is used.

        Raises:
            ArgumentError: the clip was rescaled before.
        """
        require_untouched(clip)
        remap = Remap(clip.names, self.used())
        if not remap.changes:
            return clip
        return clip.replaced(curves=remap(clip.curves.T).T, metadata=self.noted(clip.metadata))

    def noted(self, metadata: Mapping[str, str]) -> dict[str, str]:
        """The metadata with a note of these ranges, for a rescaled clip."""
        return {**metadata, _APPLIED: self.source or "without a source"}

    def rows(self) -> Iterable[tuple[str, str, str, str, str]]:
        """Rows of a table as texts: control, neutral, extreme, gain, and the reason why the range
        is not used; "" for the reason of a used range, and for the gain of an unused one."""
        for name, (range_, reason) in self.controls.items():
            gain = "" if reason else f"{range_.gain:.2f}"
            yield name, f"{range_.neutral:.3f}", f"{range_.extreme:.3f}", gain, reason


class Remap:
    """Rescales values in the order of given names; the ranges are compiled once.

    Args:
        names: names of the controls.
        ranges: name -> range; values of names without a range are kept.

    Attributes:
        changes: whether any name has a range.
    """

    def __init__(self, names: Sequence[str], ranges: Mapping[str, Range]) -> None:
        found = [(i, ranges[name]) for i, name in enumerate(names) if name in ranges]
        self.changes = bool(found)
        self._places = np.array([place for place, _ in found], np.intp)
        self._neutral = np.array([range_.neutral for _, range_ in found], np.float32)
        self._extreme = np.array([range_.extreme for _, range_ in found], np.float32)
        self._width = self._extreme - self._neutral

    def __call__(self, values: Floats) -> Floats:
        """The rescaled values.

        Args:
            values: float32[..., names]. Values below 0 are kept, and so are values above 1 if the
                extreme is at most 1, so that exaggerated captures stay exaggerated.

        Returns:
            float32[..., names], a copy.
        """
        out = np.array(values, np.float32)
        if not self.changes:
            return out
        given = out[..., self._places]
        share = np.clip((given - self._neutral) / self._width, np.float32(0.0), np.float32(1.0))
        result = share * (self._width + (np.float32(1.0) - self._width) * share)
        beyond = (given > 1.0) & (given > self._extreme) & (self._extreme <= 1.0)
        out[..., self._places] = np.where((given < 0.0) | beyond, given, result)
        return out
