# SPDX-License-Identifier: GPL-3.0-or-later
"""Detects truncated files of Blender's exporters, because USD reports success on a full disk."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

_CRATE, _OGAWA = b"PXR-USDC", b"Ogawa"
_SECTION = struct.Struct("<16sqq")  # section of a USD crate file: name, offset, size in bytes


def is_cut(path: Path) -> bool:
    """Whether the end of a USD or Alembic file is missing, or a file of another format is empty.

    Args:
        path: path of a closed file.

    Raises:
        OSError: the file cannot be read.
    """
    if path.suffix.lower() == ".usdz":
        return not zipfile.is_zipfile(path)  # a ZIP file has its directory at the end
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(24)
        if head.startswith(_CRATE):
            contents = int.from_bytes(head[16:24], "little")
            file.seek(min(contents, size))
            return _contents_cut(file.read(), size) or not 0 < contents < size
        if head.startswith(_OGAWA):  # byte 5: 0xff if finished; bytes 8 to 15: position of the root
            return head[5:6] != b"\xff" or not 0 < int.from_bytes(head[8:16], "little") < size
        if head.startswith(b"#usda"):
            file.seek(max(0, size - 64))
            return not file.read().rstrip().endswith((b"}", b")"))
    return size == 0


def _contents_cut(table: bytes, size: int) -> bool:
    """Whether a section of a USD crate file, or the table of its sections, is cut off.

    Args:
        table: the bytes of the file from the beginning of its table of sections.
        size: size of the file in bytes.
    """
    count = int.from_bytes(table[:8], "little")
    if not 0 < count <= (len(table) - 8) // _SECTION.size:
        return True
    rows = [_SECTION.unpack_from(table, 8 + i * _SECTION.size) for i in range(count)]
    return any(begin < 0 or length < 0 or begin + length > size for _, begin, length in rows)
