# SPDX-License-Identifier: GPL-3.0-or-later
"""Updates saved data of characters to the current form, one step for each form (version number).

Linked characters cannot be written, so code that reads characters must understand every form. A
character of a newer form is not changed, and only the features that this version knows are used.
"""

from __future__ import annotations

from ..animation import actions
from ..base import form, parts, session
from ..base.blender_types import ArmatureObject
from ..character import armatures, values
from ..frame import joint_turns
from ..skinning import caches

# Session uids of characters whose newer form, or whose late caches, `bring_up_all` has reported.
# These sentences are returned only once for each character.
_said: set[int] = session.keep("migrations.said", set, ("load",))


def bring_up_all() -> list[str]:
    """Update every character of this file to the current form.

    Returns:
        Sentences about changes and about characters of newer forms.
    """
    done = []
    for rig in parts.rigs(linked=True):
        controls = parts.controls_of(rig)
        if controls is None:
            continue
        if form.version_of(controls) > form.PRESENT:
            done += _say_once(rig, controls)
        elif form.version_of(controls) < form.PRESENT and rig.library is None:
            done += _bring_up(rig, controls)
    return done


def _bring_up(rig: ArmatureObject, controls: ArmatureObject) -> list[str]:
    changed: list[str] = []
    found = reached = form.version_of(controls)
    for step in _STEPS[found:]:
        done = step(rig, controls)
        if done is None:
            break  # the step is tried again later
        changed += done
        reached += 1
    if reached > found:
        if form.VERSION in controls:
            del controls[form.VERSION]  # the stored value may not be a number
        # A file does not keep this number on an override of an older library, so this character
        # is updated each time the file is opened.
        controls[form.VERSION] = reached
    late = caches.words(rig) if rig.session_uid not in _said else ""
    if late:
        _said.add(rig.session_uid)
    told = [f"{rig.name} is of an older file: {', '.join(changed)}."] if changed else []
    return [*told, *([f"{rig.name}: {late}"] if late else [])]


def _say_once(rig: ArmatureObject, controls: ArmatureObject) -> list[str]:
    if rig.session_uid in _said:
        return []
    _said.add(rig.session_uid)
    return [newer(rig)]


def newer(rig: ArmatureObject) -> str:
    """A sentence if a character has a newer form than this version knows, else empty."""
    controls = parts.controls_of(rig)
    found = form.version_of(controls) if controls is not None else 0
    if found <= form.PRESENT:
        return ""
    return (
        f"{rig.name} was saved by a newer Risorius (form {found}, this one knows {form.PRESENT}): "
        "it plays and is left as it is; install the newer add-on to edit it."
    )


def _to_1(rig: ArmatureObject, controls: ArmatureObject) -> list[str]:
    """Add the property Needs Risorius; store muted NLA tracks of a baked character by name."""
    changed = []
    if not controls.override_library:
        controls[form.NEEDS] = form.WORDS
        changed.append("its controls now say that they need Risorius")
    keys = [item.data.shape_keys for item in parts.meshes_of(rig)]
    owners = [rig, controls, *(key for key in keys if key is not None and key.library is None)]
    if any([actions.note_tracks_by_name(owner) for owner in owners]):
        changed.append("the NLA tracks that its bake silenced are known by name now")
    return changed


def _to_2(rig: ArmatureObject, _controls: ArmatureObject) -> list[str] | None:
    """Find bakes in which simulations see the face one frame late; None while such bakes exist."""
    if caches.note_old(rig):
        return None
    if caches.have_nodes(rig):
        return ["geometry nodes that were baked around it are one frame late: bake them again"]
    return []


def _to_3(rig: ArmatureObject, controls: ArmatureObject) -> list[str]:
    """Let head rotations drive RBF poses, unless sliders of joint rotations are set by hand."""
    if not joint_turns.are_set_by_hand(rig, controls):
        return []
    controls.risorius_neck_poses = False
    return ["the sliders of its joints' rotations go on leading the neck poses"]


def _to_4(rig: ArmatureObject, _controls: ArmatureObject) -> list[str]:
    """Let materials read animated maps from a mesh, because Direct mode updates no armature."""
    if not rig.override_library:
        if armatures.joints_are_shown(rig):
            rig[parts.JOINTS_SHOWN] = True
        values.carry_on_largest(rig)
        carrier = parts.carrier_of(rig)
        carrier.update_tag()
        values.point_materials(rig, carrier if parts.BAKED not in rig else rig)
    return []


_STEPS = (_to_1, _to_2, _to_3, _to_4)
