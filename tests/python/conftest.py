# SPDX-License-Identifier: MIT
"""Where test data lies, and the extras that need data which a clone does not have."""

import contextlib
import os
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[2]
GOLDEN = PROJECT / "tests" / "data" / "golden"
SHARED = Path(os.environ.get("RISORIUS_SHARED", PROJECT.parent / "shared"))

_not_run: set[str] = set()


def require_extra(path: Path, what: str) -> Path:
    """Skip an extra whose data a clone does not have; the summary names it."""
    if not path.exists():
        _not_run.add(what)
        pytest.skip(f"extra not run, no data: {what}")
    return path


def pytest_terminal_summary(terminalreporter):
    for what in sorted(_not_run):
        terminalreporter.write_line(f"EXTRA NOT RUN (no data): {what}")


@pytest.fixture(scope="session")
def standard_controls():
    """The raw controls of a standard face, as a DNA spells them."""
    path = PROJECT / "tests" / "data" / "controls" / "standard_raw.txt"
    return path.read_text(encoding="utf-8").split()


@contextlib.contextmanager
def no_room(size):
    """No file may become longer than so many bytes: as on a disk that is full by then."""
    import resource  # of POSIX

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
