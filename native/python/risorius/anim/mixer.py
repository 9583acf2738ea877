# SPDX-License-Identifier: MIT
"""Layers of clips and poses, reactions and exclusive controls: what a face's controls are when."""

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

# Curves of these are rotations in radians, and not limited to [0, 1].
_ROTATIONS = ("head.", "neck.", "eyeL.", "eyeR.")
_NO_POINTS = (np.zeros(0), np.zeros(0))


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer of a Mixer. Times in seconds, of the scene unless it says clip.

    Attributes:
        source: a Clip; a pose as {control: value}; or the name of an expression.
        name: for people.
        blend: "override" goes over to the layer's value by its weight (Blender: Replace),
            "additive" adds weight * value (Blender: Add), "max" goes over to the higher of the
            two.
        weight: in [0, 1]; or (times, values), straight lines between, held outside.
        mask: {region, control or pattern: weight}, see regions.mask; or float[controls] in [0, 1];
            None is all of it. Controls that the source has no curve of are never touched.
        start: when the clip (or its clip_range) begins, by default on its own clock; when a pose
            begins, by default always there.
        end: of a pose only; a clip ends by its length, scale and repeat.
        clip_range: (first, last) in clip time: the part that is played, by default all.
        scale: 2 plays half as fast.
        repeat: how often the part is played one after the other; need not be whole.
        reverse: plays it backwards.
        warp: (scene times, clip times), straight lines between: instead of start, end, clip_range,
            scale, repeat and reverse. The layer lasts from the first to the last scene time; clip
            times that fall play backwards.
        extend: before its start and after its end the layer may "hold", "hold_forward" (only after
            its end), be "nothing", or "repeat" for ever both ways.
        fade_in: seconds from nothing to full weight at its start, in a straight line.
        fade_out: the same at its end. Held after a fade out it is nothing, as in Blender.
        mute: leave it out.
        solo: where any layer has it, only those that have it play.
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
        """The source as a clip; a pose is one of a single frame.

        Raises:
            ValueError: an expression of that name is not known.
        """
        if isinstance(self.source, Clip):
            return self.source
        pose = self.source
        if isinstance(pose, str):
            pose = expressions.get(pose).weights
        return Clip(pose, [[value] for value in pose.values()] or np.zeros((0, 1)))


