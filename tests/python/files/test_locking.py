# SPDX-License-Identifier: MIT
"""Tests locks of folders: only one process at a time has the lock of a folder."""

import errno
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading

import pytest
from risorius.files.locking import NAME, LockedError, locked

if os.name != "nt":
    import fcntl

HOLD = """
import sys
from pathlib import Path
from risorius.files.locking import locked
with locked(Path(sys.argv[1])):
    print("has it", flush=True)
    sys.stdin.readline()
"""


def hold(folder):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "has it\n"
    return process


def test_the_second_is_told_who_has_it_and_gets_it_when_the_first_is_killed(tmp_path):
    process = hold(tmp_path)
    try:
        with pytest.raises(LockedError) as caught, locked(tmp_path):
            pytest.fail("two have it")
    finally:
        process.kill()
        process.communicate()
    since = r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d"
    who = f"process {process.pid} on {socket.gethostname()}, since {since},"
    assert caught.match(f"^{re.escape(str(tmp_path))}: {who} works in this folder")
    assert (tmp_path / NAME).exists()
    with locked(tmp_path):
        about = json.loads((tmp_path / NAME).read_text())
        assert about["process"] == os.getpid()
    assert os.listdir(tmp_path) == []


def test_one_of_many_threads_has_it_at_a_time(tmp_path):
    inside, most, refused, done, broken = [0], [0], [0], [0], []
    guard = threading.Lock()

    def work():
        while done[0] < 200:
            try:
                with locked(tmp_path):
                    with guard:
                        inside[0] += 1
                        most[0] = max(most[0], inside[0])
                    with guard:
                        inside[0] -= 1
                        done[0] += 1
            except LockedError:
                refused[0] += 1
            except OSError as error:  # otherwise it would end the thread silently
                broken.append(error)
                return

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert broken == []
    assert most[0] == 1
    # Windows does not remove a file that another thread has open, so that an empty file may stay.
    assert os.listdir(tmp_path) in ([], [NAME] if os.name == "nt" else [])


@pytest.mark.skipif(os.name == "nt", reason="an open file stays in its folder there")
def test_a_file_that_its_owner_removes_meanwhile_is_nobodys_lock(tmp_path, monkeypatch):
    path, flock, calls = tmp_path / NAME, fcntl.flock, []

    def removed_first(handle, how):
        if not calls:
            path.unlink()
        calls.append(handle)
        flock(handle, how)

    monkeypatch.setattr("fcntl.flock", removed_first)
    with locked(tmp_path):
        assert len(calls) == 2
        assert json.loads(path.read_text())["process"] == os.getpid()


@pytest.mark.skipif(os.name == "nt", reason="every file system of Windows has locks")
def test_without_the_systems_locks_the_file_says_who_has_it(tmp_path, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("fcntl.flock", refuse)
    process = hold(tmp_path)
    try:
        with pytest.raises(LockedError, match=f"process {process.pid}"), locked(tmp_path):
            pytest.fail("two have it")
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    with locked(tmp_path):  # the dead process held the lock
        pass
    about = {"machine": "elsewhere", "process": process.pid, "since": "noon"}
    (tmp_path / NAME).write_text(json.dumps(about))
    with pytest.raises(LockedError, match="on elsewhere, since noon"), locked(tmp_path):
        pytest.fail("two have it")
    for odd in ("", "[]", "{}", '{"process": "x"}', "\xff"):
        (tmp_path / NAME).write_text(odd)
        with locked(tmp_path):
            pass


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FileNotFoundError) as caught, locked(tmp_path / "none"):
        pytest.fail("there is no such folder")
    assert caught.value.filename == str(tmp_path / "none")
