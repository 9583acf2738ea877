# SPDX-License-Identifier: MIT
"""PNG files as this package writes them: 8 bits, grey or colour, rows as they are or predicted."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MOST_TEXELS = 1 << 26


def png(image: Floats) -> bytes:
    """An 8-bit PNG of float [h, w], [h, w, 3] or [h, w, 4] in [0, 1]; row 0 is the bottom (v = 0).

    The fourth value is the opacity, which the colour is not multiplied with.
    """
    pixels = np.clip(np.rint(image[::-1] * 255), 0, 255).astype(np.uint8)
    height, width = pixels.shape[:2]
    values = 1 if pixels.ndim == 2 else pixels.shape[2]
    kind = {1: 0, 3: 2, 4: 6}[values]
    rows = _predicted(pixels.reshape(height, -1), values)

    def chunk(name: bytes, data: bytes) -> bytes:
        crc = zlib.crc32(name + data)
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", crc)

    header = struct.pack(">IIBBBBB", width, height, 8, kind, 0, 0, 0)
    body = zlib.compress(rows.tobytes(), 6)
    return _SIGNATURE + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def _predicted(rows: npt.NDArray[np.uint8], values: int) -> npt.NDArray[np.uint8]:
    """uint8[h, 1 + w]: each row as it is, less its left neighbours or less the row below, whichever
    is nearest to nothing and so packs best; before it the number that says which.

    Args:
        rows: uint8[h, w], the uppermost first.
        values: of a pixel.
    """
    left, above = rows.copy(), rows.copy()
    left[:, values:] -= rows[:, :-values]
    above[1:] -= rows[:-1]
    every = np.stack([rows, left, above])
    cost = np.minimum(every, 0 - every).sum(axis=2, dtype=np.int64)
    best = np.argmin(cost, axis=0)
    chosen = np.take_along_axis(every, best[None, :, None], axis=0)[0]
    return np.concatenate([best[:, None].astype(np.uint8), chosen], axis=1)


def read_png(data: bytes) -> Floats | None:
    """An image without opacity that png wrote, or None: another kind of file, or damaged.

    Args:
        data: of the file.

    Returns:
        float64[h, w] or [h, w, 3] in [0, 1]; row 0 is the bottom.
    """
    if data[:8] != _SIGNATURE or len(data) < 33 or data[12:16] != b"IHDR":
        return None
    width, height, depth, kind, *others = struct.unpack(">IIBBBBB", data[16:29])
    values = {0: 1, 2: 3}.get(kind, 0)
    if depth != 8 or any(others) or not 0 < width * height * values <= 3 * _MOST_TEXELS:
        return None
    body = _body(data, height * (1 + width * values))
    rows = np.frombuffer(body, np.uint8).reshape(height, -1) if body else None
    if rows is None or rows[:, 0].max(initial=0) > 2:  # another program's, which predicts more
        return None
    pixels = _unpredicted(rows, values)
    pixels = pixels.reshape((height, width, values) if values > 1 else (height, width))
    return np.asarray(pixels[::-1] / 255.0)


def _unpredicted(rows: npt.NDArray[np.uint8], values: int) -> npt.NDArray[np.uint8]:
    out = rows[:, 1:].copy()
    for number, way in enumerate(rows[:, 0]):
        if way == 1:
            pixels = out[number].reshape(-1, values)
            np.cumsum(pixels, axis=0, dtype=np.uint8, out=pixels)
        elif way == 2 and number:
            out[number] += out[number - 1]
    return out


def _body(data: bytes, size: int) -> bytes:
    """The rows, unpacked; none where they are not of this size."""
    unpacked, out = zlib.decompressobj(), b""
    try:
        for kind, part in _chunks(data):
            if kind == b"IDAT":
                out += unpacked.decompress(part, size + 1 - len(out))
    except zlib.error:
        return b""
    return out if len(out) == size else b""


def _chunks(data: bytes) -> list[tuple[bytes, bytes]]:
    out, at = [], 8
    while at + 8 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        out.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    return out
