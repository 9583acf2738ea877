# SPDX-License-Identifier: GPL-3.0-or-later
"""Dragging the face: a vertex follows the drag within the limits of the sliders."""

import bpy
import numpy as np
import pytest
import risorius
from mathutils import Quaternion, Vector
from support import oracle, scene

HEAD = 0  # number of the head's mesh in the small face
VERTEX = 70
PREFIX = "CTRL_expressions."
POSE = {"jawOpen": 0.4, "mouthCornerPullL": 0.3}


@pytest.fixture
def rig(dna_file):
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.controls(rig)
    return rig


@pytest.fixture
def man():
    """The sample man, and the index of the head vertex that mouthCornerPullL moves most."""
    bpy.ops.risorius.add_character()
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    scene.set_controls(rig, mouthCornerPullL=1.0)
    head = scene.meshes(rig)[HEAD]
    far = np.linalg.norm(scene.evaluated(head) - rest_of(head), axis=1)
    scene.set_controls(rig, mouthCornerPullL=0.0)
    return rig, int(np.argmax(far))


def rest_of(head):
    flat = np.empty(3 * len(head.data.vertices), np.float32)
    head.data.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3).astype(np.float64)


def place(rig, vertex=VERTEX, mesh=HEAD):
    """The place at which Blender shows a vertex of a mesh, float64[3] in metres."""
    return scene.evaluated(scene.meshes(rig)[mesh])[vertex]


def sliders(rig):
    return {k: v for k, v in scene.face(rig).items() if isinstance(v, float)}


def drag(offset, vertex=VERTEX, **options):
    return bpy.ops.risorius.drag(
        mesh=HEAD, vertex=vertex, offset=list(map(float, offset)), **options
    )


def reach(rig, path, vertex=VERTEX, values=POSE):
    """The displacement of a head vertex if the sliders in `values` change, float64[3] in metres.

    The other sliders keep their present values. The oracle computes the displacement from the DNA
    file `path`.
    """
    dna = risorius.load(str(path))
    raw = scene.raw_of(rig, path)
    was = oracle.vertices(dna, HEAD, risorius.Rig(dna).evaluate(raw))[vertex]
    for name, value in values.items():
        raw[list(dna.raw_control_names).index(PREFIX + name)] = value
    return oracle.vertices(dna, HEAD, risorius.Rig(dna).evaluate(raw))[vertex] - was


def follows(rig, was, offset, share=0.01, vertex=VERTEX):
    return np.linalg.norm(place(rig, vertex) - was - offset) < share * np.linalg.norm(offset)


def test_a_point_goes_where_it_is_dragged(rig, dna_file):
    offset, was = reach(rig, dna_file), place(rig)
    assert np.linalg.norm(offset) > 1e-3
    moved = {}
    for method, share in (("NEAR", 0.05), ("LEAST_SQUARES", 0.01)):
        bpy.ops.risorius.reset()
        assert drag(offset, method=method) == {"FINISHED"}
        assert follows(rig, was, offset, share)
        moved[method] = [name for name, value in sliders(rig).items() if value]
    assert len(moved["NEAR"]) <= 3 < len(moved["LEAST_SQUARES"])
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_of_what_is_out_of_reach_the_sliders_stay_within_limits(rig, dna_file):
    assert drag(40 * reach(rig, dna_file)) == {"FINISHED"}
    values = np.array(list(sliders(rig).values()))
    assert values.min() >= 0.0
    assert values.max() == 1.0


@pytest.mark.parametrize(("start", "wanted"), [(1.4, 1.2), (-0.4, -0.2)])
def test_a_slider_beyond_its_limit_makes_no_jump(rig, dna_file, start, wanted):
    scene.set_controls(rig, jawOpen=wanted)
    goal = place(rig)
    scene.set_controls(rig, jawOpen=start)
    was = place(rig)
    assert drag(goal - was) == {"FINISHED"}
    assert follows(rig, was, goal - was)
    low, high = sorted((start, wanted))
    assert low <= scene.face(rig)[PREFIX + "jawOpen"] <= high


