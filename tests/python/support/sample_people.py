# SPDX-License-Identifier: MIT
"""Returns sample people, which are read and assembled once for all tests.

Tests must not change the returned objects, because later tests use them too.
"""

import functools

import pytest
from conftest import _not_run
from risorius_people import blend_shape_face, people, source


@functools.cache
def _data():
    return source.Source(source.fetch())


def data():
    """The CC0 data of the sample people; without the data, the test is skipped as NOT RUN."""
    try:
        return _data()
    except source.SourceError as error:
        _not_run.add("the sample's CC0 data")
        pytest.skip(f"extra not run: {error}")


@functools.cache
def assembled(name):
    """(dna, parts, body) of a sample person, a face with blend shapes and without hair."""
    return blend_shape_face.assemble(data(), lambda _: None, people.PEOPLE[name])


def body(name):
    """The Body of a sample person."""
    return assembled(name)[2]
