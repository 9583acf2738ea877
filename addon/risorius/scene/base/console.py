# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the add-on's messages to the console, and silences messages of Blender's operators."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout, suppress

import bpy


def say(*sentences: str) -> None:
    """Write sentences to the console."""
    for sentence in sentences:
        print(f"Risorius: {sentence}", flush=True)


@contextmanager
def quiet() -> Iterator[None]:
    """Context manager: discard standard output; standard error stays visible.

    In background mode the file descriptor is redirected too, because the renderer prints from C.
    """
    with redirect_stdout(io.StringIO()):
        if not bpy.app.background:
            yield
            return
        kept = _turn_away()
        try:
            yield
        finally:
            if kept is not None:
                os.dup2(kept, 1)
                os.close(kept)


def _turn_away() -> int | None:
    """Redirect standard output to the null device.

    Returns:
        A copy of the file descriptor that standard output had before; None if standard output is
        closed.
    """
    with suppress(OSError):  # standard output may be closed, for example in a service
        kept = os.dup(1)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.close(nowhere)
        return kept
    return None
