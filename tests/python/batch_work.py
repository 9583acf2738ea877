# SPDX-License-Identifier: MIT
"""Jobs as workers of the tests run them: slow ones, and some that end their worker."""

import os
import signal
import time

from risorius.batch.work import run_job
from risorius.fileio import replacing

SECONDS = 0.05


def slow(job, threads=1):
    time.sleep(SECONDS)
    return run_job(job, threads)


def deadly(job, threads=1):
    """One clip ends whoever gets it, as a fault of native code would, in the middle of a file."""
    if job.clip.stem == "deadly":
        path = job.outputs[0][1]
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as file:
            file.write(b"half")
            file.flush()
            os.kill(os.getpid(), signal.SIGKILL)
    return slow(job, threads)


def deadly_once(job, threads=1):
    """The same, but the second worker that gets it lives."""
    mark = job.clip.with_suffix(".mark")
    if job.clip.stem == "deadly" and not mark.exists():
        mark.touch()
        return deadly(job, threads)
    return slow(job, threads)


def faulty(job):
    raise KeyError(job.clip.stem)
