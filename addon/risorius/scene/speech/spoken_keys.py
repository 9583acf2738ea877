# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores the sounds of a voice with its action, and updates the mouth's keys after corrections.

A voice is the recorded speech from which an action was made. A sound is a phoneme and the frame at
which it begins. In each curve only the keys between the last key before the changed frames and the
first key after the changed frames are replaced. These two keys stay, but their handles towards the
replaced keys are computed again. All other keys are unchanged.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol, cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.animation import clip_units, spoken
from ...logic.animation.bezier_keys import TOLERANCE, Fitter, straight
from ...logic.animation.spoken import Sound, SpokenError
from ...logic.base.sentences import told
from ..animation import clip_actions, layer_mixing
from ..base import compat, parts

PROPERTY = "risorius_spoken"
_NEAR = TOLERANCE  # smaller changes of a control's value are ignored
_REACH = 1.2  # seconds before and after a sound in which it can move the mouth
_ROUND = 2.5  # seconds: sounds up to this far from the computed samples are included
_BESIDE = 1e-3  # frames: keys closer than this are at the same frame

Floats = NDArray[np.float64]


class Row(Protocol):
    """A sound in the list of a voice: the members of RISORIUS_PG_sound that this module uses."""

    begin: float
    name: str
    word: str


class Rows(Protocol):
    """The list of a voice's sounds: the methods of Blender's collection that this module uses."""

    def __len__(self) -> int: ...
    def __getitem__(self, place: int) -> Row: ...
    def __iter__(self) -> Iterator[Row]: ...
    def add(self) -> Row: ...
    def remove(self, place: int) -> None: ...


class Spoken(Protocol):
    """The stored data of a voice: the members of RISORIUS_PG_spoken."""

    sounds: Rows
    active: int  # index of the chosen sound
    start: float
    """Frame of the clip's first sample."""
    end: float
    """Frame at which the sound file ends."""
    fps: float
    """Frames per second of the scene when the action was made."""
    rate: float
    """Samples per second of the clip."""
    samples: int  # number of samples of the clip
    whole: bool  # whether keys are on whole frames only
    tolerance: float  # largest difference of a slider from the clip; 0: a key for each sample
    intensity: float  # strength of mouth and brows with which the clip was made
    openness: str
    """Value of this name in the metadata of a correctable clip."""
    built: str
    """The sounds from which the keys were made, as JSON."""
    visemes: str
    """The face's own visemes, as JSON: viseme -> control -> weight."""
    mark: str
    """Unique id of the voice, independent of the name of its action."""


def of(action: bpy.types.Action) -> Spoken:
    """The voice of an action; if the action has none, the list of sounds is empty."""
    return cast(Spoken, getattr(action, PROPERTY))


def sounds_of(action: bpy.types.Action) -> list[Sound]:
    """The sounds in the list of an action, in frames of the action."""
    return [Sound(row.begin, row.name, row.word) for row in of(action).sounds]


def note(
    action: bpy.types.Action,
    clip: native.Clip,
    timing: clip_units.Timing,
    tolerance: float,
    intensity: float,
    visemes: Mapping[str, native.Expression],
) -> None:
    """Store the words and sounds of a voice with its action.

    Args:
        action: action of the clip.
        clip: clip of a correctable voice.
        timing: maps the times of the clip to frames of the action.
        tolerance: largest difference of a slider from the clip after the fit of the action's keys;
            0 if each sample has a key.
        intensity: strength of mouth and brows with which the clip was made.
        visemes: visemes of the face, used for the clip.
    """
    said = of(action)
    said.start, said.fps, said.rate = float(timing.frames(np.zeros(1))[0]), timing.rate, clip.rate
    said.whole, said.tolerance, said.intensity = timing.whole, tolerance, intensity
    said.samples, said.openness = clip.frame_count, clip.metadata["openness"]
    said.end = float(timing.frames(np.array([float(clip.metadata["seconds"])]))[0])
    words = {event.time: event.value for event in clip.events if event.name == "word"}
    found = [event for event in clip.events if event.name == "phoneme"]
    begins = timing.frames(np.array([event.time for event in found]))
    sounds = [
        Sound(float(begin), event.value, words.get(event.time, ""))
        for begin, event in zip(begins, found, strict=True)
    ]
    _fill(said, sounds)
    said.built = _packed(sounds_of(action))
    said.visemes = json.dumps({name: dict(one.weights) for name, one in visemes.items()})
    said.mark = uuid.uuid4().hex  # actions can be renamed; a copy of an action is the same voice


def change(action: bpy.types.Action, sounds: Sequence[Sound]) -> int:
    """Replace the list of sounds of an action, and update the mouth's keys.

    Returns:
        The number of curves with new keys.

    Raises:
        SpokenError: the voice cannot be corrected, and its list is unchanged; or `sounds` is empty
            or not in the order of time, and the list is already replaced.
    """
    _check(action)
    _fill(of(action), sounds)
    return rebuild(action)