class Mixer:
    """Layers, reactions and rules of one face -> its controls at a time.

    A function of the time, the layers, and what was fired: any frame alone gives the same. Its
    arithmetic is written down in native/clip/mixer/mixer.h; layers equal Blender's NLA.

    Attributes:
        names: the controls, in the order of what evaluate gives.
        reactions: by name, what fire can fire.
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
        """A mixer for a list of controls.

        Args:
            names: e.g. Rig.raw_control_names; each once.
            layers: bottom to top.
            ranges: what values are clamped to, {name: (low, high)} or float[names, 2]; the others
                [0, 1], rotations of head and eyes ("head.yaw" ...) not at all.
            exclusives: rules of controls that exclude each other: None, "default", or the path of
                a TOML file such as risorius/anim/exclusives.toml, or what load_exclusives gave.
            reactions: what can be fired; by default load_reactions().
            max_fired: firings that are remembered; when there are more, the one that ended first
                is forgotten.

        Raises:
            ValueError: a sentence that names the layer or reaction and its field.
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
        """Bottom to top. Assigned as a whole; a refused assignment changes nothing."""
        return tuple(layer for layer, _ in self._layers)

    @layers.setter
    def layers(self, layers: Iterable[Layer]) -> None:
        self._set([(layer, self._curves(layer)) for layer in layers])

    def add(self, source: Layer | Clip | Mapping[str, float] | str, **settings: Any) -> int:
        """Put a layer on top, e.g. add(clip, blend="additive"); its place, from 0 at the bottom.

        Args:
            source: a layer, or the source of a new one.
            settings: fields of Layer.
        """
        layer = source if isinstance(source, Layer) else Layer(source)
        self.layers = (*self.layers, replace(layer, **settings))
        return len(self._layers) - 1

    def change(self, place: int, **settings: Any) -> None:
        """Change settings of a layer: cheap, unless it is its source or mask.

        Args:
            place: of the layer, from 0 at the bottom.
            settings: fields of Layer.
        """
        layers = list(self.layers)
        layers[place] = replace(layers[place], **settings)
        self.layers = tuple(layers)

    def remove(self, place: int) -> None:
        """Take a layer away."""
        layers = list(self.layers)
        del layers[place]
        self.layers = tuple(layers)

    def missing(self, place: int) -> list[str]:
        """The names of a layer's curves that this mixer has no control for."""
        known = set(self.names)
        return [name for name in self._layers[place][0].clip().names if name not in known]

    def fire(self, name: str, time: float, strength: float = 1.0) -> bool:
        """Start a reaction at a time, over whatever runs.

        Reactions join as 1 - (1 - a) * (1 - b): never beyond a control's limit, and firing one
        again while it runs makes no step.

        Args:
            name: one of reactions.
            time: seconds; may lie in the future.
            strength: in [0, 1].

        Returns:
            False, and nothing happens, when max_fired reactions have not ended by then.

        Raises:
            KeyError: no such reaction. ValueError: time or strength out of range.
        """
        if not (math.isfinite(time) and 0.0 <= strength <= 1.0):
            raise ArgumentError(
                f"fire {name}: a time and a strength from 0 to 1 were expected, "
                f"found {time} and {strength}"
            )
        return self._core.fire(self._reaction_index[name], time, strength)

    def fire_events(self, events: Iterable[Event], offset: float = 0.0) -> int:
        """Fire every event that bears a reaction's name; how many were fired.

        Args:
            events: of a clip; the value of one is the strength if it is a number.
            offset: seconds that are added to the times of the events.
        """
        count = 0
        for event in events:
            if event.name in self.reactions:
                count += self.fire(event.name, event.time + offset, _strength(event.value))
        return count

    def clear_fired(self) -> None:
        """Forget everything that was fired."""
        self._core.clear_fired()

    def evaluate(
        self, time: float, base: npt.ArrayLike | None = None, out: Floats | None = None
    ) -> Floats:
        """The controls at a time.

        Args:
            time: seconds, of the scene.
            base: float32[names] below the lowest layer, e.g. what an animator set; 0 without.
            out: a contiguous float32[names] to write into; may be base.

        Returns:
            float32[names].
        """
        return self._core.evaluate(time, base, out)

    def evaluate_batch(self, times: npt.ArrayLike, base: npt.ArrayLike | None = None) -> Floats:
        """The controls at many times; row n equals evaluate(times[n]).

        Args:
            times: seconds, [n].
            base: float32[names], or float32[n, names].

        Returns:
            float32[n, names], ready for Rig.evaluate_batch.
        """
        return self._core.evaluate_batch(times, base)

    def bake(self, start: float, end: float, rate: float = 60.0) -> Clip:
        """What the mixer gives from start to end, as a clip of all its controls.

        Args:
            start: seconds, of the first frame.
            end: seconds; the last frame is at it or less than a frame before it.
            rate: frames a second.
        """
        count = max(math.floor((end - start) * rate + 1e-6) + 1, 0)
        frames = self.evaluate_batch(start + np.arange(count) / rate)
        return Clip(self.names, frames.T, rate, start=start)

    def _curves(self, layer: Layer) -> LayerCurves:
        """What was made for the same source and mask, or new."""
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
    """A layer as the native mixer takes it."""
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
        raise ArgumentError(f"layers[{place}].end: a clip ends by its length, none was expected")
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
    """The number in [0, 1] that an event's value is, or 1."""
    try:
        value = float(text)
    except ValueError:
        return 1.0
    return min(max(value, 0.0), 1.0) if math.isfinite(value) else 1.0
