# SPDX-License-Identifier: MIT
"""Files that are whole or not there."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO

_PART = ".part"
_TOKEN = 8


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
    beside = path.with_name(f".{path.name}.{secrets.token_hex(_TOKEN // 2)}{_PART}")
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


def remove_parts(paths: Iterable[Path]) -> None:
    """Delete what killed writers of these files left beside them."""
    folders: dict[Path, set[str]] = {}
    for path in paths:
        folders.setdefault(path.parent, set()).add(path.name)
    for folder, names in folders.items():
        with contextlib.suppress(OSError):  # it is not there, or what is in it is in use
            for entry in os.listdir(folder):
                whole = entry[1:].removesuffix(_PART)[: -1 - _TOKEN]
                if entry.endswith(_PART) and entry.startswith(".") and whole in names:
                    (folder / entry).unlink()


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
