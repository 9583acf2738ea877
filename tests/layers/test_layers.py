# SPDX-License-Identifier: MIT
"""Tests that files follow the plan rooms.toml, and that each rule of the check can fail."""

from functools import lru_cache
from pathlib import Path

import pytest
from layers import ROOMS, sources, violations

ROOT = Path(__file__).resolve().parents[2]


@lru_cache
def files_of(part):
    return sources(ROOT, part)


def planted(part, path, text):
    """Sentences of `violations` after a text is added to a file, except sentences about folder
    sizes.

    Args:
        part: key of a part of the project in rooms.toml.
        path: path of the file below the part's folder; the file need not exist.
        text: code that is appended to the file.
    """
    files = dict(files_of(part))
    files[path] = files.get(path, "") + "\n" + text + "\n"
    return [line for line in violations(part, files) if "are the most" not in line]


TOP = """CHANGELOG.md CMakeLists.txt CMakePresets.json CONTRIBUTING.md LICENSE README.md addon
blender_tests docs native packaging pyproject.toml tests"""


def test_nothing_lies_at_the_top_that_was_left_there():
    made = [line.rstrip("/") for line in (ROOT / ".gitignore").read_text().splitlines()]
    names = [entry.name for entry in ROOT.iterdir() if not entry.name.startswith(".")]
    assert sorted(set(names) - set(made)) == TOP.split()


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
    ("room", "line", "said"),
    [
        ("logic/base", "import bpy", "may not use bpy"),
        ("logic/base", "import bpy.types as t", "may not use bpy"),
        ("logic/base", "def late():\n    import bmesh", "may not use bmesh"),
        ("logic/base", "__import__('mathutils')", "may not use mathutils"),
        ("logic/base", "__import__(name='bpy')", "may not use bpy"),
        ("logic/base", "import scipy", "may not use scipy"),
        ("logic/base", "from ...native import module", "may not use native.py"),
        ("logic/base", "from ... import native", "may not use native.py"),
        ("logic/base", "from ...scene.base.parts import x", "may not use scene/base/parts.py"),
        ("logic/base", "from importlib import import_module as f\nf('risorius.x')", "risorius"),
        ("logic/base", "__import__(f'risorius.{name}')", "may not use risorius"),
        ("logic/base", "__import__(name)", "no one can read"),
        ("logic/base", "__import__(f'...scene.{name}')", "no one can read"),
        ("logic/base", "exec('import bpy')", "no one can read"),
        ("logic/base", "from .gone import x", "no one can read"),
        ("scene/base", "from ...ui import common", "may not use ui/common.py"),
        ("scene/base", "from ..file import replace_dna", "may not use scene/file/replace_dna.py"),
        ("scene/base", "from risorius import Rig", "may not use risorius"),
        ("ui/speech", "from ..layers import panel", "may not use ui/layers/panel.py"),
        ("attic", "", "no room of the plan"),
        ("scene/attic", "", "no room of the plan"),
        (".", "", "no room of the plan"),
    ],
)
def test_a_planted_import_in_the_addon_is_found(room, line, said):
    found = planted("addon", f"{room}/planted.py".removeprefix("./"), line)
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize(
    ("room", "line", "said"),
    [
        ("base", "from ..anim import clip", "may not use anim/clip.py"),
        ("base", "import risorius.anim.clip", "may not use anim/clip.py"),
        ("base", "from risorius.anim.clip import Clip", "may not use anim/clip.py"),
        ("anim", "from risorius import load", "may not use __init__.py"),
        ("anim", "def late():\n    from .. import batch", "may not use batch/__init__.py"),
        ("anim", "import typing as t\nif t.TYPE_CHECKING:\n    from .. import cli", "use cli/"),
        ("anim", "import importlib\nimportlib.import_module('risorius.cli')", "use cli/"),
        ("anim", "import importlib\nimportlib.import_module('..cli', __package__)", "use cli/"),
        ("anim", "import matplotlib", "may not use matplotlib"),
        ("live", "from ..speech import audio", "may not use speech/audio.py"),
        ("baking", "from ..batch import pool", "may not use batch/pool.py"),
        ("attic", "", "no room of the plan"),
        ("anim/attic", "", "no room of the plan"),
        (".", "", "no room of the plan"),
    ],
)
def test_a_planted_import_in_the_package_is_found(room, line, said):
    found = planted("package", f"{room}/planted.py".removeprefix("./"), line)
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize(
    ("part", "path", "line"),
    [
        ("native", "rig/rig.h", '#include "rig/rig_file.h"'),
        ("package", "anim/clip.py", "from . import clip"),
        ("package", "anim/clip.py", "def late():\n    from . import mixer"),
        ("addon", "logic/material/animated_maps.py", "from . import skin_folds"),
    ],
)
def test_files_in_a_circle_are_found(part, path, line):
    found = planted(part, path, line)
    assert len(found) == 1
    assert found[0].startswith("files in a circle")


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


def test_a_plan_that_allows_what_nobody_needs_is_found(monkeypatch):
    rooms = ROOMS["package"]["rooms"]
    monkeypatch.setitem(rooms, "cli", [*rooms["cli"], "importing/mappings"])
    assert violations("package", files_of("package")) == [
        "cli does not use importing/mappings: take it out of the plan"
    ]
