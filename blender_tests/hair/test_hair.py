# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair cards: their material, and strands that replace them in renders."""

import bpy
import numpy as np
import pytest
from risorius.author.geometry.polygon_mesh import polygon_mesh
from support import looks, scene
from support.faces import small_face

ROWS, CARDS = 3, 5


def cards(joint):
    """A Mesh with a row of hair cards that follow a joint.

    Each card has ROWS rows of two vertices.
    """
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
    """A face with hair cards that follow its jaw joint, and a hair texture with opacity."""
    dna = small_face()
    moving = int(dna.joint_groups[0].output_indices[0]) // 9
    meshes = {"head_lod0_mesh": dna.meshes[0], "hair_lod0_mesh": cards(moving)}
    meshes["beard_lod0_mesh"] = cards(moving)  # metadata without rows: no strands
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
    """Read the rendered curves.

    Returns: the points of all curves in world space, float64[n, 3], and for each curve the index of
    its first point.
    """
    thing.hide_viewport = False
    graph = bpy.context.evaluated_depsgraph_get()
    seen = thing.evaluated_get(graph)
    curves = seen.data
    flat = np.empty(3 * len(curves.points), np.float32)
    curves.attributes["position"].data.foreach_get("vector", flat)
    world = np.array(seen.matrix_world)
    thing.hide_viewport = True
    return flat.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3], [
        curve.first_point_index for curve in curves.curves
    ]


def test_cards_are_seen_through_where_the_picture_says_so(haired):
    item = scene.meshes(haired)[1]
    shader = looks.principled(item.data.materials[0])
    assert shader.inputs["Alpha"].links[0].from_socket.name == "Alpha"
    assert shader.inputs["Base Color"].links[0].from_node.image.name.startswith("hair")
    assert item.data.materials[0].surface_render_method == "DITHERED"
    bare = looks.principled(scene.meshes(haired)[2].data.materials[0])
    assert not bare.inputs["Alpha"].is_linked


# Largest distances of strands from the edges of their cards: ASIDE across the card, as a share of
# its width; ALONG it, as a share of the distance of its rows (2 cm). At their tips, strands may be
# further away by APART metres in any direction.
ASIDE, ALONG, APART = 0.45, 0.005 / 0.02, 0.0015 * 3**0.5


def test_strands_go_wherever_their_cards_go(haired):
    item = scene.meshes(haired)[1]
    before = set(bpy.data.objects), len(bpy.data.node_groups), len(bpy.data.materials)
    assert bpy.ops.risorius.set_strands() == {"FINISHED"}
    (thing,) = set(bpy.data.objects) - before[0]
    assert bpy.ops.risorius.set_strands() == {"FINISHED"}  # the strands exist already
    assert len(set(bpy.data.objects) - before[0]) == 1
    assert (item.hide_render, thing.hide_render, thing.hide_viewport) == (True, False, True)
    for jaw in (0.0, 1.0):
        scene.set_controls(haired, jawOpen=jaw)
        corners = scene.evaluated(item).reshape(CARDS, ROWS, 2, 3)
        points, roots = points_of(thing)
        assert len(roots) == 32 * CARDS
        across, along = corners[0, 0, 1] - corners[0, 0, 0], corners[0, 1, 0] - corners[0, 0, 0]
        out = np.cross(across, along) / np.linalg.norm(np.cross(across, along))
        local = points - corners[0, 0, 0]
        side, up, off = np.linalg.solve(np.column_stack([across, along, out]), local.T)
        tips = APART / np.linalg.norm(across), APART / np.linalg.norm(along)
        pitch = 1 / 0.8  # distance of the cards, in widths
        assert side.min() >= -ASIDE - tips[0]
        assert side.max() <= (CARDS - 1) * pitch + 1 + ASIDE + tips[0]
        assert up.min() >= -ALONG - tips[1]
        assert up.max() <= ROWS - 1 + ALONG + tips[1]
        assert np.abs(off).max() < APART + 1e-6
    assert bpy.ops.risorius.set_strands(enable=False) == {"FINISHED"}
    assert set(bpy.data.objects) == before[0]
    assert (len(bpy.data.node_groups), len(bpy.data.materials)) == before[1:]
    assert not item.hide_render


