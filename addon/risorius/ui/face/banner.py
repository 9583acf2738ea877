# SPDX-License-Identifier: GPL-3.0-or-later
"""The first line of the tab: the name of the face, or the active mode with a button that ends it.

The banner is always one line high, so that the panels below it do not move.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from ...logic.character import slider_words
from ...scene.animation import tweak_guard, tweaks
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import board, sides
from ...scene.frame import look_masks
from ...scene.live import sessions
from ...scene.see_why import heat
from .. import words
from ..blender_types import Context, Icon, UILayout
from ..common import as_seen

_NAMED = 2  # most solo controls that are listed by name
_TEXT = 0.72  # share of the line for the text; the rest is for the button


@dataclass(frozen=True)
class Mode:
    """A mode of a face that changes the effect of edits or the view, and that the user can end.

    Attributes:
        text: name of the mode, in the user's language.
        icon: icon before the text.
        operator: operator that ends the mode.
        settings: properties of the operator.
        alert: True: the banner is red, as a warning that the view or new keys are not as usual.
    """

    text: str
    icon: Icon
    operator: str
    settings: Mapping[str, object] = field(default_factory=dict)
    alert: bool = False


def modes(context: Context, rig: ArmatureObject, controls: ArmatureObject) -> list[Mode]:
    """The active modes: first modes that change the effect of edits, then modes of the view.

    Args:
        context: context with the current frame.
        rig, controls: deforming and control armature of the face.
    """
    return [*_of_keys(context, rig, controls), *_of_looks(context, rig, controls)]


def _of_keys(context: Context, rig: ArmatureObject, controls: ArmatureObject) -> Iterator[Mode]:
    """Active modes that change the effect of edits and keys: capture, bake, tweak and board."""
    session = sessions.of(controls)
    if session is not None and session.recording is not None:
        yield Mode(words.say("Recording"), "REC", "risorius.live_record", alert=True)
    elif session is not None:
        yield Mode(words.say("Live Capture"), "PLAY", "risorius.live_stop")
    if parts.BAKED in rig or parts.BAKED in controls:
        yield Mode(words.say("Baked"), "ACTION", "risorius.unbake")
    tweak = tweaks.of(controls)
    if tweak is not None:
        here = tweak.weight(context.scene.frame_current_final) > 0.0
        said = "Tweak {first:g}-{last:g}" if here else "Not Here: Tweak {first:g}-{last:g}"
        text = words.say(said, first=tweak.first, last=tweak.last)
        trouble = not here or bool(tweak_guard.trouble(controls))
        yield Mode(text, "MOD_TIME", "risorius.tweak", {"enable": False}, trouble)
    if board.leads_face(rig):
        yield Mode(words.say("The Board Leads"), "BONE_DATA", "risorius.lead", {"by": "SLIDERS"})


def _of_looks(context: Context, rig: ArmatureObject, controls: ArmatureObject) -> Iterator[Mode]:
    """Active modes that change the view of the face, or link its left and right sliders."""
    look = look_masks.of(rig)
    if look.solo:
        swapped = as_seen(context)
        names = sorted(
            slider_words.title_in_region(label, "", swapped=swapped) for label in look.solo
        )
        shown = ", ".join(names) if len(names) <= _NAMED else str(len(names))
        text = words.say("Solo: {names}", names=shown)
        yield Mode(text, "SOLO_ON", "risorius.show_all", alert=True)
    elif look.muted:
        yield Mode(words.say("Muted"), "HIDE_ON", "risorius.show_all", alert=True)
    if heat.of(rig) is not None:
        yield Mode(words.say("Heat Map"), "SHADING_RENDERED", "risorius.heat", {"kind": "OFF"})
    if sides.followers(controls):
        yield Mode(words.say("Sides Linked"), "LINKED", "risorius.link_sides", {"enable": False})


def draw(layout: UILayout, context: Context, rig: ArmatureObject, controls: ArmatureObject) -> None:
    """Draw the name of the face, or the first active mode of the face with the button Done.

    Args:
        layout: layout of the panel.
        context: context of the panel.
        rig, controls: deforming and control armature of the face.
    """
    found = modes(context, rig, controls)
    if not found:
        words.show(layout.row(align=True), parts.title_of(rig), "USER")
        return
    mode = found[0]
    row = layout.split(factor=_TEXT, align=True)
    row.alert = mode.alert
    more = words.say("{mode} and {count} more", mode=mode.text, count=len(found) - 1)
    words.show(row, more if found[1:] else mode.text, mode.icon)
    button = row.operator(mode.operator, text="Done")
    for name, value in mode.settings.items():
        setattr(button, name, value)
