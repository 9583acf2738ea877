# SPDX-License-Identifier: MIT
"""Writes baseline JPEG files, grey or colour, with Huffman codes made for the picture.

Used for files that are sent over a network: a PNG of a painted face is five times as large.
"""

from __future__ import annotations

import heapq
import struct

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Pixels = npt.NDArray[np.uint8]

_LONGEST = 16  # longest code in bits
_RUN, _END = 0xF0, 0x00  # symbols: sixteen zeros, and end of the block
# Quantisation tables of annex K of the standard, for quality 50, row by row.
_LUMA = np.array(
    """16 11 10 16 24 40 51 61 12 12 14 19 26 58 60 55 14 13 16 24 40 57 69 56 14 17 22 29 51 87
    80 62 18 22 37 56 68 109 103 77 24 35 55 64 81 104 113 92 49 64 78 87 103 121 120 101 72 92 95
    98 112 100 103 99""".split(),
    np.int64,
)
_CHROMA = np.full((8, 8), 99)
_CHROMA[:4, :4] = [[17, 18, 24, 47], [18, 21, 26, 66], [24, 26, 56, 99], [47, 66, 99, 99]]
_YCC = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


def _zigzag() -> Ints:
    places = [(row + column, row, column) for row in range(8) for column in range(8)]
    places.sort(key=lambda p: (p[0], p[1] if p[0] % 2 else p[2]))
    return np.array([8 * row + column for _, row, column in places])


def _cosines() -> Floats:
    k = np.arange(8)
    rows = np.cos((2 * k[None, :] + 1) * k[:, None] * np.pi / 16) / 2
    rows[0] /= np.sqrt(2)
    return np.asarray(rows)


_ZIGZAG, _COSINES = _zigzag(), _cosines()


def jpeg(pixels: Pixels, quality: int = 85, *, fine_color: bool = False) -> bytes:
    """Encode an image as a JPEG file.

    Args:
        pixels: uint8[h, w] or [h, w, 3], sides from 1 to 65535; row 0 is the bottom (v = 0), as in
            files.png.
        quality: 1 to 100, on the usual scale of JPEG programs; 100 is the best.
        fine_color: True: store the colour of each pixel, as normal maps need; False: one colour for
            2 by 2 pixels.
    """
    height, width = pixels.shape[:2]
    image = pixels[::-1].astype(np.float64)
    planes = [image] if image.ndim == 2 else list(np.moveaxis(image @ _YCC.T, 2, 0))
    planes[0] = planes[0] - 128.0
    side = 2 if len(planes) == 3 and not fine_color else 1  # blocks of brightness along a unit
    tables = [_scaled(_LUMA, quality), _scaled(_CHROMA.ravel(), quality)]
    units = []
    for number, plane in enumerate(planes):
        whole = _padded(plane, 8 * side)
        if number == 0 or side == 1:
            units.append(_blocks(whole, side, tables[min(number, 1)]))
            continue
        mean = (whole[::2, ::2] + whole[1::2, ::2] + whole[::2, 1::2] + whole[1::2, 1::2]) / 4
        units.append(_blocks(mean, 1, tables[1]))
    body, codes = _coded(units)
    frame = b"".join(
        bytes([i + 1, (side if i == 0 else 1) * 17, min(i, 1)]) for i in range(len(planes))
    )
    scan = b"".join(bytes([i + 1, 0x11 if i else 0]) for i in range(len(planes)))
    count = len(planes)
    parts = [b"\xff\xd8", _segment(0xE0, b"JFIF\0\1\1\0\0\1\0\1\0\0")]
    used = tables[: 2 if count == 3 else 1]
    parts += [_segment(0xDB, bytes([i]) + t[_ZIGZAG].tobytes()) for i, t in enumerate(used)]
    parts += [_segment(0xC0, struct.pack(">BHHB", 8, height, width, count) + frame)]
    parts += [_segment(0xC4, bytes([place]) + code) for place, code in codes]
    parts += [_segment(0xDA, bytes([count]) + scan + b"\0\x3f\0"), body, b"\xff\xd9"]
    return b"".join(parts)


def _segment(kind: int, data: bytes) -> bytes:
    return struct.pack(">BBH", 0xFF, kind, len(data) + 2) + data


