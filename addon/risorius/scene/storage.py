# SPDX-License-Identifier: GPL-3.0-or-later
"""The DNA file inside the .blend: compressed bytes on a Text datablock.

On a Text, because Blender copies the custom properties of scene objects at each update.
"""

import hashlib
import zlib

import bpy

_BYTES = "risorius_bytes"
_HASH = "risorius_hash"


def store(name, content, made):
    """Put the bytes of a file into a new Text datablock.

    Args:
        name: the character's name.
        content: bytes of the DNA file.
        made: list that the new datablock is put on.

    Returns:
        The Text.
    """
    text = bpy.data.texts.new(f"{name}.dna")
    made.append(text)
    text.use_fake_user = False  # the armature's pointer keeps it
    text.write(
        f"The DNA file of {name} ({len(content):,} bytes) is kept in this datablock.\n"
        "The character needs it; it is not meant to be edited.\n"
    )
    text[_BYTES] = zlib.compress(content, 6)
    text[_HASH] = hashlib.sha256(content).hexdigest()
    return text


def content_hash(text):
    """The hash of what a Text holds; empty where it holds no DNA."""
    return text.get(_HASH, "") if text is not None else ""


def content(text):
    """The bytes of the DNA file that a Text holds."""
    return zlib.decompress(text[_BYTES])