def _fill(said: Spoken, sounds: Sequence[Sound]) -> None:
    active = said.active
    while len(said.sounds) > len(sounds):
        said.sounds.remove(len(said.sounds) - 1)
    for i, sound in enumerate(sounds):
        row = said.sounds[i] if i < len(said.sounds) else said.sounds.add()
        row.begin, row.name, row.word = sound
    place = min(active, len(sounds) - 1)
    if place != active:
        said.active = place


def _packed(sounds: Sequence[Sound]) -> str:
    return json.dumps([[sound.begin, sound.name] for sound in sounds])


def _built(action: bpy.types.Action) -> list[Sound]:
    """The sounds from which the current keys of the mouth were made.

    Raises:
        SpokenError: the sounds are lost.
    """
    try:
        found = [Sound(float(begin), str(name)) for begin, name in json.loads(of(action).built)]
    except (ValueError, TypeError):
        found = []
    if not found:
        raise SpokenError(
            told(
                "{action} has lost what its keys were made of: use Speak from Audio again",
                action=action.name,
            )
        )
    return found


def rebuild(action: bpy.types.Action) -> int:
    """Update the mouth's keys around sounds that have changed in the list.

    Locked curves are unchanged, and deleted curves stay deleted.

    Returns:
        The number of curves with new keys.

    Raises:
        SpokenError: the action has no voice or is linked, the list is damaged, or no slider of the
            mouth has keys in this action.
    """
    curves = _check(action)
    said, old, new = of(action), _built(action), sounds_of(action)
    span = spoken.changed(old, new, said.end)
    if span is None:
        return 0
    mouth = _Mouth(action)
    first, last = mouth.window(*span)
    before, after = mouth.curves(old, first, last), mouth.curves(new, first, last)
    count = 0
    for name in after:
        curve = curves.get(parts.property_path(name))
        moving = np.flatnonzero(np.abs(after[name] - before[name]) > _NEAR)
        if curve is None or curve.lock or not len(moving):
            continue
        ends = mouth.frames(np.array([first + moving[0], first + moving[-1]]))
        _replace(curve, mouth, new, name, (float(ends[0]), float(ends[1])))
        count += 1
    said.built = _packed(new)
    layer_mixing.note_edits([action])  # Blender does not report edits of a layer's action
    action.update_tag()
    for rig in parts.rigs():
        controls = parts.controls_of(rig)
        if controls is not None:
            controls.update_tag()
    return count


def trouble(action: bpy.types.Action) -> str:
    """The Sentence with the reason why the voice of an action cannot be corrected; "" if it can."""
    try:
        _check(action)
    except SpokenError as error:
        return cast("str", error.args[0])
    return ""


def _check(action: bpy.types.Action) -> dict[str, bpy.types.FCurve]:
    """Check that the voice of an action can be corrected.

    Returns:
        Data path -> F-curve, for all F-curves of the action.

    Raises:
        SpokenError: the voice cannot be corrected; the text gives the reason.
    """
    said = of(action)
    begins = [row.begin for row in said.sounds]
    if not begins:
        raise SpokenError(told("{action} contains no voice", action=action.name))
    _built(action)
    if not (np.diff(begins) > 0.0).all() or not said.fps > 0.0 or not said.rate > 0.0:
        raise SpokenError(
            told(
                "{action}: a list of sounds in the order of their start was expected",
                action=action.name,
            )
        )
    if action.library is not None:
        raise SpokenError(
            told(
                (
                    "{action} is linked from another file: make the action local to correct "
                    "its sounds"
                ),
                action=action.name,
            )
        )
    curves = {c.data_path: c for c in compat.curves_of(action)}
    if not any(parts.property_path(name) in curves for name in _Mouth(action).names()):
        raise SpokenError(
            told(
                (
                    "the voice of {action} cannot be corrected: the action has no keys for "
                    "sliders of the mouth, perhaps because the keys are on the face board"
                ),
                action=action.name,
            )
        )
    return curves


class _Mouth:
    """Computes the values of the mouth's controls at any sample of a voice's clip."""

    def __init__(self, action: bpy.types.Action) -> None:
        self.said = of(action)
        self._speech = native.part("speech")
        self._phoneme = native.part("speech.phones").Phoneme
        self._visemes = _visemes_of(self.said)
        self._opened = np.array([float(n) for n in self.said.openness.split()] or [1000.0]) / 1000.0

    def names(self) -> list[str]:
        return list(self.curves([Sound(self.said.start, spoken.SILENCE)], 0, 2))

    def frames(self, samples: NDArray[Any]) -> Floats:
        """The frame of the action at each sample number."""
        return self.said.start + samples * (self.said.fps / self.said.rate)

    def sample(self, frame: float) -> float:
        """The sample number, with fraction, at a frame of the action; clamped to the clip."""
        at = (frame - self.said.start) * self.said.rate / self.said.fps
        return min(max(at, 0.0), self.said.samples - 1.0)

    def window(self, begin: float, end: float) -> tuple[int, int]:
        """The samples whose values can change if sounds between two frames of the action change.

        Returns:
            The number of the first sample, and the number of the last sample plus 1.
        """
        far = _REACH * self.said.fps
        first, last = int(self.sample(begin - far)), int(np.ceil(self.sample(end + far)))
        return first, last + 1

    def curves(self, sounds: Sequence[Sound], first: int, last: int) -> dict[str, Floats]:
        """The values of the mouth's controls at a range of samples.

        Args:
            sounds: all sounds of the voice.
            first, last: the range: sample `first` to sample `last` - 1.

        Returns:
            Name of a control -> float64[last - first], its values.
        """
        said = self.said
        times = np.arange(first, last) / said.rate
        ends = [*(sound.begin for sound in sounds[1:]), said.end]
        phones = [
            self._phoneme((s.begin - said.start) / said.fps, (end - said.start) / said.fps, s.name)
            for s, end in zip(sounds, ends, strict=True)
        ]
        near = [p for p in phones if times[0] - _ROUND < p.end and p.begin < times[-1] + _ROUND]
        found: dict[str, Floats] = self._speech.mouth(
            near, self._opened, times, said.intensity, self._visemes
        )
        return found


