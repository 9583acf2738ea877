# SPDX-License-Identifier: MIT
"""Reads and writes files of timed phonemes and words, which people and other programs correct.

There are two formats: tab-separated lines, and Praat's TextGrid with a tier of words and one of
phones, as written by Praat, ELAN and forced aligners (MFA).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from ..base.errors import RisoriusError
from .phones import Phoneme, phone_named

_TOUCH = 0.005  # seconds by which neighbours may overlap because of rounding
_COLUMNS = ("begin", "end", "phoneme")
_TOKEN = re.compile(
    r'"((?:[^"]|"")*)"|<(\w+)>|(?<!\S)([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?!\S)|![^\n]*'
)
_EXPECTED = "a phoneme such as AA, a mouth such as M B P, or sil"


class SheetError(RisoriusError):
    """An unusable file of phonemes; the message names the file, and the line if there is one."""

    code = "phoneme_file"


class _Interval(NamedTuple):
    begin: float
    end: float
    text: str


def suits_textgrid(name: str) -> bool:
    """Whether a file of this name is written as a TextGrid, by its suffix."""
    return name.lower().endswith(".textgrid")


def write(found: Sequence[Phoneme], name: str) -> str:
    """The text of a file of phonemes: a TextGrid if its suffix says so, else tab-separated lines.

    Args:
        found: phonemes in order, without gaps.
        name: name of the file.
    """
    return textgrid(found) if suits_textgrid(name) else table(found)


def table(found: Sequence[Phoneme]) -> str:
    """Tab-separated lines: begin and end in seconds, phoneme, confidence, word that begins here."""
    rows = ["begin\tend\tphoneme\tconfidence\tword"]
    rows += [f"{p.begin:.3f}\t{p.end:.3f}\t{p.name}\t{p.confidence:.3f}\t{p.word}" for p in found]
    return "\n".join(rows) + "\n"


def words_of(found: Sequence[Phoneme]) -> list[tuple[float, float, str]]:
    """(begin, end, text) of each word; it ends before the next word and before silence."""
    words: list[tuple[float, float, str]] = []
    open_ = False
    for phone in found:
        if phone.word:
            words.append((phone.begin, phone.end, phone.word))
        elif open_ and phone.name != "SIL":
            words[-1] = (words[-1][0], phone.end, words[-1][2])
        open_ = bool(phone.word) or (open_ and phone.name != "SIL")
    return words


def textgrid(found: Sequence[Phoneme]) -> str:
    """The text of a TextGrid with the tiers words and phones."""
    end = found[-1].end if found else 0.0
    words: list[_Interval] = []
    for word in map(_Interval._make, words_of(found)):
        last = words[-1].end if words else 0.0
        if word.begin > last:
            words.append(_Interval(last, word.begin, ""))
        words.append(word)
    if end > (words[-1].end if words else 0.0):
        words.append(_Interval(words[-1].end if words else 0.0, end, ""))
    phones = [_Interval(p.begin, p.end, "" if p.name == "SIL" else p.name) for p in found]
    rows = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "xmin = 0"]
    rows += [f"xmax = {end:.6f}", "tiers? <exists>", "size = 2", "item []:"]
    for number, (title, tier) in enumerate((("words", words), ("phones", phones)), start=1):
        rows += [f"    item [{number}]:", '        class = "IntervalTier"']
        rows += [f'        name = "{title}"', "        xmin = 0", f"        xmax = {end:.6f}"]
        rows.append(f"        intervals: size = {len(tier)}")
        for place, part in enumerate(tier, start=1):
            text = part.text.replace('"', '""')
            rows += [f"        intervals [{place}]:", f"            xmin = {part.begin:.6f}"]
            rows += [f"            xmax = {part.end:.6f}", f'            text = "{text}"']
    return "\n".join(rows) + "\n"


def read(data: bytes, name: str) -> list[Phoneme]:
    """Reads the phonemes of a file in either format, in order; gaps between them mean silence.

    The confidence of each phoneme is 1, because a column of confidences is not read.

    Args:
        data: content of the file in UTF-8, or in UTF-16 with a byte order mark.
        name: the file's name in errors.

    Raises:
        SheetError: another format or encoding, times that do not ascend, an unknown phoneme, or no
            phoneme but silence.
    """
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise SheetError(
            f"{name}: not {'UTF-16' if wide else 'UTF-8'} (byte {error.start})"
        ) from error
    if '"ooTextFile"' in text[:200] or "TextGrid" in text[:200]:
        found = _from_textgrid(text, name)
    else:
        found = _from_table(text, name)
    if not any(p.name != "SIL" for p in found):
        raise SheetError(f"{name}: phonemes were expected, found none but silence")
    return found


def _from_table(text: str, name: str) -> list[Phoneme]:
    lines = text.splitlines()
    columns = [title.strip().lower() for title in lines[0].split("\t")] if lines else []
    if not set(_COLUMNS) <= set(columns):
        raise SheetError(
            f"{name}: a TextGrid, or lines with tabs under a first line of begin, end, phoneme and "
            f"word were expected, found {(lines[0] if lines else '')[:60]!r}"
        )
    found: list[Phoneme] = []
    for line, row in enumerate(lines[1:], start=2):
        if not row.strip():
            continue
        cells = dict(zip(columns, row.split("\t"), strict=False))
        place = f"{name}: line {line}"
        begin, end = (_seconds(cells.get(c, ""), f"{place}: {c}") for c in _COLUMNS[:2])
        word = cells.get("word", "").strip()
        _append(found, _Interval(begin, end, cells.get("phoneme", "")), word, place)
    return found


def _seconds(text: str, place: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0.0):
        raise SheetError(f"{place}: seconds from 0 on were expected, found {text.strip()[:40]!r}")
    return value


def _append(found: list[Phoneme], part: _Interval, word: str, place: str) -> None:
    phone = phone_named(part.text)
    if phone is None:
        raise SheetError(f"{place}: {_EXPECTED} was expected, found {part.text.strip()[:40]!r}")
    last = found[-1].end if found else 0.0
    if not last - _TOUCH <= part.begin < part.end:
        raise SheetError(
            f"{place}: times that ascend from {last:g} s were expected, found {part.begin:g} to "
            f"{part.end:g} s"
        )
    found.append(Phoneme(max(part.begin, last), part.end, phone, 1.0, word))


def _from_textgrid(text: str, name: str) -> list[Phoneme]:
    tiers = _tiers(text, name)
    named = {title.lower(): title for title in tiers}
    phones = next((named[t] for t in named if "phon" in t), None)
    words = next((named[t] for t in named if "word" in t), None)
    if phones is None:
        there = ", ".join(tiers) or "none"
        raise SheetError(f"{name}: a tier named phones was expected, found the tiers {there}")
    said = [w for w in tiers[words] if w.text.strip()] if words is not None else []
    found: list[Phoneme] = []
    for number, part in enumerate(tiers[phones], start=1):
        word = ""
        while said and part.begin >= said[0].begin - _TOUCH:
            first = said.pop(0)  # if several words precede the phone, the last one counts
            word = first.text.strip() if part.begin < first.end - _TOUCH else ""
        if not part.text.strip():
            word = ""
        _append(found, part, word, f"{name}: tier {phones}, interval {number}")
    return found


def _tiers(text: str, name: str) -> dict[str, list[_Interval]]:
    """Name -> intervals of each interval tier; tiers of points are skipped.

    Only free-standing numbers and strings are read, like in Praat. So Praat's long and short text
    formats need no different treatment.
    """
    tokens = _Tokens(text, name)
    tokens.string()  # ooTextFile
    tokens.string()  # TextGrid
    tokens.number()
    tokens.number()
    tiers: dict[str, list[_Interval]] = {}
    for _ in range(tokens.count()):
        kind, title = tokens.string(), tokens.string()
        tokens.number()
        tokens.number()
        count = tokens.count()
        if kind == "IntervalTier":
            rows = [
                _Interval(tokens.number(), tokens.number(), tokens.string()) for _ in range(count)
            ]
            tiers.setdefault(title, rows)
        else:  # a tier of points
            for _ in range(count):
                tokens.number()
                tokens.string()
    return tiers


class _Tokens:
    """Reads the free-standing numbers and strings of a Praat file one after the other."""

    def __init__(self, text: str, name: str) -> None:
        self._found = _TOKEN.finditer(text)
        self._text, self._name = text, name

    def _next(self, what: str, group: int) -> str:
        for match in self._found:
            if match[2] is not None or match[0].startswith("!"):
                continue
            if match[group] is None:
                line = self._text.count("\n", 0, match.start()) + 1
                raise SheetError(
                    f"{self._name}: line {line}: {what} was expected, found {match[0][:40]!r}"
                )
            return match[group]
        raise SheetError(f"{self._name}: the file ends where {what} was expected")

    def string(self) -> str:
        return self._next("text in quotation marks", 1).replace('""', '"')

    def number(self) -> float:
        text = self._next("a number", 3)
        value = float(text)
        if not math.isfinite(value):
            raise SheetError(f"{self._name}: a finite number was expected, found {text[:40]}")
        return value

    def count(self) -> int:
        value = self.number()
        if not 0 <= value <= 1e6 or value != int(value):
            raise SheetError(f"{self._name}: a number of parts was expected, found {value:g}")
        return int(value)
