# SPDX-License-Identifier: MIT
"""A lock on a folder, so that only one process writes in it."""

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
_GOING = 1.0  # seconds until other processes have closed a removed file
_UNKNOWN = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)


class LockedError(RisoriusError):
    """Another process holds the lock of the folder; the text names the process."""

    code = "locked"


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of an existing folder during the context.

    The operating system ends the lock when the process ends, even if it is killed. On a file system
    without locks, the lock counts as held while the process named in the file may run. The file
    `.risorius.lock` names the process, the machine and the time.

    Raises:
        LockedError: another process holds the lock; the text has the process, the machine and the
            time.
        OSError: the folder cannot be written; the error names the folder.
    """
    handle = _open(folder)
    try:
        os.ftruncate(handle, 0)
        os.write(handle, _about_this_process())
        yield
    finally:
        # The file is removed before the lock ends, so that another process, which opened the file
        # before, notices the removal in `_open`. Windows cannot remove an open file, so there the
        # file is closed first.
        if sys.platform != "win32":
            _remove(folder)
        os.close(handle)
        if sys.platform == "win32":
            _remove(folder)


def _remove(folder: Path) -> None:
    with contextlib.suppress(OSError):
        os.unlink(folder / NAME)


def _open(folder: Path) -> int:
    """Open and lock the folder's lock file. Returns its descriptor."""
    path, last = folder / NAME, time.monotonic() + _GOING
    while True:
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o666)
        except OSError as error:
            # Windows refuses the name of a removed file until all processes have closed it.
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

    _FAR = 1 << 30  # Windows hides locked bytes, so lock one beyond the text

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
            # This file system has no locks. The lock counts as held if the process named in the
            # file may still run.
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
    """The lock file's data about the process that holds the lock; empty if unreadable."""
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
