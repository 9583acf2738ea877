# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Controls: one slider per control, grouped by region."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import bpy

from ... import native
from ...language import tables
from ...logic.base.control_words import PREFIX
from ...logic.character import first_sliders, slider_rows, slider_words
from ...scene.base import parts, session
from ...scene.character import board, runtime, sides
from .. import words
from ..blender_types import Context, Icon, Panel, UILayout
from ..board.panel import draw_lead
from ..common import FaceOnlyPanel, as_seen, face_controls, face_rig
from ..hand.favourites import favourites_of

_ICONS: dict[str, Icon] = {
    "brow": "MOD_CURVE",
    "eye": "HIDE_OFF",
    "nose": "MONKEY",
    "cheek": "MATSPHERE",
    "mouth": "USER",
    "jaw": "MOD_SIMPLEDEFORM",
    "tongue": "MOD_SMOOTH",
    "teeth": "SNAP_FACE",
    "neck": "ARMATURE_DATA",
    "ear": "SPEAKER",
    "other": "DOT",
}
_TITLE = 0.5  # share of the width for the names of sliders


class RISORIUS_PT_controls(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_controls"
    bl_label = "Controls"
    bl_order = 1

    def draw(self, context: Context) -> None:
        layout = self.layout
        rig, controls = face_rig(context), face_controls(context)
        live, face = runtime.of(rig), controls.pose.bones[parts.FACE]
        if live is None:
            return
        manager = context.window_manager
        search, only_used = manager.risorius_search, manager.risorius_only_used
        followers = sides.followers(controls)
        led = draw_lead(layout, controls, live)
        given = board.given(rig) if led else {}
        _draw_tools(layout, context, bool(followers))
        shown = [name for name in live.labels if name in face and _is_found(name, search)]
        if only_used:
            used = sides.in_use(rig)
            shown = [name for name in shown if name in used]
        for region, names in _regions(tuple(shown)):
            if search or only_used:
                _draw_region_header(layout.row(), region)
                draw_sliders(context, layout, face, region, names, followers, given)
                continue
            header, body = layout.panel(f"RISORIUS_PT_region_{region}", default_closed=True)
            _draw_region_header(header, region)
            if body is not None:
                part = _Part(context, face, region, names, followers, given)
                _draw_parted(body, part, dict(zip(live.labels, live.rests, strict=True)))
        if not shown:
            nothing = "No control matches the search." if search else "All controls are at rest."
            words.write(layout, nothing, "INFO")


# The panel is redrawn at every frame of a playback, so the groups of sliders are cached.
@session.cached(("unregister",), 8)
def _regions(shown: tuple[str, ...]) -> list[tuple[str, tuple[str, ...]]]:
    groups = slider_words.group_controls(shown, native.regions())
    return [(region, tuple(shown[i] for i in places)) for region, places in groups.items()]


@session.cached(("unregister",), 64)
def _rows(names: tuple[str, ...], region: str, seen: bool) -> first_sliders.Parted:
    rows = slider_rows.rows_of(names, region, native.regions(), seen)
    return first_sliders.part(rows, region)


def _is_found(name: str, search: str) -> bool:
    known = tables.search_words().get(name.removeprefix(PREFIX), "") if search else ""
    return slider_words.matches(name, search, known)


def _draw_tools(layout: UILayout, context: Context, linked: bool) -> None:
    manager, seen = context.window_manager, as_seen(context)
    column = layout.column(align=True)
    row = column.row(align=True)
    words.search(row, manager, "risorius_search")
    row.prop(manager, "risorius_only_used", text="", icon="FILTER")
    row.prop(manager, "risorius_stars", text="", icon="SOLO_OFF")
    row = column.row(align=True)
    row.operator("risorius.mirror", text="Mirror", icon="MOD_MIRROR").region = ""
    button = row.operator("risorius.link_sides", text="Link", icon="LINKED", depress=linked)
    button.enable, button.from_left = not linked, not seen
    row = column.row(align=True)
    for from_left, text in ((True, "L > R"), (False, "R > L")):
        button = row.operator("risorius.copy_side", text=text)
        button.region, button.from_left = "", from_left != seen
    row.operator("risorius.copy_pose", text="", icon="COPYDOWN").region = ""
    row.operator("risorius.paste_pose", text="", icon="PASTEDOWN").flipped = False
    row.operator("risorius.paste_pose", text="", icon="PASTEFLIPDOWN").flipped = True


def _draw_region_header(layout: UILayout, region: str) -> None:
    title = words.say(native.regions().titles[region])
    words.show(layout, title, _ICONS[region])
    row = layout.row(align=True)
    row.emboss = "NONE"
    row.operator("risorius.copy_pose", text="", icon="COPYDOWN").region = region
    row.operator("risorius.mirror", text="", icon="MOD_MIRROR").region = region
    row.operator("risorius.reset", text="", icon="LOOP_BACK").region = region
    row.operator("risorius.key", text="", icon="KEY_HLT").region = region


class _Part(NamedTuple):
    """The sliders of a region, with the data for drawing them.

    Attributes:
        context: context of the panel.
        face: the bone whose custom properties are the sliders.
        region: region of the sliders.
        names: names of the sliders.
        followers: of two linked sides, the slider that follows -> the slider that leads.
        given: slider that a handle of the face board moves -> its value.
    """

    context: Context
    face: bpy.types.PoseBone
    region: str
    names: Sequence[str]
    followers: Mapping[str, str]
    given: Mapping[str, float]

    def lines(self) -> first_sliders.Parted:
        return _rows(tuple(self.names), self.region, as_seen(self.context))


def draw_sliders(
    context: Context,
    layout: UILayout,
    face: bpy.types.PoseBone,
    region: str,
    names: Sequence[str],
    followers: Mapping[str, str],
    given: Mapping[str, float],
) -> None:
    """Draw one line for each control; left and right share a line.

    A name that is too long for its line is drawn above the line. Of two linked sides only the
    leading slider is drawn. A slider that the face board moves is drawn as a read-only bar, because
    changing the slider has no effect.

    Args:
        context: context of the panel.
        layout: layout of the panel.
        face: the bone whose custom properties are the sliders.
        region: region of the sliders.
        names: names of the sliders.
        followers: of two linked sides, the slider that follows -> the slider that leads.
        given: slider that a handle of the face board moves -> its value.
    """
    part = _Part(context, face, region, names, followers, given)
    first, more = part.lines()
    _draw_lines(layout, part, [*first, *more])


def _draw_parted(layout: UILayout, part: _Part, rests: Mapping[str, float]) -> None:
    """Draw the most used sliders of a region, and the heading More with the other sliders.

    The heading shows how many of the sliders below it are not at rest.
    """
    first, more = part.lines()
    _draw_lines(layout, part, first)
    if not more:
        return
    header, body = layout.panel(f"RISORIUS_PT_more_{part.region}", default_closed=True)
    names = [name for line in more for name in line.sliders]
    moved = sum(part.face.get(name, rests[name]) != rests[name] for name in names)
    text = words.say("More: {count} moved", count=moved) if moved else words.say("More")
    words.show(header, text)
    if body is not None:
        _draw_lines(body, part, more)


def _draw_lines(layout: UILayout, part: _Part, lines: Sequence[slider_rows.Row]) -> None:
    column = layout.column(align=True)
    context, followers = part.context, part.followers
    ruler = words.Ruler(context, _TITLE)
    starred = favourites_of(context) if context.window_manager.risorius_stars else None
    if any(line.is_pair for line in lines):
        _draw_sides(column, bool(followers))
    for line in lines:
        if ruler.fits(line.title):
            row = column.split(factor=_TITLE, align=True)
            words.show(row, line.title)
        else:
            words.show(column, line.title)
            row = column
        row = row.row(align=True)
        for name in line.sliders:
            if name in part.given:
                words.bar(row, part.given[name])
            elif followers.get(name) not in part.names:
                quoted = bpy.utils.escape_identifier(name)
                row.prop(part.face, f'["{quoted}"]', text="", slider=True)
        if starred is not None:
            icon = "SOLO_ON" if set(line.sliders) <= set(starred) else "SOLO_OFF"
            button = row.operator("risorius.favourite", text="", icon=icon)
            button.controls = "\n".join(line.sliders)


def _draw_sides(column: UILayout, linked: bool) -> None:
    """Draw headings of the columns Left and Right, or one heading Both Sides.

    The headings replace letters L and R in each slider, which has no room for a letter.

    Args:
        column: layout of the sliders.
        linked: True: the sides of the face are linked, so one slider moves both.
    """
    row = column.split(factor=_TITLE, align=True)
    row.label(text="")
    row = row.row(align=True)
    row.active = False
    both, left, right = words.say("Both Sides"), words.say("Left"), words.say("Right")
    for text in (both,) if linked else (left, right):
        part = row.row()
        part.alignment = "CENTER"
        words.show(part, text)


CLASSES = (RISORIUS_PT_controls,)
