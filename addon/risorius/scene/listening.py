# SPDX-License-Identifier: GPL-3.0-or-later
"""Speech from a sound file, computed in a process beside Blender; and the recogniser's package."""

import importlib.util
import os
import subprocess
import sys
import threading
from pathlib import Path

import bpy

from .. import native

PACKAGE = "pocketsphinx==5.1.1"


class Task:
    """A clip of speech on its way.

    Attributes:
        share: 0 to 1, how far it is.
        clip: risorius.Clip when it is done.
        error: what went wrong, or None.
    """

    def __init__(self, path, transcript, **options):
        """Args: as of risorius.speech.speak."""
        self.share, self.clip, self.error = 0.0, None, None
        self._arguments = (path, transcript or None)
        self._options = options
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self.run, daemon=True)

    def start(self):
        """Begin in a thread, which waits for the process and touches nothing of Blender's."""
        self._thread.start()

    def run(self):
        """Do it now, waiting in this thread."""
        try:
            self.clip = native.part("speech.apart").speak_apart(
                *self._arguments,
                progress=self._progress,
                cancel=self._cancelled.is_set,
                **self._options,
            )
        except Exception as error:  # noqa: BLE001  a thread's error is told by who waits for it
            self.error = error

    def _progress(self, share):
        self.share = float(share)

    def is_running(self):
        """Whether the thread still works."""
        return self._thread.is_alive()

    def wait(self):
        """Until the thread ends."""
        if self.is_running():
            self._thread.join()

    def cancel(self):
        """End the process, and wait for that."""
        self._cancelled.set()
        self.wait()


def has_recogniser():
    """Whether the recogniser can be imported; what was installed for the add-on counts."""
    folder = str(packages_folder())
    if folder not in sys.path:
        sys.path.append(folder)
    importlib.invalidate_caches()
    return importlib.util.find_spec("pocketsphinx") is not None


def packages_folder():
    """Where packages lie that the user installed for the add-on."""
    package = __package__.rpartition(".")[0]
    return Path(bpy.utils.extension_path_user(package, path="packages", create=True))


def install_recogniser():
    """Install the recogniser with pip into the extension's own user folder.

    Raises:
        RuntimeError: pip failed; the last line that it said.
    """
    target = str(packages_folder())
    options = ["--target", target, "--upgrade", "--no-deps", "--only-binary", ":all:"]
    command = [sys.executable, "-m", "pip", "install", *options, PACKAGE]
    environment = {**os.environ, "PYTHONPATH": _bundled_pip()}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        said = [line for line in (done.stderr or done.stdout).splitlines() if line.strip()]
        raise RuntimeError(f"pip could not install {PACKAGE}: {(said or ['no reason given'])[-1]}")


def _bundled_pip():
    """The wheel of pip that Python carries, which runs as it lies; "" where pip is installed."""
    if importlib.util.find_spec("pip") is not None:
        return ""
    found = importlib.util.find_spec("ensurepip")
    folder = Path(found.origin).parent / "_bundled" if found is not None else Path()
    return str(next(iter(sorted(folder.glob("pip-*.whl"))), ""))
