# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences that can be translated later, because they store template and values."""

from __future__ import annotations

from collections.abc import Mapping


class Sentence(str):
    """An English sentence.

    Attributes:
        template: English text with {names} of values, as in the translation table.
        values: values of the names.
    """

    template: str
    values: Mapping[str, object]


def told(template: str, **values: object) -> Sentence:
    """Make a sentence.

    Args:
        template: English text with {names} of values.
        values: values: numbers, names, or sentences.
    """
    sentence = Sentence(template.format(**values) if values else template)
    sentence.template, sentence.values = template, values
    return sentence
