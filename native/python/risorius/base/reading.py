# SPDX-License-Identifier: MIT
"""Whole files and streams in memory, of a size that is known to fit before it is read."""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from typing import BinaryIO

from .errors import RisoriusError

TEXT = 16 << 20
"""Bytes of what a person wrote: specs, mappings, jobs, transcripts."""
MESH = 1 << 29
"""Bytes of a mesh or a take, as text or not."""
FACE = 4 << 30
"""Bytes of a DNA file, which its own format allows, also as JSON."""
_PIECE = 1 << 20


class ReadingError(RisoriusError):
    """A file that is larger than its kind may be, or that has no end.

    Attributes:
        name: of the file.
        what: what was expected and what was found.
    """

    code = "reading"

    def __init__(self, name: str, what: str) -> None:
        super().__init__(f"{name}: {what}")
        self.name, self.what = name, what


def read_file(path: str | os.PathLike[str], most: int, *, found: bool = False) -> bytes:
    """The bytes of a file; how large it is, is asked before it is read.

    Args:
        path: of the file.
        most: bytes that it may have.
        found: nobody typed this name: it is out of another file or a folder, where a pipe would be
            waited for without end.

    Raises:
        ReadingError: larger, a device, or a pipe that was found.
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
    """A file or a pipe, open for reading.

    Args:
        path: of it.

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
        most: bytes that may be left.
        name: of the stream, for the error.

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
    """Refuse what is no file, though its name was found among files.

    Raises:
        ReadingError: a pipe, a socket, a device.
        OSError: it is not there, or links to itself.
    """
    mode = os.stat(path).st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):  # reading a folder is an OSError
        raise ReadingError(os.fspath(path), "a file was expected, found a pipe or a device")


def _too_large(most: int, found: str) -> str:
    return f"at most {most:,} bytes were expected, found {found}"
