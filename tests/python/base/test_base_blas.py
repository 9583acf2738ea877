# SPDX-License-Identifier: MIT
"""Tests that linear algebra is limited to one thread if threadpoolctl is installed."""

import sys

import numpy as np
from risorius.base import blas
from threadpoolctl import threadpool_info, threadpool_limits


def test_linear_algebra_has_one_thread_and_then_as_many_as_before():
    def threads():
        return {p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas"}

    with threadpool_limits(2, "blas"):
        assert threads() == {2}
        with blas.one_thread():
            assert threads() == {1}
        assert threads() == {2}


def test_without_the_library_it_is_as_it_was(monkeypatch):
    monkeypatch.setitem(sys.modules, "threadpoolctl", None)
    with blas.one_thread():
        assert (np.eye(2) @ np.eye(2) == np.eye(2)).all()
