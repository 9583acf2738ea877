# SPDX-License-Identifier: MIT
"""Tests time limits of tests: they count CPU seconds and progress, not the clock."""

import re
import subprocess
import sys
from pathlib import Path

import limits
import pytest

PROJECT = Path(__file__).resolve().parents[3]
linux = pytest.mark.skipif(sys.platform != "linux", reason="EXTRA NOT RUN: counts by Linux's /proc")
SPIN = "while True: pass  # MARK"
IN_ANOTHER_SESSION = f"""
import subprocess, sys
subprocess.run([sys.executable, "-c", {SPIN!r}], start_new_session=True)
"""


@pytest.fixture(autouse=True)
def often(monkeypatch):
    """Let `limits` look at programs every 0.05 s, so that tests are short."""
    monkeypatch.setattr(limits, "LOOK", 0.05)


def _python(code):
    return [sys.executable, "-S", "-c", code]


def _left(mark):
    """Command lines of running processes that contain `mark`."""
    done = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True)
    return [line for line in done.stdout.splitlines() if mark in line]


@linux
@pytest.mark.parametrize("code", [SPIN, IN_ANOTHER_SESSION], ids=["itself", "a child's child"])
def test_a_program_without_end_is_killed_with_all_that_it_started(code, tmp_path):
    mark = tmp_path.name
    with pytest.raises(limits.Exceeded, match=r"0 s of CPU used|1 s of CPU used"):
        limits.run(_python(code.replace("MARK", mark)), cpu=0.3)
    assert _left(mark) == []


@linux
def test_a_program_that_waits_for_ever_is_killed():
    with pytest.raises(limits.Exceeded, match="it stood still for 0 s, after 0 s of CPU"):
        limits.run(["sleep", "1000"], cpu=100, still=0.3)


def test_the_clock_alone_kills_nobody():
    done = limits.run([*_python("import time; time.sleep(0.5); print(input())")], 0.4, input="on")
    assert (done.returncode, done.stdout) == (0, "on\n")


@pytest.mark.parametrize(("code", "status"), [("raise SystemExit(7)", 7), (SPIN, limits.KILLED)])
def test_the_command_ends_as_its_command_did(code, status, capfd):
    assert limits.main(["1", *_python(code)]) == status
    assert ("were allowed" in capfd.readouterr().err) == (status == limits.KILLED)


def test_no_script_limits_a_blender_by_the_clock():
    by_clock = re.compile(r"\btimeout -s KILL")
    found = {
        path.name
        for path in (PROJECT / "packaging").rglob("*.sh")
        if by_clock.search(path.read_text(encoding="utf-8"))
    }
    # wine.sh may use the clock, because Wine's processes are no children of its command.
    assert found == {"wine.sh"}
