# SPDX-License-Identifier: MIT
"""Folders of test data, and fixtures for tests that need data outside the repository."""

import contextlib
import json
import os
import signal
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[2]
GOLDEN = PROJECT / "tests" / "data" / "golden"
# Folder with golden data. RISORIUS_GOLDEN can name a folder with other files of the same kind.
GOLDEN_SET = Path(os.environ.get("RISORIUS_GOLDEN", GOLDEN))
SHARED = Path(os.environ.get("RISORIUS_SHARED", PROJECT.parent / "shared"))

_not_run: set[str] = set()

# Background jobs ignore Ctrl-C, and so would the commands that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)


def evaluations(tag: str | None = None) -> list[tuple[str, str, dict[str, object]]]:
    """All evaluations of the golden set, or those with a tag: (rig, tag, content of its JSON).

    Tags: "" for a complete load, ".quat" for quaternions, ".seq" for frames through time; other
    tags mean files that were loaded with a LOD filter.
    """
    found = []
    for path in sorted(GOLDEN_SET.glob("*.eval*.json")):
        name, _, rest = path.name.partition(".eval")
        its_tag = rest.removesuffix(".json")
        if tag in (None, its_tag) and (GOLDEN_SET / f"{name}.dna").exists():
            found.append((name, its_tag, json.loads(path.read_text())))
    if not found:
        raise FileNotFoundError(
            f"no <rig>.eval{tag or '*'}.json beside its <rig>.dna: {GOLDEN_SET}"
        )
    return found


def lods_of(about: dict) -> list[int] | None:
    """The LODs of the DNA file that a filtered load kept; None if the load was not filtered.

    about: content of an evaluation's JSON.
    """
    load, count = about["load"], about["counts"]["lods"]
    if load["lods"]:
        return load["lods"]
    if (load["maxLOD"], load["minLOD"]) == (0, 65535):
        return None
    return list(range(load["maxLOD"], load["maxLOD"] + count))


def require_extra(path: Path, what: str) -> Path:
    """Return `path`; skip the test if it is missing. The run's summary names the data (`what`)."""
    if not path.exists():
        _not_run.add(what)
        pytest.skip(f"extra not run, no data: {what}")
    return path


def pytest_terminal_summary(terminalreporter):
    for what in sorted(_not_run):
        terminalreporter.write_line(f"EXTRA NOT RUN (no data): {what}")


@pytest.fixture(scope="session")
def standard_controls():
    """Full names of a standard face's raw controls."""
    path = PROJECT / "tests" / "data" / "controls" / "standard_raw.txt"
    return path.read_text(encoding="utf-8").split()


@contextlib.contextmanager
def no_room(size):
    """Limit the size of files in bytes, which simulates a full disk."""
    import resource  # exists on POSIX only

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
