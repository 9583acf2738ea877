# SPDX-License-Identifier: MIT
"""Guesses the pronunciation of words that no dictionary has, by letter-to-sound rules for English.

The pronunciation need not be correct as speech, only as mouth movement: with an approximate
pronunciation the aligner still finds the times.
"""

from __future__ import annotations

# Letters -> phonemes; of several rules that match at a letter, the longest counts. ^ is the
# beginning of the word and $ its end.
_RULES = {
    "tion": "SH AH N", "sion": "ZH AH N", "ough": "AO", "augh": "AO", "eigh": "EY", "tch": "CH",
    "igh": "AY", "sch": "S K", "dge": "JH", "eau": "OW", "air": "EH R", "ear": "IH R",
    "eer": "IH R", "our": "AO R", "oor": "AO R", "ture$": "CH ER", "ous$": "AH S",
    "cia": "SH AH", "^kn": "N", "^wr": "R", "^ps": "S", "^gn": "N", "^x": "Z", "^wh": "W",
    "mb$": "M", "le$": "AH L",
    "es$": "Z", "ed$": "D", "e$": "", "y$": "IY", "^y": "Y", "ch": "CH", "sh": "SH", "th": "TH",
    "ph": "F", "gh": "G", "ng": "NG", "nk": "NG K", "qu": "K W", "ck": "K", "wh": "W", "zh": "ZH",
    "kh": "K", "bb": "B", "cc": "K", "dd": "D", "ff": "F", "gg": "G", "ll": "L", "mm": "M",
    "nn": "N", "pp": "P", "rr": "R", "ss": "S", "tt": "T", "zz": "Z", "ai": "EY", "ay": "EY",
    "au": "AO", "aw": "AO", "ea": "IY", "ee": "IY", "ei": "EY", "ey": "IY", "eu": "UW", "ew": "UW",
    "ie": "IY", "oa": "OW", "oi": "OY", "oy": "OY", "oo": "UW", "ou": "AW", "ow": "OW", "ue": "UW",
    "ui": "UW", "ar": "AA R", "er": "ER", "ir": "ER", "or": "AO R", "ur": "ER", "yr": "IH R",
    "ce": "S EH", "ci": "S IH", "cy": "S IY", "ge": "JH EH", "gi": "JH IH", "gy": "JH IY",
    "a": "AE", "b": "B", "c": "K", "d": "D", "e": "EH", "f": "F", "g": "G", "h": "HH", "i": "IH",
    "j": "JH", "k": "K", "l": "L", "m": "M", "n": "N", "o": "AA", "p": "P", "q": "K", "r": "R",
    "s": "S", "t": "T", "u": "AH", "v": "V", "w": "W", "x": "K S", "y": "IH", "z": "Z",
}  # fmt: skip
_NAMES = {
    "a": "EY", "b": "B IY", "c": "S IY", "d": "D IY", "e": "IY", "f": "EH F", "g": "JH IY",
    "h": "EY CH", "i": "AY", "j": "JH EY", "k": "K EY", "l": "EH L", "m": "EH M", "n": "EH N",
    "o": "OW", "p": "P IY", "q": "K Y UW", "r": "AA R", "s": "EH S", "t": "T IY", "u": "Y UW",
    "v": "V IY", "w": "D AH B AH L Y UW", "x": "EH K S", "y": "W AY", "z": "Z IY",
}  # fmt: skip
_LONG = {"a": "EY", "e": "IY", "i": "AY", "o": "OW", "u": "UW", "y": "AY"}
_VOWELS = frozenset("aeiouy")
_LONGEST = 5  # letters of the longest rule


def pronounce(word: str) -> list[str]:
    """The guessed phonemes of a word.

    Args:
        word: a word of letters a to z and apostrophes, with at least one letter.
    """
    letters = word.replace("'", "")
    if not _VOWELS & set(letters):  # no vowel: an abbreviation, whose letters are spelled
        return " ".join(_NAMES[letter] for letter in letters).split()
    said: list[str] = []
    place = 0
    while place < len(letters):
        if _is_long(letters, place):
            said.append(_LONG[letters[place]])
            place += 1
            continue
        taken, sounds = _rule(letters, place)
        said += sounds.split()
        place += taken
    return said


def _is_long(letters: str, place: int) -> bool:
    """Whether a silent e at the end of the word makes the vowel at `place` long, as in take."""
    tail = letters[place:]
    return (
        len(tail) == 3
        and letters[place] in _LONG
        and tail[1] not in _VOWELS | {"r", "w", "x"}
        and tail[2] == "e"
        and (place == 0 or letters[place - 1] not in _VOWELS)
    )


def _rule(letters: str, place: int) -> tuple[int, str]:
    """The longest rule that matches at `place`: its number of letters, and its phonemes."""
    for length in range(min(_LONGEST, len(letters) - place), 0, -1):
        part = letters[place : place + length]
        begin = "^" if place == 0 else ""
        end = "$" if place + length == len(letters) else ""
        for key in dict.fromkeys((begin + part + end, begin + part, part + end, part)):
            if key in _RULES and (key != "e$" or place > 1):
                return length, _RULES[key]
    return 1, ""
