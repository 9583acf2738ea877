# SPDX-License-Identifier: MIT
"""Which jobs are done: a line for each, added when its files are whole."""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .files import replacing
from .jobs import Job
from .outcome import Outcome
from .work import stamp

_HEAD = {"risorius_batch": 1}


class Journal:
    """A file of JSON lines beside the outputs.

    A job in it is done if what it was made from has not changed and its files are still those that
    it wrote, by size and time.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._records: dict[str, dict[str, Any]] = {}

    def read(self) -> None:
        """Read what an earlier run left; lines that it did not finish are not there."""
        try:
            lines = self.path.read_bytes().split(b"\n")
        except OSError:
            return
        for index, line in enumerate(lines):
            try:
                record = json.loads(line)
            except ValueError:
                continue
            if index == 0 and record != _HEAD:
                return  # of another version: everything is to be done again
            if isinstance(record, dict) and isinstance(record.get("name"), str):
                self._records[record["name"]] = record

    def done(self, job: Job) -> Outcome | None:
        """What became of a job, if it need not be done again."""
        record = self._records.get(job.name)
        if record is None:
            return None
        with contextlib.suppress(OSError):
            same_files = record.get("files") == _files(job)
            if same_files and record.get("stamp") == stamp(job):
                facts = record.get("facts")
                return Outcome(
                    job.name,
                    stamp=str(record["stamp"]),
                    facts=facts if isinstance(facts, dict) else {},
                )
        return None

    def begin(self, jobs: Sequence[Job]) -> None:
        """Start the file anew with the lines of these jobs. Raises: OSError."""
        with replacing(self.path) as file:
            file.write(_line(_HEAD))
            for job in jobs:
                file.write(_line(self._records[job.name]))

    def add(self, job: Job, outcome: Outcome) -> None:
        """A job is done. Raises: OSError."""
        record = {
            "name": job.name,
            "stamp": outcome.stamp,
            "files": _files(job),
            "facts": outcome.facts,
        }
        with open(self.path, "ab") as file:
            file.write(_line(record))
            file.flush()
            os.fsync(file.fileno())


def _line(record: dict[str, Any]) -> bytes:
    return json.dumps(record).encode() + b"\n"


def _files(job: Job) -> list[list[Any]]:
    """Kind, size and time of each output. Raises: OSError: one is not there."""
    out: list[list[Any]] = []
    for kind, path in job.outputs:
        about = path.stat()
        out.append([kind, about.st_size, about.st_mtime_ns])
    return out
