# SPDX-License-Identifier: MIT
"""Tests the extension in an official Blender of blender.org: downloads, installs, runs tests.

    official_blender.py VERSION EXTENSIONS [--program PROGRAM] [-- PYTEST ARGUMENTS]

VERSION is a published version of Blender, such as 4.5.15. The downloaded archive must have the
SHA-256 that blender.org publishes; it is kept in build/blender. EXTENSIONS is a folder made by
release.sh, or a zip. --program uses an installed Blender instead. Without PYTEST ARGUMENTS, the
basic tests run: install, controls, vertices, frames. Works on Linux, Windows and macOS. The exit
code is pytest's.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import tarfile
import tempfile
import urllib.request
import zipfile
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[3]
PACKAGING = PROJECT / "packaging"
sys.path.insert(0, str(PACKAGING / "check"))

import limits  # noqa: E402

PUBLISHED = "https://download.blender.org/release"
SYSTEMS = {
    "Linux": ("linux", ".tar.xz"),
    "Windows": ("windows", ".zip"),
    "Darwin": ("macos", ".dmg"),
}
PROCESSORS = {"x86_64": "x64", "amd64": "x64", "aarch64": "arm64", "arm64": "arm64"}
DOOR = ["extension", "controls", "vertices", "frames"]
CPU_SECONDS = 2400


def this_platform() -> tuple[str, str]:
    """Blender's name of this platform, such as linux-x64, and the file ending of its archives."""
    system, ending = SYSTEMS[platform.system()]
    return f"{system}-{PROCESSORS[platform.machine().lower()]}", ending


def address(version: str, name: str, ending: str) -> tuple[str, str]:
    """The URLs of a version's archive and of the file with its SHA-256 sums.

    Args:
        version: version, for example 4.5.15.
        name: platform, for example linux-x64.
        ending: file ending of the archive, for example .tar.xz.
    """
    folder = f"{PUBLISHED}/Blender{'.'.join(version.split('.')[:2])}"
    return f"{folder}/blender-{version}-{name}{ending}", f"{folder}/blender-{version}.sha256"


def expected_sum(sums: str, archive: str) -> str:
    """The SHA-256 of an archive, from lines `SUM  NAME`.

    Args:
        sums: the lines.
        archive: file name of the archive.

    Raises:
        SystemExit: no line contains the name.
    """
    for line in sums.splitlines():
        words = line.split()
        if len(words) == 2 and words[1] == archive:
            return words[0]
    raise SystemExit(f"official_blender.py: the published sums do not name {archive}.")


def fetch(version: str, folder: Path) -> Path:
    """Download a version's archive for this platform if it is missing, and check its SHA-256.

    Args:
        version: version, for example 4.5.15.
        folder: folder of the archive.

    Returns: path of the archive.

    Raises:
        SystemExit: the SHA-256 differs (the archive is deleted), or blender.org publishes none.
    """
    url, sums = address(version, *this_platform())
    archive = folder / url.rpartition("/")[2]
    with urllib.request.urlopen(sums, timeout=60) as answer:
        wanted = expected_sum(answer.read().decode("utf-8"), archive.name)
    if not archive.exists():
        folder.mkdir(parents=True, exist_ok=True)
        part = archive.with_name(archive.name + ".part")
        with urllib.request.urlopen(url, timeout=60) as answer, part.open("wb") as file:
            shutil.copyfileobj(answer, file)
        part.replace(archive)
    with archive.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    if found != wanted:
        archive.unlink()
        raise SystemExit(f"official_blender.py: {url} has SHA-256 {found}, published is {wanted}.")
    return archive


def unpack(archive: Path, folder: Path) -> Path:
    """Unpack an archive of blender.org into a folder, unless the folder exists.

    Returns: path of the program.

    Raises:
        SystemExit: the archive contains no program at the usual place.
    """
    if not folder.exists():
        part = folder.with_name(folder.name + ".part")
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        if archive.suffix == ".dmg":
            _copy_image(archive, part)
        elif archive.suffix == ".zip":
            with zipfile.ZipFile(archive) as packed:
                packed.extractall(part)
        else:
            with tarfile.open(archive) as packed:
                packed.extractall(part, filter="data")
        part.replace(folder)
    for pattern in ("*/blender.exe", "Blender.app/Contents/MacOS/Blender", "*/blender"):
        for program in folder.glob(pattern):
            if program.is_file():
                return program
    raise SystemExit(f"official_blender.py: there is no program of Blender in {archive}.")


