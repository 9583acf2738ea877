# SPDX-License-Identifier: MIT
"""Runs in a Blender with a window, and calls the functions that drive.py requests.

    blender --python inside.py -- TALK

TALK is a folder. drive.py writes ask-N.json with the name and the arguments of a function of this
file; this file writes its result to answer-N.json, N = 0, 1, 2 and so on. Blender's event loop
answers, so an answer also proves that Blender has handled all earlier input of the pointer.
"""

import json
import os
import sys
import traceback
from pathlib import Path

import bpy
import numpy as np
from bpy_extras import view3d_utils
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Matrix, Vector

__all__ = ["Vector", "world_to_camera_view"]  # names that expressions of see() use

TALK = Path(sys.argv[sys.argv.index("--") + 1])
_next = [0]
_drawn, _watched = {}, set()


def window():
    return bpy.context.window_manager.windows[0]


def view():
    """The 3D view of the main window: its area, its drawing region and its sidebar."""
    area = next(a for a in window().screen.areas if a.type == "VIEW_3D")
    regions = {r.type: r for r in area.regions}
    return area, regions["WINDOW"], regions["UI"]


def header_of_view():
    return next(r for r in view()[0].regions if r.type == "HEADER")


def rectangle(item):
    """Left, top, width and height of an area or region on the screen, pixels."""
    return [item.x, window().height - item.y - item.height, item.width, item.height]


def over(area, region):
    return bpy.context.temp_override(window=window(), area=area, region=region)


def rig():
    return next((o for o in bpy.data.objects if "risorius_controls" in o), None)


def face():
    return rig()["risorius_controls"].pose.bones["face"]


def module(name):
    """A module of the add-on."""
    return sys.modules[f"bl_ext.user_default.risorius.{name}"]


# ---- functions for drive.py


def ready():
    """Blender's version, and the rectangles of the areas by type."""
    return {
        "blender": bpy.app.version_string,
        "areas": {a.type: rectangle(a) for a in window().screen.areas},
    }


def layout():
    """The rectangles of the 3D view and of its sidebar."""
    _area, drawing, sidebar = view()
    return {"view": rectangle(drawing), "sidebar": rectangle(sidebar)}


def show_tab(wide=0):
    """Open the sidebar with the tab Risorius. Returns whether the tab is active."""
    area, _drawing, sidebar = view()
    area.spaces.active.show_region_ui = True
    try:
        sidebar.active_panel_category = "Risorius"
    except (AttributeError, TypeError):  # raised until the sidebar is first drawn
        return False
    area.tag_redraw()
    return sidebar.active_panel_category == "Risorius"


def quiet():
    """Set preferences for the tests, such as the file browser in this window. Remove the default
    cube and light."""
    preferences = bpy.context.preferences
    preferences.view.filebrowser_display_type = "SCREEN"
    preferences.view.show_tooltips = False
    preferences.use_preferences_save = False
    preferences.system.use_region_overlap = False  # so that clicks in the sidebar miss the view
    for name in ("Cube", "Light"):
        if name in bpy.data.objects:
            bpy.data.objects.remove(bpy.data.objects[name])
    return True


def clipboard(text=None):
    """The text of the clipboard. Args: text  a new text; None keeps the old one."""
    manager = bpy.context.window_manager
    if text is not None:
        manager.clipboard = text
    return manager.clipboard


def taken():
    """The text that a shortcut has copied since the last call; blank if none."""
    text = clipboard()
    if text.strip():
        clipboard(" ")
    return text


def see(code):
    """The value of an expression, for a check that needs no function of its own."""
    return eval(code, globals())


def state():
    """The state of Blender for checks: the current frame, the types of the areas, the last
    operator.

    If there is a face, also its sliders that are not 0, its layers, whether it has an action, its
    look and heat map, and the mode of its control armature.
    """
    found = rig()
    operators = bpy.context.window_manager.operators
    out = {
        "face": found is not None,
        "frame": bpy.context.scene.frame_current,
        "areas": sorted(a.type for a in window().screen.areas),
        "last": operators[-1].bl_idname if operators else "",
        "dragged": getattr(operators[-1], "vertex", -1) if operators else -1,
    }
    if found is None:
        return out
    controls = found["risorius_controls"]
    action = controls.animation_data.action if controls.animation_data else None
    return out | {
        "sliders": {k: float(v) for k, v in face().items() if isinstance(v, int | float) and v},
        "layers": [y.name for y in controls.risorius_layers if not y.removed],
        "keyed": action is not None,
        "look": found.get("risorius_look", ""),
        "heat": found.get("risorius_heat", ""),
        "mode": controls.mode,
        "keys": sorted(controls.keys()),
    }


