# SPDX-License-Identifier: GPL-3.0-or-later
"""Cards of hair: their material, and strands that take their place in renders."""

import bpy
import numpy as np
import pytest
from risorius.author.geometry.polygon_mesh import polygon_mesh
from support import looks, scene
from support.faces import small_face

ROWS, CARDS = 3, 5


def cards(joint):
    """A Mesh of cards beside each other on a joint, each ROWS rows of two vertices."""
    points, faces = [], []
    for card in range(CARDS):
        for row in range(ROWS):
            points += [[card, 170 + 2 * row, 3 + row], [card + 0.8, 170 + 2 * row, 3 + row]]
        first = 2 * ROWS * card
        for row in range(ROWS - 1):
            a = first + 2 * row
            faces.append([a, a + 1, a + 3, a + 2])
    points = np.array(points, float)
    uvs = np.column_stack([points[:, 0] / CARDS, (points[:, 1] - 170) / 4])
    mesh = polygon_mesh(points, np.tile([0.0, 0, 1], (len(points), 1)), faces, uvs, faces)
    mesh.skin_offsets = np.arange(len(points) + 1)
    mesh.skin_weights = np.ones(len(points), np.float32)
    mesh.skin_joint_indices = np.full(len(points), joint)
    mesh.maximum_influence_per_vertex = 1
    return mesh


@pytest.fixture
def haired(tmp_path):
    """A face with cards on the joint that its jaw control turns, and a picture with opacity."""
    dna = small_face()
    moving = int(dna.joint_groups[0].output_indices[0]) // 9
    meshes = {"head_lod0_mesh": dna.meshes[0], "hair_lod0_mesh": cards(moving)}
    meshes["beard_lod0_mesh"] = cards(moving)  # without rows in the metadata: no strands
    looks.set_meshes(dna, meshes)
    dna.metadata = {
        "texture:hair_lod0_mesh:color": "hair.png",
        "hair:hair_lod0_mesh": f"rows={ROWS}",
    }
    path = tmp_path / "haired.dna"
    path.write_bytes(dna.to_bytes())
    looks.write_image(tmp_path / "hair.png", np.full((4, 4, 4), 0.5, np.float32))
    return scene.load(path)


def points_of(thing):
    """float64[n, 3] of the curves that renders show, in world space, and their number."""
    thing.hide_viewport = False
    graph = bpy.context.evaluated_depsgraph_get()
    seen = thing.evaluated_get(graph)
    curves = seen.data
    flat = np.empty(3 * len(curves.points), np.float32)
    curves.attributes["position"].data.foreach_get("vector", flat)
    world = np.array(seen.matrix_world)
    thing.hide_viewport = True
    return flat.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3], len(curves.curves)


def test_cards_are_seen_through_where_the_picture_says_so(haired):
    item = scene.meshes(haired)[1]
    shader = looks.principled(item.data.materials[0])
    assert shader.inputs["Alpha"].links[0].from_socket.name == "Alpha"
    assert shader.inputs["Base Color"].links[0].from_node.image.name.startswith("hair")
    assert item.data.materials[0].surface_render_method == "DITHERED"
    bare = looks.principled(scene.meshes(haired)[2].data.materials[0])
    assert not bare.inputs["Alpha"].is_linked


def test_strands_lie_on_the_cards_wherever_they_go(haired):
    item = scene.meshes(haired)[1]
    before = set(bpy.data.objects), len(bpy.data.node_groups), len(bpy.data.materials)
    assert bpy.ops.risorius.set_strands() == {"FINISHED"}
    (thing,) = set(bpy.data.objects) - before[0]
    assert (item.hide_render, thing.hide_render, thing.hide_viewport) == (True, False, True)
    for jaw in (0.0, 1.0):
        scene.set_controls(haired, jawOpen=jaw)
        corners = scene.evaluated(item).reshape(CARDS, ROWS, 2, 3)
        points, count = points_of(thing)
        assert count == 26 * CARDS
        # Each point is near the segment between both edges of a card at its height.
        edges = [corners[:, r, s] for r in range(ROWS) for s in (0, 1)]
        low, high = np.min(edges, axis=(0, 1)), np.max(edges, axis=(0, 1))
        apart = 0.0026  # metres: tips part by so much
        assert (points >= low - apart).all()
        assert (points <= high + apart).all()
        roots = corners[:, 0].mean(axis=1)
        near = np.linalg.norm(points[:, None] - roots, axis=2).min(axis=0)
        assert near.max() < 0.004  # metres: half the width of a card
    assert bpy.ops.risorius.set_strands(enable=False) == {"FINISHED"}
    assert set(bpy.data.objects) == before[0]
    assert (len(bpy.data.node_groups), len(bpy.data.materials)) == before[1:]
    assert not item.hide_render


def test_a_face_without_cards_says_so(dna_file):
    scene.load(dna_file)
    with pytest.raises(RuntimeError, match="This face has no cards of hair"):
        bpy.ops.risorius.set_strands()