def test_a_turned_head_on_a_moved_face_drags_right(rig, dna_file):
    controls, offset = scene.controls(rig), reach(rig, dna_file)
    controls.matrix_world = Quaternion((0.3, 0.5, -0.2, 0.7)).to_matrix().to_4x4() * 2.0
    controls.location = (3.0, -2.0, 1.0)
    for bone, turn in (("head", (0.8, 0.1, 0.5, -0.2)), ("neck", (0.9, 0.3, -0.2, 0.1))):
        controls.pose.bones[bone].rotation_mode = "QUATERNION"
        controls.pose.bones[bone].rotation_quaternion = Quaternion(turn).normalized()
    scene.update(controls)
    scene.update(rig)
    was = place(rig)
    scene.set_controls(rig, **POSE)
    offset = place(rig) - was  # the same pose on the rotated head
    scene.set_controls(rig, **dict.fromkeys(POSE, 0.0))
    assert follows(rig, was, np.zeros(3) + 1e-9, share=1e3)
    assert drag(offset, method="LEAST_SQUARES") == {"FINISHED"}
    assert follows(rig, was, offset)


def test_along_the_view_the_depth_is_free(rig, dna_file):
    offset, was, view = reach(rig, dna_file), place(rig), np.array([0.3, -0.8, 0.2])
    view /= np.linalg.norm(view)
    assert drag(offset + 0.5 * view, view=view.tolist()) == {"FINISHED"}
    left = place(rig) - was - offset
    assert np.linalg.norm(left - view * (left @ view)) < 0.01 * np.linalg.norm(offset)


def test_one_slider_alone(rig, dna_file):
    offset = reach(rig, dna_file, values={"jawOpen": 0.5})
    was = place(rig)
    assert drag(offset, single=True) == {"FINISHED"}
    moved = {k: v for k, v in sliders(rig).items() if v}
    assert list(moved) == [PREFIX + "jawOpen"]
    assert moved[PREFIX + "jawOpen"] == pytest.approx(0.5, abs=0.01)
    assert follows(rig, was, offset, 0.03)
    bpy.ops.risorius.reset()
    assert drag(offset, single=True, choice=1) == {"FINISHED"}
    other = {k for k, v in sliders(rig).items() if v}
    assert len(other) == 1
    assert PREFIX + "jawOpen" not in other


@pytest.mark.parametrize("linked", [False, True])
def test_the_other_side_goes_the_mirrored_way(man, linked):
    rig, corner = man
    rest = rest_of(scene.meshes(rig)[HEAD])
    flip = np.array((-1.0, 1.0, 1.0))
    other = int(np.argmin(np.linalg.norm(rest - rest[corner] * flip, axis=1)))
    if linked:
        bpy.ops.risorius.link_sides(enable=True, from_left=False)
    offset = np.array((0.004, 0.0, 0.006))
    assert drag(offset, vertex=corner, symmetric=not linked) == {"FINISHED"}
    bpy.context.view_layer.update()
    assert follows(rig, rest[corner], offset, 0.05, vertex=corner)
    assert follows(rig, rest[other], offset * flip, 0.1, vertex=other)


def test_gently_the_point_comes_nearer(rig, dna_file):
    offset, was = reach(rig, dna_file), place(rig)
    assert drag(offset, method="TRANSPOSE") == {"FINISHED"}
    assert follows(rig, was, offset, 0.6)


def test_handles_lie_apart_on_both_sides(man):
    rig, _corner = man
    picking = scene.submodule("scene.drag.picking")
    live = scene.submodule("scene.character.runtime").of(rig)
    found = picking.handles_of(bpy.context, rig, live)
    places = np.array([place for _, place in found])
    assert 12 <= len(found) <= 20
    assert {mesh for (mesh, _), _ in found} == {HEAD}
    gaps = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(len(places))
    assert gaps.min() > 0.003
    assert min((places[:, 0] > 0.01).sum(), (places[:, 0] < -0.01).sum()) >= 4


def two_handles(rig):
    """The two handles that mouthCornerPullL and mouthCornerPullR move most, each (mesh, vertex)."""
    rest = {point: place(rig, point[1], point[0]) for point in offered(rig)}

    def most(name):
        scene.set_controls(rig, **{name: 1.0})
        moved = {p: np.linalg.norm(place(rig, p[1], p[0]) - at) for p, at in rest.items()}
        scene.set_controls(rig, **{name: 0.0})
        return max(moved, key=moved.get)

    left, right = most("mouthCornerPullL"), most("mouthCornerPullR")
    assert left != right
    return left, right


def offered(rig):
    picking = scene.submodule("scene.drag.picking")
    live = scene.submodule("scene.character.runtime").of(rig)
    return [point for point, _ in picking.handles_of(bpy.context, rig, live)]


