# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts the lines that a panel draws.

Tests thus check that no click in a panel moves the panels below it.
"""

from types import SimpleNamespace

import bpy

_LEAVES = ("label", "prop", "operator", "progress", "menu", "popover", "prop_search", "separator")
_LEAVES += ("operator_menu_enum", "template_list", "prop_enum")


class Lines:
    """A fake UILayout that counts the lines of a panel. A row counts as its highest part."""

    def __init__(self, beside=False):
        object.__setattr__(self, "_beside", beside)
        object.__setattr__(self, "_parts", [])

    def __setattr__(self, _name, _value):
        """Ignore options that a panel sets on a layout or on an operator's button."""

    @property
    def count(self):
        counts = [part if isinstance(part, int) else part.count for part in self._parts]
        return max(counts, default=0) if self._beside else sum(counts)

    def _part(self, part):
        self._parts.append(part)
        return part

    def panel(self, *_arguments, **_options):
        """Add a subpanel, which is always open. Returns its header and its body."""
        return self._part(Lines(beside=True)), self._part(Lines())

    def __getattr__(self, name):
        if name in _LEAVES:
            self._parts.append(1)
            return lambda *_a, **_o: SimpleNamespace()
        return lambda *_a, **_o: self._part(Lines(beside=name in ("row", "split", "grid_flow")))


def lines_of(panel):
    """The number of lines that a panel draws with all its subpanels open."""
    layout = Lines()
    panel.draw(SimpleNamespace(layout=layout), bpy.context)
    return layout.count
