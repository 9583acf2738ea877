# SPDX-License-Identifier: GPL-3.0-or-later
"""Which NLA track is which, after tracks were added, removed, renamed or put in another order."""

from __future__ import annotations

from collections.abc import Callable, Sequence

Known = tuple[str, Sequence[str]]  # a track's name, the names of its strips


def matched(noted: Sequence[Known], there: Sequence[Known]) -> dict[int, int]:
    """Find tracks again.

    First those of the same name and strips, then of the same strips, whose names Blender keeps
    apart, then of the same name.

    Args:
        noted: the tracks of before.
        there: those of now.

    Returns:
        Number of a track of now -> number of the track of before; those without one are new.
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
    return list(track[1]) or track  # tracks without strips are told apart by name


_KEYS: tuple[Callable[[Known], object], ...] = (_both, _strips, _name)
