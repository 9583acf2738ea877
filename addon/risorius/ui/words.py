# SPDX-License-Identifier: GPL-3.0-or-later
"""Words in panels and dialogs: whether they fit, and what a number or an empty field stands for."""

import textwrap

import blf

_SIDEBAR = 280  # pixels that Blender gives the sidebar at first
_EDGES = 36  # of them the tabs and the panel's margins
_MARGIN = 12  # around the text of a label


def width_of(text, style):
    """Pixels that a text takes in buttons and labels, at an interface scale of 1.

    Args:
        text: the words.
        style: a bpy.types.ThemeStyle, of the preferences.
    """
    blf.size(0, style.widget.points)
    return blf.dimensions(0, text)[0]


def fits(context, text, share):
    """Whether a label can be read whole in a share of the sidebar's width.

    Args:
        context: has the region; without one the width is that of a new sidebar.
        text: the label.
        share: 0 to 1.
    """
    preferences = context.preferences
    region = context.region
    is_sidebar = region is not None and region.type == "UI" and region.width > 1
    scale = preferences.system.ui_scale or 1.0  # 0 without a window
    width = region.width / scale if is_sidebar else _SIDEBAR
    return width_of(text, preferences.ui_styles[0]) + _MARGIN <= (width - _EDGES) * share


def prop_or(layout, owner, name, empty, meaning):
    """A property, and below it in words what is done where it is left as it is.

    Args:
        layout: of the panel or dialog.
        owner, name: the property.
        empty: its value that stands for something else, as -1, 0 or "".
        meaning: the words.
    """
    layout.prop(owner, name)
    if getattr(owner, name) == empty:
        row = layout.row()
        row.alignment, row.active = "RIGHT", False
        row.label(text=meaning)


def write(layout, text, icon="NONE"):
    """A sentence in as many lines as a narrow sidebar needs."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, 38)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1")
