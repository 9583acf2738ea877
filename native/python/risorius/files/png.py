# SPDX-License-Identifier: MIT
"""Reads and writes PNG files in this package's form: 8 bits, grey, colour, or colour with opacity,
filters 0 to 2."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Pixels = npt.NDArray[np.uint8]
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MOST_TEXELS = 1 << 26
_BAND = 1 << 22  # values that are filtered at a time


def png(image: Floats) -> bytes:
    """An 8-bit PNG of an image, float [h, w], [h, w, 3] or [h, w, 4], from 0 to 1.

    Row 0 is the bottom (v = 0). The fourth value is the opacity; the colour is not premultiplied.
    """
    return pixels_to_png(np.clip(np.rint(image * 255), 0, 255).astype(np.uint8))


def pixels_to_png(image: Pixels) -> bytes:
    """An 8-bit PNG of an image, uint8 [h, w], [h, w, 3] or [h, w, 4], from 0 to 255. Row 0 is the
    bottom, as in png()."""
    height, width = image.shape[:2]
    values = 1 if image.ndim == 2 else image.shape[2]
    kind = {1: 0, 3: 2, 4: 6}[values]
    rows = image[::-1].reshape(height, -1)

    def chunk(name: bytes, data: bytes) -> bytes:
        crc = zlib.crc32(name + data)
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", crc)

    packer, body = zlib.compressobj(6), []
    band = max(1, _BAND // max(1, width * values))
    for begin in range(0, height, band):
        first = max(0, begin - 1)  # the filter of a row may need the row above
        predicted = _predicted(rows[first : begin + band], values)[begin - first :]
        body.append(packer.compress(predicted.tobytes()))
    body.append(packer.flush())
    header = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    whole = chunk(b"IHDR", header) + chunk(b"IDAT", b"".join(body)) + chunk(b"IEND", b"")
    return _SIGNATURE + whole


def _predicted(rows: npt.NDArray[np.uint8], values: int) -> npt.NDArray[np.uint8]:
    """Filter each row: none, minus its left neighbours, or minus the row above.

    The filter with the smallest absolute values is chosen, because it compresses best. Returns
    uint8[h, 1 + w], with the filter's number first.

    Args:
        rows: uint8[h, w], the top row first.
        values: number of values per pixel.
    """
    left, above = rows.copy(), rows.copy()
    left[:, values:] -= rows[:, :-values]
    above[1:] -= rows[:-1]
    every = np.stack([rows, left, above])
    cost = np.minimum(every, 0 - every).sum(axis=2, dtype=np.int64)
    best = np.argmin(cost, axis=0)
    chosen = np.take_along_axis(every, best[None, :, None], axis=0)[0]
    return np.concatenate([best[:, None].astype(np.uint8), chosen], axis=1)


def has_opacity(data: bytes) -> bool:
    """Whether a file is an 8-bit PNG with opacity, as hair textures have.

    Args:
        data: the bytes of the file.
    """
    return _header(data)[2:] in ((8, 6), (8, 4))


def read_png(data: bytes) -> Floats | None:
    """Read an image without opacity that `png` wrote; None for other or damaged files.

    Args:
        data: the bytes of the file.

    Returns:
        float64[h, w] or [h, w, 3], from 0 to 1; row 0 is the bottom.
    """
    pixels = read_pixels(data)
    return None if pixels is None else np.asarray(pixels / 255.0)


def read_pixels(data: bytes, *, opacity: bool = False) -> Pixels | None:
    """Read an image that `png` wrote, as uint8 from 0 to 255; None for other or damaged files.

    Args:
        data: the bytes of the file.
        opacity: True: also read images [h, w, 4], whose fourth value is the opacity.

    Returns:
        uint8[h, w], [h, w, 3] or [h, w, 4]; row 0 is the bottom.
    """
    shape = pixels_of(data, opacity=opacity)
    if shape is None:
        return None
    height, width, values = shape
    body = _body(data, height * (1 + width * values))
    rows = np.frombuffer(body, np.uint8).reshape(height, -1) if body else None
    if rows is None or rows[:, 0].max(initial=0) > 2:  # another program's filters
        return None
    pixels = _unpredicted(rows, values)
    pixels = pixels.reshape((height, width, values) if values > 1 else (height, width))
    return pixels[::-1]


def pixels_of(data: bytes, *, opacity: bool = False) -> tuple[int, int, int] | None:
    """Height, width and values per pixel that a file declares.

    None if these numbers, or the declared format, show that read_pixels cannot read the file.

    Args:
        data: the bytes of the file.
        opacity: True: also accept images of colour with opacity.
    """
    width, height, depth, kind = _header(data)
    values = ({0: 1, 2: 3, 6: 4} if opacity else {0: 1, 2: 3}).get(kind, 0)
    if depth != 8 or any(data[26:29]) or not 0 < width * height * values <= 3 * _MOST_TEXELS:
        return None
    return height, width, values


def _header(data: bytes) -> tuple[int, int, int, int]:
    """Width, height, bits per value and colour type of a PNG; zeros for other files."""
    if data[:8] != _SIGNATURE or len(data) < 33 or data[12:16] != b"IHDR":
        return 0, 0, 0, 0
    width, height, depth, kind = struct.unpack(">IIBB", data[16:26])
    return width, height, depth, kind


def _unpredicted(rows: npt.NDArray[np.uint8], values: int) -> npt.NDArray[np.uint8]:
    out = rows[:, 1:].copy()
    for number, way in enumerate(rows[:, 0]):
        if way == 1:
            pixels = out[number].reshape(-1, values)
            np.cumsum(pixels, axis=0, dtype=np.uint8, out=pixels)
        elif way == 2 and number:
            out[number] += out[number - 1]
    return out


def _body(data: bytes, size: int) -> bytearray:
    """The decompressed rows; empty if their total size is not `size`."""
    unpacked, out = zlib.decompressobj(), bytearray()
    try:
        for kind, part in _chunks(data):
            if kind == b"IDAT":
                out += unpacked.decompress(part, size + 1 - len(out))
    except zlib.error:
        return bytearray()
    return out if len(out) == size else bytearray()


def _chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    out, at = [], 8
    while at + 8 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        out.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    return out
