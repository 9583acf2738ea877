# SPDX-License-Identifier: MIT
"""Files that are whole or not there."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import IO

_PART = ".part"


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """A file to write that takes its name when it is whole, on the disk too.

    An old file of the name stays until then. Whoever dies in between leaves a file `.NAME.*.part`,
    see remove_parts.

    Raises:
        OSError: it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # A name of its own: the same job may still run on a worker that was given up for dead.
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}{_PART}")
    try:
        with open(beside, "x+b") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(beside, path)
    except BaseException:
        with contextlib.suppress(OSError):
            beside.unlink()
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Make a new name outlive a power failure, where the system can."""
    if os.name == "nt":
        return
    with contextlib.suppress(OSError):  # some network folders do not know it
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def remove_parts(path: Path) -> None:
    """Delete what killed writers of a file left beside it."""
    if not path.parent.is_dir():
        return
    before, size = f".{path.name}.", len(path.name) + 10 + len(_PART)
    for name in os.listdir(path.parent):
        if name.startswith(before) and name.endswith(_PART) and len(name) == size:
            with contextlib.suppress(OSError):
                path.with_name(name).unlink()


def digest(path: Path) -> str:
    """SHA-256 of a file's bytes. Raises: OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sentence(error: BaseException) -> str:
    """What went wrong, with the file's name where the error knows it."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return "not enough memory"
    return str(error) or type(error).__name__