def _visemes_of(said: Spoken) -> dict[str, native.Expression]:
    """The face's own visemes by name; empty if the voice has none or their text is invalid."""
    make = native.part("expressions").Expression
    try:
        return {
            str(name): make(str(name), str(name), "viseme", "", {c: float(w[c]) for c in w})
            for name, w in json.loads(said.visemes or "{}").items()
        }
    except (ValueError, TypeError, AttributeError):
        return {}


def _replace(
    curve: bpy.types.FCurve,
    mouth: _Mouth,
    sounds: Sequence[Sound],
    name: str,
    span: tuple[float, float],
) -> None:
    """Replace the keys between the last key before and the first key after a span of frames.

    Args:
        curve: the F-curve of a slider.
        mouth: computes the values of the control.
        sounds: the sounds of the voice.
        name: name of the control.
        span: first and last frame of the action at which the values change.
    """
    points = curve.keyframe_points
    at = clip_actions.key_points(curve)[0].astype(np.float64)
    before = int(np.searchsorted(at, span[0] - _BESIDE)) - 1
    behind = int(np.searchsorted(at, span[1] + _BESIDE))
    begin = at[before] if before >= 0 else max(span[0] - 1.0, float(mouth.frames(np.zeros(1))[0]))
    end = at[behind] if behind < len(at) else span[1] + mouth.said.fps / mouth.said.rate
    frames, values = _samples(curve, mouth, sounds, name, (float(begin), float(end)))
    bent = mouth.said.tolerance > 0.0
    fitted = (
        Fitter(mouth.said.tolerance).between(frames, values) if bent else straight(frames, values)
    )
    first, last = 0 if before < 0 else 1, len(fitted.co) - (behind < len(at))
    if before >= 0:
        _turn(points[before], bent, right=fitted.right[0])
    if behind < len(at):
        _turn(points[behind], bent, left=fitted.left[-1])
    for place in reversed(range(before + 1, behind)):
        points.remove(points[place], fast=True)
    for rows in ("co", "left", "right"):
        setattr(fitted, rows, getattr(fitted, rows)[first:last])
    if len(fitted.co):
        clip_actions.add_keys(curve, fitted, bent)
    curve.update()


def _samples(
    curve: bpy.types.FCurve,
    mouth: _Mouth,
    sounds: Sequence[Sound],
    name: str,
    span: tuple[float, float],
) -> tuple[Floats, Floats]:
    """Frames and values of a control in a span of frames, with the curve's values at both ends.

    Args:
        curve: the F-curve of the control's slider.
        mouth: computes the values of the control.
        sounds: the sounds of the voice.
        name: name of the control.
        span: first and last frame of the action.
    """
    first, last = int(mouth.sample(span[0])), int(np.ceil(mouth.sample(span[1])))
    first, last = max(first - 1, 0), min(last + 2, mouth.said.samples)
    frames = mouth.frames(np.arange(first, last))
    values = mouth.curves(sounds, first, last)[name]
    if mouth.said.whole:
        frames, values = clip_units.onto_frames(frames, values)
    inside = (frames > span[0] + _BESIDE) & (frames < span[1] - _BESIDE)
    held = [curve.evaluate(frame) for frame in span]
    return (
        np.concatenate([span[:1], frames[inside], span[1:]]),
        np.concatenate([held[:1], values[inside], held[1:]]),
    )


def _turn(
    key: bpy.types.Keyframe,
    bent: bool,
    left: Floats | None = None,
    right: Floats | None = None,
) -> None:
    """Set the handle of a key that points into the replaced span; the key's other handle stays.

    Args:
        key: the key.
        bent: True: Bezier interpolation; False: linear.
        left, right: new end of the left or right handle, as frame and value; None: this handle
            stays.
    """
    kept = key.handle_left[:], key.handle_right[:]
    if bent:
        key.handle_left_type = key.handle_right_type = "FREE"
        key.handle_left = kept[0] if left is None else tuple(left)
        key.handle_right = kept[1] if right is None else tuple(right)
    if right is not None:
        key.interpolation = "BEZIER" if bent else "LINEAR"
