# SPDX-License-Identifier: MIT
"""Reads the size of each layer in bytes from a DNA file."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from itertools import pairwise

TITLES = {
    "desc": "descriptor",
    "defn": "definition",
    "bhvr": "behavior",
    "geom": "geometry",
    "mlbh": "neural networks",
    "rbfb": "RBF solvers",
    "rbfe": "RBF poses",
    "jbmd": "joint metadata",
    "twsw": "twist and swing",
    "mlbe": "network operations",
    "dsce": "descriptor extension",
}
_SECTIONS_OF_2_1 = (
    "descriptor",
    "definition",
    "controls",
    "joints",
    "blend shape channels",
    "animated maps",
    "geometry",
)


@dataclass(frozen=True)
class Layer:
    """A layer of the file, or a range of bytes in no layer. `key` is the layer's four-letter code
    in the file's index, or "" if the file has no index or the bytes are in no layer."""

    key: str
    title: str
    offset: int
    size: int


@dataclass(frozen=True)
class Extras:
    """Numbers from layers that old files do not have: controls that networks write, controls that
    RBF poses write, and networks."""

    ml_controls: int
    rbf_poses: int
    networks: int


class _Bytes:
    """Reads big-endian fields, and raises ValueError at the end of its layer."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def u32(self) -> int:
        if self.at + 4 > len(self.data):
            raise ValueError("the layer ends early")
        self.at += 4
        return int(struct.unpack_from(">I", self.data, self.at - 4)[0])

    def skip(self, count: int) -> None:
        if self.at + count > len(self.data):
            raise ValueError("the layer ends early")
        self.at += count

    def skip_texts(self) -> int:
        count = self.u32()
        for _ in range(count):
            self.skip(self.u32())
        return count

    def skip_list(self, depth: int) -> None:
        """Skips lists of u16. Args: depth: 1 for a list of u16, 2 for a list of such lists."""
        count = self.u32()
        if depth == 1:
            self.skip(2 * count)
            return
        for _ in range(count):
            self.skip_list(depth - 1)


def read_layers(data: bytes) -> list[Layer]:
    """The layers in file order, plus entries for other bytes; sizes add up to the file's size.

    Args:
        data: the bytes of a DNA file that `risorius.load` accepts.
    """
    version = int.from_bytes(data[5:7], "big")
    found = _sections_of_2_1(data) if version == 1 else _entries(data)
    return _with_gaps(sorted(found, key=lambda layer: (layer.offset, layer.size)), len(data))


def _sections_of_2_1(data: bytes) -> list[Layer]:
    offsets = struct.unpack_from(">8I", data, 7)
    # The third offset, of "behavior", is skipped, because that section has no bytes of its own.
    starts = [offsets[0], offsets[1], *offsets[3:8], len(data) - 3]
    layers = [Layer("", "header", 0, 39)]
    for title, (start, end) in zip(_SECTIONS_OF_2_1, pairwise(starts), strict=True):
        layers.append(Layer("", title, start, max(0, end - start)))
    return [*layers, Layer("", "end mark", len(data) - 3, 3)]


def _entries(data: bytes) -> list[Layer]:
    (count,) = struct.unpack_from(">I", data, 7)
    layers = [Layer("", "header and index", 0, 11 + 16 * count)]
    for i in range(count):
        key, _, offset, size = struct.unpack_from(">4sIII", data, 11 + 16 * i)
        text = key.decode("ascii", "backslashreplace")
        layers.append(Layer(text, TITLES.get(text, "of a kind unknown here"), offset, size))
    return layers


def _with_gaps(layers: list[Layer], end: int) -> list[Layer]:
    """The layers, followed by one entry if some of the file's `end` bytes are in no layer.

    The entry's size is the number of these bytes; its offset is the number of all other bytes."""
    covered, at = 0, 0
    for layer in layers:
        stop = min(end, layer.offset + layer.size)
        covered += max(0, stop - max(at, layer.offset))
        at = max(at, stop)
    if covered < end:
        layers = [*layers, Layer("", "in no layer", covered, end - covered)]
    return layers


def read_extras(data: bytes) -> Extras:
    """Reads counts from the layers of networks and RBF poses; 0 for absent or damaged layers.

    Args:
        data: the bytes of a DNA file."""
    if int.from_bytes(data[5:7], "big") == 1:
        return Extras(0, 0, 0)
    bodies = {x.key: data[x.offset : x.offset + x.size] for x in _entries(data) if x.key}
    ml_controls, networks = _machine_learning(bodies.get("mlbh", b""))
    return Extras(ml_controls, _pose_controls(bodies), networks)


def _machine_learning(body: bytes) -> tuple[int, int]:
    """(number of controls that networks write, number of networks) from the layer mlbh."""
    reader, names = _Bytes(body), 0
    try:
        names = reader.skip_texts()
        reader.skip_list(1)
        reader.skip_list(2)
        for _ in range(reader.u32()):
            reader.skip_texts()
        reader.skip_list(3)
        return names, reader.u32()
    except ValueError:
        return names, 0


def _pose_controls(bodies: dict[str, bytes]) -> int:
    """The number of controls that RBF poses write, from the layer rbfe; if this layer names no
    controls, the number of poses in the layer rbfb."""
    try:
        reader = _Bytes(bodies.get("rbfe", b""))
        if names := reader.u32():
            return names
    except ValueError:
        pass
    try:
        reader = _Bytes(bodies.get("rbfb", b""))
        reader.skip_list(1)
        reader.skip_list(2)
        for _ in range(reader.u32()):
            reader.skip(reader.u32())
        return reader.u32()
    except ValueError:
        return 0
