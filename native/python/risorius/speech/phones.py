# SPDX-License-Identifier: MIT
"""Phonemes, and the viseme class of each."""

from __future__ import annotations

from typing import NamedTuple

from ..expressions import VISEMES, get

__all__ = ["CLASS_OF", "GLIDES", "VISEMES", "VOWEL_VISEMES", "Phoneme", "label_of", "phone_named",
           "viseme_of"]  # fmt: skip

VOWEL_VISEMES = frozenset({"aa", "E", "I", "O", "U"})


class Phoneme(NamedTuple):
    """A sound of speech, or silence, at its time."""

    begin: float
    """Seconds."""
    end: float
    name: str
    """As in the CMU dictionary, without stress: AA, B, ... ZH; SIL for silence."""
    confidence: float = 1.0
    """0 to 1: share of its time in which a second decoder, which knows only phonemes, hears the
    same viseme."""
    word: str = ""
    """The word that begins with it, if words are known; it ends before the next word or SIL."""


# A diphthong is listed by its nucleus; GLIDES has its end.
_CLASSES = {
    "sil": "SIL", "PP": "P B M", "FF": "F V", "TH": "TH DH", "DD": "T D", "kk": "K G NG HH",
    "CH": "CH JH SH ZH", "SS": "S Z", "nn": "N L", "RR": "R ER", "aa": "AA AE AH AY AW",
    "E": "EH EY", "I": "IH IY Y", "O": "AO OW OY", "U": "UH UW W",
}  # fmt: skip
CLASS_OF = {phone: viseme for viseme, phones in _CLASSES.items() for phone in phones.split()}
"""Phoneme -> viseme class; 39 phonemes and SIL."""

GLIDES = {"AY": ("aa", "I"), "AW": ("aa", "U"), "EY": ("E", "I"), "OW": ("O", "U"),
          "OY": ("O", "I")}  # fmt: skip
"""Diphthong -> its first and its last viseme."""


def viseme_of(phone: str) -> str:
    """The class of a phoneme; noises and other sounds look like silence."""
    return CLASS_OF.get(phone, "sil")


def label_of(phone: str) -> str:
    """The animators' name for the mouth of a phoneme: M B P, F V, Oo."""
    return get(viseme_of(phone)).label


def phone_named(text: str) -> str | None:
    """The phoneme that a typed or imported name means, or None.

    Args:
        text: a phoneme of the CMU dictionary (AH, also AH0), an animators' name of a mouth (M B P),
            its viseme (PP), or empty, sil, sp or spn for silence; case does not matter.

    Returns:
        The phoneme; for a mouth the first phoneme that has it.
    """
    said = " ".join(text.split())
    phone = said.upper().rstrip("012") if said[:-1].isalpha() else said.upper()
    if phone in CLASS_OF:
        return phone
    if phone in ("", "SP", "SPN"):
        return "SIL"
    for viseme, phones in _CLASSES.items():
        if said.lower() in (viseme.lower(), get(viseme).label.lower()):
            return phones.split()[0]
    return None
