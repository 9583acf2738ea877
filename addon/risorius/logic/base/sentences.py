# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences that can be said in another language later: they remember what they were made of."""

from __future__ import annotations

from collections.abc import Mapping


class Sentence(str):
    """An English sentence.

    Attributes:
        template: the words with {names} of the values, as in the table of words.
        values: what stands for them.
    """

    template: str
    values: Mapping[str, object]


def told(template: str, **values: object) -> Sentence:
    """Make a sentence.

    Args:
        template: English words with {names} of the values.
        values: what stands for them: numbers, names of things, or sentences.
    """
    sentence = Sentence(template.format(**values) if values else template)
    sentence.template, sentence.values = template, values
    return sentence
