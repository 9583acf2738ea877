# SPDX-License-Identifier: MIT
"""Files that are whole or not there: the one way in which this package writes them."""

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
    """A file to write that takes its name when it is whole, on the disk too.

    An old file of the name stays until then, and for good after an exception. A link stays a link,
    an old file's rights stay. Until it is whole the file has a hidden name of its own in the same
    folder; what a killed process left of this kind goes when somebody writes there again. Devices
    and pipes take the bytes as they come.

    Args:
        path: of a file in a folder that is there.
        sweep: look for what killed processes left; not for each of thousands of files in a folder,
            see sweep().

    Raises:
        OSError: it cannot be written; the error names path.
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
    """A file whose errors of writing name the file that the user knows."""

    def __init__(self, file: _Path, mode: str, shown: str) -> None:
        super().__init__(file, mode)
        self._shown = shown

    def write(self, data: ReadableBuffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise OSError(error.errno, error.strerror, self._shown) from None


def write_bytes(path: _Path, data: ReadableBuffer) -> None:
    """Write a file as replacing() does.

    Args:
        path: of a file in a folder that is there.
        data: its bytes.

    Raises:
        OSError: it cannot be written; the error names path.
    """
    with replacing(path) as file:
        file.write(data)


def write_text(path: _Path, text: str) -> None:
    """Write a file as replacing() does.

    Args:
        path: of a file in a folder that is there.
        text: written as UTF-8, its lines ending as they do in it.

    Raises:
        OSError: it cannot be written; the error names path.
    """
    write_bytes(path, text.encode())


def write_all(files: Mapping[Path, ReadableBuffer]) -> None:
    """Write several files that belong together: all have room before the first takes its name.

    Args:
        files: path -> bytes; the first takes its name last. Folders that are not there are made,
            and go again if the files cannot be written.

    Raises:
        OSError: one cannot be written; then each is as it was.
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
            with contextlib.suppress(OSError):  # it is not empty
                folder.rmdir()
        raise


@contextlib.contextmanager
def staging(path: _Path) -> Iterator[Path]:
    """A path of the same name in a hidden folder beside, for writers that are not ours.

    When the block ends, all that lies in that folder takes its place beside the file, with what
    they are in, and the file last; each old one stays until then, and for good after an exception
    or when the process is killed. The folder of a killed process goes when somebody writes there
    again. Devices and pipes are given as they are.

    Args:
        path: of a file in a folder that is there.

    Raises:
        OSError: nothing can be written there, or the block has written no file; the error names
            path.
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
    """Move the files of a staging folder to where they are meant to be."""
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
    """Make a folder; which ones that took, the outermost first."""
    missing = [part for part in (folder, *folder.parents) if not part.exists()][::-1]
    for part in missing:
        part.mkdir(exist_ok=True)
    return missing


def check_writable(path: _Path, *, parents: bool = False) -> None:
    """Find out before long work whether replacing(path) would have a place to write.

    Args:
        parents: folders that are not there will be made.

    Raises:
        OSError: it would not; the error names path, and the reason.
    """
    target = Path(path)
    if os.path.exists(target) and not target.is_file() and not target.is_dir():
        return  # a device
    if parents:
        missing = target
        while not os.path.lexists(missing.parent) and missing.parent != missing:
            missing = missing.parent
        if missing != target:
            target = missing.with_name(f"{missing.name}-")  # a folder is to be there, not a file
    try:
        FileReplacement(os.fspath(target), False).discard()
    except OSError as error:
        raise OSError(error.errno, error.strerror, os.fspath(path)) from None


def sweep(folders: Iterable[Path]) -> None:
    """Delete what processes of this machine that have ended left in folders."""
    for folder in folders:
        remove_leftovers(folder)
