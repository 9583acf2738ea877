# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores the DNA file inside the .blend: compressed bytes in a property of a Text datablock.

A Text is used, because Blender copies the custom properties of scene objects at each update, but
not the properties of Texts.
"""

from __future__ import annotations

import hashlib
import zlib

import bpy

from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from . import parts
from .blender_types import ArmatureObject

_BYTES = "risorius_bytes"
_HASH = "risorius_hash"
_LENGTH = "risorius_length"  # length of the unpacked file in bytes; missing in older Texts
# Unpacking stops at 32 times the packed size plus 64 KB, even if the .blend states a larger size.
# DNA files pack to between a half and a fifth of their size. A file that would unpack to more than
# this limit is stored uncompressed.
_MOST_TIMES = 32
_ALWAYS = 1 << 16  # bytes that every file may unpack to
_PIECE = 1 << 20  # bytes that are unpacked at once
_SIGNATURE = b"DNA"  # first bytes of every DNA file


class ContentError(FaceError):
    """A Text has no intact DNA file. The error text is the end of a sentence, after a colon."""


def store(name: str, content: bytes, made: list[bpy.types.ID]) -> bpy.types.Text:
    """Store the bytes of a DNA file in a new Text, or find an existing Text with the same bytes.

    Args:
        name: the character's name.
        content: bytes of the DNA file.
        made: a new Text is appended to this list.

    Returns:
        The Text. The Text must not be changed, because characters with equal files share it.
    """
    digest = hash_of(content)
    there = _holding(content, digest)
    if there is not None:
        return there
    text = bpy.data.texts.new(f"{name}.dna")
    made.append(text)
    text.use_fake_user = False  # the armature's pointer keeps the Text in the file
    text.write(
        f"The DNA file of {name} ({len(content):,} bytes) is kept in this datablock.\n"
        "The character needs it; it is not meant to be edited.\n"
    )
    text[_BYTES] = _packed(content)
    text[_HASH] = digest
    text[_LENGTH] = str(len(content))  # as text, because integer properties end at 2 GiB
    return text


def _holding(wanted: bytes, digest: str) -> bpy.types.Text | None:
    """A Text of this .blend that stores a DNA file with the given bytes, or None.

    Args:
        wanted: bytes of the DNA file.
        digest: SHA-256 hash of these bytes.
    """
    for text in bpy.data.texts:
        if text.library is None and content_hash(text) == digest and _holds(text, wanted):
            return text
    return None


def _holds(text: bpy.types.Text, wanted: bytes) -> bool:
    try:
        return content(text) == wanted
    except ContentError:
        return False


def same(one: bpy.types.Text, other: bpy.types.Text) -> bool:
    """Whether two Texts hold the same packed bytes of a DNA file.

    Args:
        one: a Text with a DNA file.
        other: another Text, or the same.
    """
    return one == other or (
        content_hash(one) == content_hash(other) and one.get(_BYTES) == other.get(_BYTES)
    )


def _packed(content: bytes) -> bytes:
    """A zlib stream of bytes; not compressed if unpacking would then exceed the limit."""
    # Level 2 takes a sixth of the time of level 6 for 9 % more bytes.
    packed = zlib.compress(content, 2)
    return packed if len(content) <= _most(packed) else zlib.compress(content, 0)


def _most(packed: bytes) -> int:
    return _MOST_TIMES * len(packed) + _ALWAYS


def hash_of(content: bytes) -> str:
    """The SHA-256 hash of bytes, as hexadecimal text."""
    return hashlib.sha256(content).hexdigest()


def content_hash(text: object) -> str:
    """The stored hash of the DNA file in a Text; "" if there is none or `text` is no Text."""
    digest = text.get(_HASH) if isinstance(text, bpy.types.Text) else None
    return digest if isinstance(digest, str) else ""


def text_of(rig: ArmatureObject) -> bpy.types.Text | None:
    """The Text with the DNA file of a character, or None.

    Args:
        rig: the character's deforming armature.
    """
    text = rig.get(parts.DNA)
    return text if isinstance(text, bpy.types.Text) else None


def content(text: object) -> bytes:
    """The bytes of the DNA file in a Text.

    Raises:
        ContentError: the bytes were changed or damaged, or `text` is not a Text with a DNA file.
    """
    packed = text.get(_BYTES) if isinstance(text, bpy.types.Text) else None
    if not isinstance(text, bpy.types.Text) or not isinstance(packed, bytes):
        raise ContentError(told("the text data-block contains no bytes of a DNA file"))
    content = _unpack(packed, _limit(text, packed))
    if hash_of(content) != content_hash(text):
        raise ContentError(told("its bytes differ from the imported file"))
    return content


def _limit(text: bpy.types.Text, packed: bytes) -> int:
    """The largest number of bytes to unpack: the length of the DNA file that the Text stores.

    If the Text stores no length, the result is the largest allowed length: _MOST_TIMES times the
    packed size plus 64 KB.

    Args:
        text: a Text with a DNA file.
        packed: the packed bytes of the file.

    Raises:
        ContentError: the stored length is invalid, or larger than the largest allowed length.
    """
    said = text.get(_LENGTH)
    if said is None:
        return _most(packed)
    if not isinstance(said, str) or not said.isdecimal() or len(said) > 15:
        raise ContentError(told("the stored length of its file is no number"))
    if int(said) > _most(packed):
        raise ContentError(
            told(
                "its stored length is {said:,} bytes, but its {packed:,} packed "
                "bytes can contain at most {most:,}",
                said=int(said),
                most=_most(packed),
                packed=len(packed),
            )
        )
    return int(said)


def _unpack(packed: bytes, limit: int) -> bytes:
    """Unpack the bytes of a DNA file in pieces, because a malicious file may unpack to any size.

    Args:
        packed: the packed bytes.
        limit: largest number of unpacked bytes.

    Raises:
        ContentError: the bytes are damaged, do not begin like a DNA file, or unpack to more bytes
            than `limit`.
    """
    unpacking = zlib.decompressobj()
    pieces, count, rest = [], 0, packed
    while not unpacking.eof:
        try:
            piece = unpacking.decompress(rest, min(_PIECE, limit - count + 1))
        except zlib.error as error:
            raise ContentError(told("its bytes cannot be unpacked")) from error
        rest = unpacking.unconsumed_tail
        count += len(piece)
        if not pieces and not piece.startswith(_SIGNATURE[: len(piece)]):
            raise ContentError(
                told(
                    "its bytes begin with {piece!r} instead of {signature!r}",
                    piece=piece[:3],
                    signature=_SIGNATURE,
                )
            )
        if count > limit:
            raise ContentError(told("its bytes unpack to more than {limit:,} bytes", limit=limit))
        if not piece and not rest and not unpacking.eof:
            raise ContentError(told("its bytes end too early"))
        pieces.append(piece)
    return b"".join(pieces)
