# SPDX-License-Identifier: GPL-3.0-or-later
"""The sounds of a voice as a list, and corrections; each correction returns a new list.

Sounds follow each other without gaps: each lasts until the next one begins. So corrections make no
gaps and no overlaps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from ..base.errors import FaceError
from ..base.sentences import told

SHORTEST = 0.25  # frames that a sound keeps, whatever is moved
SILENCE = "SIL"


class Sound(NamedTuple):
    """A phoneme, or silence."""

    begin: float
    """Frame."""
    name: str
    """As in the CMU dictionary; SIL for silence."""
    word: str = ""
    """The word that begins with it."""


class SpokenError(FaceError):
    """A correction that cannot be made."""


@dataclass(frozen=True)
class Placing:
    """The place of an action's frames in a scene.

    Attributes:
        offset: the scene's frame of the action's frame 0.
        scale: frames of the scene for one frame of the action; below 0 if it runs backwards.
    """

    offset: float = 0.0
    scale: float = 1.0

    def shown(self, frame: float) -> float:
        """The scene's frame of a frame of the action."""
        return self.offset + self.scale * frame

    def own(self, frame: float) -> float:
        """The inverse of `shown`."""
        return (frame - self.offset) / self.scale


def end_of(sounds: Sequence[Sound], place: int, end: float) -> float:
    """The frame at which a sound ends.

    Args:
        sounds: the list.
        place: of the sound.
        end: of the whole.
    """
    return sounds[place + 1].begin if place + 1 < len(sounds) else end


def word_of(sounds: Sequence[Sound], place: int) -> range | None:
    """The places of the sounds of a sound's word; None for silence and sounds without a word.

    Args:
        sounds: the list.
        place: of the sound.
    """
    first = place
    while first > 0 and not sounds[first].word and sounds[first].name != SILENCE:
        first -= 1
    if not sounds[first].word:
        return None
    last = first + 1
    while last < len(sounds) and not sounds[last].word and sounds[last].name != SILENCE:
        last += 1
    return range(first, last) if place < last else None


def changed(old: Sequence[Sound], new: Sequence[Sound], end: float) -> tuple[float, float] | None:
    """The first and last frame of the difference between two lists, or None.

    Args:
        old, new: lists of sounds.
        end: of both.
    """
    before = [(s.begin, s.name) for s in old]
    after = [(s.begin, s.name) for s in new]
    if before == after:
        return None
    head = 0
    while head < min(len(before), len(after)) and before[head] == after[head]:
        head += 1
    tail = 0
    while tail < min(len(before), len(after)) - head and before[-1 - tail] == after[-1 - tail]:
        tail += 1
    first = min((s[head].begin for s in (old, new) if head < len(s)), default=end)
    return first, (old[len(old) - tail].begin if tail else end)


def moved(
    sounds: Sequence[Sound], wanted: Mapping[int, float], end: float
) -> tuple[list[Sound], list[int]]:
    """Move the starts of sounds; order and other sounds stay.

    Args:
        sounds: the list.
        wanted: place -> new start frame.
        end: of the whole.

    Returns:
        The new list, and the places of sounds that stopped at a neighbour.
    """
    begins = [wanted.get(i, s.begin) for i, s in enumerate(sounds)]
    low, high = -float("inf"), end - SHORTEST
    for i in range(len(sounds)):
        if i in wanted:
            begins[i] = max(begins[i], low)
        low = begins[i] + SHORTEST
    for i in reversed(range(len(sounds))):
        if i in wanted:
            begins[i] = min(begins[i], high)
        high = begins[i] - SHORTEST
    if any(b <= a for a, b in pairwise(begins)):  # no room between neighbours that stay
        begins = [s.begin for s in sounds]
    held = [i for i in sorted(wanted) if abs(begins[i] - wanted[i]) > 1e-4]
    return [s._replace(begin=b) for s, b in zip(sounds, begins, strict=True)], held


