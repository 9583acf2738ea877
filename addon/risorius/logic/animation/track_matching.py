# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds NLA tracks again after tracks were added, removed, renamed or reordered."""

from __future__ import annotations

from collections.abc import Callable, Sequence

Known = tuple[str, Sequence[str]]  # name of a track, names of its strips


def matched(noted: Sequence[Known], there: Sequence[Known]) -> dict[int, int]:
    """Find the known tracks among the current tracks.

    Tracks match first by name and strips, then by strips alone because Blender keeps the names of
    strips unique, then by name alone.

    Args:
        noted: the known tracks.
        there: the current tracks.

    Returns:
        Index of a current track -> index of the known track; new tracks are left out.
    """
    found: dict[int, int] = {}
    old, new = list(range(len(noted))), list(range(len(there)))
    for key in _KEYS:
        for number in list(new):
            same = next((i for i in old if key(noted[i]) == key(there[number])), None)
            if same is not None:
                found[number] = same
                old.remove(same)
                new.remove(number)
    return found


def _both(track: Known) -> object:
    return track[0], list(track[1])


def _name(track: Known) -> object:
    return track[0]


def _strips(track: Known) -> object:
    return list(track[1]) or track  # tracks without strips are compared by name


_KEYS: tuple[Callable[[Known], object], ...] = (_both, _strips, _name)
