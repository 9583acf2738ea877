# SPDX-License-Identifier: MIT
"""Atomic writing of files. Python code writes its outputs through this module, except journals,
which grow line by line."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING

from .._native import FileReplacement, make_hidden_folder, put_in_place, remove_leftovers

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

__all__ = [
    "check_writable",
    "replacing",
    "staging",
    "sweep",
    "write_all",
    "write_bytes",
    "write_text",
]

_Path = str | os.PathLike[str]


@contextlib.contextmanager
def replacing(path: _Path, *, sweep: bool = True) -> Iterator[IO[bytes]]:
    """Yield a file to write; it receives its name when it is complete and on disk.

    Only then an existing file is replaced; after an exception it stays. A link stays a link, and
    the permissions of an existing file stay. Until the file is complete, it has a hidden name in
    the same folder. Hidden files of killed processes are removed by the next write in that folder.
    Devices and pipes receive the bytes directly.

    Args:
        path: path of a file in an existing folder.
        sweep: True: remove hidden files of killed processes. For thousands of files in one folder,
            pass False and call sweep() once.

    Raises:
        OSError: the file cannot be written; the error names `path`.
    """
    name = os.fspath(path)
    if os.path.exists(name) and not os.path.isfile(name) and not os.path.isdir(name):
        with io.BufferedWriter(_Named(name, "wb", name)) as device:
            yield device
        return
    new = FileReplacement(name, sweep)
    try:
        with io.BufferedRandom(_Named(new.temporary, "r+b", name)) as file:
            yield file
        new.commit()
    finally:
        new.discard()


class _Named(io.FileIO):
    """A file whose write errors contain the name that the user knows."""

    def __init__(self, file: _Path, mode: str, shown: str) -> None:
        super().__init__(file, mode)
        self._shown = shown

    def write(self, data: ReadableBuffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise OSError(error.errno, error.strerror, self._shown) from None


def write_bytes(path: _Path, data: ReadableBuffer) -> None:
    """Write a file that receives its name when it is complete and on disk, as by replacing().

    Args:
        path: path of a file in an existing folder.
        data: the bytes to write.

    Raises:
        OSError: the file cannot be written; the error names `path`.
    """
    with replacing(path) as file:
        file.write(data)


def write_text(path: _Path, text: str) -> None:
    """Write a text file that receives its name when it is complete and on disk, as by replacing().

    Args:
        path: path of a file in an existing folder.
        text: the text, written as UTF-8 with unchanged line ends.

    Raises:
        OSError: the file cannot be written; the error names `path`.
    """
    write_bytes(path, text.encode())


def write_all(files: Mapping[Path, ReadableBuffer]) -> None:
    """Write several files that belong together; none gets its name before all are complete.

    Args:
        files: path -> bytes; the first file receives its name last. Missing folders are made, and
            removed again if writing fails.

    Raises:
        OSError: a file cannot be written. No file is changed then, except if the error occurs
            while the complete files receive their names.
    """
    made: list[Path] = []
    try:
        with contextlib.ExitStack() as stack:
            for path, data in files.items():
                made += _made(path.parent)
                file = stack.enter_context(replacing(path))
                file.write(data)
                file.flush()
    except BaseException:
        for folder in reversed(made):
            with contextlib.suppress(OSError):  # the folder is not empty
                folder.rmdir()
        raise


@contextlib.contextmanager
def staging(path: _Path) -> Iterator[Path]:
    """Yield a path with the same name in a hidden folder, for a library that opens the file itself.

    When the block ends, all files in the hidden folder are moved to the folder of `path`, with
    their subfolders, and the file itself last. Only then existing files are replaced; after an
    exception or a kill they stay. The hidden folder of a killed process is removed by the next
    write in that folder. Paths of devices and pipes are yielded unchanged.

    Args:
        path: path of a file in an existing folder.

    Raises:
        OSError: the folder cannot be written, or the block wrote no file; the error names `path`.
    """
    target = Path(path)
    if os.path.exists(target) and not target.is_file() and not target.is_dir():
        yield target
        return
    folder = Path(make_hidden_folder(target))
    try:
        yield folder / target.name
        _take_places(folder, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _take_places(folder: Path, target: Path) -> None:
    """Move the files of a staging folder to their final paths, `target` last."""
    main = folder / target.name
    if not main.is_file():
        raise FileNotFoundError(errno.ENOENT, "nothing was written", os.fspath(target))
    others = [p for p in folder.rglob("*") if p.is_file() and p != main]
    places = [folder.parent / other.relative_to(folder) for other in others]
    for place in places:
        place.parent.mkdir(parents=True, exist_ok=True)
    for file, place in zip([*others, main], [*places, target], strict=True):
        put_in_place(file, place)


def _made(folder: Path) -> list[Path]:
    """Make a folder and its parents. Returns the folders that were made, the outermost first."""
    missing = [part for part in (folder, *folder.parents) if not part.exists()][::-1]
    for part in missing:
        part.mkdir(exist_ok=True)
    return missing


def check_writable(path: _Path, *, parents: bool = False) -> None:
    """Check before long work whether replacing(path) will be possible.

    Args:
        path: path of a file; an existing file is not changed.
        parents: True: missing folders are allowed, because they will be made.

    Raises:
        OSError: it will not be possible; the error names `path` and the reason.
    """
    target = Path(path)
    if os.path.exists(target) and not target.is_file() and not target.is_dir():
        return  # a device
    if parents:
        missing = target
        while not os.path.lexists(missing.parent) and missing.parent != missing:
            missing = missing.parent
        if missing != target:
            target = missing.with_name(f"{missing.name}-")  # the name of a folder that will be made
    try:
        FileReplacement(os.fspath(target), False).discard()
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None


def sweep(folders: Iterable[Path]) -> None:
    """Delete hidden files that dead processes of this machine left in folders."""
    for folder in folders:
        remove_leftovers(folder)
