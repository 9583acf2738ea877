# SPDX-License-Identifier: GPL-3.0-or-later
# A checker sees members of a Context that are there; Blender's own may be None:
# pyright: reportIncompatibleMethodOverride=false
"""Names for annotations where Blender's own say too little.

Objects by what they hold: Blender's own class may hold data of any kind. The stubs of Blender's API
leave open whether a context has a scene or a window manager: it has while an operator runs or a
panel is drawn, and a checker shall not ask for it each time. While the add-on runs all classes here
are Blender's own. What is Any here is so because the base class lacks what its kinds have: nothing
else in the add-on may have Any in what it takes or gives.
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
        """What an operator or a panel works on.

        In the stubs a member named property makes methods of all members above it.
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
    """What bpy.context is now."""
    return cast(Context, bpy.context)
