# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar tab `Face`."""

import textwrap

import bpy

from .. import native
from ..logic.character import plans, regions
from ..scene.base import parts
from ..scene.character import lods, rig_placement, runtime
from . import bake_operators, life_operators, words

_ICONS = {
    "brow": "MOD_CURVE",
    "eye": "HIDE_OFF",
    "nose": "MONKEY",
    "cheek": "MATSPHERE",
    "mouth": "USER",
    "jaw": "MOD_SIMPLEDEFORM",
    "tongue": "MOD_SMOOTH",
    "teeth": "SNAP_FACE",
    "neck": "ARMATURE_DATA",
    "ear": "SPEAKER",
    "other": "DOT",
}
_OPEN = {"brow", "eye", "mouth", "jaw"}
_TITLE = 0.5  # of the width, for the names of sliders


class FacePanel:
    """What all panels of the tab share."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Face"


class FaceOnlyPanel(FacePanel):
    """A panel that is there only with a face."""

    @classmethod
    def poll(cls, context):
        rig = None if native.problem() else parts.active_rig(context)
        return rig is not None and parts.controls_of(rig) is not None


def write(layout, text, icon="NONE"):
    """A sentence in as many lines as a narrow sidebar needs."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, 38)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1")


class RISORIUS_PT_character(FacePanel, bpy.types.Panel):
    bl_idname = "RISORIUS_PT_character"
    bl_label = "Face"
    bl_order = 0

    def draw(self, context):
        layout = self.layout
        trouble = native.problem()
        if trouble:
            write(layout, trouble, "ERROR")
            return
        if life_operators.draw_trouble(layout, context):
            return
        rig = parts.active_rig(context)
        if rig is None:
            _draw_start(layout)
            return
        live = runtime.of(rig)
        controls = parts.controls_of(rig)
        if live is None or controls is None:
            return  # said above
        layout.label(text=rig.name.removesuffix("_rig"), icon="USER")
        bake_operators.draw_state(layout, rig, write)
        _draw_detail(layout, rig)
        _draw_shapes(layout, rig)
        row = layout.row(align=True)
        row.operator("risorius.reset", icon="LOOP_BACK").region = ""
        row.operator("risorius.key", text="Key All", icon="KEYFRAME_HLT").region = ""
        for warning in plans.layer_warnings(live.rig.ignored_layers):
            write(layout, warning, "INFO")


def _draw_start(layout):
    write(layout, "No face is selected.", "INFO")
    layout.operator("risorius.add_character", text="Add a Face", icon="USER")
    layout.operator("risorius.import_dna", text="Import DNA", icon="IMPORT")


def _draw_detail(layout, rig):
    levels = lods.built(rig)
    if len(levels) < 2:
        return
    column = layout.column(align=True)
    auto = lods.by_distance(rig)
    for target, text, shown in (
        ("VIEWPORT", "Detail in the Viewport", lods.viewport_level(rig)),
        ("RENDER", "Detail in Renders", lods.render_level(rig)),
    ):
        # On a line of its own: beside eight levels there is no room for words.
        column.label(text=text)
        row = column.row(align=True)
        row.active = not auto
        for level in levels:
            button = row.operator("risorius.set_lod", text=str(level), depress=level == shown)
            button.lod, button.target = level, target
    column.operator("risorius.set_lod_by_distance", depress=auto).enable = not auto
    if auto:
        for level in range(min(len(rig[parts.LOD_DISTANCES]), levels[-1])):
            column.prop(
                rig, f'["{parts.LOD_DISTANCES}"]', index=level, text=f"LOD {level + 1} from"
            )


def _draw_shapes(layout, rig):
    modes = {m.get(parts.MODE) for m in parts.meshes_of(rig)}
    row = layout.row(align=True)
    row.label(text="Shapes")
    for mode, text in (("LIVE", "Live"), ("KEYS", "Keys")):
        row.operator("risorius.set_shape_mode", text=text, depress=mode in modes).mode = mode


class RISORIUS_PT_controls(FaceOnlyPanel, bpy.types.Panel):
    bl_idname = "RISORIUS_PT_controls"
    bl_label = "Controls"
    bl_order = 1

    def draw(self, context):
        layout = self.layout
        rig = parts.active_rig(context)
        live, face = runtime.of(rig), parts.face_bone(rig)
        if live is None:
            return
        search = context.window_manager.risorius_search
        layout.prop(context.window_manager, "risorius_search", text="", icon="VIEWZOOM")
        shown = [n for n in live.labels if n in face and regions.matches(n, search)]
        for region, indices in regions.group_controls(shown).items():
            names = [shown[i] for i in indices]
            if search:
                _draw_region_header(layout.row(), region)
                _draw_sliders(context, layout, face, names)
                continue
            header, body = layout.panel(
                f"RISORIUS_PT_region_{region}", default_closed=region not in _OPEN
            )
            _draw_region_header(header, region)
            if body is not None:
                _draw_sliders(context, body, face, names)
        if not shown:
            write(layout, "No control has these words in its name.", "INFO")


def _draw_region_header(layout, region):
    layout.label(text=regions.TITLES[region], icon=_ICONS[region])
    row = layout.row(align=True)
    row.emboss = "NONE"
    row.operator("risorius.reset", text="", icon="LOOP_BACK").region = region
    row.operator("risorius.key", text="", icon="KEY_HLT").region = region


def _draw_sliders(context, layout, face, names):
    """One line per control; a left and its right control share it, a long name stands above."""
    column = layout.column(align=True)
    there = set(names)
    for name in names:
        left, right = f"{name[:-1]}L", f"{name[:-1]}R"
        if name == right and left in there:
            continue
        paired = name == left and right in there
        title = regions.title_in_region(name, sided=not paired)
        if words.fits(context, title, _TITLE):
            line = column.split(factor=_TITLE, align=True)
            line.label(text=title)
        else:
            column.label(text=title)
            line = column
        row = line.row(align=True)
        for one, text in ((left, "L"), (right, "R")) if paired else ((name, ""),):
            quoted = bpy.utils.escape_identifier(one)
            row.prop(face, f'["{quoted}"]', text=text, slider=True)


class RISORIUS_PT_options(FaceOnlyPanel, bpy.types.Panel):
    bl_idname = "RISORIUS_PT_options"
    bl_label = "Options"
    bl_order = 2
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        rig = parts.active_rig(context)
        on = bool(parts.controls_of(rig).get(parts.OVERDRIVE))
        layout.operator("risorius.set_overdrive", depress=on).enable = not on
        attached = rig_placement.body_of(parts.controls_of(rig))
        body = "risorius.detach_body" if attached else "risorius.attach_body"
        layout.operator(body, icon="ARMATURE_DATA")
        layout.operator("risorius.separate", icon="UNLINKED")
        layout.operator("risorius.reload", icon="FILE_REFRESH")
        layout.operator("risorius.replace_dna", icon="FILEBROWSER")
        layout.operator("risorius.export_dna", icon="EXPORT")
        layout.operator("risorius.describe", icon="INFO")
        layout.prop(context.window_manager, "risorius_show_timing")
        render = context.scene.render
        if not render.use_lock_interface:
            layout.prop(render, "use_lock_interface", text="Lock Interface in Renders")
        live = runtime.of(rig)
        if live is not None:
            column = layout.column(align=True)
            column.scale_y = 0.8
            column.label(text=f"{len(live.labels)} controls, {live.rig.joint_count} joints")
            column.label(text=f"{live.rig.blend_shape_count} shapes, {live.rig.simd}")


CLASSES = (RISORIUS_PT_character, RISORIUS_PT_controls, RISORIUS_PT_options)
