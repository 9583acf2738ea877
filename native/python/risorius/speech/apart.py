# SPDX-License-Identifier: MIT
"""Runs speech recognition in a separate process.

A program that embeds Python, such as Blender, may have loaded another libpocketsphinx through its
ffmpeg. The linker then makes the recogniser use that library, and it fails or crashes. A
separate process avoids this, turns a crash into an error message, and can be killed at any time.

    this process                                 separate process
    sends the task as a line of JSON     -->     calls speak()
    reads the lines                      <--     sends lines of JSON: the fraction of the work done,
                                                 again and again; then the clip or an error
    kills the process after cancel(),    -->     ends
    or ends, which closes the pipe
"""

from __future__ import annotations

import base64
import contextlib
import importlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from time import monotonic
from typing import IO, Any

import numpy as np

from .. import expressions
from ..anim.clip import Clip, Event
from ..base.errors import ArgumentError, RisoriusError
from ..expressions import Expression
from . import speak
from .audio import AudioError
from .listening import Cancel, CancelledError, Progress
from .recogniser import MissingError

_PATIENCE = 3600.0  # seconds without a message until an error; a long voice is aligned in one step
_ASKED = 0.05  # seconds: longest time between two calls of cancel
_BEGIN = (
    "import json, sys; task = json.loads(sys.stdin.buffer.readline()); sys.path[:] = task['paths'];"
    "from risorius.speech import apart; apart.serve(task)"
)
_ERRORS: dict[str, type[Exception]] = {
    "AudioError": AudioError,
    "MissingError": MissingError,
    "ArgumentError": ArgumentError,
}


class RecogniserError(RisoriusError):
    """The recogniser's process could not be started, or ended unexpectedly."""

    code = "recogniser"


def speak_apart(
    path: str | os.PathLike[str],
    transcript: str | None = None,
    *,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
    **options: Any,
) -> Clip:
    """Does the work of speak in a separate process, which is killed if cancel() returns true.

    Args:
        path: path of a sound file.
        transcript: the spoken words in English, if known.
        progress: called with the fraction of the work done, 0 to 1, from the calling thread, which
            waits.
        cancel: called repeatedly from the calling thread.
        options: further keyword arguments of speak.

    Raises:
        RecogniserError: the process could not be started, or ended unexpectedly; errors of speak.
    """
    task = {
        "paths": [os.path.abspath(place) for place in sys.path],
        "path": os.fspath(path),
        "transcript": transcript,
        "options": {**options, "library": _texts(options.get("library"))},
    }
    # Error output goes to a file, because a full pipe without a reader would block the process.
    with tempfile.TemporaryFile() as said, _started(said) as process:
        try:
            _write(process, task)
            for message in _messages(process, cancel):
                if "share" in message:
                    if progress is not None:
                        progress(message["share"])
                elif "error" in message:
                    raise _ERRORS.get(message["kind"], RecogniserError)(message["error"])
                else:
                    return _clip_of(message)
            raise RecogniserError(_how_it_ended(process, said))
        finally:
            process.kill()


def _texts(library: Mapping[str, Expression] | None) -> dict[str, str] | None:
    """Name -> text of each expression, to send them through the pipe."""
    if library is None:
        return None
    return {name: expressions.text_of(one) for name, one in library.items()}


def _library(texts: Mapping[str, str] | None) -> dict[str, Expression] | None:
    if texts is None:
        return None
    return {name: expressions.of_text(text)[name] for name, text in texts.items()}


def _started(said: IO[bytes]) -> subprocess.Popen[bytes]:
    python = python_program()
    options = ["-I", "-B"] if sys.dont_write_bytecode else ["-I"]
    # Without this flag, a console window would appear on Windows.
    quiet = getattr(subprocess, "CREATE_NO_WINDOW", 0)
    try:
        return subprocess.Popen(
            [python, *options, "-c", _BEGIN],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
            creationflags=quiet,
        )
    except OSError as error:
        raise RecogniserError(
            f"the process of the speech recogniser could not be started: {python}: {error.strerror}"
        ) from error


