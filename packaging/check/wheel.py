# SPDX-License-Identifier: MIT
"""Tests a released wheel on this system: installs it and runs its tests.

    wheel.py WHEELS [--report FILE] [-- PYTEST ARGUMENTS]

WHEELS is the folder that wheels.sh fills. The running Python (3.11 or newer) makes a venv in
build/, and pip installs the wheel for this Python and system. Then the wheel's self-test and the
Python tests of ship/cross/tests_of_the_system.txt run. Works on Linux, Windows and macOS. Exit code
0 only if all passed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
PACKAGING = PROJECT / "packaging"
WITH_TESTS = ["pytest", "python-osc", "threadpoolctl", "xxhash", "matplotlib", "colorama"]
# Python version -> NumPy's version, because Blender up to 5.0 has NumPy 1.26. All other Pythons get
# NEWER_NUMPY, and so does Windows on ARM, for which NumPy has no wheels before 2.3.
NUMPY = {(3, 11): "1.26.4"}
NEWER_NUMPY = "2.3.5"


def constraints() -> list[str]:
    """Pinned versions of requirements.txt, with NumPy's version for this Python and system."""
    pinned = (PACKAGING / "requirements.txt").read_text(encoding="utf-8").splitlines()
    on_arm = os.environ.get("PROCESSOR_ARCHITECTURE") == "ARM64"
    numpy = NEWER_NUMPY if on_arm else NUMPY.get(sys.version_info[:2], NEWER_NUMPY)
    return [line for line in pinned if not line.startswith("numpy==")] + [f"numpy=={numpy}"]


def make_python(wheels: Path, folder: Path) -> Path:
    """Make a venv with the wheel for this Python and the packages that the tests need.

    Args:
        wheels: folder of the wheels.
        folder: folder of the venv; an existing one is deleted.

    Returns:
        Path of the venv's Python.
    """
    shutil.rmtree(folder, ignore_errors=True)
    venv.create(folder, with_pip=True)
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    pins = folder / "constraints.txt"
    pins.write_text("\n".join(constraints()) + "\n", encoding="utf-8")
    pip = [str(python), "-m", "pip", "install", "-q", "--disable-pip-version-check"]
    subprocess.run([*pip, "-c", str(pins), "numpy", *WITH_TESTS], check=True)
    subprocess.run(
        [*pip, "--no-deps", "--no-index", "--find-links", str(wheels), "risorius"], check=True
    )
    return python


def tests(python: Path, report: Path, arguments: list[str]) -> int:
    """Run pytest in a venv. Returns pytest's exit code.

    Args:
        python: path of the venv's Python.
        report: path of the JUnit report.
        arguments: arguments of pytest; if empty, the tests of tests_of_the_system.txt run.
    """
    named = (
        (PACKAGING / "ship" / "cross" / "tests_of_the_system.txt")
        .read_text(encoding="utf-8")
        .split()
    )
    command = [str(python), "-m", "pytest", "-q", "-rs", f"--junitxml={report}"]
    environment = dict(os.environ, RISORIUS_SHARED=str(report.parent / "none"))
    if os.name == "nt":
        environment["RISORIUS_NOT_RUN"] = str(PACKAGING / "ship" / "cross" / "windows_not_run.toml")
        environment["PYTHONPATH"] = str(PACKAGING / "ship" / "cross")
        command += ["-p", "windows_plugin"]
    command += arguments or named
    return subprocess.run(command, cwd=PROJECT, env=environment, check=False).returncode


def main() -> int:
    """Install the wheel, run its self-test, and run the tests."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("wheels", type=Path, metavar="WHEELS")
    parser.add_argument("--report", type=Path, metavar="FILE")
    given = sys.argv[1:]
    end = given.index("--") if "--" in given else len(given)
    options, of_pytest = parser.parse_args(given[:end]), given[end + 1 :]
    if not list(options.wheels.glob("risorius-*.whl")):
        parser.error(
            f"{options.wheels}: there is no wheel of risorius; packaging/ship/wheels.sh makes them"
        )
    build = PROJECT / "build"
    build.mkdir(exist_ok=True)
    python = make_python(options.wheels.resolve(), build / "venv-wheel")
    checked = subprocess.run(
        [str(python), str(PACKAGING / "ship" / "selftest.py")], check=False
    ).returncode
    report = (options.report or build / "wheel.xml").resolve()
    return tests(python, report, of_pytest) or checked


if __name__ == "__main__":
    sys.exit(main())
