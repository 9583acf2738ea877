# SPDX-License-Identifier: MIT
"""Computes a face's controls from layers of clips and poses, reactions, and exclusion rules."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import expressions
from .._native import LayerCurves, MixerCore
from ..base.errors import ArgumentError
from ..controls.regions import mask as region_mask
from .clip import Clip, Event
from .reactions import Exclusives, Reaction, load_exclusives, load_reactions

Floats = npt.NDArray[np.float32]
Points = tuple[npt.ArrayLike, npt.ArrayLike]

# Curves with these prefixes are rotations in radians and are not clamped to [0, 1].
_ROTATIONS = ("head.", "neck.", "eyeL.", "eyeR.")
_NO_POINTS = (np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer of a Mixer. Times are in seconds of the scene, except clip times.

    Attributes:
        source: a Clip; a pose as {control: value}; or the name of an expression.
        name: name for display.
        blend: "override" blends to the layer's value by its weight (Blender: Replace), "additive"
            adds weight * value (Blender: Add), "max" blends to the higher of both values.
        weight: a number in [0, 1]; or (times, weights), linear between these times and constant
            outside.
        mask: {region, control or pattern: weight}, where controls that no entry names have weight 0
            (regions.mask lists the kinds of entry); or float[controls] in [0, 1]; None for all
            controls. Controls without a curve in the source never change.
        start: scene time at which the clip (or its clip_range) or the pose starts. None: a clip
            starts at its own start time, and a pose is active at all times before its end.
        end: scene time at which a pose ends; the end of a clip follows from its length, scale and
            repeat.
        clip_range: first and last clip time to play; None for the whole clip.
        scale: factor of the duration; 2 plays at half speed.
        repeat: number of repeats; need not be an integer.
        reverse: True: plays backwards.
        warp: (scene times, clip times), linear between; it replaces start, end, clip_range, scale,
            repeat and reverse. The layer lasts from the first to the last scene time; descending
            clip times play backwards.
        extend: outside its time the layer may "hold" its first or last value, "hold_forward" (after
            its end only), have no effect ("nothing"), or "repeat" for ever in both directions.
        fade_in: seconds in which the weight grows linearly from 0 at the start.
        fade_out: seconds in which the weight falls linearly to 0 at the end. A layer that is held
            after a fade-out has weight 0, as in Blender.
        mute: True: the layer does not play.
        solo: if True for any layer, only layers with solo play.
    """

    source: Clip | Mapping[str, float] | str
    name: str = ""
    blend: str = "override"
    weight: float | Points = 1.0
    mask: Mapping[str, float] | npt.ArrayLike | None = None
    start: float | None = None
    end: float | None = None
    clip_range: tuple[float, float] | None = None
    scale: float = 1.0
    repeat: float = 1.0
    reverse: bool = False
    warp: Points | None = None
    extend: str = "hold"
    fade_in: float = 0.0
    fade_out: float = 0.0
    mute: bool = False
    solo: bool = False

    def clip(self) -> Clip:
        """The source as a clip; a pose becomes a clip of a single frame.

        Raises:
            ValueError: an unknown expression.
        """
        if isinstance(self.source, Clip):
            return self.source
        pose = self.source
        if isinstance(pose, str):
            pose = expressions.get(pose).weights
        return Clip(pose, [[value] for value in pose.values()] or np.zeros((0, 1)))


