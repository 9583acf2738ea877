# SPDX-License-Identifier: MIT
"""Reads whole files and streams whose size is checked before reading."""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from typing import BinaryIO

from .errors import RisoriusError

TEXT = 16 << 20
"""Largest text file that a person writes: specs, mappings, jobs, transcripts."""
MESH = 1 << 29
"""Largest file of a mesh or a take."""
FACE = 4 << 30
"""Largest DNA file that the format allows, also as JSON."""
_PIECE = 1 << 20


class ReadingError(RisoriusError):
    """A file that is larger than its kind may be, or that has no end.

    Attributes:
        name: name of the file.
        what: the expected and the found value.
    """

    code = "reading"

    def __init__(self, name: str, what: str) -> None:
        super().__init__(f"{name}: {what}")
        self.name, self.what = name, what


def read_file(path: str | os.PathLike[str], most: int, *, found: bool = False) -> bytes:
    """The bytes of a file, after a check of its size.

    Args:
        path: path of the file.
        most: largest number of bytes.
        found: the name comes from another file or a folder, not from a user; then a pipe is
            refused, because reading it could wait for ever.

    Raises:
        ReadingError: the file is larger, a device, or a pipe with `found`.
        OSError: it cannot be read.
    """
    name = os.fspath(path)
    if found:
        require_regular(name)
    with open_file(name) as file:
        about = os.fstat(file.fileno())
        if stat.S_ISREG(about.st_mode) and about.st_size > most:
            raise ReadingError(name, _too_large(most, f"{about.st_size:,}"))
        return read_stream(file, most, name)


def open_file(path: str | os.PathLike[str]) -> BufferedReader:
    """Open a file or a pipe for reading.

    Args:
        path: path of the file.

    Raises:
        ReadingError: a device, which has no end.
        OSError: it cannot be read.
    """
    file = open(path, "rb")  # noqa: SIM115  the caller closes it
    if stat.S_ISCHR(os.fstat(file.fileno()).st_mode) and not file.isatty():
        file.close()
        raise ReadingError(os.fspath(path), "a file was expected, found a device")
    return file


def read_stream(file: BinaryIO, most: int, name: str) -> bytes:
    """The rest of a stream, read in pieces.

    Args:
        file: open for reading.
        most: largest number of bytes left.
        name: name of the stream, for the error.

    Raises:
        ReadingError: more are left.
        OSError: it cannot be read.
    """
    pieces: list[bytes] = []
    left = most + 1
    while left and (piece := file.read(min(left, _PIECE))):
        pieces.append(piece)
        left -= len(piece)
    if not left:
        raise ReadingError(name, _too_large(most, "more"))
    return b"".join(pieces)


def require_regular(path: str | os.PathLike[str]) -> None:
    """Raise an error if a name found among files is not a file.

    Raises:
        ReadingError: a pipe, a socket, a device.
        OSError: the file does not exist, or links to itself.
    """
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # reading a folder is an OSError
        raise ReadingError(os.fspath(path), "a file was expected, found a pipe or a device")


def _too_large(most: int, found: str) -> str:
    return f"at most {most:,} bytes were expected, found {found}"
