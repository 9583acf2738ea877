# SPDX-License-Identifier: GPL-3.0-or-later
"""See Why: solo and mute, causes of motion, heat maps, correctives; saved files have none of it."""

import bpy
import numpy as np
import pytest
import risorius
from support import oracle, scene
from support.layout import drawn

JAW, PULL, BROW = (
    "CTRL_expressions.jawOpen",
    "CTRL_expressions.mouthCornerPullL",
    "CTRL_expressions.browDownL",
)
CORRECTIVE = 11  # the control after the eleven raw ones: jaw times pull
HEAT = "risorius_heat"


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file)


def why(name):
    return scene.submodule(f"scene.see_why.{name}")


def raw_with(rig, path, **values):
    """The raw controls that the sliders give, with some other values, float32[R].

    Args:
        rig: the face.
        path: path of the DNA file.
        values: end of a raw control's name -> value instead of the slider's value.
    """
    raw = scene.raw_of(rig, path)
    names = risorius.load(str(path)).raw_control_names
    for end, value in values.items():
        raw[next(i for i, n in enumerate(names) if n.endswith(end))] = value
    return raw


def wanted(path, mesh, raw, without_corrective=False):
    """The vertices of a mesh by the oracle in mm, float64[V, 3].

    Args:
        path: path of the DNA file.
        mesh: index of the mesh.
        raw: values of the raw controls.
        without_corrective: True: without the effect of the corrective CORRECTIVE.
    """
    dna = risorius.load(str(path))
    pose = risorius.Rig(dna).evaluate(np.asarray(raw, np.float32))
    if without_corrective:
        value = float(pose.controls[CORRECTIVE])
        for group in dna.joint_groups:
            for column in np.flatnonzero(np.asarray(group.input_indices) == CORRECTIVE):
                given = np.asarray(group.values)[:, column] * value
                joints, fields = np.divmod(np.asarray(group.output_indices), 9)
                pose.joints[joints, fields] -= given
        table = dna.blend_shape_channels
        pose.blend_shapes[table.output_indices[table.input_indices == CORRECTIVE]] = 0.0
    return oracle.vertices(dna, mesh, pose) * 1000.0


def apart(one, other):
    return np.linalg.norm(one - other, axis=1)


def heat_of(rig):
    """Index of a mesh -> colours of its heat map, float32[V, 4]; without meshes that have none."""
    found = {}
    for index, item in scene.meshes(rig).items():
        layer = item.data.color_attributes.get(HEAT)
        if layer is not None:
            flat = np.empty(len(layer.data) * 4, np.float32)
            layer.data.foreach_get("color", flat)
            found[index] = flat.reshape(-1, 4)
    return found


def test_solo_shows_one_control_and_leaves_the_values(rig, dna_file, mode):
    bpy.ops.risorius.set_shape_mode(mode=mode)
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6)
    assert bpy.ops.risorius.solo(control=JAW) == {"FINISHED"}
    alone = raw_with(rig, dna_file, mouthCornerPullL=0.0)
    assert scene.error_against_oracle(rig, dna_file, alone) < scene.TOLERANCE
    assert scene.face(rig)[PULL] == pytest.approx(0.6)
    scene.set_controls(rig, jawOpen=0.4)  # solo control: the face follows it
    alone = raw_with(rig, dna_file, mouthCornerPullL=0.0)
    assert scene.error_against_oracle(rig, dna_file, alone) < scene.TOLERANCE
    text = drawn(bpy.types.RISORIUS_PT_character).text()
    assert "Solo: Jaw Open" in text
    bpy.ops.risorius.solo(control=PULL, extend=True)
    both = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, both) < scene.TOLERANCE
    bpy.ops.risorius.solo(control=JAW)
    assert bpy.ops.risorius.show_all() == {"FINISHED"}
    assert scene.error_against_oracle(rig, dna_file, both) < scene.TOLERANCE
    assert "Solo" not in drawn(bpy.types.RISORIUS_PT_character).text()


def test_solo_of_a_corrective_shows_its_factors(rig, dna_file):
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6, browDownL=1.0, mouthCornerPullR=1.0)
    assert bpy.ops.risorius.solo(corrective=CORRECTIVE) == {"FINISHED"}
    raw = raw_with(rig, dna_file, browDownL=0.0, mouthCornerPullR=0.0)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    assert list(rig["maps"]) == pytest.approx([0.7, 0.0])


