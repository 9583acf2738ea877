# SPDX-License-Identifier: MIT
"""Functions that replace the work of batch workers in tests: they are slow or kill the worker."""

import contextlib
import os
import signal
import time

from risorius.batch.outcome import Outcome
from risorius.batch.work import run_job
from risorius.files.fileio import replacing

SECONDS = 0.05


def slow(job, threads=1):
    time.sleep(SECONDS)
    return run_job(job, threads)


def deadly(job, threads=1):
    """Run a job. If its clip is named deadly, kill this worker in the middle of writing a file."""
    if job.clip.stem == "deadly":
        path = job.outputs[0][1]
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(b"half")
            file.flush()
            os.kill(os.getpid(), signal.SIGKILL)
    return slow(job, threads)


def deadly_once(job, threads=1):
    """Run a job, but kill the first worker that gets a clip named deadly.

    Only one worker is killed, even if two get such a clip at once.
    """
    if job.clip.stem == "deadly":
        with contextlib.suppress(FileExistsError):
            job.clip.with_suffix(".mark").touch(exist_ok=False)
            return deadly(job, threads)
    return slow(job, threads)


def beside_deadly(job):
    """Kill the worker if the clip is named deadly; other jobs wait until three workers are dead."""
    deaths = job.clip.with_name("deaths")
    if job.clip.stem == "deadly":
        with deaths.open("ab") as file:
            file.write(b"x")
        os.kill(os.getpid(), signal.SIGKILL)
    while not deaths.exists() or deaths.stat().st_size < 3:
        time.sleep(0.01)
    return Outcome(job.name)


def faulty(job):
    raise KeyError(job.clip.stem)