def test_roots_stand_between_the_cards_too(haired):
    item = scene.meshes(haired)[1]
    before = set(bpy.data.objects)
    bpy.ops.risorius.set_strands()
    (thing,) = set(bpy.data.objects) - before
    corners = scene.evaluated(item).reshape(CARDS, ROWS, 2, 3).astype(np.float64)
    points, first = points_of(thing)
    roots = points[first] - corners[0, 0, 0]
    across, along = corners[0, 0, 1] - corners[0, 0, 0], corners[0, 1, 0] - corners[0, 0, 0]
    side = np.sort(roots @ across / (across @ across))
    # Strands may be at transparent places of the texture. The image must keep its colour there,
    # so its alpha mode is channel packed.
    pictures = {n.image for n in item.data.materials[0].node_tree.nodes if n.type == "TEX_IMAGE"}
    assert [picture.alpha_mode for picture in pictures] == ["CHANNEL_PACKED"]
    # The gaps between cards are a quarter of a card wide, and roots fill these gaps, too: no two
    # neighbouring roots are 0.2 card widths or more apart.
    assert np.diff(side).max() < 0.2
    assert np.ptp(roots @ along / (along @ along)) > 0.3


_DARK = 0.1  # stored red, green and blue, as in textures of brows


def test_strands_of_brows_are_no_black_wires(tmp_path):
    """The strands of brows are about as light as the brows' cards, and thin at their roots."""
    dna = small_face()
    looks.set_meshes(dna, {"head_lod0_mesh": dna.meshes[0], "brows_lod0_mesh": cards(0)})
    dna.metadata = {
        "texture:brows_lod0_mesh:color": "hair.png",
        "hair:brows_lod0_mesh": f"rows={ROWS}",
    }
    (tmp_path / "brows.dna").write_bytes(dna.to_bytes())
    looks.write_image(tmp_path / "hair.png", np.full((4, 4, 4), [_DARK] * 3 + [1.0], np.float32))
    head, item = scene.meshes(scene.load(tmp_path / "brows.dna")).values()
    head.hide_render = True
    setup, _ = looks.stage([item], 24, samples=8)
    setup.render.film_transparent = True
    cards_look = looks.render(setup, tmp_path / "cards.png").reshape(-1, 4)
    before = set(bpy.data.objects)
    bpy.ops.risorius.set_strands()
    (thing,) = set(bpy.data.objects) - before
    found = looks.render(setup, tmp_path / "strands.png").reshape(-1, 4)
    light = [np.average(p[:, :3].mean(axis=1) ** 2.2, weights=p[:, 3]) for p in (cards_look, found)]
    assert 0.6 < light[1] / light[0] < 1.5
    thing.hide_viewport = False
    curves = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    radii = np.array([p.radius for p in curves.points])
    first = [c.first_point_index for c in curves.curves]
    assert (radii[first] < 0.6 * np.maximum.reduceat(radii, first)).all()


RADIUS, PITCH, LOCK, LOCKS = 2.0, 5.0, 6, 5  # mm, mm, strands per lock, locks per card


@pytest.fixture
def curly(tmp_path):
    """A function that imports a face with cards of coiled hair.

    Its argument is the coil in the DNA file's metadata, such as "radius=2 pitch=5".
    """

    def made(words):
        dna = small_face()
        meshes = {"head_lod0_mesh": dna.meshes[0], "hair_lod0_mesh": cards(0)}
        looks.set_meshes(dna, meshes)
        told = {"hair:hair_lod0_mesh": f"rows={ROWS}", "coil:hair_lod0_mesh": words}
        dna.metadata = told
        path = tmp_path / "curly.dna"
        path.write_bytes(dna.to_bytes())
        return scene.load(path)

    return made


