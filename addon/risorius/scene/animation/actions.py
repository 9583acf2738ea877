# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes baked curves to actions, and restores the earlier animation of an object."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import bpy
import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from ...logic.animation import key_reduction as reduction
from ...logic.animation import track_matching
from ..base import compat, saved
from ..base.blender_types import Animated

BEFORE = "risorius_before"  # on a datablock with a baked action: its animation before the bake
# Custom property that marks a baked action. `restore` removes a marked action if no other datablock
# uses it and the user did not edit its keys.
BAKED_ACTION = "risorius_baked_action"
_DIGEST = "risorius_digest"  # on a baked action: result of `_digest` after the bake
_LINEAR = 1  # number of Blender's interpolation "LINEAR"
_AT_ONCE = 1 << 21  # approximate number of values (frames times columns) reduced in one call


@dataclass
class Track:
    """Baked values of one property.

    Attributes:
        path: data path of the property.
        group: name of the group of its F-curves.
        values: float32[frames, width], the components of the property at each frame.
        now: float[width], current value of the property in the scene. `write` makes no curve of a
            property that has this value at all frames. None: always make a curve.
        first: array index that the first column of values animates.
        indexed: whether the property is an array.
    """

    path: str
    group: str
    values: NDArray[np.float32]
    now: npt.ArrayLike | None = None
    first: int = 0
    indexed: bool = True


@dataclass
class Counts:
    """Totals over all written F-curves.

    Attributes:
        keys: number of keyframes after the key reduction.
        all_keys: number of keyframes before the key reduction.
        error: largest error of the key reduction, in the units of the values.
        curves: number of F-curves.
    """

    keys: int = 0
    all_keys: int = 0
    error: float = 0.0
    curves: int = 0

    def sentence(self) -> str:
        """The counts as text for a report."""
        return (
            f"{self.curves:,} curves, {self.keys:,} of {self.all_keys:,} keys, "
            f"largest error {self.error:.3g}"
        )


def write(
    name: str,
    owner: Animated,
    frames: NDArray[np.float64],
    tracks: Sequence[Track],
    error: float,
    counts: Counts,
) -> tuple[bpy.types.Action, bpy.types.ActionSlot | None]:
    """Make an action from baked tracks. A track that stays at its current value gets no F-curve.

    Args:
        name: name of the action.
        owner: the datablock that will play it.
        frames: float64[N], frames of the scene.
        tracks: values of the properties at these frames.
        error: largest difference of a value after the key reduction, in the units of the values;
            0: keep every key of a curve that moves.
        counts: totals, which this call increases.

    Returns:
        The Action and its slot (None before Blender 4.4).
    """
    action = bpy.data.actions.new(name)
    action[BAKED_ACTION] = True
    action.use_frame_range = True
    action.frame_start, action.frame_end = float(frames[0]), float(frames[-1])
    moving = [t for t in tracks if t.now is None or (t.values != _flat(t.now)).any()]
    add_tracks(compat.add_curves(action, owner), frames, moving, error, counts)
    stamp(action)
    return action, compat.slot_for(action, owner)


def add_tracks(
    bag: bpy.types.ActionChannelbag,
    frames: NDArray[np.float64],
    tracks: Sequence[Track],
    error: float,
    counts: Counts,
) -> None:
    """Add an F-curve for each column of the tracks' values.

    Args:
        bag: receives the F-curves; must not contain curves of these properties.
        frames: float64[N], frames of the scene.
        tracks: values of the properties at these frames.
        error: largest difference of a value after the key reduction, in the units of the values;
            0: keep every key of a curve that moves.
        counts: totals, which this call increases.
    """
    times = np.asarray(frames, np.float32)
    for track, values, keep in _reduced(frames, tracks, error, counts):
        for column in range(values.shape[1]):
            curve = _new_curve(bag, track, track.first + column if track.indexed else 0)
            _fill(curve, times[keep[:, column]], values[keep[:, column], column])


def _flat(value: npt.ArrayLike) -> NDArray[np.float32]:
    return np.atleast_1d(np.asarray(value, np.float32))