def python_program() -> str:
    """The path of Python's executable; sys.executable may be a program that embeds Python.

    Raises: RecogniserError: none was found.
    """
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    places = [os.path.join(sys.exec_prefix, "bin", name) for name in (version, "python3")]
    places += [os.path.join(sys.exec_prefix, *part, "python.exe") for part in (["bin"], [])]
    for place in (sys.executable, getattr(sys, "_base_executable", ""), *places):
        name = os.path.basename(place or "").lower()
        if name.startswith("python") and os.path.isfile(place):
            return place
    raise RecogniserError(
        "speech recognition runs in a separate program of Python: none was found in "
        f"{sys.exec_prefix}"
    )


def _write(process: subprocess.Popen[bytes], task: dict[str, Any]) -> None:
    assert process.stdin is not None
    try:
        process.stdin.write(json.dumps(task).encode() + b"\n")
        process.stdin.flush()
    except OSError:
        pass  # the process has ended, which the reader of its messages reports


def _messages(process: subprocess.Popen[bytes], cancel: Cancel | None) -> Iterator[dict[str, Any]]:
    """The messages of the process until it ends.

    Raises: CancelledError: cancel() returned true. RecogniserError: no message for an hour."""
    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_hand_over, args=(process.stdout, lines), daemon=True).start()
    heard = monotonic()
    while True:
        if cancel is not None and cancel():
            raise CancelledError("listening was cancelled")
        try:
            line = lines.get(timeout=_ASKED)
        except queue.Empty:
            if monotonic() - heard > _PATIENCE:
                raise RecogniserError(
                    f"the process of the speech recogniser said nothing for {_PATIENCE:g} s and "
                    "was stopped"
                ) from None
            continue
        if not line:
            return
        heard = monotonic()
        yield json.loads(line)


def _hand_over(pipe: IO[bytes], lines: queue.SimpleQueue[bytes]) -> None:
    try:
        for line in pipe:
            lines.put(line)
    except (OSError, ValueError):
        pass  # this process closed the pipe while the thread was reading
    lines.put(b"")


def _how_it_ended(process: subprocess.Popen[bytes], said: IO[bytes]) -> str:
    code = process.wait()
    how = f"signal {-code}" if code < 0 else f"exit code {code}"
    said.seek(0, os.SEEK_END)
    said.seek(max(0, said.tell() - 4096))
    lines = [line for line in said.read().decode("utf-8", "replace").splitlines() if line.strip()]
    reason = f": {lines[-1].strip()}" if lines else ""
    return f"the recogniser's process ended by itself ({how}){reason}"


def _clip_of(message: dict[str, Any]) -> Clip:
    curves = np.frombuffer(base64.b64decode(message["curves"]), "<f4")
    return Clip(
        message["names"],
        curves.reshape(len(message["names"]), -1),
        message["rate"],
        events=[Event(*event) for event in message["events"]],
        metadata=message["metadata"],
    )


def serve(task: dict[str, Any]) -> None:
    """Does the task in the separate process, and reports over standard output."""
    # Output of libraries must not mix with the lines of the protocol.
    words = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(2, 1)

    def tell(**message: Any) -> None:
        words.write(json.dumps(message) + "\n")
        words.flush()

    # Import before a thread reads the pipe, because on Windows the import would wait for the read.
    with contextlib.suppress(ImportError):
        importlib.import_module("pocketsphinx")
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        clip = speak(
            task["path"],
            task["transcript"],
            progress=lambda share: tell(share=share),
            **{**task["options"], "library": _library(task["options"].get("library"))},
        )
        curves = base64.b64encode(np.ascontiguousarray(clip.curves, "<f4").tobytes())
        tell(
            names=clip.names,
            curves=curves.decode("ascii"),
            rate=clip.rate,
            events=clip.events,
            metadata=clip.metadata,
        )
    except Exception as error:  # noqa: BLE001  reported to the parent as a sentence
        kind = next((c.__name__ for c in type(error).__mro__ if c.__name__ in _ERRORS), "")
        known = kind or isinstance(error, OSError)
        tell(error=str(error) if known else f"{type(error).__name__}: {error}", kind=kind)


def _end_with_parent() -> None:
    """Ends the process when the pipe closes, for example because the parent died.

    The pipe is read with os.read, because locks of Python's buffers would block the end of the
    process.
    """
    while os.read(0, 4096):
        pass
    os._exit(1)