def test_an_unknown_control_is_refused(rig):
    with pytest.raises(RuntimeError, match="has no control nobody"):
        bpy.ops.risorius.solo(control="nobody")
    assert "risorius_look" not in rig


@pytest.mark.parametrize("kind", ["JOINTS", "SHAPES", "MAPS"])
def test_muted_parts_rest(rig, dna_file, kind):
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6)
    bpy.ops.risorius.mute(kind=kind)
    dna = risorius.load(str(dna_file))
    pose = risorius.Rig(dna).evaluate(scene.raw_of(rig, dna_file))
    {"JOINTS": pose.joints, "SHAPES": pose.blend_shapes, "MAPS": pose.animated_maps}[kind][:] = 0
    for index, item in scene.meshes(rig).items():
        if 0 in list(item["dna_lods"]):
            shown = scene.evaluated(item)
            assert np.abs(shown - oracle.vertices(dna, index, pose)).max() < 2e-5
    assert list(rig["maps"]) == pytest.approx(pose.animated_maps.tolist())
    assert "Muted" in drawn(bpy.types.RISORIUS_PT_character).text()
    bpy.ops.risorius.mute(kind=kind, enable=False)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    assert "risorius_look" not in rig


def test_renders_show_the_whole_face_unless_asked(rig):
    masks = scene.submodule("scene.frame.look_masks")
    bpy.ops.risorius.solo(control=JAW)
    assert masks.for_frame(rig, True).is_whole
    assert masks.for_frame(rig, False).solo == {JAW}
    bpy.ops.risorius.mask_renders()
    assert masks.for_frame(rig, True).solo == {JAW}


def test_a_rendered_frame_is_whole_and_the_view_is_solo_again(rig, dna_file, tmp_path):
    evaluate = scene.submodule("scene.frame.evaluate")
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6)
    bpy.ops.risorius.solo(control=JAW)
    graph = bpy.context.evaluated_depsgraph_get()
    evaluate.evaluate(rig, graph, evaluate.Moment.RENDER)  # the evaluation of a rendered frame
    bpy.context.view_layer.update()
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    scene.submodule("scene.events.handlers")._render_ended()
    bpy.context.view_layer.update()
    alone = raw_with(rig, dna_file, mouthCornerPullL=0.0)
    assert scene.error_against_oracle(rig, dna_file, alone) < scene.TOLERANCE


def test_what_moves_a_vertex_agrees_with_the_oracle(rig, dna_file):
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6)
    raw = scene.raw_of(rig, dna_file)
    here = wanted(dna_file, 0, raw)
    vertex = int(np.argmax(apart(here, wanted(dna_file, 0, raw, without_corrective=True))))
    assert bpy.ops.risorius.why_vertex(mesh=0, vertex=vertex) == {"FINISHED"}
    found = why("causes").last(rig)
    neutral = wanted(dna_file, 0, np.zeros(len(raw)))
    assert found.moved == pytest.approx(apart(here, neutral)[vertex], abs=2e-3)
    by_name = {cause.name: cause for cause in found.causes}
    for end in ("jawOpen", "mouthCornerPullL"):
        rest = wanted(dna_file, 0, raw_with(rig, dna_file, **{end: 0.0}))
        full = wanted(dna_file, 0, raw_with(rig, dna_file, **{end: 1.0}))
        assert by_name[end].now == pytest.approx(apart(here, rest)[vertex], abs=2e-3)
        assert by_name[end].full == pytest.approx(apart(full, rest)[vertex], abs=2e-3)
    corrective = next(c for c in found.causes if not c.is_raw)
    without = wanted(dna_file, 0, raw, without_corrective=True)
    assert corrective.control == CORRECTIVE
    assert corrective.now == pytest.approx(apart(here, without)[vertex], abs=2e-3)
    assert corrective.value == pytest.approx(0.7 * 0.6)
    assert [c.now for c in found.causes] == sorted((c.now for c in found.causes), reverse=True)
    assert f"Vertex {vertex}" in drawn(bpy.types.RISORIUS_PT_why).text()


