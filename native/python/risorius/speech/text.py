# SPDX-License-Identifier: MIT
"""Converts a transcript to spoken words: numbers and signs are spelled out."""

from __future__ import annotations

import re
import unicodedata

_SMALL = """zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen
fifteen sixteen seventeen eighteen nineteen""".split()
_TENS = "_ _ twenty thirty forty fifty sixty seventy eighty ninety".split()
_LARGE = ((10**9, "billion"), (10**6, "million"), (1000, "thousand"), (100, "hundred"))
_ORDINALS = {"one": "first", "two": "second", "three": "third", "five": "fifth",
             "eight": "eighth", "nine": "ninth", "twelve": "twelfth"}  # fmt: skip
_SIGNS = {"&": " and ", "%": " percent ", "@": " at ", "+": " plus ", "=": " equals ",
          "°": " degrees ", "#": " number "}  # fmt: skip
_SHORT = {"mr.": "mister", "mrs.": "missus", "ms.": "miz", "dr.": "doctor", "st.": "saint",
          "vs.": "versus", "etc.": "et cetera", "e.g.": "for example",
          "i.e.": "that is"}  # fmt: skip
_MONEY = {"$": ("dollar", "cent"), "£": ("pound", "penny"), "€": ("euro", "cent")}
_PLURALS = {"penny": "pence"}

_NUMBER = r"\d{1,3}(?:,\d{3})+(?:\.\d+)?|\d+(?:\.\d+)?"
_TOKEN = re.compile(
    rf"([$£€])?({_NUMBER})(st|nd|rd|th|s)?(?!\w)|[a-z][a-z']*|({_NUMBER})", re.ASCII
)


def words(transcript: str) -> list[str]:
    """The spoken words of a text in lower case, as letters and apostrophes only.

    Text in brackets, such as (laughs) or [music], is left out, because it is not spoken.
    """
    text = re.sub(r"\[[^\]]*\]|\([^)]*\)|<[^>]*>", " ", transcript)
    text = unicodedata.normalize("NFKD", text.replace("\u2019", "'").replace("°", _SIGNS["°"]))
    text = "".join(c for c in text if not unicodedata.combining(c)).lower()
    for short, long in _SHORT.items():
        text = re.sub(rf"(?<!\w){re.escape(short)}", f"{long} ", text)
    text = re.sub(r"(?<!\w)((?:[a-z]\.){2,})", lambda m: m[1].replace(".", " ") + " ", text)
    for sign, long in _SIGNS.items():
        text = text.replace(sign, long)
    return [word for match in _TOKEN.finditer(text) for word in _spoken(match)]


def _spoken(match: re.Match[str]) -> list[str]:
    currency, number, ending, stuck = match.groups()
    if number is None and stuck is None:
        word = match[0].strip("'")
        return [word] if word else []
    plain = (number or stuck).replace(",", "")
    if len(plain) > 30:  # such a long number is read digit by digit
        return [_SMALL[int(digit)] for digit in plain if digit.isdigit()]
    if currency:
        return _money(plain, *_MONEY[currency])
    if ending in ("st", "nd", "rd", "th") and "." not in plain:
        return _ordinal(cardinal(int(plain)))
    whole, _, decimals = plain.partition(".")
    said = _year(whole) if not decimals and "," not in (number or "") else cardinal(int(whole))
    if decimals:
        said = [*said, "point", *(_SMALL[int(digit)] for digit in decimals)]
    return [*said[:-1], _plural(said[-1])] if ending == "s" else said


def cardinal(number: int) -> list[str]:
    """A whole number in words, from 10^12 on digit by digit."""
    if number >= 10**12:
        return [_SMALL[int(digit)] for digit in str(number)]
    for size, name in _LARGE:
        if number >= size:
            rest = cardinal(number % size) if number % size else []
            return [*cardinal(number // size), name, *rest]
    if number < 20:
        return [_SMALL[number]]
    return [_TENS[number // 10], *([_SMALL[number % 10]] if number % 10 else [])]


def _year(digits: str) -> list[str]:
    """1100 to 2099 as a year (nineteen eighty four), but 2000 to 2009 as a number like all others.

    Digits that begin with 0 are read one by one.
    """
    if digits.startswith("0") and len(digits) > 1:
        return [_SMALL[int(digit)] for digit in digits]
    number = int(digits)
    if len(digits) != 4 or not 1100 <= number < 2100 or 2000 <= number < 2010:
        return cardinal(number)
    century, year = divmod(number, 100)
    if year == 0:
        return [*cardinal(century), "hundred"]
    return [*cardinal(century), *(["oh"] if year < 10 else []), *cardinal(year)]


def _ordinal(said: list[str]) -> list[str]:
    last = said[-1]
    regular = last[:-1] + "ieth" if last.endswith("y") else last + "th"
    return [*said[:-1], _ORDINALS.get(last, regular)]


def _plural(word: str) -> str:
    if word in _PLURALS:
        return _PLURALS[word]
    if word.endswith("y"):
        return word[:-1] + "ies"
    return word + ("es" if word.endswith("x") else "s")


def _money(plain: str, large: str, small: str) -> list[str]:
    whole, _, decimals = plain.partition(".")
    count, rest = int(whole), int((decimals + "00")[:2]) if decimals else 0
    said = [*cardinal(count), large if count == 1 else _plural(large)]
    if rest:
        said += ["and", *cardinal(rest), small if rest == 1 else _plural(small)]
    return said
