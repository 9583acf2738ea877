# SPDX-License-Identifier: GPL-3.0-or-later
"""Output to the console: our own sentences, without Blender's messages from our calls."""

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
    """Discard the standard output of operators; errors go to the standard error.

    Without a window the renderer prints every step of a bake from C.
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
    """Discard the standard output. Returns: its earlier file descriptor, or None."""
    with suppress(OSError):  # closed, as in a service
        kept = os.dup(1)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.close(nowhere)
        return kept
    return None
