# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests undo and redo of a hundred mixed steps, one by one; every state is restored."""

import random

import bpy
import numpy as np
import pytest
from support import scene

STEPS = 100


def _rigs():
    inside = bpy.context.scene.objects
    return sorted((o for o in inside if o.get("risorius_controls")), key=lambda o: o.name)


def _state():
    """Name of a character -> vertices of its visible meshes at the current frame."""
    bpy.context.view_layer.update()
    found = {}
    for rig in _rigs():
        shown = [m for _, m in sorted(scene.meshes(rig).items()) if not m.hide_viewport]
        found[rig.name] = np.concatenate([scene.evaluated(m) for m in shown])
    return found


def _activate(rig):
    bpy.context.view_layer.objects.active = scene.controls(rig)


def _slide(chance, rig):
    """Move a random slider, except jawOpen.

    jawOpen has keyframes, so Blender would set it back to the value of its F-curve.
    """
    name = chance.choice(("mouthCornerPullL", "mouthCornerPullR", "browDownL", "eyeLookUpL"))
    scene.set_controls(rig, **{name: chance.random()})


def _key(chance, rig):
    _activate(rig)
    scene.set_controls(rig, jawOpen=chance.random())
    bpy.ops.risorius.key(region="jaw")


def _frame(chance, _rig):
    bpy.context.scene.frame_set(chance.randint(1, 20))


def _lod(chance, rig):
    _activate(rig)
    bpy.ops.risorius.set_lod(lod=chance.choice((0, 1)))


def _mode(chance, rig):
    _activate(rig)
    bpy.ops.risorius.set_shape_mode(mode=chance.choice(("AUTO", "LIVE", "KEYS")))


def _duplicate(_chance, rig):
    if len(_rigs()) > 3:
        return
    for item in bpy.context.view_layer.objects:
        item.select_set(False)
    for item in (rig, scene.controls(rig), *scene.meshes(rig).values()):
        item.hide_set(False)
        item.hide_viewport = False
        item.select_set(True)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    for one in _rigs():
        scene.submodule("scene.lod.lods").show(one)


def _delete(_chance, rig):
    if len(_rigs()) > 1:
        objects = [rig, scene.controls(rig), *scene.meshes(rig).values()]
        with bpy.context.temp_override(selected_objects=objects, active_object=rig):
            bpy.ops.object.delete()


ACTIONS = (*[_slide] * 8, _key, _key, *[_frame] * 3, _lod, _lod, _mode, _mode, _duplicate, _delete)


def _same(now, wanted, step):
    assert now.keys() == wanted.keys(), step
    for name, points in wanted.items():
        np.testing.assert_allclose(now[name], points, atol=1e-6, err_msg=f"{name} at step {step}")


@pytest.mark.parametrize("seed", [2])
def test_a_hundred_steps_back_and_forth(dna_file, seed):
    chance = random.Random(seed)
    edit = bpy.context.preferences.edit
    edit.use_global_undo, edit.undo_steps = True, STEPS + 10
    for mode in ("AUTO", "KEYS"):
        scene.load(dna_file, mode, lods=(True, True, *(False,) * 6))
    bpy.ops.ed.undo_push(message="start")
    states = [_state()]
    for step in range(STEPS):
        chance.choice(ACTIONS)(chance, chance.choice(_rigs()))
        bpy.ops.ed.undo_push(message=str(step))
        states.append(_state())
    for step in reversed(range(STEPS)):
        assert bpy.ops.ed.undo() == {"FINISHED"}
        _same(_state(), states[step], step)
    for step in range(1, STEPS + 1):
        assert bpy.ops.ed.redo() == {"FINISHED"}
        _same(_state(), states[step], step)
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen
    distinct = {p.tobytes() for s in states for p in s.values()}
    assert len(distinct) > STEPS / 3  # the steps had an effect