def test_selected_handles_go_together(man):
    rig, _corner = man
    one, other = two_handles(rig)
    offset = np.array((0.0, 0.0, 0.001))
    starts = [place(rig, vertex, mesh) for mesh, vertex in (one, other)]

    def share(number, point):
        """The handle's motion along the drag, as a share of the drag.

        Args:
            number: index of the handle in `starts`.
            point: (mesh, vertex) of the handle.
        """
        way = place(rig, point[1], point[0]) - starts[number]
        return way @ offset / (offset @ offset)

    drag(offset, vertex=one[1])
    alone = share(1, other)
    bpy.ops.risorius.reset()
    for point in (one, other):
        done = bpy.ops.risorius.select_handle(mesh=point[0], vertex=point[1], extend=True)
        assert done == {"FINISHED"}
    assert drag(offset, vertex=one[1], with_selected=True) == {"FINISHED"}
    assert share(0, one) > 0.6
    assert share(1, other) > 0.6
    assert alone < 0.3


def test_handles_are_selected_hidden_and_shown_as_bones(man, tmp_path):
    rig, _corner = man
    one, other = two_handles(rig)
    all_of_them = offered(rig)
    for operator in (bpy.ops.risorius.hide_handles, bpy.ops.risorius.show_handles):
        assert not operator.poll()
    bpy.ops.risorius.select_handle(mesh=one[0], vertex=one[1])
    bpy.ops.risorius.select_handle(mesh=other[0], vertex=other[1], extend=True)
    assert list(scene.controls(rig)["risorius_handles_selected"]) == [*one, *other]
    bpy.ops.risorius.select_handle(mesh=one[0], vertex=one[1], extend=True)  # deselected again
    assert list(scene.controls(rig)["risorius_handles_selected"]) == [*other]
    assert bpy.ops.risorius.hide_handles() == {"FINISHED"}
    assert offered(rig) == [point for point in all_of_them if point != other]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "hidden.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "hidden.blend"))
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    assert other not in offered(rig)
    with pytest.raises(RuntimeError, match="no such handle"):
        bpy.ops.risorius.select_handle(mesh=other[0], vertex=other[1])
    assert bpy.ops.risorius.show_handles() == {"FINISHED"}
    assert offered(rig) == all_of_them
    assert list(scene.controls(rig)["risorius_handles_selected"]) == [*other]
    bpy.ops.risorius.select_handle(vertex=-1)  # a click beside the handles
    assert "risorius_handles_selected" not in scene.controls(rig)


@pytest.mark.parametrize("board", [False, True])
def test_keys_of_handles_lie_on_what_moves_them(man, board):
    rig, _corner = man
    one, _other = two_handles(rig)
    if board:
        scene.add_board()
    bpy.ops.risorius.select_handle(mesh=one[0], vertex=one[1])
    bpy.context.scene.frame_set(7)
    assert bpy.ops.risorius.key_handles() == {"FINISHED"}
    keyed = {c.data_path for c in scene.curves(scene.controls(rig))}
    assert keyed
    if board:
        assert all('"CTRL_' in path and path.endswith("location") for path in keyed)
        return
    start, controls = place(rig, one[1]), scene.controls(rig)
    far = {}
    for name in [n for n, v in scene.face(rig).items() if isinstance(v, float)]:
        scene.set_controls(rig, **{name.removeprefix(PREFIX): 1.0})
        far[name] = np.linalg.norm(place(rig, one[1]) - start)
        scene.set_controls(rig, **{name.removeprefix(PREFIX): 0.0})
    strongest = max(far, key=far.get)
    path = 'pose.bones["face"]["{}"]'.format
    assert path(strongest) in keyed
    assert not [n for n, way in far.items() if way < 1e-5 and path(n) in keyed]
    assert 2 <= len(keyed) < len(far) / 2
    assert {k.co.x for c in scene.curves(controls) for k in c.keyframe_points} == {7.0}


@pytest.mark.parametrize("mode", ["OBJECT", "POSE"])
def test_the_tool_is_taken_up_and_put_down(rig, mode):
    tool = scene.submodule("ui.drag.tool")
    bpy.ops.object.mode_set(mode=mode)
    assert not tool.is_active(bpy.context)
    assert bpy.ops.risorius.drag_tool() == {"FINISHED"}
    assert tool.is_active(bpy.context)
    tools = bpy.context.workspace.tools
    assert tools.from_space_view3d_mode(mode).idname == tool.IDNAME
    assert bpy.ops.risorius.drag_tool() == {"FINISHED"}
    assert not tool.is_active(bpy.context)
    for operator, _event, _properties in tool._KEYS:
        module, _, name = operator.partition(".")
        assert name in dir(getattr(bpy.ops, module))
    bpy.ops.risorius.drag_tool()  # so that the add-on is disabled after the test
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = scene.meshes(rig)[HEAD]
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.risorius.drag_tool.poll()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_only_sliders_of_the_region(rig, dna_file):
    assert drag(reach(rig, dna_file), region=True) == {"FINISHED"}
    of_slider = scene.submodule("native").regions().of_slider
    assert len({of_slider(k) for k, v in sliders(rig).items() if v}) == 1


