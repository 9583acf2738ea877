# SPDX-License-Identifier: MIT
"""The files keep to the plan of rooms.toml, and each rule of the check can fail."""

from functools import lru_cache
from pathlib import Path

import pytest
from layers import ROOMS, sources, violations

ROOT = Path(__file__).resolve().parents[2]


@lru_cache
def files_of(part):
    return sources(ROOT, part)


def planted(part, path, text):
    """What the check says, but for the size of folders, where a part gets one more file or line."""
    files = dict(files_of(part))
    files[path] = files.get(path, "") + "\n" + text + "\n"
    return [line for line in violations(part, files) if "are the most" not in line]


@pytest.mark.parametrize("part", ROOMS)
def test_every_file_keeps_to_the_plan(part):
    assert len(files_of(part)) > 10
    assert violations(part, files_of(part)) == []


@pytest.mark.parametrize(
    ("path", "line", "said"),
    [
        ("dna/planted.h", '#include "rig/rig.h"', "dna may not use rig/rig.h"),
        ("dna/planted.h", '#include "../rig/rig.h"', "dna may not use rig/rig.h"),
        ("dna/planted.cpp", "  #  include <rig/rig.h>", "dna may not use rig/rig.h"),
        ("dna/planted.cpp", '#include "rig/gone.h"', "no one can read"),
        ("dna/planted.cpp", "#include RISORIUS_HEADER", "no one can read"),
        ("rig/planted.h", '#include "compile/compile.h"', "rig may not use compile/compile.h"),
        ("rig/planted.cpp", "#include <immintrin.h>", "rig may not use immintrin.h"),
        ("core/planted.cpp", "#include <pybind11/pybind11.h>", "core may not use pybind11"),
        ("core/planted.cpp", "#include <boost/any.hpp>", "core may not use boost/any.hpp"),
        ("bindings/planted.cpp", "#include <unistd.h>", "bindings may not use unistd.h"),
        ("rig/rig.h", '#include "rig/rig_file.h"', "files in a circle"),
        ("attic/planted.h", "", "no room of the plan"),
        ("rig/attic/planted.h", "", "no room of the plan"),
        ("planted.h", "", "no room of the plan"),
    ],
)
def test_a_planted_include_is_found(path, line, said):
    found = planted("native", path, line)
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize(
    ("path", "line", "said"),
    [
        ("logic/base/planted.py", "import bpy", "logic/base may not use bpy"),
        ("logic/base/planted.py", "import bpy.types as t", "logic/base may not use bpy"),
        ("logic/base/planted.py", "def late():\n    import bmesh", "logic/base may not use bmesh"),
        ("logic/base/planted.py", "__import__('mathutils')", "logic/base may not use mathutils"),
        ("logic/base/planted.py", "import scipy", "logic/base may not use scipy"),
        (
            "logic/base/planted.py",
            "from ...native import module",
            "logic/base may not use native.py",
        ),
        ("logic/base/planted.py", "from ... import native", "logic/base may not use native.py"),
        (
            "logic/base/planted.py",
            "from ...scene.base.parts import x",
            "logic/base may not use scene/base/parts.py",
        ),
        (
            "logic/base/planted.py",
            "import typing as t\nif t.TYPE_CHECKING:\n    from ...scene.base import parts",
            "logic/base may not use scene/base/parts.py",
        ),
        (
            "logic/base/planted.py",
            "import importlib\nimportlib.import_module('...scene.base.parts', __package__)",
            "logic/base may not use scene/base/parts.py",
        ),
        (
            "logic/base/planted.py",
            "from importlib import import_module as load\nload('risorius.rigs')",
            "logic/base may not use risorius",
        ),
        (
            "logic/base/planted.py",
            "__import__(f'risorius.{name}')",
            "logic/base may not use risorius",
        ),
        ("logic/base/planted.py", "__import__(name='bpy')", "logic/base may not use bpy"),
        ("logic/base/planted.py", "__import__(name)", "no one can read"),
        ("logic/base/planted.py", "__import__(f'...scene.{name}')", "no one can read"),
        ("logic/base/planted.py", "exec('import bpy')", "no one can read"),
        ("logic/base/planted.py", "from .gone import x", "no one can read"),
        ("scene/base/planted.py", "from ...ui import panels", "scene/base may not use ui"),
        (
            "scene/base/planted.py",
            "from ..file import replace",
            "scene/base may not use scene/file",
        ),
        ("scene/base/planted.py", "from risorius import Rig", "scene/base may not use risorius"),
        ("logic/material/animated_maps.py", "from . import skin_folds", "files in a circle"),
        ("attic/planted.py", "", "no room of the plan"),
        ("scene/attic/planted.py", "", "no room of the plan"),
        ("planted.py", "", "no room of the plan"),
    ],
)
def test_a_planted_import_is_found(path, line, said):
    found = planted("addon", path, line)
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize("part", ROOMS)
def test_a_folder_that_grows_too_large_is_found(part):
    plan = ROOMS[part]
    folder = next(iter(plan["rooms"]))
    more = {f"{folder}/planted{n}{plan['kinds'][0]}": "" for n in range(plan["limit"] + 1)}
    assert any("are the most" in line for line in violations(part, {**files_of(part), **more}))


def test_a_plan_that_runs_backwards_is_found(monkeypatch):
    monkeypatch.setitem(ROOMS["native"]["rooms"], "core", ["bindings"])
    assert any(
        "bindings is not written above" in line for line in violations("native", files_of("native"))
    )


@pytest.mark.parametrize(
    ("path", "line", "said"),
    [
        ("base/planted.py", "from ..rigs.load import load", "base may not use rigs/load.py"),
        ("rigs/planted.py", "import risorius", "rigs may not use __init__.py"),
        ("anim/planted.py", "def late():\n    from ..batch import jobs", "anim may not use batch"),
        ("baking/planted.py", "from risorius.cli import main", "baking may not use cli"),
        ("explain/planted.py", "import matplotlib", "explain may not use matplotlib"),
        ("anim/clip.py", "from .mixer import Mixer", "files in a circle"),
        ("attic/planted.py", "", "no room of the plan"),
    ],
)
def test_a_planted_import_of_the_package_is_found(path, line, said):
    found = planted("package", path, line)
    assert len(found) == 1
    assert said in found[0]
