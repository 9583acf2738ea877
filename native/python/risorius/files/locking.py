# SPDX-License-Identifier: MIT
"""A lock on a folder, so that only one process works in it."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import socket
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from ..base.errors import RisoriusError

NAME = ".risorius.lock"
_GOING = 1.0  # seconds after which other processes have closed a removed file
_UNKNOWN = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)


class LockedError(RisoriusError):
    """Another process works in the folder; the text names it."""

    code = "locked"


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Work alone in an existing folder.

    The lock belongs to the system and ends with its process in any case. A file `.risorius.lock`
    names the holder meanwhile.

    Raises:
        LockedError: another process works there; the text says which, where and since when.
        OSError: the folder cannot be written; the error names it.
    """
    handle = _open(folder)
    try:
        os.ftruncate(handle, 0)
        os.write(handle, _about_this_process())
        yield
    finally:
        # A process that waits for the lock opens another file of that name; see _open.
        if sys.platform != "win32":
            _remove(folder)
        os.close(handle)
        if sys.platform == "win32":
            _remove(folder)


def _remove(folder: Path) -> None:
    with contextlib.suppress(OSError):
        os.unlink(folder / NAME)


def _open(folder: Path) -> int:
    """A descriptor of the folder's lock, held by this process."""
    path, last = folder / NAME, time.monotonic() + _GOING
    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o666)
        except OSError as error:
            # Windows refuses the name of a removed file until no process has it open.
            if sys.platform == "win32" and error.errno == errno.EACCES and time.monotonic() < last:
                time.sleep(0.01)
                continue
            raise OSError(error.errno, error.strerror, str(folder)) from None
        try:
            _take(handle, folder)
            # The last holder may have removed the file between open and lock.
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), os.stat(path)):
                    return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


if sys.platform == "win32":
    import msvcrt

    _FAR = 1 << 30  # Windows hides locked bytes, and the holder's name must stay readable

    def _take(handle: int, folder: Path) -> None:
        os.lseek(handle, _FAR, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            raise LockedError(_refusal(folder, _holder(handle))) from None
        os.lseek(handle, 0, os.SEEK_SET)

else:
    import fcntl

    def _take(handle: int, folder: Path) -> None:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise LockedError(_refusal(folder, _holder(handle))) from None
        except OSError as error:
            if error.errno not in _UNKNOWN:
                raise
            # A file system without locks: the process number in the file decides.
            holder = _holder(handle)
            if _may_live(holder):
                raise LockedError(_refusal(folder, holder)) from None

    def _may_live(holder: dict[str, object]) -> bool:
        process = holder.get("process")
        if not isinstance(process, int) or process <= 0:
            return False
        if holder.get("machine") != socket.gethostname():
            return True
        try:
            os.kill(process, 0)
        except OSError as error:
            return error.errno != errno.ESRCH
        return True


def _about_this_process() -> bytes:
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    about = {"machine": socket.gethostname(), "process": os.getpid(), "since": since}
    return json.dumps(about).encode() + b"\n"


def _holder(handle: int) -> dict[str, object]:
    """The holder according to the file; empty if the file is still empty."""
    os.lseek(handle, 0, os.SEEK_SET)
    try:
        found = json.loads(os.read(handle, 4096))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _refusal(folder: Path, holder: dict[str, object]) -> str:
    who = "another process"
    if holder:
        who = "process {process} on {machine}, since {since},".format(
            **{key: holder.get(key, "?") for key in ("process", "machine", "since")}
        )
    return f"{folder}: {who} works in this folder; one at a time can"
