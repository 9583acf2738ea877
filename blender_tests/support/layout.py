# SPDX-License-Identifier: GPL-3.0-or-later
"""Stands in for a UILayout: remembers what a panel says, because no window exists here."""


class Recorder:
    """Takes every call that a panel makes; `labels` and `operators` hold what was drawn."""

    def __init__(self, top=None):
        top = top or self
        object.__setattr__(self, "labels", [] if top is self else top.labels)
        object.__setattr__(self, "operators", [] if top is self else top.operators)
        object.__setattr__(self, "_top", top)

    def __setattr__(self, _name, _value):
        """Options of a layout or of an operator button."""

    def label(self, text="", **_options):
        self.labels.append(text)

    def operator(self, name, *_arguments, **_options):
        self.operators.append(name)
        return Recorder(self._top)

    def panel(self, *_arguments, **_options):
        return Recorder(self._top), Recorder(self._top)

    def __getattr__(self, name):
        if name == "operator_menu_enum":
            return self.operator
        return lambda *_a, **_o: Recorder(self._top)

    def text(self):
        """All words, as one line."""
        return " ".join(self.labels)
