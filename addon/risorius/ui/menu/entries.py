# SPDX-License-Identifier: GPL-3.0-or-later
"""The submenus of the menu Face. An unavailable entry is grey, and its tooltip gives the reason."""

from ... import native
from ...scene.character import board, runtime
from ...scene.frame import look_masks
from .. import words
from ..blender_types import Context, Menu, UILayout
from ..common import active_controls, as_seen, face_rig


class RISORIUS_MT_face_keys(Menu):
    bl_idname = "RISORIUS_MT_face_keys"
    bl_label = "Keys"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator("risorius.key", text="Key All", icon="KEYFRAME_HLT").region = ""
        layout.operator("risorius.key_handles")
        layout.separator()
        layout.operator("risorius.next_key", text="Key Before").forward = False
        layout.operator("risorius.next_key", text="Next Key").forward = True
        layout.separator()
        layout.operator("risorius.breakdown", icon="ARROW_LEFTRIGHT").kind = "BREAKDOWN"
        layout.operator("risorius.breakdown", text="Relax or Push").kind = "NEIGHBOURS"
        layout.operator("risorius.breakdown", text="To Rest").kind = "REST"
        layout.separator()
        layout.operator("risorius.colour_curves", icon="COLOR")


class RISORIUS_MT_face_eyes(Menu):
    bl_idname = "RISORIUS_MT_face_eyes"
    bl_label = "Eyes"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator("risorius.blink", icon="HIDE_ON").kind = "KEYS"
        layout.operator("risorius.blink", text="Blink as Layer").kind = "LAYER"
        layout.separator()
        layout.operator_menu_enum("risorius.gaze_target", "mode", icon="VIS_SEL_11")


class RISORIUS_MT_face_sides(Menu):
    bl_idname = "RISORIUS_MT_face_sides"
    bl_label = "Left and Right"

    def draw(self, context: Context) -> None:
        layout, seen = self.layout, as_seen(context)
        layout.operator("risorius.mirror", icon="MOD_MIRROR").region = ""
        layout.separator()
        for from_left, text in ((True, "Copy Left to Right"), (False, "Copy Right to Left")):
            button = layout.operator("risorius.copy_side", text=text)
            button.region, button.from_left = "", from_left != seen
        layout.separator()
        for enable, text in ((True, "Link Left and Right"), (False, "Unlink Left and Right")):
            button = layout.operator("risorius.link_sides", text=text)
            button.enable, button.from_left = enable, not seen


class RISORIUS_MT_face_drag(Menu):
    bl_idname = "RISORIUS_MT_face_drag"
    bl_label = "Drag"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator("risorius.drag_tool", icon="VIEW_PAN")
        layout.separator()
        layout.operator("risorius.hide_handles")
        layout.operator("risorius.show_handles")
        layout.operator("risorius.clear_pins", icon="UNPINNED")


class RISORIUS_MT_face_board(Menu):
    bl_idname = "RISORIUS_MT_face_board"
    bl_label = "Face Board"

    def draw(self, context: Context) -> None:
        layout, controls = self.layout, active_controls(context)
        live = runtime.of(face_rig(context)) if controls is not None else None
        if controls is None or live is None or not board.is_there(controls, live):
            layout.operator("risorius.add_board", icon="ADD").kind = runtime.PRIMARY
            button = layout.operator("risorius.add_board", text="Complete Board", icon="MESH_GRID")
            button.kind = runtime.COMPLETE
            return
        layout.operator_menu_enum("risorius.lead", "by")
        layout.operator_menu_enum("risorius.select_board", "region", icon="RESTRICT_SELECT_OFF")
        layout.operator("risorius.reset_board", icon="LOOP_BACK").selected = False
        layout.operator("risorius.frame_board", icon="ZOOM_SELECTED")
        layout.separator()
        layout.operator("risorius.remove_board", icon="TRASH")


class RISORIUS_MT_face_layers(Menu):
    bl_idname = "RISORIUS_MT_face_layers"
    bl_label = "Layers"

    def draw(self, context: Context) -> None:
        layout = self.layout
        if active_controls(context) is None:
            layout.operator("risorius.layer_add", icon="ADD")  # its tooltip gives the reason
            return
        layout.menu("RISORIUS_MT_layer_add", icon="ADD")
        layout.operator("risorius.layer_remove", icon="REMOVE")
        layout.menu("RISORIUS_MT_layer_more")
        layout.separator()
        layout.menu(
            "RISORIUS_MT_fire",
            text="Fire a Reaction",
            text_ctxt=words.CONTEXT,
            icon="LIGHT_SUN",
        )