class Mixer:
    """Mixes layers, reactions and rules of one face to its controls at any time.

    The result depends only on the time, the layers, and the fired reactions, so that any frame can
    be evaluated alone. native/clip/mixer/mixer.h documents the arithmetic; layers behave like
    Blender's NLA.

    Attributes:
        names: names of the controls, in the order of the result.
        reactions: reactions by name, for fire.
    """

    def __init__(
        self,
        names: Sequence[str],
        layers: Iterable[Layer] = (),
        *,
        ranges: Mapping[str, tuple[float, float]] | npt.ArrayLike | None = None,
        exclusives: Exclusives | str | os.PathLike[str] | None = None,
        reactions: Mapping[str, Reaction] | None = None,
        max_fired: int = 256,
    ) -> None:
        """Make a mixer for a list of controls.

        Args:
            names: names of the controls, e.g. Rig.raw_control_names; each once.
            layers: layers, the lowest first.
            ranges: limits of the values, {name: (low, high)} or float[names, 2]. Default: [0, 1],
                and no limits for rotations of head, neck and eyes ("head.yaw" ...).
            exclusives: rules of controls that exclude each other: None, "default", the path of a
                TOML file such as risorius/anim/exclusives.toml, or the result of load_exclusives.
            reactions: available reactions; by default load_reactions().
            max_fired: number of firings that are remembered; a new one replaces the one that ended
                first.

        Raises:
            ValueError: an invalid layer or reaction; the message names the invalid field.
        """
        self.names = tuple(names)
        low, high = _limits(self.names, ranges)
        self._core = MixerCore(list(self.names), low, high, max_fired)
        self.reactions = dict(load_reactions() if reactions is None else reactions)
        self._reaction_index = {name: i for i, name in enumerate(self.reactions)}
        index = {name: i for i, name in enumerate(self.names)}
        self._core.set_reactions([r.parts_of(index) for r in self.reactions.values()])
        if exclusives is not None:
            if not isinstance(exclusives, Exclusives):
                exclusives = load_exclusives(None if exclusives == "default" else exclusives)
            self._core.set_rules(*exclusives.rules_of(index))
        self._layers: list[tuple[Layer, LayerCurves]] = []
        self.layers = tuple(layers)

    @property
    def layers(self) -> tuple[Layer, ...]:
        """The layers, bottom to top. Assign a whole tuple; a refused assignment changes nothing."""
        return tuple(layer for layer, _ in self._layers)

    @layers.setter
    def layers(self, layers: Iterable[Layer]) -> None:
        self._set([(layer, self._curves(layer)) for layer in layers])

    def add(self, source: Layer | Clip | Mapping[str, float] | str, **settings: Any) -> int:
        """Add a layer above all others, e.g. add(clip, blend="additive").

        Returns its index, from 0 at the bottom.

        Args:
            source: a layer, or the source of a new layer.
            settings: fields of Layer.

        Raises:
            ValueError: an invalid layer, which is not added.
        """
        layer = source if isinstance(source, Layer) else Layer(source)
        self.layers = (*self.layers, replace(layer, **settings))
        return len(self._layers) - 1

    def change(self, place: int, **settings: Any) -> None:
        """Change settings of a layer; fast unless source or mask change.

        Args:
            place: index of the layer, from 0 at the bottom.
            settings: fields of Layer.

        Raises:
            ValueError: an invalid setting; the layer keeps its settings.
        """
        layers = list(self.layers)
        layers[place] = replace(layers[place], **settings)
        self.layers = tuple(layers)

    def remove(self, place: int) -> None:
        """Remove the layer at index `place`, from 0 at the bottom."""
        layers = list(self.layers)
        del layers[place]
        self.layers = tuple(layers)

    def missing(self, place: int) -> list[str]:
        """Names of the curves of layer number `place` that match no control of this mixer."""
        known = set(self.names)
        return [name for name in self._layers[place][0].clip().names if name not in known]

    def fire(self, name: str, time: float, strength: float = 1.0) -> bool:
        """Start a reaction at a time, in addition to running ones.

        Reactions combine as 1 - (1 - a) * (1 - b): they never exceed a control's limit, and firing
        a running reaction again causes no jump.

        Args:
            name: name of one of the reactions.
            time: scene time in seconds; may be in the future.
            strength: factor of the reaction, 0 to 1.

        Returns:
            True if the reaction was started; False if it was not, because max_fired reactions
            that were started earlier have not ended by `time`.

        Raises:
            KeyError: unknown reaction. ValueError: time or strength out of range.
        """
        if not (math.isfinite(time) and 0.0 <= strength <= 1.0):
            raise ArgumentError(
                f"fire {name}: a time and a strength from 0 to 1 were expected, "
                f"found {time} and {strength}"
            )
        return self._core.fire(self._reaction_index[name], time, strength)

    def fire_events(self, events: Iterable[Event], offset: float = 0.0) -> int:
        """Start a reaction for each event that has the name of a reaction; return how many started.

        Args:
            events: events of a clip; an event's value is the strength if it is a number.
            offset: seconds added to the times of the events.
        """
        count = 0
        for event in events:
            if event.name in self.reactions:
                count += self.fire(event.name, event.time + offset, _strength(event.value))
        return count

    def clear_fired(self) -> None:
        """Remove all reactions that fire() started, also those in the future."""
        self._core.clear_fired()

    def evaluate(
        self, time: float, base: npt.ArrayLike | None = None, out: Floats | None = None
    ) -> Floats:
        """The controls at a scene time.

        Args:
            time: scene time in seconds.
            base: float32[names], values below the lowest layer, e.g. an animator's; default 0.
            out: a contiguous float32[names] for the result; may be base.

        Returns:
            float32[names].
        """
        return self._core.evaluate(time, base, out)

    def evaluate_batch(self, times: npt.ArrayLike, base: npt.ArrayLike | None = None) -> Floats:
        """The controls at many times; row n equals evaluate(times[n]).

        Args:
            times: float[n], scene times in seconds.
            base: float32[names] or float32[n, names], values below the lowest layer; default 0.

        Returns:
            float32[n, names], ready for Rig.evaluate_batch.
        """
        return self._core.evaluate_batch(times, base)

    def bake(self, start: float, end: float, rate: float = 60.0) -> Clip:
        """The result of the mixer from start to end, as a clip of all its controls.

        Args:
            start: time of the first frame in seconds.
            end: time in seconds; the last frame is at `end`, or less than one frame before `end`.
            rate: frames per second.
        """
        count = max(math.floor((end - start) * rate + 1e-6) + 1, 0)
        frames = self.evaluate_batch(start + np.arange(count) / rate)
        return Clip(self.names, frames.T, rate, start=start)

    def _curves(self, layer: Layer) -> LayerCurves:
        """A layer's curves and mask as an object of the native mixer. An existing layer with the
        same source and mask shares its object."""
        for old, curves in self._layers:
            if old.source is layer.source and old.mask is layer.mask:
                return curves
        clip = layer.clip()
        mask = layer.mask
        if isinstance(mask, Mapping):
            mask = region_mask(self.names, mask)
        return LayerCurves(
            list(self.names), list(clip.names), clip.curves, clip.rate, clip.start, clip.times, mask
        )

    def _set(self, layers: list[tuple[Layer, LayerCurves]]) -> None:
        self._core.set_layers([_settings(i, *layer) for i, layer in enumerate(layers)])
        self._layers = layers


