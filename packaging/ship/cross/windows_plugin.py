# SPDX-License-Identifier: MIT
"""A pytest plugin for Windows: marks tests that are expected to fail there, with the reason.

RISORIUS_NOT_RUN names a TOML file with tables. `tests` is a list of patterns of test names
(file::name, with * and ?), `why` is the reason, and `hangs = true` prevents the test from running.
In wine, a listed test that passes is a failure, so that outdated lines are removed. On Windows
itself a listed test may pass, because some reasons concern only wine.
"""

import ctypes
import os
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest


def _in_wine():
    windows = getattr(ctypes, "windll", None)
    return windows is not None and hasattr(windows.ntdll, "wine_get_version")


def pytest_collection_modifyitems(items):
    plan = tomllib.loads(Path(os.environ["RISORIUS_NOT_RUN"]).read_text(encoding="utf-8"))
    in_wine = _in_wine()
    rules = [(pattern, rule) for rule in plan.values() for pattern in rule["tests"]]
    for item in items:
        name = f"{Path(str(item.path)).name}::{item.name}"
        for pattern, rule in rules:
            # Escape the brackets of test parameters, which fnmatch takes for a set of characters.
            if fnmatch(name, pattern.replace("[", "[[]")):
                runs = not rule.get("hangs", False)
                item.add_marker(
                    pytest.mark.xfail(reason=rule["why"], strict=runs and in_wine, run=runs)
                )
