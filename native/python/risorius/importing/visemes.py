# SPDX-License-Identifier: MIT
"""Reads viseme tracks of lip sync tools, and makes smooth curves of them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as Xml
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple
from xml.parsers import expat

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip, Event
from ..base.budget import Budget
from .errors import AnimationFileError
from .keys import VALUE_BYTES
from .source import Take, number

Doubles = npt.NDArray[np.float64]

# Frames per second of the curves. More frames are not needed, because files give the times of mouth
# shapes to a hundredth of a second or to a frame.
RATE = 60.0
# Seconds of the transition from one mouth shape to the next.
BLEND = 0.12
# Frames per second assumed for a Moho .dat file without a rate: the rate of film.
DAT_RATE = 24.0
# seconds: a longer file is assumed to contain a wrong number
LONGEST = 7200.0
# Mouth shape -> how much of its time is protected from transitions. 1: a transition reaches at most
# to the middle of the shape's time; 0: a transition may reach to the other end of this time. For
# example, viewers notice if the mouth never closes for an M, but not if a D is shortened.
DOMINANCE = {
    "A": 1.0, "B": 0.3, "C": 0.5, "D": 0.7, "E": 0.6, "F": 0.8, "G": 0.9, "H": 0.5, "X": 0.3,
    "MBP": 1.0, "FV": 0.9, "U": 0.8, "WQ": 0.8, "O": 0.7, "AI": 0.7, "L": 0.5, "etc": 0.3,
    "rest": 0.3,
}  # fmt: skip
RHUBARB = frozenset("ABCDEFGHX")
# Papagayo's ten mouth shapes. All names but E distinguish Papagayo's files from Rhubarb's files,
# which also have a shape E.
PAPAGAYO = frozenset(("AI", "E", "etc", "FV", "L", "MBP", "O", "rest", "U", "WQ"))
_TSV = re.compile(r"\s*(-?\d+(?:[.,]\d+)?)(?:\s+|\s*[;,|]\s*)([A-HXa-hx])\s*")


class Cue(NamedTuple):
    """A mouth shape from `start` to `end`, in seconds."""

    start: float
    end: float
    shape: str


def flowing_curves(
    cues: Sequence[Cue], times: Doubles, blend: float = BLEND
) -> tuple[list[str], Doubles]:
    """The shapes, and the weight of each shape in each frame; weights add up to 1 in every frame.

    Two neighbouring cues cross-fade along half a cosine that is `blend` seconds long and centred on
    their border. The cross-fade is shorter if a cue is short: it reaches at most to the middle of a
    dominant cue, and at most to the far end of a weak one. A dominant cue therefore has weight 1 in
    its middle, and a short weak one between two others never reaches weight 1.

    Args:
        cues: in order of time; each ends where the next starts.
        times: float64[frames], seconds, ascending.
        blend: length of a transition in seconds.

    Returns:
        The shapes, in order of their first cue; float64[shapes, frames].
    """
    names = list(dict.fromkeys(cue.shape for cue in cues))
    place = {name: i for i, name in enumerate(names)}
    weights = np.zeros((len(names), times.size))
    if not cues:
        return names, weights
    weights[0, :] = 1.0
    reach = [(c.end - c.start) * (1.0 - 0.5 * DOMINANCE.get(c.shape, 0.5)) for c in cues]
    for i in range(1, len(cues)):
        border = cues[i].start
        half = min(0.5 * blend, reach[i - 1], reach[i])
        # The weights after the end of cue i + 1 are not changed here, because the transitions at
        # the next borders replace this shape by then.
        beyond = cues[i + 1].end if i + 1 < len(cues) else np.inf
        first, last = np.searchsorted(times, [border - half, beyond])
        at = times[first:last]
        part = np.clip((at - border + half) / (2.0 * half), 0.0, 1.0) if half > 0 else at >= border
        rise = 0.5 - 0.5 * np.cos(np.pi * np.asarray(part, np.float64))
        weights[:, first:last] *= 1.0 - rise
        weights[place[cues[i].shape], first:last] += rise
    return names, weights


def _take(
    cues: list[Cue], kind: str, name: str, notes: list[str], events: Sequence[Event] = ()
) -> Take:
    """Makes a take from cues: curves at RATE, and the cues themselves as events.

    Args:
        cues: mouth shapes in order of time.
        kind: one of `importing.KINDS`.
        name: the file's name in errors.
        notes: sentences for the user.
        events: further events of the clip.

    Raises:
        AnimationFileError: no cue has a length, or a cue ends after LONGEST. BudgetError: too many
            shapes for a track of this length.
    """
    cues = [cue for cue in cues if cue.end > cue.start]
    if not cues:
        raise AnimationFileError(name, "mouth shapes with a length were expected, found none")
    if cues[-1].end > LONGEST:
        raise AnimationFileError(
            name, f"times to {LONGEST:g} s were expected, found {cues[-1].end:g} s"
        )
    count = int(np.ceil(cues[-1].end * RATE - 1e-6)) + 1
    shapes = len({cue.shape for cue in cues})
    Budget.of(sum(len(cue.shape) + 8 for cue in cues)).hold(
        shapes * count * VALUE_BYTES, f"{shapes} mouth shapes of {count} frames"
    )
    names, weights = flowing_curves(cues, np.arange(count) / RATE)
    marks = [Event(c.start, "viseme", c.end - c.start, c.shape) for c in cues]
    clip = Clip(names, weights, RATE, events=[*marks, *events])
    mapping = "papagayo" if set(names) & (PAPAGAYO - {"E"}) else "rhubarb"
    return Take(clip, kind, mapping, notes)


def _from_starts(starts: Sequence[tuple[float, str]], end: float, rest: str) -> list[Cue]:
    """Makes cues from start times; each cue lasts until the next one starts.

    If the first cue starts after 0 s, a cue of the shape `rest` lasts from 0 s until then.

    Args:
        starts: (start in seconds, shape) of each cue, ascending.
        end: end of the last cue in seconds.
        rest: shape before the first start.
    """
    out = [Cue(0.0, starts[0][0], rest)] if starts and starts[0][0] > 0.0 else []
    ends = [start for start, _ in starts[1:]] + [end]
    out += [Cue(start, stop, shape) for (start, shape), stop in zip(starts, ends, strict=True)]
    return out


def is_rhubarb_tsv(text: str) -> bool:
    """Whether at least half of the lines consist of a time and a Rhubarb shape, and the first line
    begins with a digit."""
    lines = [line for line in re.split(r"\r\n|\n|\r", text) if line.strip()]
    hits = sum(_TSV.fullmatch(line) is not None for line in lines)
    return bool(lines) and lines[0].strip()[:1].isdigit() and 2 * hits >= len(lines)


def read_rhubarb_tsv(text: str, name: str) -> Take:
    """Reads Rhubarb's lines "0.32<tab>B": seconds and a shape; the last line marks the end.

    Accepts lower case, blanks, decimal commas and other separators than the tab.

    Args:
        text: content of the file.
        name: the file's name in errors.

    Raises:
        AnimationFileError: an invalid line, fewer than two lines, times that do not ascend.
    """
    starts: list[tuple[float, str]] = []
    for line, row in enumerate(re.split(r"\r\n|\n|\r", text), start=1):
        if not row.strip():
            continue
        match = _TSV.fullmatch(row)
        if match is None:
            raise AnimationFileError(
                name,
                f"a time, a tab and a shape A-H or X were expected, found {row[:40]!r}",
                line=line,
            )
        starts.append((number(match[1].replace(",", "."), name, line, 1), match[2].upper()))
        _check_order(starts, name, line)
    return _rhubarb_starts(starts, name)


def rhubarb_column(times: Doubles, shapes: Sequence[str], name: str) -> Take:
    """Reads Rhubarb's shapes from one column of a table.

    Args:
        times: float64[rows], seconds.
        shapes: shape of each row, which begins at the row's time; the last one marks the end.
        name: the file's name in errors.

    Raises:
        AnimationFileError: times that do not ascend, fewer than two rows.
    """
    starts: list[tuple[float, str]] = []
    for row, (time, shape) in enumerate(zip(times.tolist(), shapes, strict=True), start=2):
        starts.append((time, shape.strip().upper()))
        _check_order(starts, name, row)
    return _rhubarb_starts(starts, name)


def is_shape(text: str) -> bool:
    """Whether a text is one of Rhubarb's shapes, in any letter case."""
    return text.strip().upper() in RHUBARB


