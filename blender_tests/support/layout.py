# SPDX-License-Identifier: GPL-3.0-or-later
"""A fake UILayout that records the drawing of a panel, because tests have no window."""

from operator import attrgetter
from types import SimpleNamespace

import bpy

ICONS = set(bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys())


class Recorder:
    """A fake UILayout that accepts every call of a panel.

    An unknown property, operator or icon raises an error, as in Blender.

    Attributes:
        labels: the drawn texts, also of buttons.
        operators: names of the operators that have buttons.
        properties: paths of the properties that the panel shows.
    """

    def __init__(self, top=None):
        top = top or self
        object.__setattr__(self, "labels", [] if top is self else top.labels)
        object.__setattr__(self, "operators", [] if top is self else top.operators)
        object.__setattr__(self, "properties", [] if top is self else top.properties)
        object.__setattr__(self, "_top", top)

    def __setattr__(self, _name, _value):
        """Ignore options that a panel sets on a layout or on an operator's button."""

    def label(self, text="", icon="NONE", **_options):
        assert icon in ICONS, icon
        self.labels.append(text)

    def progress(self, text="", factor=0.0, **_options):
        assert 0.0 <= factor <= 1.0
        self.labels.append(text)

    def prop(self, owner, path, icon="NONE", **_options):
        assert icon in ICONS, icon
        owner.path_resolve(path)
        self.properties.append(path)

    def operator(self, name, text="", icon="NONE", **_options):
        assert icon in ICONS, icon
        attrgetter(name)(bpy.ops).get_rna_type()
        self.operators.append(name)
        if text:
            self.labels.append(text)
        return Recorder(self._top)

    def operator_menu_enum(self, name, _property, **options):
        return self.operator(name, **options)

    def panel(self, *_arguments, **_options):
        return Recorder(self._top), Recorder(self._top)

    def __getattr__(self, name):
        return lambda *_a, **_o: Recorder(self._top)

    def text(self, between=" "):
        """All drawn texts in the order of drawing, joined by `between`."""
        return between.join(self.labels)


def drawn(panel):
    """Let a panel draw into a new Recorder, and return the Recorder."""
    layout = Recorder()
    panel.draw(SimpleNamespace(layout=layout), bpy.context)
    return layout
