# SPDX-License-Identifier: MIT
"""Tests that names with any bytes are read as text that is written as the same bytes."""

import pytest
import risorius


def _with_layer(identifier: bytes) -> bytes:
    dna = risorius.Dna(name="odd")
    dna.unknown_layers = [("abcd", "1.0", b"\x01")]
    return dna.to_bytes().replace(b"abcd", identifier)


def test_layers_whose_names_are_no_text():
    dna = risorius.load(_with_layer(b"\x9e\xffab"))
    assert dna.unknown_layers[0][0].encode("utf-8", "surrogateescape") == b"\x9e\xffab"
    ignored = risorius.Rig(dna).ignored_layers
    assert [i.encode("utf-8", "surrogateescape") for i in ignored] == [b"\x9e\xffab"]


def test_an_error_about_a_name_that_is_no_text_is_still_this_error():
    twice = risorius.Dna(name="odd")
    twice.unknown_layers = [("abcd", "1.0", b"\x01"), ("efgh", "1.0", b"\x02")]
    content = bytearray(twice.to_bytes().replace(b"abcd", b"\x9e\xffab"))
    offset = content.index(b"\x9e\xffab") + 8
    content[offset : offset + 4] = b"\xff\xff\xff\x00"
    with pytest.raises(risorius.DnaError) as caught:
        risorius.load(bytes(content))
    assert isinstance(caught.value.where, str)
