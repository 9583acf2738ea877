# SPDX-License-Identifier: MIT
"""Tests the tool that drags the skin with a real pointer: in all views, with pins and handles."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from common import REST, SMILE, Check, clear, look_at_face, put_down, ready_tab, take_up
from hand import HEIGHT, WIDTH, Hand, difference

Place = tuple[float, float]


def drag_skin(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Drag the corner of the mouth; test Esc, undo, dragging a single control, pins and handles."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    take_up(hand)
    hand.ask("run", code=HANDLES.format(False))  # because a press near a handle takes the handle
    corner = hand.ask("moved_by", control=SMILE[0])
    start = corner["at"]
    end = (start[0] + 14, start[1] - 12)
    vertex, beside = _pressed(hand, start)

    def apart() -> float:
        at = hand.ask("vertex_at", vertex=vertex)["at"]
        return max(abs(a - b - c) for a, b, c in zip(at, end, beside, strict=True))

    yield f"a press takes the vertex that is under it ({beside})", max(map(abs, beside)) <= 4
    hand.begin_drag(start)
    hand.go(start, end)
    hand.picture("skin-dragged")
    yield f"the vertex is within 2 pixels of the pointer ({apart():.1f})", apart() <= 2
    hand.key("Escape")
    hand.do("mouseup", 1)
    sliders = hand.ask("state")["sliders"]
    yield "Esc while it is dragged gives all sliders back what they had", sliders == {}
    hand.move(*start)
    hand.drag(start, end)
    sliders = hand.ask("state")["sliders"]
    yield f"let go it stays within 2 pixels ({apart():.1f})", apart() <= 2 and len(sliders) > 0
    yield "and the last operator was one drag", hand.ask("state")["last"] == "RISORIUS_OT_drag"
    hand.do("keydown", "ctrl")
    hand.begin_drag(end)
    hand.go(end, (end[0], end[1] + 25))
    hand.picture("skin-one-slider")
    hand.key("Escape")
    hand.do("mouseup", 1)
    hand.do("keyup", "ctrl")
    yield "one slider by Ctrl, and Esc: as before", hand.ask("state")["sliders"] == sliders
    hand.move(WIDTH * 0.3, HEIGHT * 0.5)
    hand.key("ctrl+z")
    hand.wait("undone", lambda: hand.ask("state")["sliders"] == {})
    yield "Ctrl-Z takes the drag back, the tool stays", hand.ask("drags")
    hand.do("keydown", "shift")
    hand.click(*start)
    hand.do("keyup", "shift")
    yield "Shift and click pins", "risorius_pins" in hand.ask("state")["keys"]
    hand.picture("skin-pin")
    hand.ask("run", code="bpy.ops.risorius.clear_pins()")
    yield from handles(hand)
    yield from _end(hand, start, end)


def handles(hand: Hand) -> Iterator[Check]:
    """Test handles: select by clicks, drag together, keyframe by I, hide by H, show by Alt-H."""
    hand.ask("run", code=HANDLES.format(True))
    selected = "risorius_handles_selected"
    low, high = hand.ask("two_handles")
    hand.click(*low["at"])
    yield "a click selects a handle", hand.ask("kept", key=selected) == low["point"]
    hand.do("keydown", "shift")
    hand.click(*high["at"])
    hand.do("keyup", "shift")
    both = low["point"] + high["point"]
    yield "Shift and click another beside it", hand.ask("kept", key=selected) == both
    start = low["at"]
    hand.drag(start, (start[0], start[1] - 4))
    moved = [hand.ask("vertex_at", vertex=one["point"][1])["at"][1] for one in (low, high)]
    ways = [one["at"][1] - y for one, y in zip((low, high), moved, strict=True)]
    told = f"both go with the one that is dragged ({ways[0]:.1f}, {ways[1]:.1f} of 4 pixels)"
    yield told, min(ways) > 1
    hand.picture("skin-handles")
    hand.move(WIDTH * 0.3, HEIGHT * 0.5)
    hand.key("i")
    yield "I keys what moves them", hand.ask("keyed_frames") == [1]
    hand.key("h")
    hidden = hand.ask("kept", key="risorius_handles_hidden")
    yield "H hides them", sorted(hidden) == sorted(both)
    hand.key("alt+h")
    yield "Alt-H shows them", hand.ask("kept", key="risorius_handles_hidden") == []
    hand.ask("run", code="bpy.ops.risorius.select_handle(vertex=-1)")
    clear(hand)


def _end(hand: Hand, start: Place, end: Place) -> Iterator[Check]:
    """Deactivate the tool, and check that its handles are hidden and the skin cannot be dragged."""
    before = hand.still()
    put_down(hand)
    box = hand.ask("face_box")
    hand.move(WIDTH * 0.3, HEIGHT * 0.7)
    after = hand.still()
    yield "put down, its handles are drawn no more", difference(before, after, box) > 0.0005
    hand.drag(start, end)
    yield "and a press on the skin is no drag any more", hand.ask("state")["sliders"] == {}
    hand.ask("run", code=SELECT)


HANDLES = "bpy.context.window_manager.risorius_drag.handles = {}"
SELECT = """
for one in bpy.context.selected_objects:
    one.select_set(False)