def head():
    """The visible mesh that has the most vertices of all meshes of the face."""
    shown = [o for o in bpy.data.objects if o.get("risorius_rig") and o.type == "MESH"]
    shown = [o for o in shown if "dna_mesh" in o and o.visible_get()]
    return max(shown, key=lambda o: len(o.data.vertices))


def points():
    """float64[V, 3]: the evaluated vertices of the head in world space."""
    seen = head().evaluated_get(bpy.context.evaluated_depsgraph_get())
    flat = np.empty(len(seen.data.vertices) * 3, np.float32)
    seen.data.vertices.foreach_get("co", flat)
    world = np.array(seen.matrix_world)
    return flat.reshape(-1, 3).astype(float) @ world[:3, :3].T + world[:3, 3]


def on_screen(place):
    """The pixel on the screen of a point in world space; None if it is behind the viewer."""
    area, drawing, _sidebar = view()
    at = view3d_utils.location_3d_to_region_2d(drawing, area.spaces.active.region_3d, place)
    if at is None:
        return None
    left, top, _width, height = rectangle(drawing)
    return [left + at.x, top + height - at.y]


def face_box():
    """The bounds of the head on the screen: left, top, right, bottom in pixels."""
    spots = np.array([on_screen(p) for p in points()[::7]])
    return [*spots.min(axis=0), *spots.max(axis=0)]


def moved_by(control):
    """The vertex that a control moves most, and its place on the screen."""
    live = module("scene.character.runtime").of(rig())
    rests = np.array(live.rests, np.float32)
    raised = rests.copy()
    raised[live.labels.index(control)] = 1.0
    poses = [live.rig.evaluate(raw) for raw in (raised, rests)]
    pairs = [(p.joints, p.blend_shapes) for p in poses]
    far = module("scene.see_why.displacement").distances(live, int(head()["dna_mesh"]), *pairs)
    vertex = int(np.argmax(far))
    return {"vertex": vertex, "at": on_screen(points()[vertex])}


def vertex_at(vertex):
    """The place of a vertex of the head in world space and on the screen."""
    place = points()[vertex]
    return {"world": place.tolist(), "at": on_screen(place)}


def seen_in_front(vertex):
    """The place of a vertex on the screen, in the view that shows the face best from the front.

    Args:
        vertex: index of a vertex of the head.
    """
    area, _drawing, _sidebar = view()
    regions = [r for r in area.regions if r.type == "WINDOW" and r.data is not None]
    region = max(regions, key=lambda r: -r.data.view_matrix.inverted().col[2].y)
    at = view3d_utils.location_3d_to_region_2d(region, region.data, points()[vertex])
    left, top, _width, height = rectangle(region)
    return [left + at.x, top + height - at.y]


def drags():
    """Whether the tool that drags the face is active."""
    return module("ui.drag.tool").is_active(bpy.context)


def two_handles():
    """The lowest handle, and the handle nearest to it that is more than 20 pixels away.

    Returns mesh and vertex ("point") and the place on the screen ("at") of each.
    """
    one, live = rig(), module("scene.character.runtime").of(rig())
    found = module("scene.drag.picking").handles_of(bpy.context, one, live)
    found = [f for f in found if on_screen(f[1]) is not None]
    found.sort(key=lambda f: f[1][2])
    low = found[0]
    apart = lambda f: np.linalg.norm(np.subtract(on_screen(f[1]), on_screen(low[1])))  # noqa: E731
    high = min((f for f in found[1:] if apart(f) > 20), key=apart)
    return [{"point": list(point), "at": on_screen(place)} for point, place in (low, high)]


def kept(key):
    """The list in the control armature's custom property `key`; empty if it is missing."""
    return list(rig()["risorius_controls"].get(key, ()))


def bone_at(bone):
    """The place of the middle of a control bone on the screen."""
    return on_screen(bone_in_world(bone))


