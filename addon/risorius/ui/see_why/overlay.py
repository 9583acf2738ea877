# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws over the 3D view: state of solo and mute, colours of a heat map, correctives."""

from __future__ import annotations

from typing import cast

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from ...logic.base import heat_ramp
from ...scene.base import parts, session
from ...scene.base.blender_types import ArmatureObject
from ...scene.frame import look_masks
from ...scene.see_why import causes, heat, present
from .. import words
from ..blender_types import Context
from .properties import choices
from .spoken import spoken, title

Colour = tuple[float, float, float, float]
_handles: list[object] = session.keep("overlay.handles", list, ("unregister",))
_WHITE: Colour = (1.0, 1.0, 1.0, 1.0)
_DIM: Colour = (0.72, 0.72, 0.72, 1.0)
_BOX: Colour = (0.09, 0.09, 0.10, 0.86)
_ON: Colour = (0.33, 0.62, 0.86, 1.0)
_LINE: Colour = (0.75, 0.75, 0.75, 0.55)
_ALERT: Colour = (0.72, 0.28, 0.06, 0.95)
_STEPS = 48  # number of colours in the drawn ramp
_MOST = 9  # largest number of drawn correctives


def start() -> None:
    """Add the draw handler."""
    if not _handles:
        view = bpy.types.SpaceView3D
        _handles.append(view.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL"))


def stop() -> None:
    """Remove the draw handler."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


class _Pen:
    """Draws boxes, lines and text over a region; the size of text follows the interface scale.

    All places are in pixels from the lower left corner of the region.
    """

    def __init__(self, context: Context) -> None:
        self.scale: float = context.preferences.system.ui_scale
        self.size = round(12 * self.scale)
        self.flat = gpu.shader.from_builtin("UNIFORM_COLOR")

    def box(self, x: float, y: float, width: float, height: float, colour: Colour) -> None:
        corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
        batch = batch_for_shader(self.flat, "TRI_FAN", {"pos": corners})
        self.flat.bind()
        self.flat.uniform_float("color", colour)
        batch.draw(self.flat)

    def line(self, one: tuple[float, float], other: tuple[float, float], colour: Colour) -> None:
        batch = batch_for_shader(self.flat, "LINES", {"pos": [one, other]})
        self.flat.bind()
        self.flat.uniform_float("color", colour)
        batch.draw(self.flat)

    def text(self, text: str, x: float, y: float, colour: Colour = _WHITE) -> float:
        """Draw a line of text. Returns the width of the text in pixels."""
        blf.size(0, self.size)
        blf.color(0, *colour)
        blf.position(0, x, y, 0)
        blf.draw(0, text)
        return self.width(text)

    def width(self, text: str) -> float:
        blf.size(0, self.size)
        return float(blf.dimensions(0, text)[0])

    def cut(self, text: str, most: float) -> str:
        """The text; if it is wider than `most` pixels, it is cut and ends with three dots."""
        if self.width(text) <= most:
            return text
        while text and self.width(text + "...") > most:
            text = text[:-1]
        return text + "..."


def _draw() -> None:
    context = cast(Context, bpy.context)
    rig, region = parts.active_rig(context), context.region
    if rig is None or region is None:
        return
    look, shown = look_masks.of(rig), heat.of(rig)
    graph = choices(context).show_graph
    if look.is_whole and shown is None and not graph:
        return
    pen = _Pen(context)
    gpu.state.blend_set("ALPHA")
    # The text starts above the redo panel, which is in the lower left corner.
    x, y = 20.0 * pen.scale + _tools(context), 72.0 * pen.scale
    if shown is not None:
        y = _draw_ramp(pen, words.say(title(context, rig, shown)), shown, x, y)
    if not look.is_whole:
        y = _draw_look(pen, look_in_words(context, look), x, y)
    if graph:
        _draw_graph(pen, context, rig, x, y)
    gpu.state.blend_set("NONE")


def _tools(context: Context) -> int:
    regions = context.area.regions if context.area else ()
    return next((r.width for r in regions if r.type == "TOOLS"), 0)


def _draw_ramp(pen: _Pen, text: str, shown: heat.Heat, x: float, y: float) -> float:
    """Draw the colour scale of a heat map, from 0 to the largest motion in mm, and its title.

    Returns the height above the scale at which the next text can be drawn, in pixels.
    """
    width, height, unit = 220.0 * pen.scale, 14.0 * pen.scale, pen.scale
    full = max(width, pen.width(text)) + 20 * unit
    pen.box(x - 10 * unit, y - 8 * unit, full, height + 48 * unit, _BOX)
    shades = heat_ramp.colours(np.linspace(0.0, 1.0, _STEPS))
    step = width / _STEPS
    for number, shade in enumerate(shades.tolist()):
        pen.box(x + number * step, y + 16 * unit, step + 1, height, tuple(shade))
    pen.text("0", x, y)
    end = f"{shown.most:.2f} mm"
    pen.text(end, x + width - pen.width(end), y)
    pen.text(text, x, y + height + 22 * unit)
    return y + height + 52 * unit


def look_in_words(context: Context, look: look_masks.Look) -> str:
    """The soloed controls and muted parts of a face as a text; "" if there are none.

    Args:
        context: context with the preferences.
        look: solo and mute state of the face.
    """
    if look.solo:
        names = ", ".join(sorted(spoken(context, label) for label in look.solo))
        text = words.say("Solo: {names}", names=names)
    else:
        text = ""
    kinds = {
        "JOINTS": words.say("Joints"),
        "SHAPES": words.say("Shapes"),
        "MAPS": words.say("Maps"),
    }
    if look.muted:
        muted = ", ".join(kinds[kind] for kind in look_masks.KINDS if kind in look.muted)
        text += ("; " if text else "") + words.say("Muted: {kinds}", kinds=muted)
    return text


def _draw_look(pen: _Pen, sentence: str, x: float, y: float) -> float:
    text, unit = pen.cut(sentence, 420 * pen.scale), pen.scale
    pen.box(x - 10 * unit, y - 8 * unit, pen.width(text) + 20 * unit, 26 * unit, _ALERT)
    pen.text(text, x, y)
    return y + 34 * unit


def _draw_graph(pen: _Pen, context: Context, rig: ArmatureObject, x: float, y: float) -> None:
    """Draw the chosen control on the left, and the correctives that depend on it on the right.

    At most the first nine correctives are drawn; below them is the number of the others.
    """
    label, now = choices(context).control, present.of(rig)
    control = causes.control_of(rig, label)
    if control < 0 or now is None:
        pen.text(words.say("Choose a control in the panel See Why."), x, y, _DIM)
        return
    found = causes.parts_of(rig, control)
    rows, unit = found[:_MOST], pen.scale
    high, gap, wide = 38 * unit, 6 * unit, 190 * unit
    total = max(len(rows), 1) * (high + gap)
    left = (x, y + total / 2 - high / 2)
    _draw_node(pen, *left, wide, high, spoken(context, label), "", float(now.raw[control]))
    for number, part in enumerate(rows):
        at = (x + wide + 60 * unit, y + total - (number + 1) * (high + gap))
        colour = _ON if part.value else _LINE
        pen.line((left[0] + wide, left[1] + high / 2), (at[0], at[1] + high / 2), colour)
        others = ", ".join(f"{spoken(context, name)} {value:.2f}" for name, value in part.others)
        _draw_node(pen, *at, wide * 1.4, high, spoken(context, part.name), others, part.value)
    more = len(found) - len(rows)
    if more > 0 or not found:
        text = words.say("and {count} more", count=more) if found else words.say("No correctives.")
        pen.text(text, x + wide + 60 * unit, y - 14 * unit, _DIM)


def _draw_node(
    pen: _Pen, x: float, y: float, width: float, height: float, name: str, more: str, value: float
) -> None:
    unit = pen.scale
    pen.box(x, y, width, height, _BOX)
    pen.box(x, y, width * min(max(value, 0.0), 1.0), 4 * unit, _ON)
    number = f"{value:.2f}"
    room = width - pen.width(number) - 24 * unit
    up = y + height - 15 * unit
    pen.text(pen.cut(name, room), x + 8 * unit, up, _WHITE if value else _DIM)
    pen.text(number, x + width - pen.width(number) - 8 * unit, up, _WHITE if value else _DIM)
    if more:
        pen.text(pen.cut(more, width - 16 * unit), x + 8 * unit, y + 9 * unit, _DIM)