def test_the_selected_vertex_is_asked_for(rig):
    head = scene.meshes(rig)[0]
    bpy.context.view_layer.objects.active = head
    head.data.vertices.foreach_set("select", [i == 17 for i in range(len(head.data.vertices))])
    assert bpy.ops.risorius.why_vertex() == {"FINISHED"}
    assert (why("causes").last(rig).mesh, why("causes").last(rig).vertex) == (0, 17)
    with pytest.raises(RuntimeError, match="Select a vertex"):
        bpy.ops.risorius.why_vertex(mesh=0, vertex=10**6)


@pytest.mark.parametrize("kind", ["POSE", "CONTROL", "CORRECTIVE"])
def test_a_heat_map_has_the_distances_of_the_oracle(rig, dna_file, kind):
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6)
    raw = scene.raw_of(rig, dna_file)
    zero = np.zeros(len(raw))
    what = {"POSE": "", "CONTROL": PULL, "CORRECTIVE": str(CORRECTIVE)}[kind]
    assert bpy.ops.risorius.heat(kind=kind, what=what) == {"FINISHED"}
    far = {}
    for mesh in (0, 1):
        one, other = wanted(dna_file, mesh, raw), wanted(dna_file, mesh, zero)
        if kind == "CONTROL":
            one = wanted(dna_file, mesh, np.eye(len(raw))[1])
        elif kind == "CORRECTIVE":
            other = wanted(dna_file, mesh, raw, without_corrective=True)
        far[mesh] = apart(one, other)
    most = max(float(f.max()) for f in far.values())
    assert why("heat").of(rig).most == pytest.approx(most, rel=1e-3)
    shown = heat_of(rig)
    assert sorted(shown) == [0, 1]  # the meshes of the visible level
    ramp = scene.submodule("logic.base.heat_ramp")
    for mesh, colours in shown.items():
        expected = ramp.linear(ramp.colours(far[mesh] / most))
        assert np.abs(colours - expected).max() < 5e-3
    text = drawn(bpy.types.RISORIUS_PT_why).text()
    assert f"{why('heat').of(rig).most:.2f} mm" in text


def test_the_ramp_grows_brighter_from_end_to_end():
    ramp = scene.submodule("logic.base.heat_ramp")
    shades = ramp.linear(ramp.colours(np.linspace(0, 1, 50)))
    brightness = shades[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(brightness) > 0).all()


def test_colours_follow_the_pose(rig, dna_file):
    bpy.ops.risorius.heat(kind="POSE")
    assert bpy.app.timers.is_registered(why("heat")._look)
    assert why("heat").of(rig).most == 0.0
    scene.set_controls(rig, jawOpen=1.0)
    graph = bpy.context.evaluated_depsgraph_get()
    assert why("heat").refresh(rig, graph)
    assert not why("heat").refresh(rig, graph)
    raw = scene.raw_of(rig, dna_file)
    far = apart(wanted(dna_file, 0, raw), wanted(dna_file, 0, np.zeros(len(raw))))
    assert why("heat").of(rig).most >= float(far.max()) * 0.999


def test_what_a_layer_adds(rig, dna_file):
    bone = scene.face(rig)
    bone[JAW] = 0.6
    bone.keyframe_insert(f'["{JAW}"]', frame=1)
    bpy.ops.risorius.layer_add(kind="ACTION", source=scene.controls(rig).animation_data.action.name)
    scene.controls(rig).animation_data_clear()
    scene.controls(rig).risorius_layers[-1].blend = "ADD"
    scene.set_controls(rig, jawOpen=0.2, mouthCornerPullL=0.5)
    place = len(scene.controls(rig).risorius_layers) - 1
    assert bpy.ops.risorius.heat(kind="LAYER", what=str(place)) == {"FINISHED"}
    below = scene.raw_of(rig, dna_file)
    above = below.copy()
    above[0] += 0.6
    far = [apart(wanted(dna_file, m, above), wanted(dna_file, m, below)).max() for m in (0, 1)]
    assert why("heat").of(rig).most == pytest.approx(max(far), rel=1e-3)
    assert scene.error_against_oracle(rig, dna_file, above) < scene.TOLERANCE  # it still plays
    with pytest.raises(RuntimeError, match="plays nothing"):
        bpy.ops.risorius.heat(kind="LAYER", what="77")


