# SPDX-License-Identifier: MIT
"""Of pytest in wine: tests that cannot pass there are expected to fail, each with its reason.

RISORIUS_NOT_RUN names a .toml of tables: `tests` is a list of patterns of test names (file::name,
with * and ?), `why` a sentence, `hangs` true where a test would not come back. One that passes is a
failure: its line is to be taken out.
"""

import os
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest


def pytest_collection_modifyitems(items):
    plan = tomllib.loads(Path(os.environ["RISORIUS_NOT_RUN"]).read_text(encoding="utf-8"))
    rules = [(pattern, rule) for rule in plan.values() for pattern in rule["tests"]]
    for item in items:
        name = f"{Path(str(item.path)).name}::{item.name}"
        for pattern, rule in rules:
            # Brackets of parameters are no set of letters here.
            if fnmatch(name, pattern.replace("[", "[[]")):
                runs = not rule.get("hangs", False)
                item.add_marker(pytest.mark.xfail(reason=rule["why"], strict=runs, run=runs))