def _rhubarb_starts(starts: list[tuple[float, str]], name: str) -> Take:
    if len(starts) < 2:
        raise AnimationFileError(name, "two lines at least were expected: a shape and the end")
    return _take(_from_starts(starts[:-1], starts[-1][0], "X"), "rhubarb", name, [])


def _check_order(starts: Sequence[tuple[float, str]], name: str, line: int) -> None:
    if starts[-1][0] < 0.0 or (len(starts) > 1 and starts[-1][0] < starts[-2][0]):
        raise AnimationFileError(
            name,
            (
                f"times that ascend from 0 were expected, found {starts[-1][0]:g}: no "
                "time below 0 s or before the previous time"
            ),
            line=line,
        )


def read_rhubarb_xml(text: str, name: str) -> Take:
    """Reads Rhubarb's <rhubarbResult> with <mouthCue start end>, in seconds.

    Args:
        text: content of the file.
        name: the file's name in errors.

    Raises:
        AnimationFileError: not such XML, or XML with a document type.
    """
    text = re.sub(r"^\s*<\?xml.*?\?>", "", text, flags=re.DOTALL)
    try:
        _refuse_declarations(text, name)
        root = Xml.fromstring(text)
    except expat.ExpatError as error:
        raise AnimationFileError(
            name, f"not XML: {expat.ErrorString(error.code)}", line=error.lineno,
            column=error.offset + 1,
        ) from error  # fmt: skip
    except Xml.ParseError as error:
        line, column = error.position
        raise AnimationFileError(
            name, f"not XML: {error.msg}", line=line, column=column + 1
        ) from error
    if root.tag != "rhubarbResult":
        raise AnimationFileError(name, f"<rhubarbResult> was expected, found <{root.tag[:40]}>")
    rows = [
        (cue.get("start", ""), cue.get("end", ""), (cue.text or "").strip())
        for cue in root.iterfind("mouthCues/mouthCue")
    ]
    return _rhubarb_cues(rows, name)