def strands_of(face):
    """Make strands of a face's hair cards.

    Returns: the points of all strands, float64[n, 3]; for each strand the index of its first point;
    the corners of the cards, float64[CARDS, ROWS, 2, 3]. All are in world space.
    """
    corners = scene.evaluated(scene.meshes(face)[1]).reshape(CARDS, ROWS, 2, 3).astype(float)
    before = set(bpy.data.objects)
    bpy.ops.risorius.set_strands()
    (thing,) = set(bpy.data.objects) - before
    points, first = points_of(thing)
    return points, first, corners


def test_strands_of_tight_curls_wind_about_their_way(curly):
    points, first, corners = strands_of(curly(f"radius={RADIUS} pitch={PITCH}"))
    along = corners[0, -1, 0] - corners[0, 0, 0]
    long = np.linalg.norm(along)
    along /= long
    ways = [points[a:b] for a, b in zip(first, [*first[1:], len(points)], strict=True)]
    assert len(ways) == LOCK * LOCKS * CARDS
    locks = {}
    for number, way in enumerate(ways):
        place = way - corners[0, 0, 0]
        up = place @ along
        off = place - up[:, None] * along
        wound = up > up[0] + 2 * RADIUS / 1000
        # The axis of the coil is nearly parallel to the straight card, so the radius is measured
        # from the mean of the coil's points, after projection along the card.
        flat = off[wound] - off[wound].mean(axis=0)
        radius = np.linalg.norm(flat, axis=1) * 1000
        assert 0.5 * RADIUS < np.median(radius) < 1.5 * RADIUS
        turned = np.unwrap(np.arctan2(flat[:, 2], flat[:, 0]))
        pitch = np.ptp(up[wound]) * 1000 / (np.ptp(turned) / (2 * np.pi))
        assert abs(pitch - PITCH) < 0.2 * PITCH
        locks.setdefault(number // LOCK, []).append(place[0])
    # All strands of a lock have their roots at one place.
    for roots in locks.values():
        assert np.ptp(np.array(roots), axis=0).max() < 0.0005


@pytest.mark.parametrize("words", ["radius=0 pitch=5", "radius=2", "pitch=5 radius=2", "tight"])
def test_curls_that_the_metadata_do_not_say_rightly_are_none(curly, words):
    _, first, _ = strands_of(curly(words))
    assert len(first) == 32 * CARDS


def test_coarse_cards_have_as_many_strands_together_as_fine_ones(tmp_path):
    dna = small_face()
    few = polygon_mesh(
        np.asarray(cards(0).positions)[: 4 * ROWS].astype(float),
        np.tile([0.0, 0, 1], (4 * ROWS, 1)),
        [[a, a + 1, a + 3, a + 2] for a in (0, 2, 6, 8)],
        np.zeros((4 * ROWS, 2)),
        [[a, a + 1, a + 3, a + 2] for a in (0, 2, 6, 8)],
    )
    meshes = {"head_lod0_mesh": dna.meshes[0], "hair_lod0_mesh": cards(0), "hair_lod1_mesh": few}
    looks.set_meshes(dna, meshes)
    dna.metadata = {f"hair:hair_lod{lod}_mesh": f"rows={ROWS}" for lod in (0, 1)}
    path = tmp_path / "levels.dna"
    path.write_bytes(dna.to_bytes())
    rig = scene.load(path)
    before = set(bpy.data.objects)
    bpy.ops.risorius.set_strands()
    made = {thing.name.split("_lod")[1][0]: thing for thing in set(bpy.data.objects) - before}
    assert len(scene.meshes(rig)) == 3
    assert {lod: len(points_of(thing)[1]) for lod, thing in made.items()} == {
        "0": 32 * CARDS,
        "1": 32 * CARDS,
    }


def test_a_face_without_cards_says_so(dna_file):
    scene.load(dna_file)
    with pytest.raises(RuntimeError, match="This face has no cards of hair"):
        bpy.ops.risorius.set_strands()