def test_a_pin_holds_and_is_saved(rig, dna_file, tmp_path):
    held = 75
    offset, was = reach(rig, dna_file), place(rig, held)
    drag(offset, method="LEAST_SQUARES")
    loose = np.linalg.norm(place(rig, held) - was)
    bpy.ops.risorius.reset()
    assert bpy.ops.risorius.pin(mesh=HEAD, vertex=held) == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "pin.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "pin.blend"))
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    assert list(scene.controls(rig)["risorius_pins"]) == [HEAD, held]
    drag(offset)
    few = np.linalg.norm(place(rig, held) - was)
    bpy.ops.risorius.reset()
    drag(offset, method="LEAST_SQUARES")
    assert max(few, np.linalg.norm(place(rig, held) - was)) < 0.8 * loose
    assert bpy.ops.risorius.pin(mesh=HEAD, vertex=held + 3) == {"FINISHED"}
    assert list(scene.controls(rig)["risorius_pins"]) == [HEAD, held, HEAD, held + 3]
    assert bpy.ops.risorius.clear_pins.poll()
    for vertex in (held, held + 3):  # set and removed
        assert bpy.ops.risorius.pin(mesh=HEAD, vertex=vertex) == {"FINISHED"}
    assert "risorius_pins" not in scene.controls(rig)
    assert not bpy.ops.risorius.clear_pins.poll()  # disabled, because no pin is left


def test_keys_are_inserted_on_what_moved_if_auto_key_is_on(rig, dna_file):
    tools = bpy.context.scene.tool_settings
    drag(reach(rig, dna_file))
    assert scene.controls(rig).animation_data is None
    bpy.ops.risorius.reset()
    bpy.context.scene.frame_set(12)
    tools.use_keyframe_insert_auto = True
    drag(reach(rig, dna_file), single=True)
    tools.use_keyframe_insert_auto = False
    moved = {f'pose.bones["face"]["{k}"]' for k, v in sliders(rig).items() if v}
    keyed = {
        c.data_path: [k.co.x for k in c.keyframe_points] for c in scene.curves(scene.controls(rig))
    }
    assert keyed == {path: [12.0] for path in moved}


def test_through_layers_above_the_sliders_the_seen_point_follows(rig):
    bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy")
    scene.controls(rig).risorius_layers[0].weight = 0.5
    scene.update(scene.controls(rig))
    was = place(rig)
    scene.set_controls(rig, jawOpen=0.4, browDownL=0.3)
    offset = place(rig) - was
    scene.set_controls(rig, jawOpen=0.0, browDownL=0.0)
    assert drag(offset) == {"FINISHED"}
    assert follows(rig, was, offset, 0.03)


def test_sliders_with_drivers_stay(rig, dna_file):
    for name in sliders(rig):
        curve = scene.controls(rig).driver_add(f'pose.bones["face"]["{name}"]')
        curve.driver.type = "SUM"
    scene.update(scene.controls(rig))
    with pytest.raises(RuntimeError, match="led by drivers or layers"):
        drag(reach(rig, dna_file))


def test_modifiers_above_that_make_other_vertices(rig, dna_file):
    head = scene.meshes(rig)[HEAD]
    offset, was = reach(rig, dna_file), place(rig)
    head.modifiers.new("Smooth", "SUBSURF").levels = 1
    scene.update(head)
    assert drag(offset, method="LEAST_SQUARES") == {"FINISHED"}
    head.modifiers.remove(head.modifiers["Smooth"])
    scene.update(head)
    assert follows(rig, was, offset)


def test_what_lies_under_a_ray(rig):
    picking = scene.submodule("scene.drag.picking")
    head = scene.meshes(rig)[HEAD]
    for name in ("", "SUBSURF"):
        if name:
            head.modifiers.new("More", name).levels = 1
            scene.update(head)
        for vertex in (45, 70, 100):
            at = oracle_place(rig, vertex)
            toward = Vector((0.0, 1.0, 0.0))
            hit = picking.under(bpy.context, Vector(at) - toward, toward)
            assert hit.rig == rig
            assert hit.point == (HEAD, vertex)
            assert np.linalg.norm(hit.place - at) < 2e-4
    assert picking.under(bpy.context, Vector((0, 0, 50)), Vector((0, 0, 1))) is None