def _scaled(table: Ints, quality: int) -> Pixels:
    percent = 5000 // quality if quality < 50 else 200 - 2 * quality
    return np.clip((table * percent + 50) // 100, 1, 255).astype(np.uint8)


def _padded(plane: Floats, step: int) -> Floats:
    rows, columns = (-size % step for size in plane.shape)
    return np.pad(plane, ((0, rows), (0, columns)), mode="edge")


def _blocks(plane: Floats, side: int, table: Pixels) -> Ints:
    """int64[units, side * side, 64]: quantised DCT coefficients of each block, in zigzag order.

    A unit of the file is a square of `side` by `side` blocks of 8 by 8 pixels.

    Args:
        plane: float64[h, w], one component of the image; both sides are multiples of 8 * side.
        side: number of blocks along a unit.
        table: uint8[64], quantisation table, row by row.
    """
    rows, columns = (size // (8 * side) for size in plane.shape)
    cut = plane.reshape(rows, side, 8, columns, side, 8).transpose(0, 3, 1, 4, 2, 5)
    waves = _COSINES @ cut @ _COSINES.T
    whole = np.rint(waves.reshape(-1, side * side, 64) / table).astype(np.int64)
    return whole[..., _ZIGZAG]


def _coded(units: list[Ints]) -> tuple[bytes, list[tuple[int, bytes]]]:
    """The encoded scan, and its Huffman tables as (class and number in one byte, table)."""
    per = [unit.shape[1] for unit in units]
    tokens = []
    for number, unit in enumerate(units):
        blocks = unit.reshape(-1, 64)
        turn = np.arange(len(blocks))
        order = turn // per[number] * sum(per) + sum(per[:number]) + turn % per[number]
        tokens.append(_tokens(blocks, order, min(number, 1)))
    keys, table, symbols, extra, bits = (np.concatenate(row) for row in zip(*tokens, strict=True))
    order = np.argsort(keys, kind="stable")
    table, symbols, extra, bits = table[order], symbols[order], extra[order], bits[order]
    codes, found = np.zeros((4, 256), np.int64), []
    lengths = np.zeros((4, 256), np.int64)
    for which in np.unique(table):
        counts = np.bincount(symbols[table == which], minlength=256)
        lengths[which], codes[which], text = _code(counts)
        found.append((int(which) >> 1 | (int(which) & 1) << 4, text))
    values = codes[table, symbols] << bits | extra
    return _packed(values, lengths[table, symbols] + bits), found


def _tokens(blocks: Ints, order: Ints, colour: int) -> tuple[Ints, ...]:
    """The tokens of a scan: Huffman-coded symbols that are each followed by extra bits.

    Returns, per token: number that sorts it into the scan, number of its Huffman table, symbol,
    extra bits, number of extra bits.

    Args:
        blocks: int64[n, 64], quantised DCT coefficients in zigzag order.
        order: int64[n], index of each block in the scan.
        colour: 0 for brightness, 1 for colour; the tables are 2 * colour and 2 * colour + 1.
    """
    steady = np.diff(blocks[:, 0], prepend=0)
    block, place = np.nonzero(blocks[:, 1:])
    place = place + 1
    before = np.where(np.diff(block, prepend=-1) == 0, np.roll(place, 1), 0)
    runs = place - before - 1
    waves = blocks[block, place]
    longs = np.repeat(np.arange(len(runs)), runs // 16)
    last = blocks[:, 63] == 0
    sizes, wave_sizes = _sizes(steady), _sizes(waves)
    end = np.nonzero(last)[0]
    none = np.zeros(len(longs), np.int64)
    nothing = np.zeros(len(end), np.int64)
    rows = (
        (order * 128, 0, sizes, _extra(steady, sizes), sizes),
        (order[block[longs]] * 128 + 2 * place[longs] - 1, 1, none + _RUN, none, none),
        (
            order[block] * 128 + 2 * place,
            1,
            runs % 16 << 4 | wave_sizes,
            _extra(waves, wave_sizes),
            wave_sizes,
        ),
        (order[end] * 128 + 127, 1, nothing + _END, nothing, nothing),
    )
    filled = [(k, np.full(len(k), 2 * colour + t), s, e, b) for k, t, s, e, b in rows]
    return tuple(np.concatenate(column) for column in zip(*filled, strict=True))


def _sizes(values: Ints) -> Ints:
    return np.ceil(np.log2(np.abs(values) + 1)).astype(np.int64)


def _extra(values: Ints, sizes: Ints) -> Ints:
    return np.where(values < 0, values + (1 << sizes) - 1, values)


def _code(counts: Ints) -> tuple[Ints, Ints, bytes]:
    """Code lengths and Huffman codes by symbol, and the table as the file stores it."""
    # The standard forbids a code of only ones, so the unused symbol 256 takes it.
    heap = [(int(n), i, [i]) for i, n in enumerate(counts) if n] + [(0, 256, [256])]
    long = np.zeros(257, np.int64)
    heapq.heapify(heap)
    while len(heap) > 1:
        a, b = heapq.heappop(heap), heapq.heappop(heap)
        long[a[2] + b[2]] += 1
        heapq.heappush(heap, (a[0] + b[0], min(a[1], b[1]), a[2] + b[2]))
    amounts = np.bincount(long[long > 0], minlength=_LONGEST + 1)
    for length in range(len(amounts) - 1, _LONGEST, -1):  # see figure K.3 of the standard
        while amounts[length] > 0:
            shorter = length - 2
            while amounts[shorter] == 0:
                shorter -= 1
            amounts[length] -= 2
            amounts[length - 1] += 1
            amounts[shorter + 1] += 2
            amounts[shorter] -= 1
    amounts = amounts[: _LONGEST + 1]
    amounts[np.nonzero(amounts)[0][-1]] -= 1
    symbols = sorted(np.nonzero(counts)[0], key=lambda s: (long[s], s))
    lengths, codes = np.zeros(256, np.int64), np.zeros(256, np.int64)
    code, at = 0, 0
    for length in range(1, _LONGEST + 1):
        for symbol in symbols[at : at + int(amounts[length])]:
            lengths[symbol], codes[symbol] = length, code
            code += 1
        at += int(amounts[length])
        code <<= 1
    return lengths, codes, bytes(amounts[1:].tolist()) + bytes(int(s) for s in symbols)


def _packed(values: Ints, lengths: Ints) -> bytes:
    ends = np.cumsum(lengths)
    token = np.repeat(np.arange(len(values)), lengths)
    below = ends[token] - 1 - np.arange(len(token))
    bits = (values[token] >> below & 1).astype(np.uint8)
    bits = np.append(bits, np.ones(-len(bits) % 8, np.uint8))
    return np.packbits(bits).tobytes().replace(b"\xff", b"\xff\0")