bpy.context.view_layer.objects.active = rig()["risorius_controls"]
"""


def _pressed(hand: Hand, start: Place) -> tuple[int, Place]:
    """The vertex that a press of the mouse button grabs, and its offset from the pointer in pixels.

    Drags once to find the vertex, and undoes the drag.
    """
    hand.move(*start)
    hand.drag(start, (start[0] + 6, start[1] - 6))
    vertex = hand.ask("state")["dragged"]
    hand.move(WIDTH * 0.3, HEIGHT * 0.5)
    hand.key("ctrl+z")
    hand.wait("undone", lambda: hand.ask("state")["sliders"] == {})
    at = hand.ask("vertex_at", vertex=vertex)["at"]
    return vertex, (round(at[0] - start[0], 1), round(at[1] - start[1], 1))


def drag_in_views(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Drag the skin of a turned head: in perspective, through a camera, and in a quad view."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    vertex = hand.ask("moved_by", control=SMILE[0])["vertex"]
    take_up(hand)
    hand.ask("run", code=HANDLES.format(False))
    for name, code in VIEWS.items():
        hand.ask("run", code=code)
        hand.still()
        start = hand.ask("seen_in_front", vertex=vertex)
        end = (start[0] + 9, start[1] - 8)
        hand.move(*start)
        hand.drag(start, end)
        state = hand.ask("state")
        # If the head is small in the view, a pixel covers millimetres, so the press may grab a
        # neighbour of `vertex`. The pointer is compared with the vertex that the press grabbed.
        at = hand.ask("seen_in_front", vertex=state["dragged"])
        moved = len(state["sliders"]) > 0
        hand.picture("skin-" + name.replace(" ", "-"))
        hand.ask("run", code=STILL)
        was = hand.ask("seen_in_front", vertex=state["dragged"])
        near = max(abs(a - b) for a, b in zip(was, start, strict=True))
        apart = max(abs(a - b - c + d) for a, b, c, d in zip(at, was, end, start, strict=True))
        told = f"{name}: within 2 pixels of the pointer ({apart:.1f}; pressed {near:.1f} away)"
        yield told, apart <= 2 and near <= 4 and moved
        hand.ask("run", code=REST)
    hand.ask("run", code=HANDLES.format(True))
    hand.ask("run", code=ONE_VIEW)
    put_down(hand)


STILL = """
sliders_bone = rig()["risorius_controls"].pose.bones["face"]
for name, value in list(sliders_bone.items()):
    if isinstance(value, float) and value and name.startswith("CTRL_"):
        sliders_bone[name] = 0.0
sliders_bone.id_data.update_tag()
bpy.context.view_layer.update()
"""
VIEWS = {
    "a turned head in perspective": """
bone = rig()["risorius_controls"].pose.bones["head"]
bone.rotation_mode = "XYZ"
bone.rotation_euler = (0.2, -0.3, -0.4)
bpy.context.view_layer.update()
eye = view()[0].spaces.active.region_3d
eye.view_perspective = "PERSP"
""",
    "through a camera": """
eye, camera = view()[0].spaces.active.region_3d, bpy.context.scene.camera
spots = points()
camera.location = (spots.min(axis=0) + spots.max(axis=0)) / 2 + np.array((0.0, -1.2, 0.0))
camera.rotation_euler = (np.pi / 2, 0.0, 0.0)
bpy.context.view_layer.update()
eye.view_perspective = "CAMERA"
""",
    "one of four views": """
eye = view()[0].spaces.active.region_3d
eye.view_perspective = "PERSP"
with over(*view()[:2]):
    bpy.ops.screen.region_quadview()
spots = points()
for one in view()[0].spaces.active.region_quadviews:
    one.view_location = (spots.min(axis=0) + spots.max(axis=0)) / 2
    one.view_distance = float(np.ptp(spots[:, 2])) * 1.9
""",
}
ONE_VIEW = """
with over(*view()[:2]):
    bpy.ops.screen.region_quadview()
"""