def replaced(sounds: Sequence[Sound], place: int, name: str) -> list[Sound]:
    """The list with another phoneme at a place. Args: sounds  the list, name  the phoneme."""
    out = list(sounds)
    word = "" if name == SILENCE else out[place].word
    out[place] = out[place]._replace(name=name, word=word)
    return out


def inserted(sounds: Sequence[Sound], begin: float, name: str, end: float) -> list[Sound]:
    """Insert a sound; it takes the rest of the sound at its start.

    Args:
        sounds: the list.
        begin: frame.
        name: phoneme.
        end: of the whole.

    Raises:
        SpokenError: the list has no room for it.
    """
    after = next((i for i, s in enumerate(sounds) if s.begin > begin), len(sounds))
    low = sounds[after - 1].begin + SHORTEST if after else -float("inf")
    high = (sounds[after].begin if after < len(sounds) else end) - SHORTEST
    if low > high:
        raise SpokenError(
            told("frame {frame:g}: this sound is too short for one more in it", frame=begin)
        )
    return [*sounds[:after], Sound(min(max(begin, low), high), name), *sounds[after:]]


def removed(sounds: Sequence[Sound], places: Sequence[int]) -> list[Sound]:
    """Remove sounds; the sound before each becomes longer, at the start the next one.

    Args:
        sounds: the list.
        places: places of the sounds to remove.

    Raises:
        SpokenError: no sound would be left.
    """
    gone, word, out = set(places), "", list[Sound]()
    for i, sound in enumerate(sounds):
        if i in gone:
            word = sound.word or word
            continue
        keeps = sound.word or (word if sound.name != SILENCE else "")
        out.append(sound._replace(word=keeps))
        word = ""
    if not out:
        raise SpokenError(told("a voice keeps one sound at least: replace it by Rest instead"))
    out[0] = out[0]._replace(begin=min(out[0].begin, sounds[0].begin))
    return out


def respelled(
    sounds: Sequence[Sound], place: int, said: Sequence[tuple[str, Sequence[str]]], end: float
) -> list[Sound]:
    """Replace the word at a place by one or more words within its time.

    Args:
        sounds: the list.
        place: place of a sound of the word; a sound without a word is replaced alone.
        said: each word with its phonemes.
        end: of the whole.

    Raises:
        SpokenError: the phonemes do not fit into the time of the word.
    """
    where = word_of(sounds, place) or range(place, place + 1)
    begin, until = sounds[where[0]].begin, end_of(sounds, where[-1], end)
    names = [
        (name, word if i == 0 else "") for word, phones in said for i, name in enumerate(phones)
    ]
    step = (until - begin) / len(names)
    if step < SHORTEST:
        raise SpokenError(
            told(
                "{count} sounds do not fit into {frames:.1f} frames: make the word longer first",
                count=len(names),
                frames=until - begin,
            )
        )
    new = [Sound(begin + i * step, name, word) for i, (name, word) in enumerate(names)]
    return [*sounds[: where[0]], *new, *sounds[where[-1] + 1 :]]


class Mark(NamedTuple):
    """A marker of a timeline."""

    frame: int
    """Of the scene."""
    name: str


def label_of(sound: Sound, mouth: str) -> str:
    """The name of a marker: the starting word, and the mouth.

    Args:
        sound: sound of the marker.
        mouth: name of the mouth, such as M B P.
    """
    return f"{sound.word}: {mouth}" if sound.word else mouth


