# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct mode equals Blender's armature modifier in two hundred random poses."""

import os
from pathlib import Path

import bpy
import numpy as np
import pytest
from support import both_ways, scene
from support.faces import neck_face, small_face

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "data" / "golden"
STAND_IN = "RISORIUS_TEST_STAND_IN"  # variable: path of a file of tests/fullscale/generate.py
MAN = ROOT / "build" / "sample" / "man.dna"
NORMALS_NEAR = 2e-3  # tolerance of unit normals, which are computed from float positions

# _CONVENTIONS: name of a case -> options of small_face, for other axes, rotations and units.
# CASES: name of a case -> (function that makes a Dna, or path of a DNA file; tested LODs; number of
# poses; scale of the face's objects).
_CONVENTIONS = {
    "small": {},
    "z up": {"axes": ("right", "front", "up")},
    "left-handed": {"axes": ("left", "up", "front"), "rotation_signs": (1, -1, 1)},
    "zyx": {"axes": ("front", "left", "up"), "rotation_sequence": "zyx"},
    "radians": {"axes": ("right", "up", "back"), "rotation_sequence": "yzx",
                "rotation_unit": "radians"},
    "metres": {"translation_unit": "m"},
}  # fmt: skip
CASES = {
    **{name: (lambda given=given: small_face(**given), (0, 1), 14, 1.0)
       for name, given in _CONVENTIONS.items()},
    "hundredth": (small_face, (0, 1), 14, 0.01),
    "hundredfold": (small_face, (0, 1), 14, 100.0),
    "neck poses": (neck_face, (0, 1), 22, 1.0),
    "medium": (GOLDEN / "medium.dna", (0, 1, 2, 3), 22, 1.0),
    "units": (GOLDEN / "units.dna", (0,), 14, 1.0),
    "tiny": (GOLDEN / "tiny_v28.dna", (0, 1), 10, 1.0),
    "trained": (GOLDEN / "ml.dna", (0, 1, 2), 10, 1.0),
    "man": (MAN, (7,), 10, 1.0),
    STAND_IN: (Path(os.environ.get(STAND_IN, "")), (0,), 4, 1.0),
}  # fmt: skip


def test_the_cases_have_two_hundred_poses():
    assert sum(poses for _source, _lods, poses, _scale in CASES.values()) >= 200


def _path(source, folder):
    if isinstance(source, Path):
        if not source.is_file():
            pytest.skip("EXTRA NOT RUN: random poses both ways of a file that is not there")
        return source
    source().save(str(folder / "face.dna"))
    return folder / "face.dna"


def _pose(pair, random, turned):
    """Set the sliders of both faces to the same random values.

    If `turned` is True, neck, head and the target of the eyes are rotated, and the target is moved.
    """
    sliders = None
    for rig in pair.each():
        face, bones = scene.face(rig), scene.controls(rig).pose.bones
        names = [k for k, v in face.items() if isinstance(v, float) and k in face]
        if sliders is None:
            sliders = random.random(len(names)) * (random.random(len(names)) < 0.5)
            turns = random.normal(0.0, 0.15, (3, 3)) * turned
        for name, value in zip(names, sliders.tolist(), strict=True):
            face[name] = value
        for name, turn in zip(("neck", "head", "eyes"), turns.tolist(), strict=True):
            if name in bones:
                bones[name].rotation_mode = "XYZ"
                bones[name].rotation_euler = turn
        if turned and "eyes" in bones:
            bones["eyes"].location = (0.1 * turns[2]).tolist()
        scene.controls(rig).update_tag()
    bpy.context.view_layer.update()


def _normals_apart(pair, lod):
    worst = 0.0
    for number, item in scene.meshes(pair.direct).items():
        if lod in list(item["dna_lods"]):
            other = scene.meshes(pair.live)[number]
            (one, there), (two, _there) = both_ways.normals(item), both_ways.normals(other)
            assert there.mean() > 0.4, item.name
            worst = max(worst, float(np.abs(one - two)[there].max(initial=0.0)))
    return worst


@pytest.mark.parametrize("name", CASES)
def test_random_poses_both_ways(tmp_path, name):
    source, lods, poses, scale = CASES[name]
    path = _path(source, tmp_path)
    pair = both_ways.Pair(path, lods=tuple(i in lods for i in range(8)))
    random = np.random.default_rng(54)
    for rig in pair.each():
        scene.controls(rig).scale = (scale,) * 3
    shares = np.array_split(np.arange(poses), len(lods))
    for lod, share in zip(lods, shares, strict=True):
        for rig in pair.each():
            bpy.context.view_layer.objects.active = scene.controls(rig)
            if len(lods) > 1:
                assert bpy.ops.risorius.set_lod(lod=lod) == {"FINISHED"}
        for number in share.tolist():
            _pose(pair, random, turned=number % 2)
            assert pair.apart(lod) < both_ways.NEAR, (lod, number)
        assert _normals_apart(pair, lod) < NORMALS_NEAR, lod
        shown = [m for m in scene.meshes(pair.direct).items() if lod in list(m[1]["dna_lods"])]
        assert both_ways.is_direct(pair.direct, *(number for number, _item in shown))
    face = scene.face(pair.direct)
    for label in list(face.keys())[:3]:
        face[label] = 1.0 - 0.9 * face[label]
    scene.update(scene.controls(pair.direct))
    assert pair.apart(lods[-1]) > both_ways.NEAR, "the comparison notices another pose"
