# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes animation clips from recorded speech, and installs the speech recogniser."""

from __future__ import annotations

import importlib.util
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.machinery import PathFinder
from pathlib import Path

import bpy

from ... import native
from ...logic.animation import recogniser
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import session
from ..base.task import Task

_LOOK_EVERY = 3.0  # seconds between two searches for the recogniser
_looked: dict[str, float] = session.keep(
    "speech_task.looked", lambda: {"lacks": False, "until": 0.0}, ("unregister",)
)


class SpeechTask(Task["native.Clip"]):
    """Makes the animation clip of a speech recording in a separate process."""

    def __init__(self, path: str, transcript: str | None, **options: object) -> None:
        """Prepare the task.

        Args:
            path: the sound file.
            transcript: the spoken words in English; None or "": the recogniser finds the words.
            options: further keyword arguments of risorius.speech.speak, such as rate and intensity.
        """
        folder = str(packages_folder())
        if folder not in sys.path:
            sys.path.append(folder)  # the new process searches the folders of this sys.path

        def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> native.Clip:
            return native.part("speech.apart").speak_apart(
                path, transcript or None, progress=progress, cancel=cancelled, **options
            )

        super().__init__(work)


def has_recogniser() -> bool:
    """Whether the recogniser can be imported, also from the add-on's own folder of packages."""
    importlib.invalidate_caches()
    places = [*sys.path, str(packages_folder())]
    return PathFinder.find_spec("pocketsphinx", places) is not None


def lacks_recogniser() -> bool:
    """Whether the recogniser is missing. The answer is cached, because panels redraw often."""
    now = time.monotonic()
    if now > _looked["until"]:
        _looked.update(lacks=not has_recogniser(), until=now + _LOOK_EVERY)
    return bool(_looked["lacks"])


def packages_folder() -> Path:
    """The folder for Python packages that the user installs for the add-on; created if missing."""
    return Path(bpy.utils.extension_path_user(native.ADDON, path="packages", create=True))


class InstallError(FaceError, RuntimeError):
    """pip could not install the recogniser; the text gives the reason."""


def install_recogniser() -> None:
    """Install the speech recogniser with pip into `packages_folder`.

    Raises:
        InstallError: pip failed; the text gives the reason.
        ValueError: Blender has no Python program.
    """
    python = native.part("speech.apart").python_program()
    options = ["--no-deps", "--only-binary", ":all:", "--require-hashes"]
    options += ["--retries", "1", "--timeout", "20"]  # with 0 retries pip prints no cause
    environment = {**os.environ, "PYTHONPATH": _bundled_pip()}
    with tempfile.TemporaryDirectory() as folder:
        wanted = Path(folder) / "recogniser.txt"
        wanted.write_text(recogniser.requirements(), encoding="ascii")
        target = ["--target", str(packages_folder()), "--upgrade", "-r", str(wanted)]
        command = [python, "-m", "pip", "install", *options, *target]
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, errors="replace", check=False
        )
    _looked["until"] = 0.0
    if done.returncode:
        running = f"Python {sys.version_info.major}.{sys.version_info.minor}"
        running += f" on {platform.system()} {platform.machine()}"
        why = recogniser.reason(f"{done.stdout}\n{done.stderr}", running)
        raise InstallError(
            told("{package} could not be installed: {why}.", package=recogniser.PACKAGE, why=why)
        )


def _bundled_pip() -> str:
    """Path of the pip wheel bundled with Python, which runs without installation; "" if pip is
    installed or the wheel is missing."""
    if importlib.util.find_spec("pip") is not None:
        return ""
    found = importlib.util.find_spec("ensurepip")
    origin = found.origin if found is not None else None
    folder = Path(origin).parent / "_bundled" if origin is not None else Path()
    return str(next(iter(sorted(folder.glob("pip-*.whl"))), ""))
