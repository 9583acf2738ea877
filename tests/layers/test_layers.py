# SPDX-License-Identifier: MIT
"""The folders know only those before them, and the check can fail."""

import shutil
from pathlib import Path

import pytest
from layers import addon_violations, native_violations

ROOT = Path(__file__).resolve().parents[2]


def test_native_includes_follow_the_layers():
    assert native_violations(ROOT) == []


def test_addon_imports_follow_the_layers():
    assert addon_violations(ROOT) == []


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("native/dna/planted.h", '#include "rig/rig.h"'),
        ("native/rig/planted.cpp", "#include <immintrin.h>"),
        ("native/core/planted.cpp", "#include <pybind11/pybind11.h>"),
        ("native/rig/planted.h", '#include "compile/compile.h"'),
    ],
)
def test_a_planted_include_is_found(tmp_path, file, line):
    shutil.copytree(ROOT / "native", tmp_path / "native")
    (tmp_path / file).write_text(line + "\n")
    assert len(native_violations(tmp_path)) == 1


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("logic/planted.py", "import bpy"),
        ("logic/planted.py", "from ..native import module"),
        ("scene/planted.py", "from ..ui import panels"),
        ("scene/planted.py", "from risorius import Rig"),
        ("logic/planted.py", "from ..scene import build"),
    ],
)
def test_a_planted_import_is_found(tmp_path, file, line):
    shutil.copytree(ROOT / "addon", tmp_path / "addon")
    (tmp_path / "addon" / "risorius" / file).write_text(line + "\n")
    assert len(addon_violations(tmp_path)) == 1
