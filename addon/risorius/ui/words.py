# SPDX-License-Identifier: GPL-3.0-or-later
"""Text in panels and dialogs: fitting, wrapping, and meanings of special values."""

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
NAMES = "Names"  # the context of names of things, in which nothing is translated
_SIDEBAR = 280  # pixels that Blender gives the sidebar at first
_EDGES = 36  # of them the tabs and the panel's margins
_MARGIN = 12  # around the text of a label
# locale: Blender's of now; given: the language that it has our words of.
_language = session.keep("words.language", lambda: {"locale": "", "given": ""}, ("unregister",))


class Ruler:
    """Tells which labels can be read whole in a share of the sidebar's width."""

    def __init__(self, context: Context, share: float) -> None:
        """Args: context with the region, or a new sidebar is assumed; share 0 to 1."""
        preferences, region = context.preferences, context.region
        width: float = _SIDEBAR
        if region is not None and region.type == "UI" and region.width > 1:
            width = region.width / (preferences.system.ui_scale or 1.0)  # 0 without a window
        self._room = (width - _EDGES) * share - _MARGIN
        self._points = preferences.ui_styles[0].widget.points
        self._font = preferences.view.font_path_ui

    def fits(self, text: str) -> bool:
        """Whether a label can be read whole."""
        return width_of(text, self._points, self._font) <= self._room


@session.cached(
    ("unregister",), 2048
)  # a panel asks for the names of all sliders each time it is drawn
def width_of(text: str, points: float, font: str = "") -> float:
    """Width of a text in buttons and labels in pixels, at an interface scale of 1.

    Args:
        text: the words.
        points: size of the letters in the preferences.
        font: path of the interface's font: another font has other widths.
    """
    blf.size(0, points)
    return blf.dimensions(0, text)[0]


def prop_or(
    layout: UILayout, owner: bpy.types.bpy_struct, name: str, empty: float | str, meaning: str
) -> None:
    """A property, and below it the meaning of its special value.

    Args:
        layout: of the panel or dialog.
        owner, name: the property.
        empty: the special value, such as -1, 0 or "".
        meaning: meaning of the special value.
    """
    layout.prop(owner, name)
    if getattr(owner, name) == empty:
        row = layout.row()
        row.alignment, row.active = "RIGHT", False
        row.label(text=meaning, text_ctxt=CONTEXT)


def search(layout: UILayout, owner: bpy.types.bpy_struct, name: str) -> None:
    """A search field. Blender's own placeholder is translated into few languages.

    Args:
        layout: of the panel.
        owner, name: the property.
    """
    placeholder: Any = {"placeholder": say("Search")} if _has_placeholder() else {}
    layout.prop(owner, name, text="", icon="VIEWZOOM", **placeholder)


@session.cached(("unregister",))
def _has_placeholder() -> bool:
    """Whether fields of this Blender have placeholders."""
    functions: Any = bpy.types.UILayout.bl_rna.functions  # pyright: ignore  the stub has none
    return "placeholder" in functions["prop"].parameters


def write(layout: UILayout, text: str, icon: Icon = "NONE") -> None:
    """A sentence in as many lines as a narrow sidebar needs.

    Args:
        layout: of the panel.
        text: the sentence; it is translated if the table has it.
        icon: icon before the first line.
    """
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(say(text), 38)):
        show(column, line, icon if number == 0 else "BLANK1")


def say(text: str, **values: object) -> str:
    """A label or sentence in the user's language.

    Args:
        text: English text of the table, with {names} of values; or a Sentence.
        values: values: numbers and names, which are never translated.
    """
    follow_language()
    if isinstance(text, Sentence):
        return say(text.template, **text.values)
    values = {name: _local_value(name, v) for name, v in values.items()}
    local = bpy.app.translations.pgettext_iface(text, CONTEXT) or text
    return local.format(**values) if values else local


def _local_value(name: str, value: object) -> object:
    """A value of a sentence: a Sentence and an error message of the package are translated."""
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
    """The text of an error, translated if it has a Sentence."""
    first = error.args[0] if error.args else ""
    if isinstance(first, Sentence):
        return say(first)
    follow_language()
    return errors.local(str(error), _language["given"])


def local(text: str) -> str:
    """A translated Sentence; other text stays as it is."""
    return say(text) if isinstance(text, Sentence) else text


def mark(text: str) -> str:
    """A label that Blender itself looks up later; so the test of the tables finds it."""
    return text


def show(layout: UILayout, text: str, icon: Icon = "NONE") -> None:
    """A label shown unchanged: a name, or text from `say`.

    Args:
        layout: of the panel.
        text: the label.
        icon: icon before the label.
    """
    layout.label(text=text, icon=icon, translate=False)


def bar(layout: UILayout, value: float) -> None:
    """A number from 0 to 1 as a read-only bar.

    Args:
        layout: of the panel.
        value: the number.
    """
    number = format(value, ".2f")
    layout.progress(factor=value, type="BAR", text=number, translate=False)


def follow_language() -> None:
    """Give Blender our words in the user's language; they are read when it is first chosen."""
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
    """Take our words away from Blender."""
    if _language["given"]:
        bpy.app.translations.unregister(native.ADDON)
    _language["locale"] = _language["given"] = ""


def give_context(cls: type) -> None:
    """Let Blender search translations of a class and its properties in the add-on's table first.

    Args:
        cls: an operator, a panel, a menu or a group of properties, before it is registered.
    """
    if issubclass(cls, (bpy.types.Operator, bpy.types.Panel, bpy.types.Menu)):
        cls.bl_translation_context = CONTEXT
    for one in cls.__mro__:
        for held in getattr(one, "__annotations__", {}).values():
            if hasattr(held, "keywords"):
                held.keywords.setdefault("translation_context", CONTEXT)