def _refuse_declarations(text: str, name: str) -> None:
    """Refuses XML with a document type, which could define entities that grow exponentially.

    Raises:
        AnimationFileError: the text has a document type. ExpatError: not XML.
    """

    def refuse(*_: object) -> None:
        raise AnimationFileError(
            name, "XML without declarations of its own was expected",
            line=parser.CurrentLineNumber, column=parser.CurrentColumnNumber + 1,
        )  # fmt: skip

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.Parse(text.encode("utf-8", "surrogatepass"), True)


def read_rhubarb_json(document: dict[str, object], name: str) -> Take:
    """Reads Rhubarb's {"metadata": ..., "mouthCues": [{"start", "end", "value"}]}, in seconds.

    Args:
        document: parsed JSON.
        name: the file's name in errors.

    Raises:
        AnimationFileError: cues in another form.
    """
    rows = document.get("mouthCues")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise AnimationFileError(name, "mouthCues: a list of tables was expected")
    return _rhubarb_cues(
        [(str(r.get("start")), str(r.get("end")), str(r.get("value"))) for r in rows], name
    )


def _rhubarb_cues(rows: Sequence[tuple[str, str, str]], name: str) -> Take:
    cues: list[Cue] = []
    for i, (start, end, shape) in enumerate(rows):
        place = f"mouth cue {i}"
        try:
            cue = Cue(float(start), float(end), shape)
        except ValueError:
            raise AnimationFileError(
                name, f"{place}: numbers for start and end were expected, found {start!r}, {end!r}"
            ) from None
        if not is_shape(shape):
            raise AnimationFileError(
                name, f"{place}: a shape A-H or X was expected, found {shape!r}"
            )
        before = cues[-1].end if cues else 0.0
        if not before - 0.005 <= cue.start <= cue.end < np.inf:
            raise AnimationFileError(
                name,
                (
                    f"{place}: times that ascend from {before:g} s were expected, found "
                    f"{start} to {end}"
                ),
            )
        if cue.start > before + 0.005:
            cues.append(Cue(before, cue.start, "X"))
        cues.append(Cue(max(cue.start, before), cue.end, shape.strip().upper()))
    return _take(cues, "rhubarb", name, [])


