# SPDX-License-Identifier: MIT
"""Phonemes of English, and the viseme of each."""

from __future__ import annotations

from typing import NamedTuple

from ..expressions import VISEMES, get

__all__ = ["CLASS_OF", "GLIDES", "VISEMES", "VOWEL_VISEMES", "Phoneme", "label_of", "phone_named",
           "viseme_of"]  # fmt: skip

VOWEL_VISEMES = frozenset({"aa", "E", "I", "O", "U"})


class Phoneme(NamedTuple):
    """A sound of speech, or silence, with its times."""

    begin: float
    """Beginning in seconds."""
    end: float
    name: str
    """Phoneme of the CMU dictionary, without stress: AA, B, ... ZH; SIL for silence."""
    confidence: float = 1.0
    """0 to 1. Aligned: fraction of its duration in which a decoder of phonemes hears the same
    viseme. Recognised by vote: mean share of the votes for its viseme. Read from a file: 1."""
    word: str = ""
    """The word that begins with this phoneme, or ""; it ends before the next word or SIL."""


# Viseme -> its phonemes. A diphthong is listed at the viseme of its first vowel; GLIDES has the
# visemes of both vowels.
_CLASSES = {
    "sil": "SIL", "PP": "P B M", "FF": "F V", "TH": "TH DH", "DD": "T D", "kk": "K G NG HH",
    "CH": "CH JH SH ZH", "SS": "S Z", "nn": "N L", "RR": "R ER", "aa": "AA AE AH AY AW",
    "E": "EH EY", "I": "IH IY Y", "O": "AO OW OY", "U": "UH UW W",
}  # fmt: skip
CLASS_OF = {phone: viseme for viseme, phones in _CLASSES.items() for phone in phones.split()}
"""Phoneme -> viseme, for 39 phonemes and SIL."""

GLIDES = {"AY": ("aa", "I"), "AW": ("aa", "U"), "EY": ("E", "I"), "OW": ("O", "U"),
          "OY": ("O", "I")}  # fmt: skip
"""Diphthong -> (first viseme, last viseme)."""


def viseme_of(phone: str) -> str:
    """The viseme of a phoneme; noises and unknown sounds have the viseme of silence."""
    return CLASS_OF.get(phone, "sil")


def label_of(phone: str) -> str:
    """The animators' name of a phoneme's mouth shape, such as M B P, F V, Oo."""
    return get(viseme_of(phone)).label


def phone_named(text: str) -> str | None:
    """The phoneme that a typed or imported name means, or None if it means none.

    Args:
        text: a phoneme of the CMU dictionary (AH or AH0), an animators' name of a mouth shape (M B
            P), a viseme (PP), or empty, sil, sp or spn for silence; letter case is ignored.

    Returns:
        The phoneme; for a mouth shape the first phoneme with this shape.
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
