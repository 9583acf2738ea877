# SPDX-License-Identifier: MIT
"""The journal of finished jobs: one line per job, added when its files are complete."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from ..files.fileio import replacing
from .jobs import Job, JobsError
from .outcome import Outcome
from .work import stamp

_HEAD = {"risorius_batch": 1}


class _Record(NamedTuple):
    """A finished job: hash of its inputs; its output files; offset and length in bytes of its line
    in the journal."""

    stamp: str
    files: list[list[Any]]
    offset: int
    size: int


class Journal:
    """A file of JSON lines next to the outputs.

    A job counts as finished if its inputs have not changed and its files still have the recorded
    size and modification time. The measured facts of a job are read from the file when needed,
    because the control ranges of thousands of jobs would take too much memory.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._records: dict[str, _Record] = {}

    def read(self) -> None:
        """Read the journal of an earlier run; incomplete lines are ignored."""
        try:
            with open(self.path, "rb") as file:
                if _parsed(next(file, b"")) != _HEAD:
                    return  # a journal of another version: every job runs again
                offset = file.tell()
                for line in iter(file.readline, b""):
                    self._take(line, offset)
                    offset += len(line)
        except OSError:
            return

    def _take(self, line: bytes, offset: int) -> None:
        record = _parsed(line)
        if not isinstance(record, dict) or not isinstance(record.get("facts"), dict):
            return
        name = str(record.get("name"))
        files = record.get("files")
        self._records[name] = _Record(
            str(record.get("stamp")), files if isinstance(files, list) else [[]], offset, len(line)
        )

    def is_done(self, job: Job) -> bool:
        """Whether a job is finished, and its inputs and outputs are unchanged."""
        record = self._records.get(job.name)
        try:
            return record is not None and record[:2] == (stamp(job), _files(job))
        except OSError:
            return False

    def facts(self, name: str) -> dict[str, Any]:
        """The facts of a finished job.

        Raises:
            KeyError: the journal has no such job.
            OSError: the journal cannot be read.
            JobsError: the file has other bytes at the place of the job's line.
        """
        record = _parsed(self._line_of(name))
        if not isinstance(record, dict) or not isinstance(record.get("facts"), dict):
            raise JobsError(f"{self.path}: somebody else has changed it while this batch ran")
        return dict(record["facts"])

    def begin(self, kept: Iterable[str]) -> None:
        """Start a new journal with the lines of the jobs in `kept`. Raises: OSError."""
        records: dict[str, _Record] = {}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(self.path) as file:
            file.write(_line(_HEAD))
            for name in kept:
                offset, line = file.tell(), self._line_of(name)
                file.write(line)
                records[name] = self._records[name]._replace(offset=offset, size=len(line))
        self._records = records

    def _line_of(self, name: str) -> bytes:
        record = self._records[name]
        with open(self.path, "rb") as file:
            file.seek(record.offset)
            return file.read(record.size)

    def add(self, job: Job, outcome: Outcome) -> None:
        """Record a finished job; its line is on disk when this returns.

        Args:
            job: job whose files are complete.
            outcome: outcome with the stamp and facts to record.

        Raises:
            OSError: the journal cannot be written; the error names the journal.
        """
        files = _files(job)
        line = _line(
            {"name": job.name, "stamp": outcome.stamp, "files": files, "facts": outcome.facts}
        )
        with open(self.path, "ab", buffering=0) as file:
            offset = file.seek(0, os.SEEK_END)
            try:
                rest = memoryview(line)
                while rest:
                    rest = rest[file.write(rest) :]
                os.fsync(file.fileno())
            except OSError as error:
                with contextlib.suppress(OSError):  # half a line would damage the next one
                    file.truncate(offset)
                raise OSError(error.errno, error.strerror, str(self.path)) from None
        self._records[job.name] = _Record(outcome.stamp, files, offset, len(line))


def _parsed(line: bytes) -> object:
    try:
        return json.loads(line)
    except (ValueError, RecursionError):
        return None


def _line(record: dict[str, Any]) -> bytes:
    return json.dumps(record).encode() + b"\n"


def _files(job: Job) -> list[list[Any]]:
    """Kind ("npz", "csv" or "rzc"), size and modification time of each output file of a job.

    Raises: OSError: an output file is missing.
    """
    out: list[list[Any]] = []
    for kind, path in job.outputs:
        about = path.stat()
        out.append([kind, about.st_size, about.st_mtime_ns])
    return out