def read_dat(text: str, name: str, rate: float | None = None) -> Take:
    """Reads Moho's switch data: MohoSwitch1, then lines with a frame (from 1) and a shape.

    Args:
        text: content of the file.
        name: the file's name in errors.
        rate: frames per second; None: from an FPS line, else DAT_RATE with a note.

    Raises:
        AnimationFileError: an invalid line, a rate that is not above 0, fewer than two shapes, or
            frames that do not ascend.
    """
    lines = re.split(r"\r\n|\n|\r", text)
    notes: list[str] = []
    rows: list[tuple[int, float, str]] = []
    for line, row in enumerate(lines[1:], start=2):
        words = row.split()
        if not words:
            continue
        if words[0] == "FPS" and len(words) == 2:
            rate = rate or number(words[1], name, line, 2)
            continue
        if len(words) != 2:
            raise AnimationFileError(
                name, f"a frame number and a shape were expected, found {row[:40]!r}", line=line
            )
        rows.append((line, number(words[0], name, line, 1), words[1]))
    if rate is None:
        rate = DAT_RATE
        notes.append(f"a .dat does not say its frames a second: {rate:g} were assumed")
    if not rate > 0.0:
        raise AnimationFileError(name, f"frames a second above 0 were expected, found {rate:g}")
    starts: list[tuple[float, str]] = []
    for line, frame, shape in rows:
        starts.append((max(frame - 1.0, 0.0) / rate, shape))
        _check_order(starts, name, line)
    if len(starts) < 2:
        raise AnimationFileError(name, "two shapes at least were expected")
    rest = "X" if {shape for _, shape in starts} <= RHUBARB else "rest"
    last = starts[-1][0]
    end = last + 1.0 / rate if starts[-1][1] in ("rest", "X") else last + BLEND
    return _take(_from_starts(starts, end, rest), "moho", name, notes)


class Lines:
    """Reads the lines of a .pgo file one after the other; errors name the line."""

    def __init__(self, text: str, name: str) -> None:
        self.rows = re.split(r"\r\n|\n|\r", text.rstrip("\r\n"))
        self.name = name
        self.at = 0

    def next(self) -> str:
        if self.at >= len(self.rows):
            raise AnimationFileError(self.name, "the file ends too early", line=self.at)
        self.at += 1
        return self.rows[self.at - 1].strip()

    def fail(self, message: str) -> AnimationFileError:
        return AnimationFileError(self.name, message, line=self.at)

    def count(self, text: str, what: str) -> int:
        """Parses an integer of up to nine digits, which may be negative.

        Args:
            text: the line.
            what: the meaning of the number, for errors.

        Raises:
            AnimationFileError: the line is not such a number.
        """
        if not re.fullmatch(r"-?\d{1,9}", text):
            raise self.fail(f"{what} was expected, found {text[:40]!r}")
        return int(text)


class Word(NamedTuple):
    """A word of a Papagayo file; `start` and `end` are frames from 0, `end` is the last frame.

    `phonemes` has (first frame, mouth shape) of each phoneme.
    """

    text: str
    start: int
    end: int
    phonemes: list[tuple[int, str]]


def read_pgo(text: str, name: str) -> Take:
    """Reads Papagayo's text file: voices, phrases of a voice, words of a phrase, their phonemes.

    Args:
        text: content of the file.
        name: the file's name in errors.

    Raises:
        AnimationFileError: an invalid line, or too few lines.
    """
    lines = Lines(text, name)
    lines.next()
    lines.next()  # path of the sound file
    rate = float(lines.count(lines.next(), "frames a second"))
    lines.count(lines.next(), "the sound's length in frames")
    voices = []
    for _ in range(lines.count(lines.next(), "the number of voices")):
        voice, words = lines.next(), []
        lines.next()  # the voice's text
        for _ in range(lines.count(lines.next(), "the number of phrases")):
            lines.next()
            lines.count(lines.next(), "the phrase's first frame")
            lines.count(lines.next(), "the phrase's last frame")
            for _ in range(lines.count(lines.next(), "the number of words")):
                words.append(_pgo_word(lines))
        voices.append((voice, words))
    return _from_voices(voices, rate, name)


