# SPDX-License-Identifier: MIT
"""Limits the threads of NumPy's linear algebra."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext


def one_thread() -> AbstractContextManager[object]:
    """Make linear algebra use only the calling thread until the context ends.

    Use it for work that already occupies all cores: OpenBLAS's threads would wait for each other at
    full load and take cores from other work. Without threadpoolctl, as inside Blender, nothing
    changes.
    """
    try:
        from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]
    except ImportError:
        return nullcontext()
    limits: AbstractContextManager[object] = threadpool_limits(1, "blas")
    return limits
