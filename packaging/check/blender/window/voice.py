# SPDX-License-Identifier: MIT
"""Tests speech with a real pointer: speak a voice, replace a sound, move a sound."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from common import (
    Check,
    NotThereError,
    clear,
    look_at_face,
    open_section,
    ready_tab,
    scroll,
)
from hand import Hand
from menus import in_menu, name_file, search
from take_tasks import REMOVE_ACTION

SOUNDS = """[[s.name, s.word, s.start, s.length] for s in rig()["risorius_controls"].animation_data
.action.risorius_spoken.sounds]"""
MARKERS = "[[m.name, m.frame] for m in bpy.context.scene.timeline_markers]"
CHOSEN = 'rig()["risorius_controls"].animation_data.action.risorius_spoken.active'
NEAR = 12.0  # distance in frames from a sound within which its keys may change


def voice(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Test Speak from Audio. Without PocketSphinx, a menu must open instead of the file browser."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    if not hand.see("module('scene.animation.speech_task').has_recogniser()"):
        search(hand, "Speak from Audio")
        hand.picture("voice-lacks")
        stayed = "FILE_BROWSER" not in hand.ask("state")["areas"]
        yield "without PocketSphinx the file browser stays shut, a menu says so", stayed
        hand.key("Escape")
        raise NotThereError("a voice and a viseme that is corrected: PocketSphinx is not installed")
    path = hand.user / "voice.wav"
    if not path.exists():
        raise NotThereError("a voice and a viseme that is corrected: espeak-ng is not installed")
    search(hand, "Speak from Audio")
    name_file(hand, path)
    hand.wait("the view is back", lambda: "VIEW_3D" in hand.ask("state")["areas"])
    hand.wait("keys", lambda: hand.ask("keyed_frames"))
    yield "keys of the voice are seen", hand.ask("seen_keys") == hand.ask("keyed_frames")
    open_section(hand, "RISORIUS_PT_speech")
    scroll(hand)
    hand.picture("voice")
    yield from _replace(hand)
    yield from _markers(hand)
    hand.ask("run", code=REMOVE_ACTION + "bpy.context.scene.timeline_markers.clear()")
    clear(hand)


def _replace(hand: Hand) -> Iterator[Check]:
    """Replace a sound of the list by another from a menu. Only keyframes near it may change."""
    word_set = hand.find(r"risorius\.word_set")
    x, y = hand.find(r"risorius\.sound_insert", columns=(0.93, 0.97, 1.0))
    before, frame = hand.see(CHOSEN), hand.ask("state")["frame"]
    hand.click(x - 180, y + 66)  # the fourth row; a row is 22 pixels high
    chosen = hand.see(CHOSEN)
    sounds = hand.see(SOUNDS)
    name, _word, start, length = sounds[chosen]
    now = hand.ask("state")["frame"]
    told = f"a click on a row ({name}) shows its frame ({now})"
    yield told, chosen != before and now != frame and now == round(start)
    curves = hand.ask("curves_below")
    hand.click(word_set[0], word_set[1] - 21)
    hand.still()
    hand.picture("voice-mouths")
    in_menu(hand, r"risorius\.sound_set\(sound=.O.\)", word_set[0] - 100, word_set[1] - 400, 700)
    hand.wait("another sound", lambda: hand.see(SOUNDS)[chosen][0] != name)
    after = hand.see(SOUNDS)
    yield (
        f"Replace Sound: {name} becomes {after[chosen][0]}, and the others stay",
        [s[0] for i, s in enumerate(after) if i != chosen]
        == [s[0] for i, s in enumerate(sounds) if i != chosen],
    )
    changed = _changed(curves, hand.ask("curves_below"))
    near = [start - NEAR <= f <= start + length + NEAR for f in changed]
    told = f"keys changed near it only ({len(changed)}, frames {min(changed, default=0):.1f} to"
    yield f"{told} {max(changed, default=0):.1f} around {start:.1f})", bool(near) and all(near)
    hand.picture("voice-replaced")


def _changed(before: list[Any], after: list[Any]) -> list[float]:
    """Frames of keyframes that were added, removed or changed between two states of the curves."""
    one, other = _keys(before), _keys(after)
    differ = (one.get(c, set()) ^ other.get(c, set()) for c in {*one, *other})
    return sorted({frame for keys in differ for frame, _value in keys})


def _keys(curves: list[Any]) -> dict[tuple[str, int], set[tuple[float, float]]]:
    return {(path, index): {(x, y) for x, y in keys} for path, index, keys in curves}


def _markers(hand: Hand) -> Iterator[Check]:
    """Show the sounds as markers, move one in the timeline, and run Update Speech."""
    hand.click(*hand.find(r"risorius\.speech_markers", columns=(0.3,)))
    sounds = hand.see(SOUNDS)
    markers = hand.wait("markers", lambda: hand.see(MARKERS))
    yield f"Markers: {len(markers)} of {len(sounds)} sounds", len(markers) == len(sounds)
    # The longest sound is moved, because a sound cannot move past its neighbour.
    place = max(range(1, len(sounds) - 1), key=lambda i: sounds[i][3])
    name, frame = markers[place]
    left, top = hand.ask("timeline_at", frame=frame)
    hand.move(left, top + 20)
    hand.key("ctrl+space")  # maximised, because a low timeline does not show markers
    hand.wait("large", lambda: len(hand.ask("state")["areas"]) == 1)
    hand.key("Home")
    hand.still()
    low = hand.see("rectangle(timeline())[1] + rectangle(timeline())[3] - 14")
    left, top = hand.ask("timeline_at", frame=frame)
    hand.still()
    hand.click(left, low)
    hand.ask("ready")
    hand.key("g")
    hand.type("2")
    hand.key("Return")
    hand.wait("the move has ended", lambda: not hand.ask("is_modal"))
    moved = hand.see(MARKERS)
    yield f"the marker {name} goes from {frame} to {moved[place][1]}", moved[place][1] == frame + 2
    hand.picture("voice-markers")
    hand.key("ctrl+space")
    hand.wait("small", lambda: len(hand.ask("state")["areas"]) > 1)
    hand.still()
    hand.click(*hand.find(r"risorius\.speech_update", columns=(0.7,)))
    hand.wait("read", lambda: hand.see(SOUNDS) != sounds)
    now = hand.see(SOUNDS)[place]
    told = f"Update Speech: it begins at {now[2]:.1f}, before at {sounds[place][2]:.1f}"
    yield told, abs(now[2] - sounds[place][2] - 2.0) < 0.6
