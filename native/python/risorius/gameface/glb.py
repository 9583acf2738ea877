# SPDX-License-Identifier: MIT
"""Writes a GLB file: accessors that are dense, sparse, or packed with meshoptimizer."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _native

Numbers = npt.NDArray[Any]

MESHOPT = "EXT_meshopt_compression"
QUANTIZED = "KHR_mesh_quantization"
_COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
_VERTICES, _CORNERS = 34962, 34963


class Glb:
    """The JSON table and the binary buffer of a GLB file under construction.

    Attributes:
        table: the JSON; callers append nodes and meshes to its lists.
        packs: whether vertices and triangles are packed with meshoptimizer.
        sparse: whether an accessor of a morph target whose rows are mostly zero stores only the
            nonzero rows; without effect if `packs` is set.
        pictures: name of a picture file of the face without suffix, "_" and the role of the picture
            -> number of the texture made from the file.
    """

    def __init__(self, *, packs: bool = False, sparse: bool = False) -> None:
        self.packs, self.sparse = packs, sparse
        self.table: dict[str, Any] = {"accessors": [], "bufferViews": []}
        self.pictures: dict[str, int] = {}
        self._binary = bytearray()
        # bytes of buffer 1, which is not stored: packed views declare their unpacked size in it
        self._unpacked = 0

    def vertices(self, values: Numbers, *, normalized: bool = False, bounds: bool = False) -> int:
        """Adds an accessor with one row per vertex, and returns its number.

        Args:
            values: [V, k] of int8, uint8, int16, uint16 or float32.
            normalized: whether integers mean -1 to 1 (signed) or 0 to 1 (unsigned).
            bounds: whether to write minimum and maximum, which glTF requires for positions.
        """
        about = self._about(values, normalized, bounds)
        about["bufferView"] = self._rows(values)
        return self._accessor(about)

    def changes(self, values: Numbers, *, normalized: bool = False, bounds: bool = False) -> int:
        """Adds an accessor of a morph target, and returns its number.

        If all values are 0, no bytes are stored; zero rows take no bytes in a sparse accessor.

        Args:
            values, normalized, bounds: as for `vertices`.
        """
        about = self._about(values, normalized, bounds)
        moved = np.flatnonzero(values.any(axis=1))
        wide = 2 if len(values) <= 0xFFFF else 4
        kept = len(moved) * (wide + values.dtype.itemsize * values.shape[1])
        if len(moved) and (not self.sparse or self.packs or kept >= len(values) * _stride(values)):
            about["bufferView"] = self._rows(values)
        elif len(moved):
            rows = moved.astype(f"<u{wide}")
            about["sparse"] = {
                "count": len(moved),
                "indices": {
                    "bufferView": self.view(rows.tobytes()),
                    "componentType": _COMPONENTS[f"u{wide}"],
                },
                "values": {"bufferView": self.view(values[moved].tobytes())},
            }
        return self._accessor(about)

    def corners(self, triangles: Numbers, vertices: int) -> int:
        """Adds an accessor of triangles. Args: triangles: int[T, 3]; vertices: vertex count."""
        wide = 2 if vertices <= 0xFFFF else 4
        flat = triangles.reshape(-1).astype(f"<u{wide}")
        about = self._about(flat[:, None], False, False)
        if self.packs:
            view = self._packed(flat.tobytes(), len(flat), wide, "TRIANGLES")
        else:
            view = self.view(flat.tobytes(), target=_CORNERS)
        return self._accessor({**about, "bufferView": view})

    def plain(self, values: Numbers) -> int:
        """Adds an accessor without padding and compression. Args: values: as for `vertices`."""
        about = self._about(values, False, False)
        return self._accessor({**about, "bufferView": self.view(values.tobytes())})

    def matrices(self, values: Numbers) -> int:
        """Adds an accessor of matrices. Args: values: float[n, 4, 4], row-major."""
        flat = np.ascontiguousarray(np.swapaxes(values, 1, 2), "<f4").reshape(-1, 16)
        return self._accessor(
            {**self._about(flat, False, False), "bufferView": self.view(flat.tobytes())}
        )

    def view(self, data: bytes, *, target: int = 0, stride: int = 0) -> int:
        """Adds a buffer view of unchanged bytes, and returns its number.

        Args:
            data: the bytes.
            target: code of vertex or index buffers, 0 for other data.
            stride: bytes per row, 0 for data without rows.
        """
        about: dict[str, Any] = {
            "buffer": 0,
            "byteOffset": self._put(data),
            "byteLength": len(data),
        }
        if target:
            about["target"] = target
        if stride:
            about["byteStride"] = stride
        self.table["bufferViews"].append(about)
        return len(self.table["bufferViews"]) - 1

    def uses(self, extension: str, *, required: bool) -> None:
        """Adds an extension to the lists of the JSON.

        Args:
            extension: name of the extension.
            required: whether a program without it cannot read the file.
        """
        for key in ("extensionsUsed", "extensionsRequired")[: 1 + required]:
            if extension not in self.table.setdefault(key, []):
                self.table[key].append(extension)

    @property
    def size(self) -> int:
        """Bytes of the binary buffer so far."""
        return len(self._binary)

    def data(self) -> bytes:
        """The bytes of the GLB file."""
        if self._unpacked:
            self.uses(MESHOPT, required=True)
        buffers: list[dict[str, Any]] = [{"byteLength": len(self._binary)}]
        if self._unpacked:
            fallback = {"byteLength": self._unpacked, "extensions": {MESHOPT: {"fallback": True}}}
            buffers.append(fallback)
        table = {"asset": {"version": "2.0", "generator": "Risorius"}, **self.table}
        table = {key: value for key, value in table.items() if value != []} | {"buffers": buffers}
        text = json.dumps(table, ensure_ascii=False, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self._binary) + b"\0" * (-len(self._binary) % 4)
        whole = 12 + 8 + len(text) + 8 + len(binary)
        return b"".join(
            [
                struct.pack("<4sII", b"glTF", 2, whole),
                struct.pack("<I4s", len(text), b"JSON"), text,
                struct.pack("<I4s", len(binary), b"BIN\0"), binary,
            ]
        )  # fmt: skip

    def _about(self, values: Numbers, normalized: bool, bounds: bool) -> dict[str, Any]:
        about: dict[str, Any] = {
            "componentType": _COMPONENTS[values.dtype.str[1:]],
            "count": len(values),
            "type": _TYPES[values.shape[1]],
        }
        if normalized:
            about["normalized"] = True
        if bounds:
            about["min"] = values.min(axis=0).tolist()
            about["max"] = values.max(axis=0).tolist()
        return about

    def _accessor(self, about: dict[str, Any]) -> int:
        self.table["accessors"].append(about)
        return len(self.table["accessors"]) - 1

    def _rows(self, values: Numbers) -> int:
        """A buffer view with rows at multiples of 4 bytes, which glTF requires of vertices."""
        stride = _stride(values)
        own = values.dtype.itemsize * values.shape[1]
        flat = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), own)
        data = np.pad(flat, ((0, 0), (0, stride - own))).tobytes()
        if self.packs:
            return self._packed(data, len(values), stride, "ATTRIBUTES")
        return self.view(data, target=_VERTICES, stride=stride)

    def _packed(self, data: bytes, count: int, stride: int, mode: str) -> int:
        packed = _native.pack_buffer(data, count, stride, mode, "NONE")
        own = {"buffer": 0, "byteOffset": self._put(packed), "byteLength": len(packed)}
        about: dict[str, Any] = {
            "buffer": 1,
            "byteOffset": self._unpacked,
            "byteLength": len(data),
            "target": _VERTICES if mode == "ATTRIBUTES" else _CORNERS,
            "extensions": {MESHOPT: {**own, "byteStride": stride, "mode": mode, "count": count}},
        }
        if mode == "ATTRIBUTES":
            about["byteStride"] = stride
        self._unpacked += len(data) + -len(data) % 4
        self.table["bufferViews"].append(about)
        return len(self.table["bufferViews"]) - 1

    def _put(self, data: bytes) -> int:
        self._binary += b"\0" * (-len(self._binary) % 4)
        place = len(self._binary)
        self._binary += data
        return place


def _stride(values: Numbers) -> int:
    """Bytes of a row, rounded up to a multiple of 4."""
    own = int(values.dtype.itemsize * values.shape[1])
    return own + -own % 4
