# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the DNA file of a sample person in a background thread."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ... import native
from ..base.task import Task, telling


class SampleTask(Task[bool]):
    """Builds a sample person and writes the DNA file with its textures; the result is True.

    Attributes:
        fetched: progress of the download, 0 to 1; None while nothing is downloaded.
    """

    fetched: float | None = None


def sample_task(path: Path, person: str, *, offline: bool) -> SampleTask:
    """A task that builds the DNA file of a sample person.

    Args:
        path: path of the new DNA file; its folder may contain the data package (.whl).
        person: name of the sample person, from the dict PEOPLE of the package of sample people.
        offline: True: do not download.
    """
    sample = native.sample_module()

    def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> bool:
        path.parent.mkdir(parents=True, exist_ok=True)

        def came(count: int) -> bool:
            task.fetched = min(count / sample.DATA_SIZE, 1.0)
            return not cancelled()

        def tell(share: float) -> bool:
            task.fetched = None if share > 0.0 else task.fetched
            return telling(progress, cancelled)(share)

        sample.build_sample(
            path,
            person=sample.PEOPLE[person],
            data=_data(path.parent),
            offline=offline,
            progress=tell,
            fetched=came,
        )
        return True

    task = SampleTask(work)
    return task


def can_be_built(folder: Path) -> bool:
    """Whether a person can be built without a download.

    Args:
        folder: folder that may contain the data package (.whl).
    """
    return _data(folder) is not None or bool(native.sample_module().is_fetched())


def _data(folder: Path) -> Path | None:
    """The path of the first .whl file (data package) in a folder, or None."""
    return next(iter(sorted(folder.glob("*.whl"))), None)
