# SPDX-License-Identifier: MIT
"""A plugin of pytest for Windows: some tests are expected to fail there, each with its reason.

RISORIUS_NOT_RUN names a .toml of tables: `tests` is a list of patterns of test names (file::name,
with * and ?), `why` a sentence, `hangs` true where a test would not come back. In wine, a listed
test that passes is a failure, and its line has to go. On Windows itself it may pass: some reasons
are wine's.
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
            # Brackets of parameters are no set of letters here.
            if fnmatch(name, pattern.replace("[", "[[]")):
                runs = not rule.get("hangs", False)
                item.add_marker(
                    pytest.mark.xfail(reason=rule["why"], strict=runs and in_wine, run=runs)
                )
