# SPDX-License-Identifier: GPL-3.0-or-later
# Members of this Context are never None, which pyright would report:
# pyright: reportIncompatibleMethodOverride=false
"""Defines types for annotations that are more exact than the stubs of Blender's API.

Objects have one type for each kind of data. A Context always has a scene and a window manager,
because it has both while an operator runs or a panel is drawn. At run time all classes here are
Blender's own. Any is used for types whose subtypes have different members. No other file of the
add-on may use Any in a signature.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import bpy
from numpy.typing import NDArray

Node = Any  # a shader or compositor node; each kind has different settings
Attribute = Any  # an attribute of a mesh; each type has different data
NodeTree = Any  # the node tree of a material, a scene or a group
Socket = Any  # a node socket; the type of default_value depends on its kind
Values = NDArray[Any]  # values of a mesh attribute: one row for each vertex, corner or face
Override = dict[str, Any]  # keyword arguments of bpy.context.temp_override
Animated = bpy.types.Object | bpy.types.Key  # datablocks of a face that play actions

if TYPE_CHECKING:

    class ArmatureObject(bpy.types.Object):
        """The deforming or the control armature of a character."""

        data: bpy.types.Armature  # pyright: ignore[reportIncompatibleVariableOverride]
        risorius_layer_rules: bool  # this and the next two properties: see layer_properties
        risorius_layers_index: int
        risorius_reactions_index: int
        risorius_converge: float  # this and the next three properties: see gaze_settings
        risorius_lids: float
        risorius_neck_poses: bool
        risorius_body_turn: float

        @property
        def pose(self) -> bpy.types.Pose: ...
        @property
        def original(self) -> ArmatureObject: ...

    class MeshObject(bpy.types.Object):
        """A mesh of a character."""

        data: bpy.types.Mesh  # pyright: ignore[reportIncompatibleVariableOverride]

    class Depsgraph(bpy.types.Depsgraph):
        """An evaluated dependency graph, whose scene is never None."""

        @property
        def scene(self) -> bpy.types.Scene: ...

    class WindowManager(bpy.types.WindowManager):
        """The window manager with the properties that registration.py adds."""

        risorius_search: str
        risorius_only_used: bool
        risorius_stars: bool
        risorius_show_timing: bool
        risorius_live: bpy.types.PropertyGroup

    class Context(bpy.types.Context):
        """The context of an operator or a panel.

        The members are declared again, because the stubs' Context has a member named `property`,
        which pyright takes for the decorator of the other members.
        """

        region: bpy.types.Region | None  # pyright: ignore[reportIncompatibleVariableOverride]

        def evaluated_depsgraph_get(self) -> Depsgraph: ...
        @property
        def area(self) -> bpy.types.Area | None: ...
        @property
        def screen(self) -> bpy.types.Screen | None: ...
        @property
        def window(self) -> bpy.types.Window | None: ...
        @property
        def preferences(self) -> bpy.types.Preferences: ...
        @property
        def scene(self) -> bpy.types.Scene: ...
        @property
        def view_layer(self) -> bpy.types.ViewLayer: ...
        @property
        def window_manager(self) -> WindowManager: ...
        @property
        def workspace(self) -> bpy.types.WorkSpace: ...

else:
    ArmatureObject = MeshObject = bpy.types.Object
    Depsgraph = bpy.types.Depsgraph
    WindowManager = bpy.types.WindowManager
    Context = bpy.types.Context


def current_context() -> Context:
    """The current bpy.context."""
    return cast(Context, bpy.context)
