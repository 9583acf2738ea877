# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the size of a picture from its file header, so that it can be checked before loading."""

from __future__ import annotations

import struct
from collections.abc import Callable

Read = Callable[[int, int], bytes]

_JPEG_PARTS = 4000  # most segments to read; real files have about 20 before the size
_EXR_ATTRIBUTES = 1000
_TIFF_TAGS = 4000


def size_of(read: Read) -> tuple[int, int, int] | None:
    """Width and height in pixels, and the bytes that Blender needs per pixel.

    Args:
        read: `read(offset, count)` returns up to `count` bytes of the file.

    Returns:
        None if the file is no PNG, JPEG, BMP, WebP, TIFF, OpenEXR or Targa, or its header is
        damaged.
    """
    head = read(0, 32)
    try:
        for start, size in _KINDS:
            if head.startswith(start):
                return size(read, head)
        return _targa(head)
    except (struct.error, IndexError):
        return None


def _png(_read: Read, head: bytes) -> tuple[int, int, int]:
    width, height, depth = struct.unpack_from(">IIB", head, 16)
    return width, height, 16 if depth == 16 else 4


def _bmp(_read: Read, head: bytes) -> tuple[int, int, int]:
    (kind,) = struct.unpack_from("<I", head, 14)
    width, height = struct.unpack_from("<HH" if kind == 12 else "<ii", head, 18)
    return abs(width), abs(height), 4


def _jpeg(read: Read, _head: bytes) -> tuple[int, int, int] | None:
    at = 2
    for _ in range(_JPEG_PARTS):
        fill, kind, length, height, width = struct.unpack(">BBHxHH", read(at, 9))
        if fill != 0xFF:
            return None
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            return width, height, 4
        at += 2 + length if kind != 0xFF else 1
    return None


def _webp(_read: Read, head: bytes) -> tuple[int, int, int] | None:
    if head[8:12] != b"WEBP":
        return None
    if head[12:16] == b"VP8X":
        return (
            1 + int.from_bytes(head[24:27], "little"),
            1 + int.from_bytes(head[27:30], "little"),
            4,
        )
    if head[12:16] == b"VP8L":
        (bits,) = struct.unpack_from("<I", head, 21)
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF), 4
    width, height = struct.unpack_from("<HH", head, 26)
    return width & 0x3FFF, height & 0x3FFF, 4


def _tiff(read: Read, head: bytes) -> tuple[int, int, int] | None:
    order = "<" if head[:2] == b"II" else ">"
    (kind,) = struct.unpack_from(f"{order}H", head, 2)
    # Values for BigTIFF, then for TIFF: number format of the first directory's offset, and the byte
    # at which this offset is stored; number format of the tag count; bytes per tag.
    at_form, at, count_form, step = ("Q", 8, "Q", 20) if kind == 43 else ("I", 4, "H", 12)
    (start,) = struct.unpack_from(order + at_form, head, at)
    count_size = struct.calcsize(count_form)
    (count,) = struct.unpack(order + count_form, read(start, count_size))
    tags = read(start + count_size, min(count, _TIFF_TAGS) * step)
    found = {}
    for place in range(0, len(tags) - step + 1, step):
        tag, form = struct.unpack_from(f"{order}HH", tags, place)
        if tag in (256, 257) and form in (3, 4, 16):
            value = {3: "H", 4: "I", 16: "Q"}[form]
            (found[tag],) = struct.unpack_from(order + value, tags, place + step // 2 + 2)
    return (found[256], found[257], 16) if len(found) == 2 else None


def _exr(read: Read, _head: bytes) -> tuple[int, int, int] | None:
    at, width, height = 8, 0, 0
    for _ in range(_EXR_ATTRIBUTES):
        words = read(at, 600).split(b"\0", 2)
        if not words[0]:
            break
        if len(words) < 3:
            return None
        name, kind, rest = words
        (size,) = struct.unpack_from("<i", rest)
        if name in (b"dataWindow", b"displayWindow"):
            left, low, right, high = struct.unpack_from("<iiii", rest, 4)
            width, height = max(width, right - left + 1), max(height, high - low + 1)
        if size < 0:
            return None
        at += len(name) + len(kind) + 2 + 4 + size
    return (width, height, 16) if width > 0 and height > 0 else None


def _targa(head: bytes) -> tuple[int, int, int] | None:
    palette, kind = head[1], head[2]
    width, height, depth = struct.unpack_from("<HHB", head, 12)
    known = palette < 2 and kind in (1, 2, 3, 9, 10, 11) and depth in (8, 15, 16, 24, 32)
    return (width, height, 4) if known else None


_KINDS: tuple[tuple[bytes, Callable[[Read, bytes], tuple[int, int, int] | None]], ...] = (
    (b"\x89PNG\r\n\x1a\n", _png),
    (b"\xff\xd8", _jpeg),
    (b"BM", _bmp),
    (b"RIFF", _webp),
    (b"II*\0", _tiff),
    (b"MM\0*", _tiff),
    (b"II+\0", _tiff),
    (b"MM\0+", _tiff),
    (b"\x76\x2f\x31\x01", _exr),
)