def _pgo_word(lines: Lines) -> Word:
    parts = lines.next().rsplit(maxsplit=3)
    if len(parts) == 3:
        parts.insert(0, "")
    if len(parts) != 4:
        raise lines.fail(
            "a word, its first frame, its last frame and the number of its phonemes were expected"
        )
    start, end, count = (lines.count(part, "a frame or a number") for part in parts[1:])
    phonemes = []
    for _ in range(count):
        row = lines.next().split()
        if len(row) != 2:
            raise lines.fail("a frame and a phoneme were expected")
        phonemes.append((lines.count(row[0], "a frame"), row[1]))
    return Word(parts[0], start, end, phonemes)


def read_pgo_json(document: dict[str, object], name: str) -> Take:
    """Reads a file of Papagayo-NG, version 2.

    Args:
        document: parsed JSON.
        name: the file's name in errors.

    Raises:
        AnimationFileError: tables in another form, no phonemes, or frames that do not ascend.
    """
    try:
        voices = [
            (
                str(voice["name"]),
                [
                    Word(
                        str(word["text"]), int(word["start_frame"]), int(word["end_frame"]),
                        [(int(p["frame"]), str(p["text"])) for p in word["phonemes"]],
                    )
                    for phrase in voice["phrases"]
                    for word in phrase["words"]
                ],
            )
            for voice in document["voices"]  # type: ignore[attr-defined]
        ]  # fmt: skip
        rate = float(document["fps"])  # type: ignore[arg-type]
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise AnimationFileError(name, f"not a Papagayo document: {error!r}"[:120]) from error
    return _from_voices(voices, rate, name)


def _from_voices(voices: Sequence[tuple[str, list[Word]]], rate: float, name: str) -> Take:
    """Makes a take from the first voice with phonemes; between words the shape is "rest".

    Args:
        voices: (name, words) of each voice.
        rate: frames per second.
        name: the file's name in errors.
    """
    if not 0.0 < rate < 1e4:
        raise AnimationFileError(name, f"frames a second above 0 were expected, found {rate:g}")
    speaking = [(voice, words) for voice, words in voices if any(w.phonemes for w in words)]
    if not speaking:
        raise AnimationFileError(name, "phonemes were expected, found none")
    voice, words = speaking[0]
    notes = [f"voice {other!r}: left out" for other, _ in speaking[1:]]
    starts: list[tuple[int, str]] = []
    for word in sorted(words, key=lambda word: word.start):
        if starts and starts[-1][1] == "rest" and starts[-1][0] >= word.start:
            starts.pop()
        starts += [(frame, shape) for frame, shape in word.phonemes if frame >= 0]
        starts.append((word.end + 1, "rest"))
    times = [frame for frame, _ in starts]
    if any(b < a for a, b in pairwise(times)) or starts[0][0] < 0:
        raise AnimationFileError(
            name,
            (
                f"voice {voice!r}: phonemes and ends of words in the order of their frames, from "
                "frame 0, were expected"
            ),
        )
    cues = _from_starts(
        [(frame / rate, shape) for frame, shape in starts], (times[-1] + 1) / rate, "rest"
    )
    events = [
        Event(w.start / rate, "word", (w.end + 1 - w.start) / rate, w.text) for w in words if w.text
    ]
    return _take(cues, "papagayo", name, notes, events)


def reader_of(text: str, kind: str | None) -> Callable[[str, str], Take] | None:
    """The viseme reader for a text; None if the text is JSON, a table or of another kind.

    Args:
        text: content of the file.
        kind: one of `importing.KINDS` from the caller, or None.
    """
    head = text.lstrip()[:200]
    if head.startswith("<"):
        return read_rhubarb_xml
    if head.startswith("lipsync version"):
        return read_pgo
    # If the caller chooses rhubarb, an invalid text that begins with a digit is still read, so
    # that the error names the invalid line. A text with a header is a table.
    if is_rhubarb_tsv(text) or (kind == "rhubarb" and head[:1].isdigit()):
        return read_rhubarb_tsv
    return None
