# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of baked simulations: in older files, in other processes, and between frames."""

import json

import bpy
import numpy as np
import pytest
from support import child, scene, simulations
from support.simulations import NEAR

VERSION = "risorius_version"


def _baked(dna_file, mode):
    """A face whose head mesh has a baked cloth simulation with pinned vertices: (rig, mesh)."""
    rig, item = simulations.moving(dna_file, mode)
    simulations.cloth(item)
    assert bpy.ops.risorius.bake_physics() == {"FINISHED"}
    return rig, item


def _told(rig):
    return scene.submodule("scene.skinning.caches").words(rig)


def _rig():
    return next(o for o in bpy.data.objects if "risorius_controls" in o)


def _reopened(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return _rig()


@pytest.mark.parametrize("old", [0, 1])
def test_caches_of_older_files_are_told_until_they_are_baked_again(old, dna_file, tmp_path, capsys):
    _face, _item = _baked(dna_file, "KEYS")
    rig = _reopened(tmp_path / "new.blend")
    assert not _told(rig)
    scene.controls(rig)[VERSION] = old
    path = tmp_path / "old.blend"
    for _ in range(2):  # the second time, the file was saved without baking again
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        capsys.readouterr()
        bpy.ops.wm.open_mainfile(filepath=str(path))
        rig = _rig()
        assert "caches: 1" in _told(rig)
        assert capsys.readouterr().out.count("older Risorius") == 1
        assert scene.controls(rig)[VERSION] == 1
    bpy.context.view_layer.objects.active = rig
    assert bpy.ops.risorius.bake_physics() == {"FINISHED"}
    assert not _told(rig)
    rig = _reopened(tmp_path / "again.blend")
    assert not _told(rig)
    assert scene.controls(rig)[VERSION] == 4


def test_each_frame_in_a_process_of_its_own(dna_file, tmp_path):
    _face, item = _baked(dna_file, "LIVE")
    wanted = simulations.film(item)
    path = tmp_path / "baked.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    for frame in (7, 3):
        lines = (
            "import json, numpy as np",
            f"bpy.ops.wm.open_mainfile(filepath={str(path)!r})",
            f"bpy.context.scene.frame_set({frame})",
            f"points = scene.evaluated(bpy.data.objects[{item.name!r}])",
            "print('POINTS', json.dumps(points.tolist()))",
        )
        code, said = child.run(tmp_path, "\n".join(lines))
        assert code == 0, said
        found = json.loads(said.partition("POINTS ")[2].splitlines()[0])
        assert simulations.apart({frame: np.array(found)}, {frame: wanted[frame]}) < NEAR


def test_a_render_with_motion_blur_has_the_face_of_every_part_of_a_frame(mode, dna_file, tmp_path):
    """With motion blur, a render sees the face at each time within a frame.

    The face has cloth, whose places Blender interpolates between two whole frames.
    """
    _face, item = _baked(dna_file, mode)
    setup, seen = bpy.context.scene, {}
    setup.render.engine, setup.cycles.samples, setup.cycles.device = "CYCLES", 1, "CPU"
    setup.cycles.use_denoising = False  # some Blenders lack the denoiser
    setup.render.resolution_x = setup.render.resolution_y = 8
    setup.render.use_motion_blur, setup.render.motion_blur_shutter = True, 1.0
    setup.render.filepath = str(tmp_path / "blurred.png")
    setup.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    setup.collection.objects.link(setup.camera)

    def look(of, depsgraph):
        if depsgraph.mode == "RENDER":
            mesh = item.evaluated_get(depsgraph)
            points = np.array([mesh.matrix_world @ v.co for v in mesh.data.vertices])
            seen[of.frame_current_final] = points

    bpy.app.handlers.frame_change_post.insert(0, look)
    try:
        setup.frame_set(4)
        bpy.ops.render.render(write_still=True)
    finally:
        bpy.app.handlers.frame_change_post.remove(look)
    assert {3.5, 4.5} <= set(seen)
    wanted = simulations.film(item, sorted(seen))
    assert simulations.apart(seen, wanted) < NEAR
    assert simulations.apart(seen, {f: wanted[4.0] for f in (3.5, 4.5)}) > 1000 * NEAR
    assert not scene.submodule("scene.frame.lateness").total()
