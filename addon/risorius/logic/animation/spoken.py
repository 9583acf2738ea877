# SPDX-License-Identifier: GPL-3.0-or-later
"""Corrections of the list of sounds in a spoken sentence; each returns a new list.

A sound lasts until the next one begins. So corrections make no gaps and no overlaps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from ..base.errors import FaceError
from ..base.sentences import told

SHORTEST = 0.25  # shortest duration of a sound, in frames
SILENCE = "SIL"


class Sound(NamedTuple):
    """A phoneme or silence, with the frame at which it begins."""

    begin: float
    """Frame."""
    name: str
    """A phoneme of the CMU dictionary; SIL for silence."""
    word: str = ""
    """The word that begins with this sound; empty for other sounds."""


class SpokenError(FaceError):
    """A correction is not possible."""


@dataclass(frozen=True)
class Placing:
    """The conversion from frames of an action to frames of the scene.

    Attributes:
        offset: frame of the scene at the action's frame 0.
        scale: frames of the scene for one frame of the action; below 0 if it runs backwards.
    """

    offset: float = 0.0
    scale: float = 1.0

    def shown(self, frame: float) -> float:
        """The frame of the scene at which a frame of the action plays."""
        return self.offset + self.scale * frame

    def own(self, frame: float) -> float:
        """The frame of the action that plays at a frame of the scene; the inverse of `shown`."""
        return (frame - self.offset) / self.scale


def end_of(sounds: Sequence[Sound], place: int, end: float) -> float:
    """The frame at which a sound ends.

    Args:
        sounds: the list of sounds.
        place: index of the sound.
        end: frame at which the list ends.
    """
    return sounds[place + 1].begin if place + 1 < len(sounds) else end


def word_of(sounds: Sequence[Sound], place: int) -> range | None:
    """The indices of all sounds in the word of a sound; None for silence and sounds without a word.

    Args:
        sounds: the list of sounds.
        place: index of the sound.
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
    """The range of frames in which two lists have different sounds.

    Args:
        old, new: lists of sounds; their words are not compared.
        end: frame at which both lists end.

    Returns:
        The first frame of the range, and the frame from which the lists are equal again. None if
        the starts and names of all sounds are equal.
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
    """Move the starts of sounds. The order and the starts of other sounds stay.

    Args:
        sounds: the list.
        wanted: index of a sound -> its new start frame.
        end: frame at which the list ends.

    Returns:
        The new list, and the indices of sounds that could not reach the new frame. If the moved
        sounds do not fit between the other sounds, no sound moves.
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
    if any(b <= a for a, b in pairwise(begins)):  # no room between sounds that were not moved
        begins = [s.begin for s in sounds]
    held = [i for i in sorted(wanted) if abs(begins[i] - wanted[i]) > 1e-4]
    return [s._replace(begin=b) for s, b in zip(sounds, begins, strict=True)], held


def replaced(sounds: Sequence[Sound], place: int, name: str) -> list[Sound]:
    """Replace the phoneme of one sound.

    Args:
        sounds: the list.
        place: index of the sound.
        name: the new phoneme; a sound that becomes silence (SIL) loses its word.
    """
    out = list(sounds)
    word = "" if name == SILENCE else out[place].word
    out[place] = out[place]._replace(name=name, word=word)
    return out


def inserted(sounds: Sequence[Sound], begin: float, name: str, end: float) -> list[Sound]:
    """Insert a sound at a frame; it lasts until the next sound of the list begins.

    Args:
        sounds: the list.
        begin: frame at which the sound begins; moved if the sound or the sound before it would
            last less than SHORTEST, a quarter of a frame.
        name: phoneme of the sound.
        end: frame at which the list ends.

    Raises:
        SpokenError: the sound at this frame is too short to be divided.
    """
    after = next((i for i, s in enumerate(sounds) if s.begin > begin), len(sounds))
    low = sounds[after - 1].begin + SHORTEST if after else -float("inf")
    high = (sounds[after].begin if after < len(sounds) else end) - SHORTEST
    if low > high:
        raise SpokenError(
            told("frame {frame:g}: this sound is too short to insert another sound", frame=begin)
        )
    return [*sounds[:after], Sound(min(max(begin, low), high), name), *sounds[after:]]


def removed(sounds: Sequence[Sound], places: Sequence[int]) -> list[Sound]:
    """Remove sounds. The sound before the removed ones is extended to fill their time.

    If the first sounds of the list are removed, the sound after them begins earlier instead. If the
    first sound of a word is removed, the next sound gets the word, unless this sound is silence or
    begins another word.

    Args:
        sounds: the list.
        places: indices of the sounds to remove.

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
        raise SpokenError(
            told("a voice keeps one sound at least: replace the last sound by Rest instead")
        )
    out[0] = out[0]._replace(begin=min(out[0].begin, sounds[0].begin))
    return out


def respelled(
    sounds: Sequence[Sound], place: int, said: Sequence[tuple[str, Sequence[str]]], end: float
) -> list[Sound]:
    """Replace a word by the sounds of one or more words.

    The new sounds share the time of the old word equally.

    Args:
        sounds: the list.
        place: index of a sound of the word; a sound without a word is replaced alone.
        said: the new words, each with its phonemes.
        end: frame at which the list ends.

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
    """A marker of Blender's timeline."""

    frame: int
    """Frame of the scene."""
    name: str


def label_of(sound: Sound, mouth: str) -> str:
    """The name of a sound's marker: the word that begins with the sound, and the mouth shape.

    Args:
        sound: the sound of the marker.
        mouth: name of the sound's mouth shape, such as "M B P" for the sounds M, B and P.
    """
    return f"{sound.word}: {mouth}" if sound.word else mouth


@dataclass(frozen=True)
class Board:
    """Timeline markers that show the sounds of a list.

    Attributes:
        placed: markers as the add-on created them, one for each sound.
        own: the user's own markers at the time when the add-on created the `placed` markers.
        there: all markers of the current scene.
    """

    placed: Sequence[Mark]
    own: Sequence[Mark]
    there: Sequence[Mark]

    def paired(self, named: Callable[[str], str | None]) -> tuple[dict[int, Mark], list[Mark]]:
        """Find the current marker of each sound by frame and name, which is all that markers store.

        A marker with unchanged frame and name belongs to its sound. The other sounds are compared
        with the markers that are not the user's own. A sound gets the first of these: a
        marker with another name at the sound's frame (renamed), a marker with the sound's name at
        another frame (moved), or a marker between the neighbouring sounds that is named like a
        mouth shape. Of several such markers, the nearest counts.

        Args:
            named: converts a mouth shape's name to a phoneme; returns None for an unknown name.

        Returns:
            Index in `placed` -> current marker, and a list of markers for added sounds: the markers
            left over whose name contains a mouth shape. All other markers belong to the user.
        """
        there, found = Counter(self.there), dict[int, Mark]()
        for place, mark in enumerate(self.placed):  # most are unchanged; there may be thousands
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
    """The mouth shape in the name of a marker, which may begin with a word and a colon."""
    return name.rpartition(":")[2].strip()


def from_marks(
    sounds: Sequence[Sound],
    board: Board,
    placing: Placing,
    end: float,
    label: Callable[[str], str],
    named: Callable[[str], str | None],
) -> tuple[list[Sound], list[int]]:
    """Correct a list of sounds from its moved, renamed, copied and deleted markers.

    Args:
        sounds: the list for which the markers were created.
        board: the markers.
        placing: the conversion from the list's frames to frames of the scene.
        end: frame at which the list ends.
        label: converts a phoneme to the name of its mouth shape.
        named: converts the name of a mouth shape or phoneme to a phoneme; returns None for an
            unknown name.

    Returns:
        The new list; indices in `sounds` of moved sounds that were stopped by a neighbour.

    Raises:
        SpokenError: no marker of the sounds is left, the markers were created for another number
            of sounds, a renamed marker contains no mouth shape or phoneme, or an added sound has
            no room.
    """
    found, more = board.paired(named)
    if not found or len(board.placed) != len(sounds):
        raise SpokenError(
            told("no marker of this voice is left: show its markers again with the button Markers")
        )
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
    """The sound with the word and the mouth shape in a marker's name.

    Args:
        mark: the marker with its current name.
        before: the marker as the add-on created it.
        sound: the sound of the marker.
        label: converts a phoneme to the name of its mouth shape.
        named: converts the name of a mouth shape or phoneme to a phoneme; None if unknown.

    Raises:
        SpokenError: the name contains no known mouth shape or phoneme.
    """
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
