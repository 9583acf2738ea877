# SPDX-License-Identifier: GPL-3.0-or-later
"""What the console is told: our own sentences, and none of Blender's while it works for us."""

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
    """Drop what operators write to the standard output; errors have their own way.

    Without a window a bake tells every step of the renderer, from C; with one it tells none.
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
    """Let the standard output go nowhere; returns what it was, None where there is none."""
    with suppress(OSError):  # closed, as in a service
        kept = os.dup(1)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.close(nowhere)
        return kept
    return None
