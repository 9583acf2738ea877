# SPDX-License-Identifier: MIT
"""Maps values of controls by the ranges of a person: neutral becomes 0, extreme becomes 1.

    share = (value - neutral) / (extreme - neutral)         0 to 1
    result = share * (width + (1 - width) * share)          width = extreme - neutral

The slope is 1 at neutral, so that noise at rest is not amplified.
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
"""Limits of a range's neutral value."""
WIDTHS = (0.1, 1.9)
"""Limits of extreme minus neutral; beyond them the mapping would not be ascending."""


_APPLIED = "range"  # key in a clip's metadata for the source of removed ranges
_CAPTURES = ("live_link_face", "csv", "json")  # kinds of files with captures


def is_captured(clip: Clip) -> bool:
    """Whether a clip holds captured values: not speech, and without removed ranges."""
    is_capture = clip.metadata.get("kind") in _CAPTURES or "subject" in clip.metadata
    return is_capture and _APPLIED not in clip.metadata


def require_untouched(clip: Clip) -> None:
    """Raises: ArgumentError: ranges were removed from the clip before."""
    if _APPLIED in clip.metadata:
        raise ArgumentError(
            "a capture as it came was expected, found one whose range was taken out before: "
            f"{clip.metadata[_APPLIED]}"
        )


class Range(NamedTuple):
    """The range of one control."""

    neutral: float
    """The value of a face at rest, within NEUTRALS."""
    extreme: float
    """The largest possible value; neutral plus a width within WIDTHS."""

    @property
    def gain(self) -> float:
        """The factor that maps the range to 1; 1 means no change."""
        return 1.0 / (self.extreme - self.neutral)

    def calibrated(self) -> Range:
        """The range after the face at rest was subtracted, see process.calibrate."""
        return Range(0.0, (self.extreme - self.neutral) / (1.0 - self.neutral))

    def trouble(self) -> tuple[str, str] | None:
        """(field, expected and found value) of an invalid range; None if it is valid."""
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
    """The measurement of one control in a take."""

    range: Range
    """The measured range, even if it is not used."""
    reason: str = ""
    """Why the control stays as captured; "" if its range is used."""


@dataclass(frozen=True)
class Ranges:
    """The ranges of a person.

    Attributes:
        controls: raw control in the spelling of a DNA -> its measurement.
        source: the take in which they were measured.
    """

    controls: Mapping[str, Learned] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        """Raises: ArgumentError: a used range is invalid."""
        for name, range_ in self.used().items():
            if trouble := range_.trouble():
                raise ArgumentError(f"{name}: {trouble[0]}: {trouble[1]}")

    def used(self) -> dict[str, Range]:
        """The ranges of the controls that change."""
        return {name: found.range for name, found in self.controls.items() if not found.reason}

    def apply(self, clip: Clip) -> Clip:
        """A clip of raw controls with the ranges removed; other curves keep their bits.

        Raises:
            ArgumentError: ranges were removed from the clip before.
        """
        require_untouched(clip)
        remap = Remap(clip.names, self.used())
        if not remap.changes:
            return clip
        return clip.replaced(curves=remap(clip.curves.T).T, metadata=self.noted(clip.metadata))

    def noted(self, metadata: Mapping[str, str]) -> dict[str, str]:
        """Metadata of a clip from which these ranges are removed."""
        return {**metadata, _APPLIED: self.source or "without a source"}

    def rows(self) -> Iterable[tuple[str, str, str, str, str]]:
        """For a table: control, neutral, extreme, gain, reason why it is not used."""
        for name, (range_, reason) in self.controls.items():
            gain = "" if reason else f"{range_.gain:.2f}"
            yield name, f"{range_.neutral:.3f}", f"{range_.extreme:.3f}", gain, reason


class Remap:
    """Ranges compiled for values in the order of given names.

    Args:
        names: names of the controls.
        ranges: by name; names without a range keep their values.

    Attributes:
        changes: whether any value may change.
    """

    def __init__(self, names: Sequence[str], ranges: Mapping[str, Range]) -> None:
        found = [(i, ranges[name]) for i, name in enumerate(names) if name in ranges]
        self.changes = bool(found)
        self._places = np.array([place for place, _ in found], np.intp)
        self._neutral = np.array([range_.neutral for _, range_ in found], np.float32)
        self._extreme = np.array([range_.extreme for _, range_ in found], np.float32)
        self._width = self._extreme - self._neutral

    def __call__(self, values: Floats) -> Floats:
        """The values with the ranges removed.

        Args:
            values: float32[..., names]. A value below 0 stays, and so does one above 1 that exceeds
                the extreme, for overdrive.

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
