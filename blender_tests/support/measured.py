# SPDX-License-Identifier: GPL-3.0-or-later
"""A fake UILayout that finds texts which Blender would cut off.

The fake layout calculates the widths of Blender's layouts at an interface scale of 1 with
Blender's font. Each part of a column has the column's width. A row divides its width in proportion
to the widths that its parts request, and a split divides its width by its factor. With
use_property_split, the names of properties get the left two fifths of the width.
"""

from types import SimpleNamespace

import blf
import bpy

SIDEBAR = 280 - 20 - 16  # pixels: a sidebar without its tabs and the margins of a panel
FILE_BROWSER = 240 - 16
DIALOG = 300 - 24
_MARGIN = 10  # pixels around the text of a label; a button has more
_BUTTON = 14
_ICON = 20
_ASKED = 30  # pixels that a button requests from a row in addition to its text
_NUMBER = 60  # pixels that a number field requests in addition to its text
_NAMES = 0.4
_VALUE = "0.000"
# Heights in pixels of a panel's header, a subpanel's header, a line, and the space above and below
# a panel's content. They were measured in Blender 4.3, where they are larger than in 5.2.
HEADER, SUB_HEADER, _LINE, EDGES = 28, 25, 21, 10
# English text -> translation. Tests fill this table, because the bpy module has no translations of
# Blender.
LOCAL = {}


def width_of(text):
    """The width of a text in Blender's interface font, in pixels at an interface scale of 1."""
    points = bpy.context.preferences.ui_styles[0].widget.points
    blf.size(0, points)
    return blf.dimensions(0, text)[0]


def local(text):
    """The translation of a label from LOCAL, or the label itself if LOCAL has none."""
    return LOCAL.get(text, text)


