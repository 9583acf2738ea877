# SPDX-License-Identifier: GPL-3.0-or-later
"""The DNA file inside the .blend: compressed bytes on a Text datablock.

On a Text, because Blender copies the custom properties of scene objects at each update.
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
_LENGTH = "risorius_length"  # of the unpacked file; Texts of older versions have none
# Unpacked bytes are at most 32 times the packed bytes and 64 KB more, whatever a .blend states. DNA
# files pack to a half or a fifth; a file that packs better is stored unpacked.
_MOST_TIMES = 32
_ALWAYS = 1 << 16  # bytes
_PIECE = 1 << 20  # bytes
_SIGNATURE = b"DNA"  # what the first bytes of every DNA file are


class ContentError(FaceError):
    """A Text does not have the stored DNA file. Its sentence continues after a colon."""


def store(name: str, content: bytes, made: list[bpy.types.ID]) -> bpy.types.Text:
    """Put the bytes of a file into a Text datablock: a new one, or an existing one with the same
    bytes.

    Args:
        name: the character's name.
        content: bytes of the DNA file.
        made: receives a new datablock.

    Returns:
        The Text. It is never written again, because characters of one file share it.
    """
    digest = hash_of(content)
    there = _holding(content, digest)
    if there is not None:
        return there
    text = bpy.data.texts.new(f"{name}.dna")
    made.append(text)
    text.use_fake_user = False  # the armature's pointer keeps it
    text.write(
        f"The DNA file of {name} ({len(content):,} bytes) is kept in this datablock.\n"
        "The character needs it; it is not meant to be edited.\n"
    )
    text[_BYTES] = _packed(content)
    text[_HASH] = digest
    text[_LENGTH] = str(len(content))  # words: Blender's integers end at 2 GiB
    return text


def _holding(wanted: bytes, digest: str) -> bpy.types.Text | None:
    """A Text of this .blend with these bytes, or None. Its bytes are unpacked and compared."""
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
        one: a Text with a file.
        other: another, or the same Text.
    """
    return one == other or (
        content_hash(one) == content_hash(other) and one.get(_BYTES) == other.get(_BYTES)
    )


def _packed(content: bytes) -> bytes:
    """The bytes of a file as a zlib stream, within the bound for unpacking."""
    # Level 2 takes a sixth of the time of level 6 for 9 % more bytes.
    packed = zlib.compress(content, 2)
    return packed if len(content) <= _most(packed) else zlib.compress(content, 0)


def _most(packed: bytes) -> int:
    return _MOST_TIMES * len(packed) + _ALWAYS


def hash_of(content: bytes) -> str:
    """The hash of the bytes of a file, as stored beside them."""
    return hashlib.sha256(content).hexdigest()


def content_hash(text: object) -> str:
    """The hash of the DNA file in a Text; empty if it has none or is no Text."""
    digest = text.get(_HASH) if isinstance(text, bpy.types.Text) else None
    return digest if isinstance(digest, str) else ""


def text_of(rig: ArmatureObject) -> bpy.types.Text | None:
    """The Text with the DNA file of a character. Args: rig its deforming armature."""
    text = rig.get(parts.DNA)
    return text if isinstance(text, bpy.types.Text) else None


def content(text: object) -> bytes:
    """The bytes of the DNA file in a Text.

    Raises:
        ContentError: the bytes were changed or damaged, or this is no Text.
    """
    packed = text.get(_BYTES) if isinstance(text, bpy.types.Text) else None
    if not isinstance(text, bpy.types.Text) or not isinstance(packed, bytes):
        raise ContentError(told("the Text holds no bytes of a DNA file"))
    content = _unpack(packed, _limit(text, packed))
    if hash_of(content) != content_hash(text):
        raise ContentError(told("its bytes are not those that were imported"))
    return content


def _limit(text: bpy.types.Text, packed: bytes) -> int:
    """The bytes that may be unpacked: the stored size, within the bound."""
    said = text.get(_LENGTH)
    if said is None:
        return _most(packed)
    if not isinstance(said, str) or not said.isdecimal() or len(said) > 15:
        raise ContentError(told("the length of its file is no number"))
    if int(said) > _most(packed):
        raise ContentError(
            told(
                "its file is said to have {said:,} bytes, {most:,} can be in the {packed:,} "
                "that are there",
                said=int(said),
                most=_most(packed),
                packed=len(packed),
            )
        )
    return int(said)


def _unpack(packed: bytes, limit: int) -> bytes:
    """Unpack piece by piece: a few kilobytes of zeros would unfold to any size."""
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
            raise ContentError(told("its bytes unpack to more than {limit:,}", limit=limit))
        if not piece and not rest and not unpacking.eof:
            raise ContentError(told("its bytes end too early"))
        pieces.append(piece)
    return b"".join(pieces)