def _limits(
    names: Sequence[str], ranges: Mapping[str, tuple[float, float]] | npt.ArrayLike | None
) -> tuple[Floats, Floats]:
    limits = np.tile(np.array([0.0, 1.0], np.float32), (len(names), 1))
    for i, name in enumerate(names):
        if name.startswith(_ROTATIONS):
            limits[i] = (-np.inf, np.inf)
    if isinstance(ranges, Mapping):
        index = {name: i for i, name in enumerate(names)}
        for name, limit in ranges.items():
            limits[index[name]] = limit
    elif ranges is not None:
        limits = np.asarray(ranges, np.float32)
        if limits.shape != (len(names), 2):
            raise ArgumentError(
                f"ranges: the shape [{len(names)}, 2] was expected, found {list(limits.shape)}"
            )
    return np.ascontiguousarray(limits[:, 0]), np.ascontiguousarray(limits[:, 1])


def _points(points: Points) -> Points:
    return tuple(np.atleast_1d(np.asarray(p, np.float64)) for p in points)  # type: ignore[return-value]


def _settings(place: int, layer: Layer, curves: LayerCurves) -> dict[str, Any]:
    """The settings of a layer as the native mixer expects them."""
    still = curves.frame_count < 2
    first, last = layer.clip_range or curves.range
    start, end = layer.start, layer.end
    if layer.warp is not None:
        plain = (None, None, None, 1.0, 1.0, False)
        if (start, end, layer.clip_range, layer.scale, layer.repeat, layer.reverse) != plain:
            raise ArgumentError(
                f"layers[{place}].warp: a warp alone, without start, end, clip_range, scale, "
                "repeat and reverse, was expected"
            )
    elif not still and end is not None:
        raise ArgumentError(
            f"layers[{place}].end: a clip ends by its length, so that no end was expected"
        )
    if start is None:
        start = -math.inf if still else first
    weight = layer.weight
    if not isinstance(weight, tuple):
        weight = ([0.0], [weight])
    return {
        "curves": curves,
        "blend": layer.blend,
        "extend": layer.extend,
        "weight": _points(weight),
        "warp": _NO_POINTS if layer.warp is None else _points(layer.warp),
        "start": start,
        "end": math.inf if end is None else end,
        "clip_range": (first, last),
        "scale": layer.scale,
        "repeat": layer.repeat,
        "reverse": layer.reverse,
        "fade_in": layer.fade_in,
        "fade_out": layer.fade_out,
        "mute": layer.mute,
        "solo": layer.solo,
    }


def _strength(text: str) -> float:
    """The strength in an event's value: a number, clamped to [0, 1]; 1 if it is no number."""
    try:
        value = float(text)
    except ValueError:
        return 1.0
    return min(max(value, 0.0), 1.0) if math.isfinite(value) else 1.0
