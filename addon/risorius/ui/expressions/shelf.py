# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""An asset shelf with expressions, for versions of Blender whose shelves accept operators.

Blender's own pose shelf applies the same assets only in pose mode and to the selected bones; this
shelf appears in object mode and moves the sliders of the active face.
"""

from typing import Any

import bpy

from ...logic.base.sentences import told
from ...scene.expressions import library
from ..blender_types import Context, Operator, OperatorBase
from ..common import active_controls
from .operators import Applies, Blends

_LIBRARIES = (  # with Blender's numbers for the kinds of asset libraries
    ("LOCAL", "This File", "", 1),
    ("ALL", "All", "", 2),
    ("ESSENTIALS", "Essentials", "", 3),
    ("CUSTOM", "Library", "", 100),
)


class _OfAsset(OperatorBase):
    """Properties with which an asset shelf passes an asset to an operator."""

    asset_library_type: bpy.props.EnumProperty(
        name="Library", items=_LIBRARIES, options={"HIDDEN", "SKIP_SAVE"}
    )
    asset_library_identifier: bpy.props.StringProperty(
        name="Library", options={"HIDDEN", "SKIP_SAVE"}
    )
    relative_asset_identifier: bpy.props.StringProperty(
        name="Asset", options={"HIDDEN", "SKIP_SAVE"}
    )

    def item(self, context: Context) -> library.Item:
        """The expression that is stored in the asset.

        Raises:
            LibraryError: no expression is stored in the asset.
        """
        name = self.relative_asset_identifier.replace("\\", "/").rpartition("/")[2]
        asset: Any = getattr(context, "asset", None)
        text = asset.metadata.get(library.MARK) if asset is not None else None
        action = bpy.data.actions.get(name)
        if not isinstance(text, str) and self.asset_library_type == "LOCAL" and action is not None:
            text = action.get(library.MARK)
        expression = library.of_text(text) if isinstance(text, str) else None
        if expression is None:
            raise library.LibraryError(told("{name} is no expression of a face.", name=name))
        items, _ = library.all_items(library.folder(context))
        known = items.get(expression.name)
        source = known.source if known is not None else library.FILE
        return library.Item(expression, source)


class RISORIUS_OT_apply_pose_asset(_OfAsset, Applies, Operator):
    """Move the sliders to the expression of a pose asset. Ctrl: swap sides, Shift: add"""

    bl_idname = "risorius.apply_pose_asset"
    bl_label = "Expression"


class RISORIUS_OT_blend_pose_asset(_OfAsset, Blends, Operator):
    """Blend the expression of a pose asset in by moving the mouse"""

    bl_idname = "risorius.blend_pose_asset"
    bl_label = "Blend Expression"


class RISORIUS_AST_expressions(bpy.types.AssetShelf):
    bl_space_type = "VIEW_3D"
    bl_activate_operator = RISORIUS_OT_apply_pose_asset.bl_idname
    bl_drag_operator = RISORIUS_OT_blend_pose_asset.bl_idname
    bl_options = {"STORE_ENABLED_CATALOGS_IN_PREFERENCES"}
    bl_default_preview_size = 96

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        given: Any = context
        if getattr(given, "mode", "") != "OBJECT" or not hasattr(given, "object"):
            return False  # while a file opens, the context has no attribute `object`
        return active_controls(given) is not None

    @classmethod
    def asset_poll(cls, asset: bpy.types.AssetRepresentation | None) -> bool:
        known: Any = asset
        return known.id_type == "ACTION" and library.MARK in known.metadata.keys()  # noqa: SIM118


def takes_operators() -> bool:
    """Whether asset shelves of this Blender can run the add-on's operators, as from 4.3 on."""
    return "bl_activate_operator" in bpy.types.AssetShelf.bl_rna.properties


CLASSES = (RISORIUS_OT_apply_pose_asset, RISORIUS_OT_blend_pose_asset)
if takes_operators():
    CLASSES = (*CLASSES, RISORIUS_AST_expressions)
