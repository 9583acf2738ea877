# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that each entry of the add-on's session is emptied by the events that it names."""

import ctypes
import gc
import inspect
import sys
import weakref

import addon_utils
import bpy
import pytest
from conftest import MODULE
from support import scene
from support.extension_steps import of_ours

WORDS = ("free", "undo", "load", "frame", "rewrite", "unregister", "quit")


def _session():
    return scene.submodule("scene.base.session")


def _undo():
    bpy.ops.ed.undo()


def _redo():
    bpy.ops.ed.redo()


def _load():
    bpy.ops.wm.read_homefile(use_empty=True)


def _frame():
    bpy.context.scene.frame_set(bpy.context.scene.frame_current + 1)


@pytest.fixture
def probes():
    """Name of an event -> a list in the session that this event must empty."""
    session = _session()
    kept = {word: session.keep(f"probe.{word}", list, (word,)) for word in WORDS}
    yield kept
    for word in WORDS:
        session._entries.pop(f"probe.{word}")


@pytest.mark.parametrize(
    ("event", "ended"),
    [
        (_frame, {"frame"}),
        (_undo, {"free", "undo"}),
        (_redo, {"free", "undo"}),
        (_load, {"free", "undo", "load"}),
    ],
)
def test_an_event_ends_its_words(probes, event, ended):
    for _ in range(2):
        bpy.ops.object.empty_add()
        bpy.ops.ed.undo_push(message="step")
    if event is _redo:
        _undo()
    for kept in probes.values():
        kept.append(1)
    event()
    gone = {word for word, kept in probes.items() if not kept}
    assert gone - {"rewrite"} == ended


def _fill(dna_file):
    """Make a face and use it, so that the session's entries have content."""
    rig = scene.load(dna_file, "LIVE")
    bpy.context.view_layer.objects.active = scene.controls(rig)
    scene.set_controls(rig, jawOpen=0.5, mouthCornerPullL=0.4)
    assert bpy.ops.risorius.key(region="jaw") == {"FINISHED"}
    assert len(scene.submodule("scene.see_why.causes").strongest(rig)) == 1
    assert bpy.ops.risorius.heat(kind="POSE") == {"FINISHED"}
    assert bpy.ops.risorius.copy_pose() == {"FINISHED"}
    assert not scene.submodule("scene.skinning.caches").note_old(rig)
    scene.submodule("ui.see_why.panel")._ask_soon()
    _frame()
    return rig


# Entries of the add-on's session that must be emptied when a .blend file is loaded.
MISSED = (
    "caches.late",
    "controls_ahead.edited",
    "displacement.skins",
    "handlers.mended",
    "heat.held",
    "present.known",
    "tool.pointed",
    "see_why.panel.soon",
)


def _held(session, *words):
    return {name for name in session.held() if set(words) & set(session.ends_of(name))}


def test_a_load_leaves_nothing_of_the_file_before(dna_file):
    session = _session()
    rig = _fill(dna_file)
    live = weakref.ref(scene.submodule("scene.character.runtime").of(rig))
    full = _held(session, "load")
    kept = {"present.known", "displacement.skins", "see_why.panel.soon", "caches.late"}
    assert kept | {"last_written.inputs", "heat.shown"} <= full
    assert [name for name in MISSED if "load" not in session.ends_of(name)] == []
    _load()
    assert _held(session, "load", "undo", "free") == set()
    bpy.ops.object.empty_add()
    bpy.context.view_layer.update()
    gc.collect()
    assert live() is None
    panel = scene.submodule("ui.see_why.panel")
    panel._ask_soon()  # Blender removes the timer with the file; it must be registered again
    assert bpy.app.timers.is_registered(panel._ask)


def _timers():
    """Names of the add-on's functions that are registered as timers of Blender."""
    modules = [m for name, m in sys.modules.items() if name.startswith(f"{MODULE}.")]
    functions = {f for m in modules for f in vars(m).values() if inspect.isfunction(f)}
    return {f.__name__ for f in functions if bpy.app.timers.is_registered(f)}


def test_registered_again_it_is_as_new(dna_file):
    session = _session()
    first = (set(session.held()), of_ours(), _timers())
    _fill(dna_file)
    assert "runtime.cache" in session.held()
    addon_utils.disable(MODULE)
    assert {name for name in session.held() if "quit" not in session.ends_of(name)} == set()
    assert not any(of_ours().values())
    assert _timers() == set()
    addon_utils.enable(MODULE)
    again = _session()
    assert (set(again.held()), of_ours(), _timers()) == first
    scene.set_controls(bpy.data.objects["Small_rig"], jawOpen=1.0)
    assert "runtime.cache" in again.held()


class _Holder:
    """An object whose attribute `it` is the only Python reference to a value."""

    def __init__(self, it):
        self.it = it


def test_blender_counts_one_reference_too_few_to_temporary_data():
    """Blender holds one reference too few to temporary data, up to version MISCOUNTED_UNTIL.

    The test fails in the first version that counts correctly. Then set MISCOUNTED_UNTIL in
    scene/base/stage.py to the version before.
    """
    place = scene.submodule("scene.base.stage")
    lender = bpy.data.temp_data()
    lent, control = _Holder(lender.__enter__()), _Holder(object())
    also = [control.it]
    asked, right = sys.getrefcount(lent.it), sys.getrefcount(control.it)
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(lent.it))
    lender.__exit__(None, None, None)
    too_few = bpy.app.version[:2] <= place.MISCOUNTED_UNTIL
    assert right - asked == too_few, "see MISCOUNTED_UNTIL of stage.py"
    stage = place.Stage([])
    counted = sys.getrefcount(stage._file)
    stage.close()
    assert counted == right == 2 + len(also)
