# SPDX-License-Identifier: GPL-3.0-or-later
"""When characters are brought up to their controls."""

import bpy
from bpy.app.handlers import persistent

from .. import native
from . import copies, evaluate, parts, runtime, testing

_state = {"objects": -1, "busy": False}


@persistent
def _frame_changed(_scene, depsgraph=None):
    if depsgraph is not None:
        evaluate.evaluate_all(depsgraph)


@persistent
def _updated(_scene, depsgraph):
    """React to edits of control armatures; writes here tag the rig only, so it ends at once."""
    if _state["busy"] or native.problem():
        return
    _state["busy"] = True
    try:
        _notice_copies()
        for rig in _edited(depsgraph):
            evaluate.mend_types(rig)
            evaluate.evaluate(rig, depsgraph)
    finally:
        _state["busy"] = False


def _notice_copies():
    count = len(bpy.data.objects)
    if count != _state["objects"]:
        _state["objects"] = count
        for sentence in copies.separate_all():
            print(f"Risorius: {sentence}")


def _edited(depsgraph):
    """The characters whose control armature is among the updates."""
    found = []
    for update in depsgraph.updates:
        item = update.id.original
        if isinstance(item, bpy.types.Armature):
            runtime.forget_outputs()
        if not isinstance(item, bpy.types.Object) or item.type != "ARMATURE":
            continue
        rig = item.get(parts.RIG)
        if isinstance(rig, bpy.types.Object) and rig not in found:
            found += [r for r in parts.rigs() if r.get(parts.CONTROLS) == item]
    return found


@persistent
def _restored(*_arguments):
    """After load, undo and redo: what was written before says nothing about what is there."""
    runtime.forget_outputs()
    _state["objects"] = -1
    refresh()
    # The evaluated copies may not have caught up yet: look once more when they have.
    runtime.forget_outputs()
    for rig in parts.rigs():
        controls = parts.controls_of(rig)
        if controls is not None:
            controls.update_tag()


@persistent
def _before_save(*_arguments):
    copies.separate_all()
    _end_tests()


@persistent
def _end_tests(*_arguments):
    if testing.clear_all():
        refresh()


def refresh():
    """Bring all characters of the current scene up to their controls now."""
    if native.problem():
        return
    for scene in bpy.data.scenes:
        layers = scene.view_layers
        if parts.rigs() and len(layers):
            depsgraph = layers[0].depsgraph
            if depsgraph is not None:
                evaluate.evaluate_all(depsgraph)
                break


_HANDLERS = (
    ("frame_change_post", _frame_changed),
    ("depsgraph_update_post", _updated),
    ("load_post", _restored),
    ("undo_post", _restored),
    ("redo_post", _restored),
    ("save_pre", _before_save),
    ("render_init", _end_tests),
)


def register():
    """Add the handlers, and bring up what is already there."""
    _state["objects"] = -1
    for name, handler in _HANDLERS:
        present = getattr(bpy.app.handlers, name)
        if handler not in present:
            present.append(handler)


def unregister():
    """Remove the handlers and drop all compiled data."""
    for name, handler in reversed(_HANDLERS):
        present = getattr(bpy.app.handlers, name)
        if handler in present:
            present.remove(handler)
    runtime.forget()
