# SPDX-License-Identifier: GPL-3.0-or-later
# The methods here accept only a Context with a scene, Blender's own methods accept any context. A
# type checker would report this difference, so this check is off in this file:
# pyright: reportIncompatibleMethodOverride=false
"""Blender's classes for type annotations of operators, panels and menus.

In the type stubs of Blender's API, the layout of a panel may be None. A panel that is drawn always
has a layout, so the classes here declare it as present. At run time all names here are Blender's
own classes. Arguments of UIList have the type Any, because a list shows items of any type.
"""

from typing import TYPE_CHECKING, Any, TypeAlias

import bpy
from bpy_extras import io_utils

from ..scene.base.blender_types import Context

Result: TypeAlias = "set[OperatorReturnItems]"  # return value of an operator
Icon: TypeAlias = "IconItems"
Item = tuple[str, str, str]  # item of an enum: identifier, name, description

if TYPE_CHECKING:
    from bpy.stub_internal.rna_enums import IconItems, OperatorReturnItems

    class OperatorButton(bpy.types.OperatorProperties):
        """Properties that a button sets on its operator; their names depend on the operator."""

        def __setattr__(self, name: str, value: object) -> None: ...

    class UILayout(bpy.types.UILayout):
        """The layout of a panel, a dialog or a menu."""

        def operator(
            self,
            operator: str,
            *,
            text: str = "",
            icon: Icon = "NONE",
            depress: bool = False,
            emboss: bool = True,
            translate: bool = True,
        ) -> OperatorButton: ...
        def panel(
            self, idname: str, *, default_closed: bool = False
        ) -> "tuple[UILayout, UILayout | None]": ...

    class Operator(bpy.types.Operator):
        """An operator while it runs or while its dialog is drawn."""

        @property
        def layout(self) -> UILayout: ...
        @classmethod
        def poll(cls, context: Context) -> bool: ...
        def execute(self, context: Context) -> Result: ...
        def invoke(self, context: Context, event: bpy.types.Event) -> Result: ...
        def modal(self, context: Context, event: bpy.types.Event) -> Result: ...
        def cancel(self, context: Context) -> None: ...
        def check(self, context: Context) -> bool: ...
        def draw(self, context: Context) -> None: ...

    class _FileSelector:
        """Mixin of operators with the path of a file that the user chooses."""

        filepath: str

        def invoke(self, context: Context, event: bpy.types.Event) -> Result: ...
        def check(self, context: Context) -> bool: ...

    ImportHelper = ExportHelper = _FileSelector

    class Panel(bpy.types.Panel):
        """A panel while it is drawn."""

        @property
        def layout(self) -> UILayout: ...
        @classmethod
        def poll(cls, context: Context) -> bool: ...
        def draw(self, context: Context) -> None: ...
        def draw_header_preset(self, context: Context) -> None: ...

    class Menu(bpy.types.Menu):
        """A menu while it is drawn."""

        @property
        def layout(self) -> UILayout: ...
        def draw(self, context: Context) -> None: ...

    class UIList(bpy.types.UIList):
        """A list while its items, which may be of any type, are drawn."""

        def draw_item(
            self,
            context: Context,
            layout: UILayout,
            data: Any,
            item: Any,
            icon: int,
            active_data: Any,
            active_property: str,
        ) -> None: ...
        def filter_items(
            self, context: Context, data: Any, property: str
        ) -> tuple[list[int], list[int]]: ...
        def draw_filter(self, context: Context, layout: UILayout) -> None: ...

    class FileHandler(bpy.types.FileHandler):
        """Handler of files dropped onto a window."""

        @classmethod
        def poll_drop(cls, context: Context) -> bool: ...

    class AddonPreferences(bpy.types.AddonPreferences):
        """The add-on's preferences while they are drawn."""

        layout: UILayout  # pyright: ignore[reportIncompatibleVariableOverride]

    OperatorBase, PanelBase = Operator, Panel
else:
    UILayout = bpy.types.UILayout
    Operator, Panel = bpy.types.Operator, bpy.types.Panel
    Menu, UIList = bpy.types.Menu, bpy.types.UIList
    FileHandler, AddonPreferences = bpy.types.FileHandler, bpy.types.AddonPreferences
    ImportHelper, ExportHelper = io_utils.ImportHelper, io_utils.ExportHelper
    OperatorButton = bpy.types.OperatorProperties
    OperatorBase = PanelBase = object  # for base classes that are not registered themselves