class Part:
    """A row, a column, a grid or a split.

    Its children are Parts, and leaves (text, pixels that show the text fully, pixels that the leaf
    requests from a row).
    """

    everything_open = True  # False: nested panels have their default state

    def __init__(self, kind="column", factor=0.0, split=False):
        self.is_header = False
        self.kind, self.factor, self.children = kind, factor, []
        self.use_property_split = split
        self.use_property_decorate = self.active = self.enabled = True
        self.alignment, self.emboss, self.scale_x, self.scale_y = "EXPAND", "NORMAL", 1.0, 1.0
        self.operator_context = "EXEC_DEFAULT"

    def _inner(self, kind, factor=0.0):
        part = Part(kind, factor, self.use_property_split)
        self.children.append(part)
        return part

    def row(self, align=False, heading=""):
        part = self._inner("row")
        if heading:
            self._named(heading)
        return part

    def column(self, align=False, heading=""):
        if heading:
            self._named(heading)
        return self._inner("column")

    def box(self):
        return self._inner("column")

    def grid_flow(self, columns=1, **_options):
        return self._inner("grid", columns)

    def split(self, factor=0.5, align=False):
        return self._inner("split", factor)

    def panel(self, _name, default_closed=False):
        header = self._inner("row")
        header.is_header = True
        if default_closed and not Part.everything_open:
            return header, None
        return header, self._inner("column")

    def separator(self):
        pass

    def template_list(self, *_arguments, **_options):
        self._leaf("", 100)

    def _leaf(self, text, pixels, asked=None):
        asked = (pixels if asked is None else asked) * self.scale_x
        self.children.append((text, pixels, asked))

    def _named(self, text):
        """Add a line with a name at its left and room for a value at its right."""
        part = self._inner("split", _NAMES)
        part._leaf(text, width_of(text) + _MARGIN)
        part._leaf("", 0)

    def label(self, text="", icon="NONE", translate=True, **_options):
        text = local(text) if translate else text
        pixels = width_of(text) + _MARGIN + (_ICON if icon != "NONE" else 0)
        self._leaf(text, pixels, pixels - _MARGIN / 2)

    def operator(self, name, text=None, icon="NONE", translate=True, **_options):
        rna = getattr(bpy.ops.risorius, name.partition(".")[2]).get_rna_type()
        text = rna.name if text is None else text
        self._button(local(text) if translate else text, icon)
        return SimpleNamespace()

    def menu(self, name, text=None, icon="NONE", **_options):
        self._button(local(getattr(bpy.types, name).bl_label if text is None else text), icon)

    def popover(self, panel, text=None, icon="NONE", **_options):
        self._button(local(getattr(bpy.types, panel).bl_label if text is None else text), icon)

    def progress(self, text="", translate=True, **_options):
        self._leaf(text, width_of(text) + _MARGIN)

    def _button(self, text, icon):
        there = width_of(text) + (_ICON if icon != "NONE" else 0)
        if text:
            self._leaf(text, there + _BUTTON, there + _ASKED)
        else:
            self._leaf("", _ICON)

    def prop_enum(self, data, name, value):
        items = _property(data, name).enum_items
        self._button(local(items[value].name), "NONE")

    def prop_search(self, data, name, _where, _names, **_options):
        self._value(local(_property(data, name).name), 100)

    def prop(self, data, name, text=None, icon="NONE", toggle=False, index=-1, **_options):
        rule = None if name.startswith("[") else _property(data, name)
        shown = local((rule.name if rule is not None else name) if text is None else text)
        kind = "FLOAT" if rule is None else rule.type
        if kind == "BOOLEAN":
            self._checkbox(shown, icon, toggle)
        elif kind == "ENUM":
            names = [local(item.name) for item in rule.enum_items]
            self._value(shown, max(map(width_of, names), default=60) + _BUTTON + _ICON)
        else:
            number = kind in ("INT", "FLOAT")
            self._value(shown, width_of(_VALUE) + _BUTTON if number else 60, number)

    def _checkbox(self, text, icon, toggle):
        if toggle or icon != "NONE":
            self._button(text, icon)
        elif self.use_property_split:
            part = self._inner("split", _NAMES)
            part._leaf("", 0)
            part._leaf(text, width_of(text) + _ICON)
        else:
            self._leaf(text, width_of(text) + _ICON + _MARGIN)

    def _value(self, text, pixels, within=False):
        if not text:
            self._leaf("", pixels, pixels + _NUMBER)
        elif self.use_property_split and self.kind != "row":
            self._named(text)
            self.children[-1].children[-1] = (text, pixels, pixels)
        elif within:  # the field of a number contains its name
            self._leaf(text, width_of(text) + pixels, width_of(text) + pixels + _NUMBER)
        else:
            part = self._inner("split", _NAMES)
            part._leaf(text, width_of(text) + _MARGIN)
            part._leaf(text, pixels)

    def asks(self):
        """Width in pixels that this part requests from a row."""
        asked = [c.asks() if isinstance(c, Part) else c[2] for c in self.children]
        return sum(asked) if self.kind == "row" else max(asked, default=0)

    def height(self):
        """The height of this part in pixels, if its texts are not wrapped."""
        if self.is_header:
            return SUB_HEADER
        tall = [c.height() if isinstance(c, Part) else _LINE for c in self.children]
        return max(tall, default=0) if self.kind in ("row", "split") else sum(tall)

    def cut(self, width):
        """The texts that are cut off if this part has a width of `width` pixels.

        Returns (text, needed pixels, available pixels) for each.
        """
        found = []
        for child, room in zip(self.children, self._rooms(width), strict=True):
            if isinstance(child, Part):
                found += child.cut(room)
            elif child[1] > room + 0.5:
                found.append((child[0], round(child[1]), round(room)))
        return found

    def _rooms(self, width):
        count = len(self.children)
        if self.kind == "row":
            asked = [c.asks() if isinstance(c, Part) else c[2] for c in self.children]
            scale = width / max(sum(asked), 1)
            return [n * scale for n in asked]
        if self.kind == "grid":
            return [width / self.factor] * count
        if self.kind == "split" and count > 1:
            return [width * self.factor, *[width * (1 - self.factor) / (count - 1)] * (count - 1)]
        return [width] * count


def _property(data, name):
    if isinstance(data, Operator):
        return data._rna.properties[name]
    return data.bl_rna.properties[name]


class Operator:
    """Stands for an instance of an operator class, so that its draw() can be called.

    Args:
        kind: the operator class.
        given: values of properties; all other properties have their default values.
    """

    def __init__(self, kind, **given):
        self._kind = kind
        self._rna = getattr(bpy.ops.risorius, kind.bl_idname.partition(".")[2]).get_rna_type()
        self._given = given
        self.layout = Part()

    def __getattr__(self, name):
        if name in self._given:
            return self._given[name]
        rule = self._rna.properties.get(name)
        if rule is None:
            return getattr(self._kind, name).__get__(self)
        if rule.type == "ENUM" and rule.is_enum_flag:
            return rule.default_flag
        return rule.default_array if getattr(rule, "is_array", False) else rule.default

    def draw(self, context):
        """Call draw() of the operator class. Returns the Part that it has drawn into."""
        self._kind.draw(self, context)
        return self.layout


def drawn(kind, context, **given):
    """Let a panel or list draw into a new Part, and return the Part.

    Args:
        kind: class of the panel or list.
        context: context of Blender.
        given: further attributes of the object that stands for an instance of the class.
    """
    layout = Part()
    kind.draw(SimpleNamespace(layout=layout, **given), context)
    return layout