def test_views_and_active_colours_come_back(rig):
    head = scene.meshes(rig)[0].data
    own = head.color_attributes.new("mine", "BYTE_COLOR", "CORNER")
    head.color_attributes.active_color_name = own.name
    views = [s for w in bpy.data.screens for a in w.areas for s in a.spaces if s.type == "VIEW_3D"]
    before = [(v.shading.type, v.shading.color_type, v.shading.light) for v in views]
    bpy.ops.risorius.heat(kind="CONTROL", what=JAW)
    assert head.color_attributes.active_color_name == HEAT
    assert all(v.shading.color_type == "VERTEX" for v in views)
    materials = [list(m.data.materials) for m in scene.meshes(rig).values()]
    bpy.ops.risorius.heat(kind="OFF")
    assert head.color_attributes.active_color_name == "mine"
    assert [(v.shading.type, v.shading.color_type, v.shading.light) for v in views] == before
    assert heat_of(rig) == {}
    assert [list(m.data.materials) for m in scene.meshes(rig).values()] == materials
    assert not any(HEAT + "_before" in m.data for m in scene.meshes(rig).values())


def test_a_file_has_none_of_it_and_the_session_goes_on(rig, dna_file, tmp_path):
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6)
    bpy.ops.risorius.solo(control=JAW)
    bpy.ops.risorius.heat(kind="POSE")
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert why("heat").of(rig) is not None
    bpy.context.view_layer.update()
    alone = raw_with(rig, dna_file, mouthCornerPullL=0.0)
    assert scene.error_against_oracle(rig, dna_file, alone) < scene.TOLERANCE
    bpy.ops.wm.open_mainfile(filepath=path)
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    assert not {"risorius_look", HEAT} & set(rig.keys())
    assert heat_of(rig) == {}
    raw = scene.raw_of(rig, dna_file)
    assert raw[:2] == pytest.approx([0.7, 0.6])
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_without_the_addon_the_face_is_whole_and_plain(rig, dna_file):
    import addon_utils

    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.6)
    bpy.ops.risorius.solo(control=JAW)
    bpy.ops.risorius.heat(kind="POSE")
    raw = scene.raw_of(rig, dna_file)
    addon_utils.disable(scene.MODULE)
    bpy.context.view_layer.update()
    assert not {"risorius_look", HEAT} & set(rig.keys())
    assert heat_of(rig) == {}
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_a_control_and_its_correctives(rig):
    scene.set_controls(rig, jawOpen=0.5, mouthCornerPullL=0.4)
    causes = why("causes")
    (part,) = causes.parts_of(rig, 0)
    assert part.control == CORRECTIVE
    assert part.value == pytest.approx(0.2)
    assert [(n, pytest.approx(v)) for n, v in part.others] == [("mouthCornerPullL", 0.4)]
    assert causes.parts_of(rig, 3) == []
    bpy.context.window_manager.risorius_why.control = JAW
    spoken = scene.submodule("ui.see_why.spoken").spoken
    assert spoken(bpy.context, "jawOpen x mouthCornerPullL") == "Jaw Open x Mouth Corner Pull R"
    text = drawn(bpy.types.RISORIUS_PT_why).text()
    assert spoken(bpy.context, part.name) in text
    assert "mouthCornerPull" not in text  # as the sliders are called, and on the side as seen


def test_the_strongest_correctives_have_millimetres(rig, dna_file):
    causes = why("causes")
    assert causes.strongest(rig) == []
    scene.set_controls(rig, jawOpen=0.5, mouthCornerPullL=0.4)
    assert not causes.is_known(rig)
    (fired,) = causes.strongest(rig)
    assert causes.is_known(rig)
    raw = scene.raw_of(rig, dna_file)
    far = [
        apart(wanted(dna_file, m, raw), wanted(dna_file, m, raw, without_corrective=True)).max()
        for m in (0, 1)
    ]
    assert fired.control == CORRECTIVE
    assert fired.now == pytest.approx(max(far), rel=1e-3)
    assert fired.value == pytest.approx(0.2)
