# SPDX-License-Identifier: MIT
"""How many threads NumPy's linear algebra takes."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext


def one_thread() -> AbstractContextManager[object]:
    """Linear algebra by the thread that asks for it alone, until the context ends.

    Work that shares its cores out itself has nothing of more: OpenBLAS's threads wait for each
    other at full load, and take a core from whatever else is done. Without threadpoolctl, as
    inside Blender, everything stays as it is.
    """
    try:
        from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]
    except ImportError:
        return nullcontext()
    limits: AbstractContextManager[object] = threadpool_limits(1, "blas")
    return limits