def outline_at(bone):
    """The rightmost point of a control bone's outline inside the view, on the screen."""
    one = rig()["risorius_controls"].pose.bones[bone]
    size = one.bone.length if one.use_custom_shape_bone_size else 1.0
    turn = one.custom_shape_translation, one.custom_shape_rotation_euler.to_quaternion()
    held = Matrix.LocRotScale(*turn, one.custom_shape_scale_xyz * size)
    shown = one.custom_shape_transform or one
    world = rig()["risorius_controls"].matrix_world @ shown.matrix @ held
    spots = [on_screen(world @ v.co) for v in one.custom_shape.data.vertices]
    left, top, width, height = rectangle(view()[1])
    middle = np.array((left + width / 2, top + height / 2))
    inside = [s for s in spots if s and np.abs(np.array(s) - middle).max() < min(width, height) / 2]
    return max(inside, key=lambda s: s[0])


def bones():
    return [b.name for b in rig()["risorius_controls"].pose.bones]


def active_bone():
    """The name of the active pose bone, or ""."""
    bone = bpy.context.active_pose_bone
    return bone.name if bone else ""


def is_modal():
    """Whether a modal operator is running."""
    return len(window().modal_operators) > 0


def board_in_view(names):
    """Whether the face and all named control bones are inside the view."""
    left, top, width, height = rectangle(view()[1])
    spots = [on_screen(bone_in_world(n)) for n in names] + [face_box()[:2], face_box()[2:]]
    inside = [s and left <= s[0] <= left + width and top <= s[1] <= top + height for s in spots]
    return all(inside)


def least_travel(names):
    """The smallest travel of these handles from neutral to the farther end of an axis, pixels."""
    controls, found = rig()["risorius_controls"], []
    for bone in (controls.pose.bones[n] for n in names):
        limit = next((c for c in bone.constraints if c.type == "LIMIT_LOCATION"), None)
        if limit is None:
            continue
        board = bone.parent  # the scale of the board also applies to its handles
        held = board.matrix @ board.bone.matrix_local.inverted() if board else Matrix()
        rest = controls.matrix_world @ held @ bone.bone.matrix_local
        start = np.array(on_screen(rest.translation))
        for axis in "xyz":
            ends = [getattr(limit, f"{end}_{axis}") for end in ("min", "max")]
            ways = [Vector([e if a == axis else 0.0 for a in "xyz"]) for e in ends if abs(e) > 1e-9]
            if ways:
                found.append(max(np.linalg.norm(on_screen(rest @ w) - start) for w in ways))
    return float(min(found))


def bone_in_world(name):
    """The middle of a control bone in world space."""
    controls = rig()["risorius_controls"]
    bone = controls.pose.bones[name]
    return controls.matrix_world @ ((bone.head + bone.tail) / 2)


def board_leads():
    """Whether the face board, and not the sliders, sets the controls of the face."""
    return bool(module("scene.character.board").leads_face(rig()))


def browser_region(kind):
    """The rectangle of a region of the file browser. Args: kind  type of the region."""
    area = next(a for a in window().screen.areas if a.type == "FILE_BROWSER")
    return rectangle(next(r for r in area.regions if r.type == kind))


def timeline():
    """The drawing region of the timeline."""
    area = next(a for a in window().screen.areas if a.type == "DOPESHEET_EDITOR")
    return next(r for r in area.regions if r.type == "WINDOW")


def timeline_at(frame):
    """The place of a frame in the timeline's ruler, on the screen."""
    region = timeline()
    x, _y = region.view2d.view_to_region(frame, 0, clip=False)
    left, top, _width, _height = rectangle(region)
    return [left + x, top + 10]


def timeline_header():
    """Left, top, width and height of the timeline's header, and the scene's last frame."""
    area = next(a for a in window().screen.areas if a.type == "DOPESHEET_EDITOR")
    region = next(r for r in area.regions if r.type == "HEADER")
    return [*rectangle(region), bpy.context.scene.frame_end]


def keyed_frames_of_active():
    """keyed_frames() of the face whose control armature is the active object."""
    return keyed_frames(bpy.context.view_layer.objects.active)


def keyed_frames(controls=None):
    """Frames at which a face's action has keyframes.

    Args:
        controls: control armature; None takes the first face.
    """
    data = (controls or rig()["risorius_controls"]).animation_data
    curves = module("scene.base.compat").curves_of(data.action) if data and data.action else []
    return sorted({round(p.co.x) for c in curves for p in c.keyframe_points})


def seen_keys(editor="DOPESHEET_EDITOR"):
    """Frames of the keyframes that the timeline, or another editor in its place, shows."""
    area = next(a for a in window().screen.areas if a.type == editor)
    region = next(r for r in area.regions if r.type == "WINDOW")
    with over(area, region):
        curves = list(bpy.context.visible_fcurves or ())
    return sorted({round(p.co.x) for c in curves for p in c.keyframe_points})


