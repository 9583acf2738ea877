# SPDX-License-Identifier: MIT
"""Reads files and streams completely, with a limit on their size."""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from typing import BinaryIO

from .errors import RisoriusError

TEXT = 16 << 20
"""Largest size in bytes of text files that people write: specs, mappings, jobs, transcripts."""
MESH = 1 << 29
"""Largest size in bytes of a file with a mesh or a take."""
FACE = 4 << 30
"""Largest size in bytes of a DNA file, also as JSON; the format allows no more."""
_PIECE = 1 << 20


class ReadingError(RisoriusError):
    """A file that exceeds the size limit, or a device, which has no end.

    Attributes:
        name: name of the file.
        what: text with the expected and the found value.
    """

    code = "reading"

    def __init__(self, name: str, what: str) -> None:
        super().__init__(f"{name}: {what}")
        self.name, self.what = name, what


def read_file(path: str | os.PathLike[str], most: int, *, found: bool = False) -> bytes:
    """Read a file after a check of its size.

    Args:
        path: path of the file.
        most: largest number of bytes to accept.
        found: True: the name comes from another file or a folder and not from a user; then a pipe
            is refused, because reading it might wait for ever.

    Raises:
        ReadingError: the file is larger, is a device, or is a pipe while `found` is True.
        OSError: the file cannot be read.
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
        ReadingError: the file is a character device other than a terminal; such a device may have
            no end.
        OSError: the file cannot be read.
    """
    file = open(path, "rb")  # noqa: SIM115  the caller closes it
    if stat.S_ISCHR(os.fstat(file.fileno()).st_mode) and not file.isatty():
        file.close()
        raise ReadingError(os.fspath(path), "a file was expected, found a device")
    return file


def read_stream(file: BinaryIO, most: int, name: str) -> bytes:
    """Read the rest of a stream, in pieces.

    Args:
        file: stream open for reading.
        most: largest number of bytes to accept.
        name: name of the stream for the error.

    Raises:
        ReadingError: the rest is longer than `most`.
        OSError: the stream cannot be read.
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
    """Raise an error if a path that was found in a folder or file is a pipe, a socket or a device.

    Args:
        path: path of a file or a folder; a link is followed.

    Raises:
        ReadingError: the path is a pipe, a socket or a device.
        OSError: the file does not exist, or links to itself.
    """
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # reading a folder raises OSError
        raise ReadingError(os.fspath(path), "a file was expected, found a pipe or a device")


def _too_large(most: int, found: str) -> str:
    return f"at most {most:,} bytes were expected, found {found}"
