# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The user's settings of live capture, stored with the window manager."""

from typing import cast

import bpy

from ... import native
from ...scene.live import sessions
from ..blender_types import Context
from ..common import active_controls, system_path

SOURCES = tuple(
    (name, row["title"], row["description"]) for name, row in native.live_sources().items()
)
PORTS = {name: row["port"] for name, row in native.live_sources().items()}


def _source_changed(self: "RISORIUS_PG_live", _context: bpy.types.Context) -> None:
    self.port = PORTS[self.source]


def _changed(_self: "RISORIUS_PG_live", given: bpy.types.Context) -> None:
    context = cast(Context, given)
    session = sessions.of(active_controls(context))
    if session is not None:
        sessions.apply_settings(session, settings_of(context))


class RISORIUS_PG_live(bpy.types.PropertyGroup):
    """The user's settings of live capture, stored with the window manager."""

    source: bpy.props.EnumProperty(
        name="Source",
        description="App that sends the capture",
        items=SOURCES,
        update=_source_changed,
    )
    port: bpy.props.IntProperty(
        name="Port",
        description="UDP port to which the app sends",
        default=PORTS.get("livelink", 1),
        min=1,
        max=65535,
    )
    everywhere: bpy.props.BoolProperty(
        name="From the Network",
        description="Receive from any device in the network, such as a phone; off: "
        "only from programs on this computer. In a network that is not "
        "your own, other people could move the face",
        default=False,
    )
    subject: bpy.props.StringProperty(
        name="Subject",
        description=(
            "Name of the person to follow, as the app sends the name; empty: the "
            "first person received"
        ),
        update=_changed,
    )
    mapping: bpy.props.StringProperty(
        name="Mapping",
        description="File that maps received names to controls; empty: names of ARKit and VRM",
        subtype="FILE_PATH",
    )
    smoothing: bpy.props.FloatProperty(
        name="Smoothing",
        description="Smooth small jitter in the view; recordings stay unsmoothed",
        default=0.3,
        min=0.0,
        max=1.0,
        update=_changed,
    )
    gain: bpy.props.FloatProperty(
        name="Gain",
        description="Factor by which all received values of the face are multiplied",
        default=1.0,
        min=0.0,
        max=3.0,
        update=_changed,
    )
    head_gain: bpy.props.FloatProperty(
        name="Head",
        description="Factor of the head's rotation: 0 keeps the head still, -1 inverts it",
        default=1.0,
        min=-2.0,
        max=2.0,
        update=_changed,
    )


def choices(context: Context) -> RISORIUS_PG_live:
    """The user's settings of live capture."""
    return cast(RISORIUS_PG_live, context.window_manager.risorius_live)


def settings_of(context: Context) -> sessions.Settings:
    """The user's settings as an object for a capture; without a mapping file it gets "arkit"."""
    chosen = choices(context)
    return sessions.Settings(
        chosen.source,
        chosen.port,
        chosen.everywhere,
        chosen.subject,
        chosen.smoothing,
        chosen.gain,
        chosen.head_gain,
        system_path(chosen.mapping) or "arkit",
    )


CLASSES = (RISORIUS_PG_live,)