def _copy_image(image: Path, folder: Path) -> None:
    """Copy Blender.app from a macOS disk image into a folder."""
    with tempfile.TemporaryDirectory() as mounted:
        subprocess.run(
            ["hdiutil", "attach", "-quiet", "-readonly", "-mountpoint", mounted, image], check=True
        )
        try:
            shutil.copytree(Path(mounted) / "Blender.app", folder / "Blender.app", symlinks=True)
        finally:
            subprocess.run(["hdiutil", "detach", "-quiet", mounted], check=True)


def extension(place: Path) -> Path:
    """The extension's zip for this platform.

    Args:
        place: a folder made by release.sh, or a zip, which is returned.

    Raises:
        SystemExit: the folder has no zip for this platform, or several.
    """
    if place.is_file():
        return place
    found = sorted(place.rglob(f"risorius-*-{this_platform()[0]}.zip"))
    found = [path for path in found if path.parent.name != "repository"]
    if len(found) != 1:
        raise SystemExit(
            f"official_blender.py: {place} has {len(found)} files "
            f"risorius-*-{this_platform()[0]}.zip, one is wanted."
        )
    return found[0]


def pytest_folder(build: Path) -> Path:
    """Install the pinned pytest below `build`, because Blender's Python lacks it.

    Returns: the folder, to be added to the module path.
    """
    pinned = (PACKAGING / "requirements.txt").read_text(encoding="utf-8").splitlines()
    wanted = [line for line in pinned if line.startswith("pytest==")]
    folder = build / "pytest-for-blender"
    if not folder.exists():
        command = [sys.executable, "-m", "pip", "install", "-q", "--target", str(folder)]
        subprocess.run([*command, *wanted, "colorama"], check=True)
    return folder


def run(program: Path, zip_file: Path, tests: list[str], build: Path) -> int:
    """Run tests in Blender with a temporary user folder. Returns pytest's exit code.

    Args:
        program: Blender's program.
        zip_file: the extension.
        tests: arguments of pytest.
        build: folder of pytest and of the report.
    """
    command = [str(program), "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1"]
    command += ["--python", "blender_tests/run.py", "--", "--extension", str(zip_file.resolve())]
    command += [f"--junitxml={build / 'blender.xml'}", *tests]
    os.chdir(PROJECT)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as user:
        os.environ["BLENDER_USER_RESOURCES"] = user
        os.environ["RISORIUS_TEST_PATH"] = str(pytest_folder(build))
        return limits.main([str(CPU_SECONDS), *command])


def main() -> int:
    """Download and unpack Blender if no program is given, and run the tests."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("version", metavar="VERSION")
    parser.add_argument("extensions", type=Path, metavar="EXTENSIONS")
    parser.add_argument("--program", type=Path, metavar="PROGRAM")
    given = sys.argv[1:]
    end = given.index("--") if "--" in given else len(given)
    options, of_pytest = parser.parse_args(given[:end]), given[end + 1 :]
    build = PROJECT / "build" / "blender"
    build.mkdir(parents=True, exist_ok=True)
    zip_file = extension(options.extensions)
    program = options.program
    if program is None:
        archive = fetch(options.version, build)
        program = unpack(archive, build / f"blender-{options.version}")
    said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    print(said.splitlines()[0], zip_file, flush=True)
    if not said.startswith(f"Blender {options.version}"):
        raise SystemExit(f"official_blender.py: {program} is not Blender {options.version}.")
    places = (PROJECT / "blender_tests").glob("*/test_*.py")
    door = [str(path.relative_to(PROJECT)) for path in places if path.stem[5:] in DOOR]
    return run(program, zip_file, of_pytest or door, build)


if __name__ == "__main__":
    sys.exit(main())
