# SPDX-License-Identifier: MIT
"""Jobs as workers of the tests run them: slow ones, and some that end their worker."""

import os
import signal
import time

from risorius.batch.work import run_job

SECONDS = 0.05


def slow(job):
    time.sleep(SECONDS)
    return run_job(job)


def deadly(job):
    """One clip ends whoever gets it, as a fault of native code would."""
    if job.clip.stem == "deadly":
        os.kill(os.getpid(), signal.SIGKILL)
    return slow(job)


def deadly_once(job):
    """The same, but the second worker that gets it lives."""
    mark = job.clip.with_suffix(".mark")
    if job.clip.stem == "deadly" and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return slow(job)


def faulty(job):
    raise KeyError(job.clip.stem)
