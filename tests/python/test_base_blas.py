# SPDX-License-Identifier: MIT
"""One thread of linear algebra, where that can be asked for."""

import sys

import numpy as np
import pytest
from risorius.base import blas


def test_linear_algebra_has_one_thread_and_then_as_many_as_before():
    tool = pytest.importorskip("threadpoolctl")

    def threads():
        return [p["num_threads"] for p in tool.threadpool_info() if p["user_api"] == "blas"]

    before = threads()
    with blas.one_thread():
        assert set(threads()) <= {1}
    assert threads() == before


def test_without_the_library_it_is_as_it_was(monkeypatch):
    monkeypatch.setitem(sys.modules, "threadpoolctl", None)
    with blas.one_thread():
        assert (np.eye(2) @ np.eye(2) == np.eye(2)).all()