class RISORIUS_MT_face_why(Menu):
    bl_idname = "RISORIUS_MT_face_why"
    bl_label = "See Why"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator("risorius.why_vertex", icon="EYEDROPPER")
        for kind, text in (("POSE", "Heat Map from Neutral"), ("OFF", "Hide Heat Map")):
            button = layout.operator("risorius.heat", text=text)
            button.kind, button.what = kind, ""
        layout.separator()
        controls = active_controls(context)
        muted = look_masks.of(face_rig(context)).muted if controls is not None else ()
        for mute, unmute, kind in (
            ("Mute Joints", "Unmute Joints", "JOINTS"),
            ("Mute Shapes", "Unmute Shapes", "SHAPES"),
            ("Mute Maps", "Unmute Maps", "MAPS"),
        ):
            text = words.say(unmute if kind in muted else mute)
            button = layout.operator("risorius.mute", text=text, translate=False)
            button.kind, button.enable = kind, kind not in muted
        layout.operator("risorius.show_all", icon="LOOP_BACK")


class RISORIUS_MT_face_import(Menu):
    bl_idname = "RISORIUS_MT_face_import"
    bl_label = "Animation"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator("risorius.import_animation", icon="IMPORT")
        layout.operator("risorius.import_arkit_rig", icon="SHAPEKEY_DATA")
        layout.operator("risorius.curves_from_mesh", icon="MESH_DATA")
        layout.operator("risorius.speak", icon="SPEAKER")
        layout.operator("risorius.word_set", text="Replace Spoken Word")
        layout.operator("risorius.speech_markers", text="Speech Markers", icon="MARKER_HLT")
        layout.operator("risorius.speech_update", icon="FILE_REFRESH")
        layout.separator()
        layout.operator("risorius.live_start", text="Start Live Capture", icon="RADIOBUT_ON")
        layout.operator("risorius.live_record", text="Record Live Capture", icon="REC")
        layout.operator("risorius.live_stop", text="Stop Live Capture")
        layout.separator()
        layout.operator("risorius.learn_range", icon="DRIVER_DISTANCE")


class RISORIUS_MT_face_out(Menu):
    bl_idname = "RISORIUS_MT_face_out"
    bl_label = "Bake and Export"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator("risorius.bake", icon="ACTION")
        layout.operator("risorius.unbake", icon="LOOP_BACK")
        layout.operator("risorius.bake_physics", icon="PHYSICS")
        layout.separator()
        layout.operator("risorius.export_animation", icon="EXPORT")
        layout.operator("risorius.export_web", icon="URL")
        layout.operator("risorius.export_game_face", icon="SHAPEKEY_DATA")
        layout.operator("risorius.export_dna")
        layout.separator()
        layout.operator("risorius.prepare_for_export", icon="ARMATURE_DATA").enable = True


class RISORIUS_MT_face_character(Menu):
    bl_idname = "RISORIUS_MT_face_character"
    bl_label = "Character"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.menu("RISORIUS_MT_sample", text="Add a Face", text_ctxt=words.CONTEXT, icon="USER")
        layout.operator("risorius.import_dna", icon="IMPORT")
        layout.operator("risorius.make_rig", icon="SHAPEKEY_DATA")
        layout.operator("risorius.make_rig_from_head")
        layout.operator("risorius.conform_face")
        layout.operator("risorius.find_landmarks")
        layout.separator()
        layout.operator("risorius.attach_body", icon="ARMATURE_DATA")
        layout.operator("risorius.detach_body")
        for enable, text in ((True, "Overdrive"), (False, "Overdrive Off")):
            layout.operator("risorius.set_overdrive", text=text).enable = enable
        layout.separator()
        layout.operator("risorius.separate", icon="UNLINKED")
        layout.operator("risorius.make_override", icon="LIBRARY_DATA_OVERRIDE")
        layout.operator("risorius.bring_back")
        layout.operator("risorius.move_outlines")
        layout.operator("risorius.reload", icon="FILE_REFRESH")
        layout.operator("risorius.replace_dna", icon="FILEBROWSER")


class RISORIUS_MT_face_about(Menu):
    bl_idname = "RISORIUS_MT_face_about"
    bl_label = "Risorius"

    def draw(self, context: Context) -> None:
        layout = self.layout
        # The add-on's translation table does not contain the names of Blender's operators, so the
        # button gets a translated text.
        text = words.say("Preferences")
        layout.operator(
            "preferences.addon_show", text=text, icon="PREFERENCES", translate=False
        ).module = native.ADDON
        layout.operator("risorius.self_test", icon="CHECKMARK")
        layout.operator("risorius.describe", icon="INFO")
        _draw_manual(layout)


def _draw_manual(layout: UILayout) -> None:
    site = native.website()
    if site:
        text = words.say("Online Manual")
        layout.operator("wm.url_open", text=text, icon="URL", translate=False).url = site


CLASSES = (
    RISORIUS_MT_face_keys,
    RISORIUS_MT_face_eyes,
    RISORIUS_MT_face_sides,
    RISORIUS_MT_face_drag,
    RISORIUS_MT_face_board,
    RISORIUS_MT_face_layers,
    RISORIUS_MT_face_why,
    RISORIUS_MT_face_import,
    RISORIUS_MT_face_out,
    RISORIUS_MT_face_character,
    RISORIUS_MT_face_about,
)