def _reduced(
    frames: NDArray[np.float64], tracks: Sequence[Track], error: float, counts: Counts
) -> Iterator[tuple[Track, NDArray[np.float32], NDArray[np.bool_]]]:
    """Yields each track, its values [frames, width], and a mask of the keys that remain after the
    reduction, bool[frames, width].

    Args:
        frames: float64[N], frames of the scene.
        tracks: values of the properties at these frames.
        error: largest error of the key reduction, in the units of the values; 0: keep every key
            of a curve that moves. A curve that stays at its first value keeps only one key.
        counts: totals, which this call increases.
    """
    most = max(_AT_ONCE // len(frames), 16)  # columns to collect before a reduction
    waiting, width = [], 0
    for number, track in enumerate(tracks):
        waiting.append(track)
        width += track.values.shape[1]
        if width < most and number + 1 < len(tracks):
            continue
        values = np.concatenate([t.values for t in waiting], axis=1, dtype=np.float32)
        keep = reduction.reduce_keys(frames, values, error)
        if error > 0.0:
            off = np.abs(reduction.rebuilt(frames, values, keep) - values).max(initial=0.0)
            counts.error = max(counts.error, float(off))
        counts.curves += width
        counts.keys += int(keep.sum())
        counts.all_keys += keep.size
        ends = np.cumsum([t.values.shape[1] for t in waiting])[:-1]
        yield from zip(waiting, np.split(values, ends, 1), np.split(keep, ends, 1), strict=True)
        waiting, width = [], 0


def _new_curve(bag: bpy.types.ActionChannelbag, track: Track, index: int) -> bpy.types.FCurve:
    rna: Any = bag.fcurves.bl_rna
    words = rna.functions["new"].parameters.keys()
    for word in ("action_group", "group_name"):  # name of the argument up to Blender 4.3; since 5.0
        if word in words:
            return bag.fcurves.new(track.path, index=index, **{word: track.group})
    curve = bag.fcurves.new(track.path, index=index)
    group = bag.groups.get(track.group)
    curve.group = group if group is not None else bag.groups.new(track.group)
    return curve


def _fill(curve: bpy.types.FCurve, times: NDArray[np.float32], values: NDArray[np.float32]) -> None:
    points = curve.keyframe_points
    points.add(len(times))
    places = np.stack([times, values], axis=1).ravel()
    # Linear keyframes ignore their handles. The handles are placed at the keyframe, because
    # Blender would otherwise compute them, which is slow.
    for name in ("co", "handle_left", "handle_right"):
        points.foreach_set(name, places)
    points.foreach_set("interpolation", np.full(len(times), _LINEAR, np.int32))


def was_edited(action: bpy.types.Action) -> bool:
    """Whether the frames or values of an action's keys changed since the last call of `stamp`.

    Edits of handles and interpolation are not noticed. True if `stamp` was never called for the
    action.
    """
    return action.get(_DIGEST) != _digest(action)


def stamp(action: bpy.types.Action) -> None:
    """Store a digest of the frames and values of an action's keys for `was_edited`."""
    action[_DIGEST] = _digest(action)


def _digest(action: bpy.types.Action) -> str:
    """A digest of data path, index, and frames and values of the keys of an action's F-curves."""
    found = hashlib.sha1(usedforsecurity=False)
    for curve in compat.curves_of(action):
        places = np.empty(len(curve.keyframe_points) * 2, np.float32)
        curve.keyframe_points.foreach_get("co", places)
        found.update(f"{curve.data_path} {curve.array_index}".encode())
        found.update(places.tobytes())
    return found.hexdigest()


def play(
    owner: Animated,
    action: bpy.types.Action,
    slot: bpy.types.ActionSlot | None,
    muted: Collection[str] = (),
    strip: bool = False,
) -> None:
    """Let a datablock play a baked action and no other action or NLA strip.

    The earlier animation of the datablock is stored for `restore`.

    Args:
        owner: object or shape keys that play the action.
        action, slot: the results of `write`.
        muted: data paths of baked properties, whose drivers are muted.
        strip: put the action on a new NLA track instead of making it the active action.
    """
    keep(owner)
    data = owner.animation_data
    assert data is not None
    silenced = [c for c in data.drivers if c.data_path in muted and not c.mute]
    for curve in silenced:
        curve.mute = True
    held = owner[BEFORE]
    held["drivers"] = [f"{c.array_index} {c.data_path}" for c in silenced]
    data.action_influence, data.action_blend_type = 1.0, "REPLACE"
    data.action_extrapolation = "HOLD"
    if not strip:
        data.use_nla = False
        compat.assign_action(data, action, slot)
        return
    held["tracks"] = [_noted(track, track.mute, track.is_solo) for track in data.nla_tracks]
    for track in data.nla_tracks:
        track.is_solo = False
        track.mute = True
    data.action = None
    data.use_nla = True
    track = data.nla_tracks.new()
    track.name = action.name
    made = track.strips.new(action.name, int(np.floor(action.frame_start)), action)
    if slot is not None:
        made.action_slot = slot
    made.frame_start_ui = made.action_frame_start
    held["track"], held["baked"] = track.name, action


def keep(owner: Animated) -> None:
    """Store the animation settings of a datablock for `restore`, unless they are stored already."""
    if BEFORE in owner:
        return
    had = owner.animation_data is not None
    data = owner.animation_data or owner.animation_data_create()
    state: dict[str, Any] = {
        "had": int(had),
        "use_nla": int(data.use_nla),
        "influence": data.action_influence,
        "blend": data.action_blend_type,
        "extrapolation": data.action_extrapolation,
    }
    if data.action is not None:
        state["action"] = data.action
        slot = getattr(data, "action_slot", None)
        if slot is not None:
            state["slot"] = slot.identifier
    owner[BEFORE] = state


def note_values(owner: Animated, paths: Iterable[str]) -> None:
    """Store the current values of properties that a baked action changes, for `restore`.

    Args:
        owner: object for which `play` was called.
        paths: data paths of the properties.
    """
    lines = []
    for path in paths:
        value = owner.path_resolve(path)
        numbers = [value] if isinstance(value, (bool, int, float)) else list(value)
        lines.append(json.dumps([path, numbers]))
    owner[BEFORE]["values"] = lines


def _set_back(owner: Animated, lines: Iterable[str]) -> None:
    for line in lines:
        try:
            path, numbers = json.loads(line)
            value = owner.path_resolve(path)
            if isinstance(value, (bool, int, float)):
                _set(owner, path, numbers[0])
            else:
                for i, number in enumerate(numbers):
                    value[i] = number
        except (ValueError, TypeError, LookupError, AttributeError):
            continue  # the property is missing, or the line is damaged


def _set(owner: Animated, path: str, number: float) -> None:
    """Set a property by its path: a custom property in brackets, or an attribute.

    Args:
        owner: the datablock from which the path starts.
        path: data path of one number.
        number: the new value.
    """
    if path.endswith('"]'):
        where, key = path[:-2].rsplit('["', 1)
        item = owner.path_resolve(where) if where else owner
        item[bpy.utils.unescape_identifier(key)] = number
    else:
        where, _dot, key = path.rpartition(".")
        setattr(owner.path_resolve(where) if where else owner, key, number)


def restore(owner: Animated) -> None:
    """Restore the animation that a datablock had before `play`.

    Muted drivers play again, and the values that `note_values` stored are set. Baked actions are
    removed, unless another datablock uses them, the user gave them a fake user, or the user edited
    them. An action that the user assigned since `play` is unassigned and gets a fake user.
    """
    if BEFORE not in owner:
        return
    note_tracks_by_name(owner)
    state = saved.table(owner, BEFORE) or {}
    data = owner.animation_data or owner.animation_data_create()
    baked = [data.action]
    action = state.get("action")
    action = action if isinstance(action, bpy.types.Action) else None
    if data.action is not None and data.action != action:
        data.action.use_fake_user |= not data.action.get(BAKED_ACTION)
    if "track" in state:
        baked += _remove_track(data, state)
    for curve in data.drivers:
        if f"{curve.array_index} {curve.data_path}" in saved.texts(state, "drivers"):
            curve.mute = False
    _play_again(data, state, action)
    _set_back(owner, saved.texts(state, "values"))
    if not saved.whole(state, "had", 1) and not (action or data.drivers or data.nla_tracks):
        owner.animation_data_clear()
    del owner[BEFORE]
    for made in baked:
        if made is None or not made.get(BAKED_ACTION) or _is_used(made):
            continue
        if not was_edited(made):
            bpy.data.actions.remove(made)
        else:
            made.use_fake_user = True


def _play_again(
    data: bpy.types.AnimData, state: Mapping[str, object], action: bpy.types.Action | None
) -> None:
    """Restore the stored action, slot and blending settings of animation data.

    Args:
        data: the animation data of the datablock.
        state: the settings that `keep` stored.
        action: the action that was active then, or None.
    """
    data.action = action
    if action is not None and "slot" in state:
        slot = next((s for s in action.slots if s.identifier == state["slot"]), None)
        if slot is not None:
            data.action_slot = slot
    data.action_influence = saved.number(state, "influence", 1.0, 0.0, 1.0)
    for name, key in (("action_blend_type", "blend"), ("action_extrapolation", "extrapolation")):
        known = data.bl_rna.properties[name]
        if saved.text(state, key) in cast("bpy.types.EnumProperty", known).enum_items:
            setattr(data, name, state[key])
    data.use_nla = bool(saved.whole(state, "use_nla", 1))


def _is_used(action: bpy.types.Action) -> bool:
    """Whether a datablock or a fake user uses an action.

    `users` alone is not enough: Blender 4.3 counts one user too many if an object was duplicated.
    """
    return bool(
        action.users and (action.use_fake_user or bpy.data.user_map(subset=[action])[action])
    )


def _noted(track: bpy.types.NlaTrack, mute: bool | int, solo: bool | int) -> str:
    """JSON text that stores an NLA track for `restore`: mute, solo, name, names of its strips."""
    return json.dumps([bool(mute), bool(solo), track.name, [s.name for s in track.strips]])


def _track_noted(line: str) -> tuple[bool, bool, str, list[str]] | None:
    """Mute, solo, name and strip names from a text of `_noted`; None if the text is damaged."""
    try:
        mute, solo, name, strips = json.loads(line)
        return bool(mute), bool(solo), str(name), [str(strip) for strip in strips]
    except (ValueError, TypeError):
        return None


def note_tracks_by_name(owner: Animated) -> bool:
    """Convert the stored states of NLA tracks from the format of old .blend files to JSON texts.

    The old format stores mute and solo in the order of the tracks; the texts have names too.

    Returns:
        Whether the stored states had the old format and were converted.
    """
    state = saved.table(owner, BEFORE) or {}
    lines = saved.texts(state, "tracks")
    if not lines or lines[0].startswith("["):
        return False
    data = owner.animation_data
    if data is None:  # the user removed the animation data, and with it the tracks
        owner[BEFORE]["tracks"] = []
        return False
    own = data.nla_tracks.get(saved.text(state, "track"))
    others = [track for track in data.nla_tracks if track != own]
    flags = [[*x.split(), "0", "0"][:2] for x in lines]
    pairs = zip(others, flags, strict=False)
    owner[BEFORE]["tracks"] = [_noted(t, mute == "1", solo == "1") for t, (mute, solo) in pairs]
    if own is not None and len(own.strips) and own.strips[0].action is not None:
        owner[BEFORE]["baked"] = own.strips[0].action
    return True


def _remove_track(
    data: bpy.types.AnimData, state: Mapping[str, object]
) -> list[bpy.types.Action | None]:
    """Remove the baked strips, and tracks that are empty then; restore mute and solo of the others.

    Args:
        data: the animation data with the NLA tracks.
        state: the state that `keep` and `play` stored.

    Returns:
        The actions of the removed strips.
    """
    own = _baked_strips(data, state)
    played: list[bpy.types.Action | None] = []
    for _track, strip in own:
        played += compat.actions_in([strip])
    for track, strip in own:
        track.strips.remove(strip)
    for track in {track.name: track for track, _strip in own}.values():
        if not len(track.strips):
            data.nla_tracks.remove(track)
    noted = list(filter(None, map(_track_noted, saved.texts(state, "tracks"))))
    there = [(track.name, [s.name for s in track.strips]) for track in data.nla_tracks]
    pairs = track_matching.matched([(name, strips) for _mute, _solo, name, strips in noted], there)
    for at, before in pairs.items():
        data.nla_tracks[at].mute = noted[before][0]
    for at, before in pairs.items():
        if noted[before][1]:
            data.nla_tracks[at].is_solo = True
    return played


def _baked_strips(
    data: bpy.types.AnimData, state: Mapping[str, object]
) -> list[tuple[bpy.types.NlaTrack, bpy.types.NlaStrip]]:
    """The NLA strips that play the baked action, each with its track.

    Strips and tracks that the user renamed or moved are found too. If no strip plays the stored
    action, strips of other baked actions on the track with the stored name are found.
    """
    strips = [(track, strip) for track in data.nla_tracks for strip in track.strips]
    baked = state.get("baked")
    own = [(t, s) for t, s in strips if baked and set(compat.actions_in([s])) == {baked}]
    if own:
        return own
    # A copied object may play a copy of the baked action; copies have the mark BAKED_ACTION too.
    marked = [(t, s) for t, s in strips if s.action is not None and s.action.get(BAKED_ACTION)]
    return [(t, s) for t, s in marked if t.name == saved.text(state, "track")]


def busy(owner: Animated) -> str:
    """The reason why the animation of a datablock cannot be replaced now; "" if it can."""
    data = owner.animation_data
    if data is not None and data.use_tweak_mode:
        return f"{owner.name} is in the tweak mode of the NLA editor: leave it first."
    return ""
