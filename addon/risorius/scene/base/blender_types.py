# SPDX-License-Identifier: GPL-3.0-or-later
# A checker treats members of this Context as present; Blender's own may be None:
# pyright: reportIncompatibleMethodOverride=false
"""Types for annotations that are more exact than Blender's own.

An Object type for each kind of data: Blender's class may have data of any kind. In the stubs of
Blender's API a context may lack a scene or a window manager. It has both while an operator runs or
a panel is drawn, so code need not test it each time. At run time all classes here are Blender's
own. Any is used here because a base class lacks the members of its kinds. No other file of the
add-on may use Any in a signature.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import bpy
from numpy.typing import NDArray

Node = Any  # one of some hundred kinds, each with settings of its own
Attribute = Any  # of a mesh: each type has data of its own
NodeTree = Any  # of a material, a scene or a group
Socket = Any  # each kind has another default_value
Values = NDArray[
    Any
]  # of a mesh's layer: a row each vertex, corner or face, of the layer's own type
Override = dict[str, Any]  # what bpy.context.temp_override takes: members of all kinds
Animated = bpy.types.Object | bpy.types.Key  # what a face has that plays actions

if TYPE_CHECKING:

    class ArmatureObject(bpy.types.Object):
        """The deforming or the control armature of a character."""

        data: bpy.types.Armature  # pyright: ignore[reportIncompatibleVariableOverride]
        risorius_layer_rules: bool  # see layer_properties, as the two below
        risorius_layers_index: int
        risorius_reactions_index: int
        risorius_converge: float  # see gaze_settings, as the two below
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
        """An evaluated dependency graph: it has a scene."""

        @property
        def scene(self) -> bpy.types.Scene: ...

    class WindowManager(bpy.types.WindowManager):
        """With the properties that registration.py gives it."""

        risorius_search: str
        risorius_only_used: bool
        risorius_stars: bool
        risorius_show_timing: bool
        risorius_live: bpy.types.PropertyGroup

    class Context(bpy.types.Context):
        """The context of an operator or a panel.

        In the stubs a member named property turns all members above it into methods.
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