def oracle_place(rig, vertex):
    """Place of a head vertex while the face is at rest, float64[3] in metres."""
    data = scene.meshes(rig)[HEAD].data
    return np.array(data.vertices[vertex].co)


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda rig: bpy.ops.risorius.bake(), "is baked"),
        (lambda rig: hide(rig, scene.controls(rig), rig), "is hidden"),
        (lambda rig: rig.pop("risorius_dna"), "lost its controls or its DNA"),
    ],
)
def test_faces_that_cannot_be_dragged_say_why(rig, spoil, sentence):
    before = None
    spoil(rig)
    before = sliders(rig)
    with pytest.raises(RuntimeError, match=sentence):
        drag((0.0, 0.0, 0.01))
    assert sliders(rig) == before


def hide(rig, *items):
    for item in (*items, *scene.meshes(rig).values()):
        item.hide_viewport = True
    bpy.context.view_layer.update()


def test_points_that_nothing_moves_or_that_are_not_there(rig, dna_file):
    for values, sentence in (
        ({"mesh": 2, "vertex": 0}, "level of detail"),
        ({"mesh": HEAD, "vertex": 10**6}, "below 168 was expected"),
    ):
        with pytest.raises(RuntimeError, match=sentence):
            bpy.ops.risorius.drag(offset=(0, 0, 0.01), **values)


def test_restoring_gives_every_slider_its_bits_back(rig, dna_file):
    scene.set_controls(rig, jawOpen=0.1, mouthCornerPullL=0.7, browDownL=1.3)
    before, was = sliders(rig), scene.snapshot(rig)
    stroke = scene.submodule("scene.drag.stroke")
    held = stroke.begin(bpy.context, rig, (HEAD, VERTEX), stroke.Options(symmetric=True))
    for step in (0.3, 1.0, -4.0):
        held.to(bpy.context, held.start + step * reach(rig, dna_file))
    assert sliders(rig) != before
    held.restore(bpy.context)
    assert sliders(rig) == before
    assert np.array_equal(scene.snapshot(rig), was)


def test_a_drag_depends_on_its_end_and_not_on_its_way(rig, dna_file):
    stroke = scene.submodule("scene.drag.stroke")
    offset = reach(rig, dna_file)
    held = stroke.begin(bpy.context, rig, (HEAD, VERTEX), stroke.Options())
    for step in (-3.0, 9.0, 0.2):
        held.to(bpy.context, held.start + step * offset)
    held.finish(bpy.context, held.start + offset)
    winding = sliders(rig)
    bpy.ops.risorius.reset()
    drag(offset)
    straight = sliders(rig)
    assert winding == pytest.approx(straight, abs=1e-4)


def test_a_dragged_brow_turns_no_eye_and_both_sides_go_alike(man):
    """On the sample man, a dragged brow moves no look control.

    A symmetric drag gives the sliders of both sides equal values, although the two sides of the
    sample man's face differ.
    """
    rig, corner = man
    stroke = scene.submodule("scene.drag.stroke")
    rest = rest_of(scene.meshes(rig)[HEAD])
    scene.set_controls(rig, browDownL=1.0)
    far = np.linalg.norm(scene.evaluated(scene.meshes(rig)[HEAD]) - rest, axis=1)
    scene.set_controls(rig, browDownL=0.0)
    before = sliders(rig)  # the gaze is not at rest
    down = stroke.begin(bpy.context, rig, (HEAD, int(np.argmax(far))), stroke.Options())
    down.finish(bpy.context, down.start + np.array((0.0, 0.0, -0.004)), np.array((0.0, 1.0, 0.0)))
    after = {name: v - before[name] for name, v in sliders(rig).items() if v != before[name]}
    moved = {name.removeprefix(PREFIX): v for name, v in after.items()}
    assert moved["browDownL"] > 0.2
    assert not [name for name in moved if name.startswith("eyeLook")]
    bpy.ops.risorius.reset()
    pursed = stroke.begin(bpy.context, rig, (HEAD, corner), stroke.Options(symmetric=True))
    inward = np.array((-np.sign(rest[corner, 0]) * 0.004, 0.0, 0.0))
    pursed.finish(bpy.context, pursed.start + inward, np.array((0.0, 1.0, 0.0)))
    after = {name: v - before[name] for name, v in sliders(rig).items() if v != before[name]}
    moved = {name.removeprefix(PREFIX): v for name, v in after.items()}
    assert "mouthLeft" not in moved
    assert "mouthRight" not in moved
    assert 2 <= len(moved) <= 4  # one or two pairs
    mirrored = scene.submodule("native").regions().mirrored
    for name, value in moved.items():
        assert moved[mirrored(name)] == pytest.approx(value, abs=1e-6), name
