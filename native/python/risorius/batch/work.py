# SPDX-License-Identifier: MIT
"""Runs one job after the other in a worker, with recent faces and clips kept in memory."""

from __future__ import annotations

import hashlib
import json
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Generic, TypeVar

import risorius
from risorius._native import compile_version, rig_block_version
from risorius.base.errors import sentence

from ..baking.bake import bake
from ..baking.clips import Performance, load_performance
from ..baking.face import Face, load_face, prepared
from .jobs import Job
from .outcome import Outcome

_FORMAT = 1  # version of the outputs; raising it makes all existing outputs outdated
_Value = TypeVar("_Value")


class Kept(Generic[_Value]):
    """A cache of the last few objects made from files; cache keys depend on the files' content.

    Thread-safe, because a cluster's worker runs several jobs at the same time. An object that two
    jobs need at the same time is made once.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._lock = threading.Lock()
        self._values: OrderedDict[object, _Value] = OrderedDict()

    def get(self, key: object, make: Callable[[], _Value]) -> _Value:
        """The value of a key. A value that the cache lacks is made; until it is made, all
        other threads that use this cache wait.

        Args:
            key: key of the value; hashable.
            make: function that makes the value; its exceptions pass through.
        """
        with self._lock:
            if key not in self._values:
                self._values[key] = make()
                while len(self._values) > self._count:
                    self._values.popitem(last=False)
            self._values.move_to_end(key)
            return self._values[key]


_faces: Kept[Face] = Kept(8)
_clips: Kept[Performance] = Kept(4)
_digests: Kept[str] = Kept(4096)


def file_digest(path: Path) -> str:
    """SHA-256 of a file, cached by path, size and modification time. Raises: OSError."""
    about = path.stat()
    return _digests.get((path, about.st_size, about.st_mtime_ns), lambda: _digest(path))


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def stamp(job: Job) -> str:
    """A hash of everything that a job's outputs depend on: clip, DNA, LOD, options, version.

    Raises:
        OSError: a file cannot be read.
    """
    what = {
        "format": _FORMAT,
        "risorius": risorius.__version__,
        "block": rig_block_version(),
        "compile": compile_version(),
        "clip": file_digest(job.clip),
        "character": file_digest(job.character),
        "names": [job.clip.stem, job.character.stem],  # an .npz contains these names
        "lod": job.lod,
        "kinds": [kind for kind, _ in job.outputs],
        "options": asdict(job.options) | {"mapping": _mapping_digest(job)},
    }
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()


def _mapping_digest(job: Job) -> str | None:
    """The digest of the mapping's file, or the name of a built-in mapping; None for no mapping."""
    name = job.options.mapping
    return file_digest(Path(name)) if name and os.path.isabs(name) else name


def _face(job: Job) -> Face:
    quaternions = job.options.quaternions
    key = (file_digest(job.character), job.character.stem, quaternions)
    return _faces.get(key, lambda: load_face(job.character, quaternions=quaternions))


def _performance(job: Job) -> Performance:
    face = _face(job)
    key = (file_digest(job.clip), job.clip.name, file_digest(job.character), _mapping_digest(job))
    return _clips.get(key, lambda: load_performance(job.clip, face, job.options.mapping))


def run_job(job: Job, threads: int = 1, version: str | None = None) -> Outcome:
    """Run a job. An OSError, ValueError or MemoryError gives an Outcome with the text of the error;
    other errors are raised.

    Args:
        job: job whose paths exist on this machine.
        threads: number of threads for the evaluation.
        version: version of the Risorius that sent the job; None to skip the check.
    """
    if version not in (None, risorius.__version__):
        return Outcome(
            job.name,
            f"a worker with risorius {version} was expected, found {risorius.__version__}",
        )
    try:
        started = time.perf_counter()
        made_from = stamp(job)
        face, performance = _face(job), _performance(job)
        clip = prepared(performance.clip, face, job.options.rate, job.options.frames)
        loaded = time.perf_counter()
        facts = bake(
            clip, face, job.lod, dict(job.outputs), parts=job.options.parts,
            compress=job.options.compress, threads=threads,
        )  # fmt: skip
    except (OSError, ValueError, MemoryError) as error:
        return Outcome(job.name, sentence(error))
    facts["mapping"] = performance.mapping
    facts["unmapped_curves"] = list(performance.unmapped)
    facts["load_seconds"] = loaded - started
    facts["job_seconds"] = time.perf_counter() - started
    return Outcome(job.name, stamp=made_from, facts=facts)
