# SPDX-License-Identifier: GPL-3.0-or-later
"""The DNA file inside the .blend: compressed bytes on a Text datablock.

On a Text, because Blender copies the custom properties of scene objects at each update.
"""

import hashlib
import zlib

import bpy

_BYTES = "risorius_bytes"
_HASH = "risorius_hash"
_MOST_BYTES = 1 << 32


class ContentError(ValueError):
    """What a Text holds is not the DNA file that was put there; the text goes on after a colon."""


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
    """The hash of what a Text holds; empty where it holds no DNA or is no Text at all."""
    digest = text.get(_HASH) if isinstance(text, bpy.types.Text) else None
    return digest if isinstance(digest, str) else ""


def content(text):
    """The bytes of the DNA file that a Text holds.

    Raises:
        ContentError: they were tampered with or damaged.
    """
    packed = text.get(_BYTES)
    if not isinstance(packed, bytes):
        raise ContentError("the Text holds no bytes of a DNA file")
    try:
        # Not all at once: a few kilobytes of zeros would unfold to any size.
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(packed, _MOST_BYTES)
    except zlib.error as error:
        raise ContentError("its bytes cannot be unpacked") from error
    if not unpacking.eof:
        raise ContentError("its bytes end too early, or unpack to more than a DNA file can be")
    if hashlib.sha256(content).hexdigest() != content_hash(text):
        raise ContentError("its bytes are not those that were imported")
    return content