def curves_below():
    """(data path, array index, [[frame, value], ...]) of each F-curve of the face's action."""
    data = rig()["risorius_controls"].animation_data
    curves = module("scene.base.compat").curves_of(data.action) if data and data.action else []
    keys = [(c.data_path, c.array_index, [list(p.co) for p in c.keyframe_points]) for c in curves]
    return sorted(keys)


def curves_of_empty():
    """The F-curves of the Empty "Look Here", which the eyes follow."""
    action = bpy.data.objects["Look Here"].animation_data.action
    return list(module("scene.base.compat").curves_of(action))


def tweaks():
    """Whether a tweak of the face's animation is active."""
    return module("scene.animation.tweaks").of(rig()["risorius_controls"]) is not None


def given_by_board(control):
    """The value to which the face board sets a raw control; 0 if the board does not drive it."""
    return float(module("scene.character.board").given(rig()).get(control, 0.0))


def pictures_drawn(expression):
    """Whether the picture of an expression has been drawn."""
    previews = module("ui.expressions.previews")
    items, _troubles = module("scene.expressions.library").all_items(
        module("scene.expressions.library").folder(bpy.context)
    )
    jobs = previews.jobs_of(rig(), [items[expression]])
    return all(previews.icon_of(job.path) for job in jobs)


def has(operator):
    """Whether an operator exists. Args: operator  for example "risorius.key"."""
    group, _, name = operator.partition(".")
    return name in dir(getattr(bpy.ops, group))


def found_causes():
    """The last result of See Why: the vertex and its first cause; None without a result."""
    found = module("scene.see_why.causes").last(rig())
    return None if found is None else {"vertex": found.vertex, "first": found.causes[0].name}


def settle():
    """Set the 3D view to the orthographic front view, and hide the floor."""
    area, drawing, _sidebar = view()
    with over(area, drawing):
        bpy.ops.view3d.view_axis(type="FRONT")
    area.spaces.active.region_3d.view_perspective = "ORTHO"
    area.spaces.active.overlay.show_floor = False
    return True


def center(zoom=1.0):
    """Centre the face in the view so that it fills the height. Args: zoom  magnification."""
    area, _drawing, _sidebar = view()
    spots = points()
    eye = area.spaces.active.region_3d
    eye.view_location = (spots.min(axis=0) + spots.max(axis=0)) / 2
    eye.view_distance = float(np.ptp(spots[:, 2])) * 1.9 / zoom
    return True


def watch(panel):
    """Start to count the draw calls of a panel or menu. Blender draws only open ones.

    Args:
        panel: class name.
    """
    kind = getattr(bpy.types, panel)
    draw = kind.draw

    def counted(self, context):
        _drawn[panel] = _drawn.get(panel, 0) + 1
        draw(self, context)

    if panel not in _watched:
        _watched.add(panel)
        kind.draw = counted
    return True


def draw_again(panel):
    """Request a redraw of the sidebar, which happens before the next answer. Resets the count."""
    _drawn[panel] = 0
    _area, _drawing, sidebar = view()
    sidebar.tag_redraw()
    return True


def drawn(panel):
    """Whether a panel or menu was drawn since draw_again()."""
    return _drawn[panel] > 0


def redraw():
    """Request a redraw of the main regions, which happens before the next answer.

    The sidebar is left out, because Blender 4.3 would close open menus.
    """
    for area in window().screen.areas:
        for region in area.regions:
            if region.type == "WINDOW":
                region.tag_redraw()
    return True


def run(code):
    """Run Python code that prepares the scene."""
    exec(code, dict(globals()))  # names of one run must not replace functions of this file
    return True


def leave():
    """End Blender without the question about unsaved changes."""
    sys.stdout.flush()
    os._exit(0)


def answer():
    """Answer all requests of drive.py. Returns the seconds until Blender's timer calls again."""
    while True:
        path = TALK / f"ask-{_next[0]}.json"
        if not path.exists():
            return 0.005
        given = json.loads(path.read_text(encoding="utf-8"))
        try:
            reply = {"value": globals()[given["name"]](**given["arguments"])}
        except Exception:  # noqa: BLE001  the driver prints it
            reply = {"error": traceback.format_exc()}
        done = TALK / f"answer-{_next[0]}.json"
        part = done.with_suffix(".part")
        part.write_text(json.dumps(reply), encoding="utf-8")
        part.rename(done)
        _next[0] += 1


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(answer, first_interval=0.5, persistent=True)
