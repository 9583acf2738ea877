# SPDX-License-Identifier: GPL-3.0-or-later
"""Translation of texts, and labels of panels and dialogs: wrapping and special values."""

import textwrap
from typing import Any

import blf
import bpy

from .. import native
from ..language import errors, tables
from ..language.tables import CONTEXT
from ..logic.base.sentences import Sentence
from ..scene.base import session
from .blender_types import Context, Icon, UILayout

_REASONS = ("error", "reason", "said", "trouble", "why")  # values that are error messages
NAMES = "Names"  # translation context of names, which are not translated
_SIDEBAR = 280  # default width of Blender's sidebar in pixels
_EDGES = 36  # pixels of the sidebar for tabs and the panel's margins
_MARGIN = 12  # pixels around the text of a label
# "locale" -> the locale of Blender at the last call of follow_language; "given" -> the language
# whose translation table is registered with Blender, or "".
_language = session.keep("words.language", lambda: {"locale": "", "given": ""}, ("unregister",))


class Ruler:
    """Computes which labels fit completely into a share of the sidebar's width."""

    def __init__(self, context: Context, share: float) -> None:
        """Measure the sidebar; without a sidebar, use the width of a newly opened sidebar.

        Args:
            context: context with the sidebar's region.
            share: part of the width for the label, 0 to 1.
        """
        preferences, region = context.preferences, context.region
        width: float = _SIDEBAR
        if region is not None and region.type == "UI" and region.width > 1:
            width = region.width / (preferences.system.ui_scale or 1.0)  # scale 0: no window
        self._room = (width - _EDGES) * share - _MARGIN
        self._points = preferences.ui_styles[0].widget.points
        self._font = preferences.view.font_path_ui

    def fits(self, text: str) -> bool:
        """Whether the label fits completely."""
        return width_of(text, self._points, self._font) <= self._room


@session.cached(
    ("unregister",), 2048
)  # a panel measures the names of all sliders each time it is drawn
def width_of(text: str, points: float, font: str = "") -> float:
    """The width of a text in buttons and labels, in pixels at interface scale 1.

    Args:
        text: the text.
        points: size of the letters in points, from the preferences.
        font: path of the interface's font, because widths depend on it.
    """
    blf.size(0, points)
    return blf.dimensions(0, text)[0]


def prop_or(
    layout: UILayout, owner: bpy.types.bpy_struct, name: str, empty: float | str, meaning: str
) -> None:
    """Draw a property; if it has the value `empty`, draw the meaning of this value below it.

    Args:
        layout: layout of the panel or dialog.
        owner, name: owner and name of the property.
        empty: the special value, such as -1, 0 or "".
        meaning: meaning of the special value.
    """
    layout.prop(owner, name)
    if getattr(owner, name) == empty:
        row = layout.row()
        row.alignment, row.active = "RIGHT", False
        row.label(text=meaning, text_ctxt=CONTEXT)


def search(layout: UILayout, owner: bpy.types.bpy_struct, name: str) -> None:
    """Draw a search field with the add-on's own grey text "Search".

    The grey text of Blender is translated into few languages only.

    Args:
        layout: layout of the panel.
        owner, name: owner and name of the property.
    """
    placeholder: Any = {"placeholder": say("Search")} if _has_placeholder() else {}
    layout.prop(owner, name, text="", icon="VIEWZOOM", **placeholder)


@session.cached(("unregister",))
def _has_placeholder() -> bool:
    """Whether text fields of this Blender support placeholders."""
    functions: Any = bpy.types.UILayout.bl_rna.functions  # pyright: ignore  the stub has none
    return "placeholder" in functions["prop"].parameters


def write(layout: UILayout, text: str, icon: Icon = "NONE") -> None:
    """Draw a sentence in as many lines as a narrow sidebar needs.

    Args:
        layout: layout of the panel.
        text: the sentence, which is translated if the table contains it.
        icon: icon before the first line.
    """
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(say(text), 38)):
        show(column, line, icon if number == 0 else "BLANK1")


def say(text: str, **values: object) -> str:
    """Translate a label or sentence into the user's language.

    Args:
        text: English text of the translation table, with the names of `values` in braces; or a
            Sentence, which contains its values.
        values: values that replace the braces. A Sentence is translated, and so are error messages
            of the package in values named error, reason, said, trouble or why.
    """
    follow_language()
    if isinstance(text, Sentence):
        return say(text.template, **text.values)
    values = {name: _local_value(name, v) for name, v in values.items()}
    local = bpy.app.translations.pgettext_iface(text, CONTEXT) or text
    return local.format(**values) if values else local


def _local_value(name: str, value: object) -> object:
    """A value for a sentence, translated if it is a Sentence or an error message of the package.

    Only a value whose `name` is in `_REASONS` is taken for an error message.
    """
    if isinstance(value, Sentence):
        return say(value)
    if name in _REASONS and isinstance(value, str):
        return errors.local(value, _language["given"])
    return value


def name_of_new(text: str) -> str:
    """The name of a new datablock, translated if Blender translates such names."""
    follow_language()
    return bpy.app.translations.pgettext_data(text, CONTEXT) or text


def of_error(error: Exception) -> str:
    """The text of an error, translated if it is a Sentence or a known message of the package."""
    first = error.args[0] if error.args else ""
    if isinstance(first, Sentence):
        return say(first)
    follow_language()
    return errors.local(str(error), _language["given"])


def local(text: str) -> str:
    """Translate a Sentence, or a note or error of the package; other text stays unchanged."""
    if isinstance(text, Sentence):
        return say(text)
    follow_language()
    return errors.local(text, _language["given"])


def mark(text: str) -> str:
    """Return a text unchanged; the test of the translation tables thus finds the text in the code.

    Blender or a later call of `say` translates the text.
    """
    return text


def show(layout: UILayout, text: str, icon: Icon = "NONE") -> None:
    """Draw a label unchanged: a name, or a text that `say` has translated.

    Args:
        layout: layout of the panel.
        text: the label.
        icon: icon before the label.
    """
    layout.label(text=text, icon=icon, translate=False)


def bar(layout: UILayout, value: float) -> None:
    """Draw a number from 0 to 1 as a read-only bar.

    Args:
        layout: layout of the panel.
        value: the number, 0 to 1.
    """
    number = format(value, ".2f")
    layout.progress(factor=value, type="BAR", text=number, translate=False)


def follow_language() -> None:
    """Register the translation table of the user's language, if Blender's language has changed."""
    locale = bpy.app.translations.locale or ""
    if locale == _language["locale"]:
        return
    forget_language()
    language = tables.language_of(locale)
    _language["locale"], _language["given"] = locale, language
    if language:
        ours: Any = {language: tables.translation(language)}  # the stub has no contexts
        bpy.app.translations.register(native.ADDON, ours)


def forget_language() -> None:
    """Remove our translations from Blender."""
    if _language["given"]:
        bpy.app.translations.unregister(native.ADDON)
    _language["locale"] = _language["given"] = ""


def give_context(cls: type) -> None:
    """Make Blender translate texts of a class and its properties with the add-on's table first.

    Args:
        cls: operator, panel, menu or property group, before it is registered.
    """
    if issubclass(cls, (bpy.types.Operator, bpy.types.Panel, bpy.types.Menu)):
        cls.bl_translation_context = CONTEXT
    for one in cls.__mro__:
        for held in getattr(one, "__annotations__", {}).values():
            if hasattr(held, "keywords"):
                held.keywords.setdefault("translation_context", CONTEXT)
