# SPDX-License-Identifier: MIT
"""Tests that `from risorius import *` imports each native class of the public API."""

import inspect

import risorius
import risorius._native as native


def test_every_name_is_there_once():
    assert len(set(risorius.__all__)) == len(risorius.__all__)
    assert [name for name in risorius.__all__ if not hasattr(risorius, name)] == []


def test_every_class_that_callers_are_handed_is_named():
    classes = {n: v for n, v in vars(risorius).items() if inspect.isclass(v)}
    handed = {n for n, v in classes.items() if v.__module__ == native.__name__}
    assert {"Dna", "Rig", "MlType"} <= handed <= set(risorius.__all__)
