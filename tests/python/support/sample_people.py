# SPDX-License-Identifier: MIT
"""People of the sample, read and assembled once for all tests that look at them.

Nobody changes what these functions give: the next test has the same objects.
"""

import functools

import pytest
from conftest import _not_run
from risorius_people import blend_shape_face, people, source


@functools.cache
def _data():
    return source.Source(source.fetch())


def data():
    """The sample's CC0 data; where they cannot be had, the test does not run and says so."""
    try:
        return _data()
    except source.SourceError as error:
        _not_run.add("the sample's CC0 data")
        pytest.skip(f"extra not run: {error}")


@functools.cache
def assembled(name):
    """(dna, parts, body) of one of the cast, as a face of shapes without hair."""
    return blend_shape_face.assemble(data(), lambda _: None, people.PEOPLE[name])


def body(name):
    """The Body of one of the cast."""
    return assembled(name)[2]