@dataclass(frozen=True)
class Board:
    """Markers of a scene that represent sounds.

    Attributes:
        placed: markers as they were added, one for each sound.
        own: the user's own markers at that time.
        there: all current markers.
    """

    placed: Sequence[Mark]
    own: Sequence[Mark]
    there: Sequence[Mark]

    def paired(self, named: Callable[[str], str | None]) -> tuple[dict[int, Mark], list[Mark]]:
        """The current marker of each sound. Markers store frame and name only.

        An unchanged marker belongs to its sound. Next come a marker with another name at its frame
        (renamed), a marker with its name at another frame (moved), and a marker named like a sound
        between its neighbours.

        Args:
            named: text -> phoneme, or None.

        Returns:
            Place in `placed` -> its marker, and markers of added sounds. Other markers belong to
            the user.
        """
        there, found = Counter(self.there), dict[int, Mark]()
        for place, mark in enumerate(self.placed):  # most are as they were, and may be thousands
            if there[mark]:
                there[mark] -= 1
                found[place] = mark
        left = list((there - Counter(self.own)).elements())
        self._match(found, left, lambda old, new: old.frame == new.frame)
        self._match(found, left, lambda old, new: old.name == new.name)
        left = [mark for mark in left if named(_mouth_of(mark.name)) and _mouth_of(mark.name)]
        frames = [mark.frame for mark in self.placed]
        before, behind = frames[:1] + frames[:-1], frames[1:] + frames[-1:]
        spans = zip(before, behind, strict=True)
        between = dict(zip(self.placed, spans, strict=True))
        self._match(found, left, lambda old, new: between[old][0] < new.frame < between[old][1])
        return found, left

    def _match(
        self, found: dict[int, Mark], left: list[Mark], fits: Callable[[Mark, Mark], bool]
    ) -> None:
        for place, old in enumerate(self.placed):
            if place in found:
                continue
            fitting = [mark for mark in left if fits(old, mark)]
            if fitting:
                found[place] = min(fitting, key=lambda mark: abs(mark.frame - old.frame))
                left.remove(found[place])


def _mouth_of(name: str) -> str:
    """The mouth in a marker's name, behind the word."""
    return name.rpartition(":")[2].strip()


def from_marks(
    sounds: Sequence[Sound],
    board: Board,
    placing: Placing,
    end: float,
    label: Callable[[str], str],
    named: Callable[[str], str | None],
) -> tuple[list[Sound], list[int]]:
    """The list from the markers: moved, renamed, copied and deleted markers are corrections.

    Args:
        sounds: the list of the added markers.
        board: the markers.
        placing: where the list lies in the scene.
        end: of the list.
        label: phoneme -> what its mouth is called.
        named: what somebody wrote -> phoneme, or None.

    Returns:
        The new list; places in `sounds` of those that were moved past a neighbour and stay beside.

    Raises:
        SpokenError: no marker is left, or one has a name that stands for no sound.
    """
    found, more = board.paired(named)
    if not found or len(board.placed) != len(sounds):
        raise SpokenError(told("no marker of this voice is left: show its markers again"))
    wanted: dict[int, float] = {}
    out = list(sounds)
    for place, mark in found.items():
        out[place] = _renamed(mark, board.placed[place], out[place], label, named)
        if mark.frame != board.placed[place].frame:
            wanted[place] = placing.own(mark.frame)
    out, held = moved(out, wanted, end)
    missing = [i for i in range(len(sounds)) if i not in found]
    out = removed(out, missing) if missing else out
    for mark in more:
        out = inserted(out, placing.own(mark.frame), named(_mouth_of(mark.name)) or SILENCE, end)
    return out, held


def _renamed(
    mark: Mark,
    before: Mark,
    sound: Sound,
    label: Callable[[str], str],
    named: Callable[[str], str | None],
) -> Sound:
    """The sound that a marker's name says. Raises: SpokenError."""
    if mark.name == before.name:
        return sound
    word, colon, _ = mark.name.rpartition(":")
    word, mouth = word.strip() if colon else sound.word, _mouth_of(mark.name)
    if mouth != label(sound.name):
        name = named(mouth)
        if name is None or not mouth:
            raise SpokenError(
                told(
                    "the marker {name} at frame {frame:g}: a mouth such as M B P or a phoneme "
                    "such as AA was expected",
                    name=mark.name,
                    frame=mark.frame,
                )
            )
        sound = sound._replace(name=name)
    return sound._replace(word="" if sound.name == SILENCE else word)
