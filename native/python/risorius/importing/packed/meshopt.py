# SPDX-License-Identifier: MIT
"""Unpacks buffer views of glTF files: EXT_meshopt_compression and KHR_meshopt_compression, which
has the same fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ... import _native
from ...base.given import GivenError, shown, text, whole

EXTENSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
MODES = ("ATTRIBUTES", "TRIANGLES", "INDICES")
FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL")
_WIDEST = 256  # largest number of bytes per row


@dataclass(frozen=True)
class Packing:
    """The fields of the extension that packs a buffer view.

    Attributes:
        name: name of the extension.
        table: the extension's table; buffer, byteOffset and byteLength locate the packed bytes.
        count, stride: rows, and bytes per row, after unpacking.
        mode, filter: one of MODES and one of FILTERS.
    """

    name: str
    table: Mapping[str, Any]
    count: int
    stride: int
    mode: str
    filter: str

    @property
    def size(self) -> int:
        """Number of bytes after unpacking."""
        return self.count * self.stride


def packing_of(view: Mapping[str, Any]) -> Packing | None:
    """Reads how a buffer view is packed; None if it is not packed.

    Args:
        view: the buffer view's table in the JSON.

    Raises:
        GivenError: an invalid entry; the message begins with the name of the extension.
    """
    found = view.get("extensions")
    extensions = found if isinstance(found, dict) else {}
    for name in EXTENSIONS:
        table = extensions.get(name)
        if table is None:
            continue
        if not isinstance(table, dict):
            raise GivenError(f"{name}: a table was expected, found {shown(table)}")
        return Packing(
            name,
            table,
            _whole(name, table, "count"),
            _whole(name, table, "byteStride", _WIDEST),
            _word(name, table, "mode", MODES),
            _word(name, table, "filter", FILTERS) if "filter" in table else FILTERS[0],
        )
    return None


def unpacked(packed: bytes, packing: Packing) -> bytes:
    """The packing.size bytes of a buffer view, unpacked.

    Args:
        packed: the compressed bytes of the buffer view.
        packing: from packing_of.

    Raises:
        GivenError: bytes of another kind, damaged bytes, or a row size that the mode does not
            allow.
    """
    try:
        return _native.unpack_buffer(
            packed, packing.count, packing.stride, packing.mode, packing.filter
        )
    except ValueError as error:
        raise GivenError(f"{packing.name}: {error}") from None


def _whole(name: str, table: Mapping[str, Any], key: str, high: int = 1 << 31) -> int:
    try:
        return whole(table.get(key), 0, high)
    except GivenError as error:
        raise GivenError(f"{name}.{key}: {error}") from None


def _word(name: str, table: Mapping[str, Any], key: str, known: tuple[str, ...]) -> str:
    try:
        found = text(table.get(key))
    except GivenError as error:
        raise GivenError(f"{name}.{key}: {error}") from None
    if found not in known:
        raise GivenError(
            f"{name}.{key}: one of {', '.join(known)} was expected, found {shown(found)}"
        )
    return found
