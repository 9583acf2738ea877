# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences that store their template and values, so that they can be translated later."""

from __future__ import annotations

from collections.abc import Mapping


class Sentence(str):
    """An English sentence.

    Attributes:
        template: English text with {names} of values, as in the translation table.
        values: name in the template -> value.
    """

    template: str
    values: Mapping[str, object]


def told(template: str, **values: object) -> Sentence:
    """Make a Sentence from a template.

    Args:
        template: English text with {names} of values.
        values: name in the template -> number, name or Sentence.
    """
    sentence = Sentence(template.format(**values) if values else template)
    sentence.template, sentence.values = template, values
    return sentence
