# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that a Blender without the add-on shows the last pose and loses nothing.

Changes that are made there take effect when the add-on is enabled again.
"""

import os
import sys
from pathlib import Path

import bpy
import limits
import numpy as np
import pytest
from support import scene

# Code that runs in a Blender with factory settings, and so without the add-on. It writes the
# vertices of the face to a file, changes a slider, and saves the .blend file.
_OTHER = """
import sys, os
import bpy, numpy as np
blend, out = sys.argv[-2:]
bpy.ops.wm.open_mainfile(filepath=blend)
assert not hasattr(bpy.types, "RISORIUS_OT_reset")
rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
items = sorted((rig[k] for k in rig.keys() if k.startswith("risorius_mesh_")),
               key=lambda o: o["dna_mesh"])
bpy.context.scene.frame_set(bpy.context.scene.frame_current)
depsgraph = bpy.context.evaluated_depsgraph_get()
points = [np.array([v.co[:] for v in o.evaluated_get(depsgraph).to_mesh().vertices])
          for o in items]
np.save(out, np.concatenate(points))
face = rig["risorius_controls"].pose.bones["face"]
face["CTRL_expressions.mouthCornerPullR"] = 0.75
rig.location.x = 0.0
bpy.data.materials.new("made elsewhere").use_fake_user = True
bpy.ops.wm.save_as_mainfile(filepath=blend)
sys.stdout.flush()
os._exit(0)
"""


def _in_another_blender(blend, folder):
    """Open a .blend file in a Blender without the add-on, and change and save it there by _OTHER.

    Returns the vertices that this Blender has shown before the change.
    """
    script, out = folder / "other.py", folder / "shown.npy"
    script.write_text(_OTHER, encoding="utf-8")
    environment = dict(os.environ, BLENDER_USER_RESOURCES=str(folder / "nobody"))
    program = [sys.executable, str(script)]
    if bpy.app.binary_path:  # Blender itself: sys.executable is its Python, without bpy
        flags = ["-b", "--factory-startup", "-noaudio", "--python-exit-code", "1"]
        program = [bpy.app.binary_path, *flags, "--python", str(script), "--"]
    limits.run([*program, str(blend), str(out)], 120, env=environment).check_returncode()
    return np.load(out)


def _rig():
    return next(o for o in bpy.data.objects if "risorius_controls" in o)


def test_a_file_goes_through_a_blender_without_the_addon(mode, dna_file, tmp_path):
    content = dna_file.read_bytes()
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.8, mouthCornerPullL=0.5, browDownL=1.0)
    before = scene.snapshot(rig)
    counts = scene.counts()
    machine = tmp_path / "another machine"
    machine.mkdir()
    blend = machine / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    dna_file.unlink()
    shown = _in_another_blender(blend, tmp_path)
    np.testing.assert_allclose(shown, before, atol=1e-6)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    counts["materials"] += 1
    assert {k: v for k, v in scene.counts().items() if k != "libraries"} == {
        k: v for k, v in counts.items() if k != "libraries"
    }
    rig = _rig()
    path = Path(dna_file)
    path.write_bytes(content)
    raw = scene.raw_of(rig, path)
    assert raw[2] == pytest.approx(0.75)
    assert scene.error_against_oracle(rig, path, raw) < scene.TOLERANCE
    scene.set_controls(rig, jawOpen=0.2)
    assert scene.error_against_oracle(rig, path, scene.raw_of(rig, path)) < scene.TOLERANCE
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen
