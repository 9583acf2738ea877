# SPDX-License-Identifier: MIT
"""Tests hair of sample people: growth, orientation of hair cards, and contact with the skin."""

import zlib
from dataclasses import replace

import numpy as np
import pytest
import risorius
import sample_people
from risorius.author.geometry.polygon_mesh import polygon_mesh
from risorius.files.png import png, read_png
from risorius.mixing import Mix, difference, mix_faces
from risorius.mixing.hair import hair_meshes
from risorius_people import blend_shape_face, people
from risorius_people.hair import add_hair, grow_hair, hair_metadata, hair_picture
from risorius_people.hair.binding import Turning, append_mesh, corners_of
from risorius_people.hair.clearance import cut_clear, narrow_edges
from risorius_people.hair.growth import curled, eased, grow
from risorius_people.hair.strips import card_faces, card_vertices, make_strips
from risorius_people.hair.surface import Roots, Surface, nearest_places
from risorius_people.paint.atlas import TILES
from risorius_people.paint.places import brow_density, brow_ridge, hairline_height
from risorius_people.paint.strands import paint_strands
from risorius_people.polygons import Polygons, subdivide

CUBE = Polygons(
    faces=[[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
    uv_faces=[[0, 1, 2, 3]] * 6,
    uvs=np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float),
    vertex_count=8,
)
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
MOST_VERTICES = 12_000


@pytest.fixture(scope="module")
def ball():
    """A ball with radius 1 as a head."""
    polygons, points = CUBE, CORNERS
    for _ in range(3):
        polygons, operator = subdivide(polygons)
        points = operator.apply(points)
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    return Surface(polygons, points, points, np.zeros(3))


def test_hair_grows_within_the_hairline():
    """Crown, nape and side of the head have hair; forehead, brow, ear, cheek and neck have none."""
    inside = [[0, 1.05, -0.7], [0, -0.3, -1.6], [0.75, 0.4, -0.7]]
    outside = [[0, 0.5, 0.2], [0.3, 0.2, 0.1], [0.8, -0.2, -0.8], [0.6, -0.5, 0], [0, -1, -1.5]]
    assert hairline_height(np.array(inside, float)).min() > 0.1
    assert hairline_height(np.array(outside, float)).max() < -0.05
    forehead = np.array([[0.4, 0.75, 0.0]])
    assert hairline_height(forehead) > 0.05
    assert hairline_height(forehead, recession=1.0) < 0


def test_a_brow_begins_with_few_hairs():
    eye, along = 0.3, np.array([-0.03, 0.06, 0.12, 0.3])
    points = np.column_stack([along * 0.44 + eye - 0.185, brow_ridge(along), 0 * along])
    found = brow_density(points, eye)
    assert found[0] < 0.01
    assert 0.1 < found[1] < 0.6 * found[3]
    assert found[2] < 0.9 * found[3]


def test_roots_are_apart_and_on_the_skin(ball):
    density = np.ones(len(ball.positions))
    roots = ball.scattered(density, 0.2, np.random.default_rng(1))
    places = roots.of(ball.man)
    apart = np.linalg.norm(places[:, None] - places, axis=2) + 9 * np.eye(len(places))
    assert apart.min() >= 0.2
    assert len(roots) > 150
    again = ball.nearest(places)
    np.testing.assert_allclose(again.of(ball.positions), places, atol=1e-9)


def test_guides_stay_over_the_skin_and_are_as_long_as_asked(ball):
    roots = ball.scattered(np.ones(len(ball.positions)), 0.4, np.random.default_rng(2))
    n = len(roots)
    flow = np.tile([0.0, -1.0, 0.0], (len(ball.positions), 1))
    rise = np.full(n, 0.3), np.full(n, -0.4)
    everywhere = np.arange(len(ball.positions))
    points, out = grow(ball, roots, flow, np.full(n, 0.5), rise, 5, everywhere, least=0.02)
    np.testing.assert_allclose(points[:, 0], roots.of(ball.positions))
    assert np.linalg.norm(points[:, -1], axis=1).min() > 1.0
    long = np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1)
    assert np.abs(long - 0.5).max() < 0.06
    strips = make_strips(points, out, np.full(n, 0.05), np.ones(5), np.zeros(n, int), roots)
    positions, _ = card_vertices(strips)
    faces, uvs = card_faces(strips)
    assert len(positions) == len(uvs) == 10 * n
    corners = positions[np.array(faces)]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0])
    middles = corners.mean(axis=1)
    outward = (facing * middles).sum(axis=1)  # positive: counter-clockwise
    assert outward[middles[:, 1] > -0.8].min() > 0  # below -0.8 hairs of all directions meet


def test_neither_a_turned_strip_nor_a_curl_goes_into_the_skin(ball):
    """On flat skin, a rotated card is at most 1.4 mm deep in the skin, and a curl is above it."""
    n, rows = 50, 6
    roots = ball.scattered(np.ones(len(ball.positions)), 0.2, np.random.default_rng(3))
    roots = roots.taken(np.arange(n))
    points = np.zeros((n, rows, 3))
    points[:, :, 0] = np.linspace(0, 0.5, rows)
    outside = np.tile([0.0, 0.0, 1.0], (n, rows, 1))
    turns = np.linspace(0, np.pi, n)
    half, taper = np.full(n, 0.06), np.ones(rows)
    strips = make_strips(points, outside, half, taper, np.zeros(n, int), roots, turns)
    assert np.abs(strips.sides[:, 0, 2]).max() == pytest.approx(0.014)
    np.testing.assert_allclose(np.linalg.norm(strips.sides[0, 0]), 0.06)  # the first card is flat
    np.testing.assert_allclose(np.linalg.norm(strips.sides[:, 1:], axis=2), 0.06)
    random = np.random.default_rng(4)
    wound = curled(points, outside, np.full(n, 0.05), np.full(n, 1.5), random)
    assert wound[:, :, 2].min() > -1e-9
    assert wound[:, 2:, 2].max() > 0.045


def test_a_card_that_leans_back_over_its_root_is_no_bow(ball):
    """If a hair bends back over its root, the left and right edge of its card must not swap."""
    roots = ball.scattered(np.ones(len(ball.positions)), 0.4, np.random.default_rng(3))
    roots = roots.taken(np.arange(1))
    points = np.array([[[0, 0, 0], [0.1, 0, 0.1], [0.1, 0, 0.3], [-0.1, 0, 0.3], [-0.3, 0, 0.2]]])
    outside = np.tile([0.0, 0.0, 1.0], (1, 5, 1))
    strips = make_strips(points, outside, np.array([0.01]), np.ones(5), np.zeros(1, int), roots)
    np.testing.assert_array_less(0, (strips.sides[0, 1:] * strips.sides[0, :-1]).sum(axis=1))


@pytest.mark.parametrize("who", ["man", "fighter", "woman", "elder"])
def test_hairs_of_a_card_fade_out_to_its_sides(who):
    """A card must have fewer hairs towards its sides, or else it looks like a rectangle."""
    cover = paint_strands(people.PEOPLE[who])[..., 3]
    curly = who in ("fighter", "woman")
    for kind, thin in (("beard", slice(0, 8)), ("scalp", slice(0 if curly else 5, 8))):
        left, low, width, height, count = TILES[kind]
        tiles = cover[low : low + height, left : left + count * width]
        tiles = tiles.reshape(height, count, width)[:, thin].mean(axis=(0, 1))
        at = np.abs((np.arange(width) + 0.5) / width - 0.5)
        outer, middle = (at > 0.25) & (at < 0.4), at < 0.25
        assert tiles[outer].mean() < 0.6 * tiles[middle].mean()


@pytest.mark.parametrize("who", ["man", "lady"])
def test_no_straight_hair_is_cut_off_by_a_side_of_its_card(who):
    cover = paint_strands(people.PEOPLE[who])[..., 3]
    left, low, width, height, count = TILES["scalp"]
    tiles = cover[low : low + height, left : left + count * width].reshape(height, count, width)
    sides = tiles[:, :, [0, 1, -2, -1]]
    # The painted share of the sides' texels: bent hairs may touch a side; if inclined hairs crossed
    # it, the share would be 0.056.
    assert (sides > 0.5).mean() < 0.02


def test_an_eased_guide_goes_to_and_fro_no_more_and_keeps_its_ends():
    t = np.linspace(0, 1, 5)
    zigzag = np.column_stack([t, 0.1 * np.array([0, 1, -1, 1, 0]), t**2])[None]
    out = eased(zigzag)
    np.testing.assert_array_equal(out[0, [0, -1]], zigzag[0, [0, -1]])
    bend = np.abs(np.diff(zigzag[0, :, 1], 2)).max(), np.abs(np.diff(out[0, :, 1], 2)).max()
    assert bend[1] < 0.35 * bend[0]
    np.testing.assert_array_equal(
        eased(np.outer(t, [1.0, 2.0, 3.0])[None])[0], np.outer(t, [1, 2, 3])
    )


def test_a_shape_that_turns_the_skin_turns_what_stands_on_it():
    """A hair vertex 5 mm above the skin rotates with the skin.

    A vertex 20 mm above the skin moves only as far as a vertex 8 mm above it. Lengths in the code
    are in centimetres.
    """
    grid = np.array([[x, 0.0, z] for x in range(5) for z in range(5)], float)
    faces = [[5 * i + j, 5 * i + j + 1, 5 * i + j + 6, 5 * i + j + 5] for i, j in np.ndindex(4, 4)]
    head = polygon_mesh(grid, np.tile([0.0, 1.0, 0.0], (25, 1)), faces, grid[:, [0, 2]] / 4, faces)
    roots = Roots(np.array([[6, 7, 11], [12, 13, 17]]), np.full((2, 3), 1 / 3))
    off = np.array([[0.0, 0.5, 0.0], [0.0, 1.6, 1.2]])
    hair = risorius.Mesh(positions=roots.of(grid) + off)
    angle = np.radians(40)
    turn = np.array(
        [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
    )
    wanted = (off * [[1], [0.8 / 2.0]]) @ (turn - np.eye(3)).T
    found = Turning(head, roots, hair).of(grid @ turn.T - grid)
    np.testing.assert_allclose(found, wanted, atol=1e-6)


@pytest.fixture
def stage():
    """A face with one flat mesh, which is 2 decimetres wide.

    The control `rise` raises the mesh by 0.1 decimetres from x = 0.2 on, with a slope from x =
    0.15. The control `idle` moves nothing.
    """
    side = np.arange(41)
    x, z = np.meshgrid(0.05 * side - 1, 0.05 * side - 1, indexing="ij")
    flat = np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3)
    corners = [[0, 0], [0, 1], [1, 1], [1, 0]]  # counter-clockwise seen from above
    faces = [[41 * (i + a) + k + b for a, b in corners] for i in range(40) for k in range(40)]
    up = np.tile([0.0, 1.0, 0.0], (len(flat), 1))
    mesh = polygon_mesh(flat, up, faces, flat[:, :2], faces)
    mesh.skin_offsets, mesh.skin_weights = np.arange(len(flat) + 1), np.ones(len(flat))
    mesh.skin_joint_indices, mesh.maximum_influence_per_vertex = np.zeros(len(flat), int), 1
    raised = np.flatnonzero(flat[:, 0] > 0.175)
    mesh.blend_shape_targets = [
        risorius.BlendShapeTarget(
            deltas=0.1 * up[raised], vertex_indices=raised, blend_shape_channel_index=0
        )
    ]
    dna = risorius.Dna()
    dna.lod_count, dna.joint_names, dna.joint_parents = 1, ["head"], [0]
    dna.neutral_joint_translations = dna.neutral_joint_rotations = np.zeros((1, 3))
    dna.raw_control_names = ["CTRL_expressions.rise", "CTRL_expressions.idle"]
    dna.blend_shape_channel_names = ["rise"]
    dna.joint_row_count, dna.joint_column_count = 9, 2
    dna.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[1], input_indices=[0], output_indices=[0]
    )
    dna.lod_joint_mapping, dna.lod_blend_shape_mapping, dna.lod_mesh_mapping = [[0]], [[0]], [[]]
    append_mesh(dna, "head_lod0_mesh", mesh, [0])
    return dna


def _lying(dna, roots_x, way):
    """Hairs on the mesh of `stage` along x or -x (`way` 1 or -1), with roots at x = roots_x.

    They reach 0.3 decimetres far, and end 0.03 decimetres above the skin at rest.
    """
    n = len(roots_x)
    at = np.column_stack([roots_x, np.zeros(n), np.full(n, 0.02)])
    roots = nearest_places(dna.meshes[0].positions.astype(float), *corners_of(dna.meshes[0]), at)
    t = np.linspace(0, 1, 3)[None, :, None]
    points = at[:, None] + t * np.array([0.3 * way, 0.03, 0.0])
    out = np.tile([0.0, 1.0, 0.0], (n, 3, 1))
    return make_strips(points, out, np.full(n, 0.01), np.ones(3), np.zeros(n, int), roots, held=0.0)


@pytest.mark.parametrize("faces", [[], [np.array([1.0, 0.0], np.float32)]])
def test_a_hair_that_an_expression_would_swallow_is_cut_or_does_not_grow(stage, faces):
    head = stage.meshes[0]
    away = _lying(stage, [-0.055], -1)
    kept = cut_clear(_lying(stage, [-0.055], -1), stage, head, 1.0, faces)
    np.testing.assert_array_equal(kept.points, away.points)
    toward = _lying(stage, [-0.055, 0.14], 1)
    kept = cut_clear(_lying(stage, [-0.055, 0.14], 1), stage, head, 1.0, faces)
    assert len(kept) == 1  # a hair with its root at the slope has no room
    np.testing.assert_array_equal(kept.points[0, 0], toward.points[0, 0])
    # The hair is shortened twice, each time to three quarters of its length; after the first time
    # it would end in the slope, at x = 0.17.
    np.testing.assert_allclose(
        kept.points[0, -1] - kept.points[0, 0], 0.75**2 * np.array([0.3, 0.03, 0]), atol=1e-12
    )


def test_a_face_that_no_control_makes_alone_counts(stage):
    """Each of two controls raises the skin too little to reach a hair; together they reach it."""
    head = stage.meshes[0]
    target = head.blend_shape_targets[0]
    low = 0.2 * np.asarray(target.deltas)  # 0.02 each; the ends are 0.03 high
    stage.blend_shape_channels = risorius.BlendShapeChannels(
        lods=[2], input_indices=[0, 1], output_indices=[0, 1]
    )
    stage.blend_shape_channel_names = ["rise", "more"]
    stage.lod_blend_shape_mapping = [[0, 1]]
    rows = target.vertex_indices
    head.blend_shape_targets = [
        risorius.BlendShapeTarget(deltas=low, vertex_indices=rows, blend_shape_channel_index=k)
        for k in range(2)
    ]
    stage.meshes = [head]
    alone = cut_clear(_lying(stage, [-0.055], 1), stage, head, 1.0, [])
    both = [np.ones(2, np.float32)]
    together = cut_clear(_lying(stage, [-0.055], 1), stage, head, 1.0, both)
    # The hair is shortened once: at x = 0.17 the skin rises by 0.016, and there the hair is 0.0225
    # high.
    np.testing.assert_allclose(
        together.points[0, -1] - together.points[0, 0],
        0.75 * (alone.points[0, -1] - alone.points[0, 0]),
        atol=1e-12,
    )


@pytest.mark.parametrize(("row", "most"), [(0, 0.014), (1, 0.004)])
def test_no_edge_of_a_card_lies_deep_in_the_skin(ball, row, most):
    roots = ball.scattered(np.ones(len(ball.positions)), 0.4, np.random.default_rng(2))
    at = roots.of(ball.positions)
    out = at / np.linalg.norm(at, axis=1, keepdims=True)
    points = np.stack([at, at + 0.1 * out], axis=1)
    strips = make_strips(
        points, np.stack([out, out], axis=1), np.full(len(at), 0.1), np.ones(2),
        np.zeros(len(at), int), roots,
    )  # fmt: skip
    # Row 1 is 0.1 above the skin, row 0 on the skin; one edge of the card is moved below the skin.
    strips.sides[:, row] += (0.08, 0.18)[row] * out
    narrow_edges(strips, ball)
    edges = points[:, row] - strips.sides[:, row]
    deep = np.linalg.norm(at, axis=1) - np.linalg.norm(edges, axis=1)
    assert most - 0.006 < deep.max() < most + 0.002  # 0.08 before
    np.testing.assert_array_equal(strips.points, points)


def test_a_picture_with_opacity_is_a_png_that_others_read():
    image = np.random.default_rng(3).uniform(0, 1, (4, 6, 4))
    data = png(image)
    assert data[24:26] == bytes([8, 6])
    begin = data.index(b"IDAT") + 4
    rows = np.frombuffer(zlib.decompressobj().decompress(data[begin:]), np.uint8).reshape(4, 25)
    if not rows[:, 0].any():
        np.testing.assert_array_equal(rows[::-1, 1:].reshape(4, 6, 4), np.rint(image * 255))
    assert read_png(data) is None  # hair textures are not mixed


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('hair_style = "mohawk"', "hair_style: one of none, crop, receding, long, bun, afro"),
        ('beard_style = "long"', "beard_style: one of none, full, short, goatee, moustache"),
        ("hair_length = 9", "hair_length: a number from 0.3 to 2 was expected, found 9"),
        ("hair_grey = -1", "hair_grey: a number from 0 to 1 was expected, found -1"),
        ("hair_fringe = 2", "hair_fringe: a number from 0 to 1 was expected, found 2"),
    ],
)
def test_styles_are_named_or_refused(tmp_path, text, sentence):
    path = tmp_path / "p.toml"
    path.write_text(f'like = "man"\nname = "P"\n{text}\n')
    with pytest.raises(ValueError, match="p.toml") as caught:
        people.read_person(path)
    assert sentence in str(caught.value)


# ---- with the real data, if they are available


@pytest.fixture(scope="module")
def haired():
    """(face with hair, hair, person), for the man and a variant of him with other hair styles."""
    man = people.PEOPLE["man"]
    dna, parts, body = sample_people.assembled("man")
    base = sample_people.data().base_mesh()
    out = []
    for person in (man, replace(man, name="Other", hair_style="bun", beard_style="short")):
        face = risorius.load(dna.to_bytes())
        hair = grow_hair(person, body, body.man.positions, base, parts, blend_shape_face.CM)
        add_hair(face, hair)
        out.append((face, hair, person))
    return out


def test_extra_a_fringe_hangs_before_the_forehead_and_ends_over_the_brows():
    """A fringe adds hair before the forehead, down to the chosen height, not before the eyes."""
    _, parts, body = sample_people.assembled("man")
    base, even = sample_people.data().base_mesh(), body.man.positions
    eye = even[body.groups["helper-l-eye"]].mean(axis=0)
    lowest, before = [], []
    for share in (0.0, 0.5, 1.0):
        person = replace(people.PEOPLE["man"], hair_style="long", hair_fringe=share)
        strips = grow_hair(person, body, even, base, parts, blend_shape_face.CM).strips["hair"]
        ends = strips.points[:, -1] - [0, *eye[1:]]
        front = (np.abs(ends[:, 0]) < 0.35) & (ends[:, 2] > 0.2)
        before.append(int(front.sum()))
        lowest.append(float(ends[front, 1].min(initial=1.0)))
    assert before[0] == 0  # parted hair falls to the sides
    assert min(before[1:]) > 25
    assert lowest == pytest.approx([1.0, 0.42, 0.24], abs=0.06)


def moved(dna, raw, name):
    """Vertices of a mesh after blend shapes and linear blend skinning."""
    from risorius.author.geometry import skeleton as sk

    pose = risorius.Rig(dna).evaluate(raw)
    mesh = dna.meshes[dna.mesh_names.index(name)]
    p = np.asarray(mesh.positions, float).copy()
    for target in mesh.blend_shape_targets:
        weight = float(pose.blend_shapes[target.blend_shape_channel_index])
        p[target.vertex_indices] += weight * np.asarray(target.deltas, float)
    rest = np.zeros((len(dna.joint_names), 9))
    matrices = [sk.world_matrices(dna, d) for d in (np.asarray(pose.joints, float), rest)]
    motions = (matrices[0] @ np.linalg.inv(matrices[1]))[:, :3]
    return sk.skinned(p, sk.dense_weights(mesh, len(dna.joint_names)), motions)


def test_extra_faces_with_hair_are_sane_and_small(haired):
    for dna, hair, _ in haired:
        assert dna.validate() == []
        shown = [n for n in dna.mesh_names if n.split("_")[0] in hair.strips]
        finest = sum(
            len(dna.meshes[dna.mesh_names.index(n)].positions) for n in shown if "_lod0_" in n
        )
        assert 5000 < finest <= MOST_VERTICES
        assert {f"texture:{n}:color" for n in shown} <= set(
            hair_metadata(dna, hair, people.PEOPLE["man"])
        )
        assert list(hair_picture(people.PEOPLE["man"], 64)) == ["hair_color.png"]


def test_metadata_say_where_strands_wind(haired):
    for dna, hair, _ in haired:
        wound = {}
        for who in ("man", "woman", "fighter"):
            told = hair_metadata(dna, hair, people.PEOPLE[who])
            wound[who] = {k: told[k] for k in told if k.startswith("coil:")}
        own = [n for n in dna.mesh_names if n.split("_")[0] in {"hair", "beard"} & set(hair.strips)]
        assert wound["man"] == {}
        assert own
        assert set(wound["woman"]) == set(wound["fighter"]) == {f"coil:{n}" for n in own}
        # The fighter's hair is shorter than the woman's, so that its coils are smaller.
        for name in wound["woman"]:
            sizes = [float(wound[who][name].split()[0][7:]) for who in ("fighter", "woman")]
            assert 0.3 < sizes[0] <= sizes[1] < 3
            assert (sizes[0] < sizes[1]) == ("hair" in name)


def test_extra_roots_stay_on_the_skin_in_each_expression(haired):
    """Roots of hair stay within 2 mm of the skin for each of several controls at 1."""
    dna, hair, _ = haired[1]
    names = dna.raw_control_names
    worst = {}
    for control in ("eyeBlinkL", "browRaiseOuterL", "browDownL", "mouthCornerPullL", "jawOpen"):
        raw = np.zeros(len(names), np.float32)
        raw[names.index(f"CTRL_expressions.{control}")] = 1
        skin = moved(dna, raw, "head_lod0_mesh")
        for kind, strips in hair.strips.items():
            own = moved(dna, raw, f"{kind}_lod0_mesh").reshape(-1, strips.rows, 2, 3)
            still = np.asarray(dna.meshes[dna.mesh_names.index(f"{kind}_lod0_mesh")].positions)
            still = still.reshape(-1, strips.rows, 2, 3)
            way = (own - still)[:, 0].mean(axis=1)
            place = strips.roots.of(skin) - strips.roots.of(
                np.asarray(dna.meshes[0].positions, float)
            )
            apart = 10 * np.linalg.norm(way - place, axis=1).max()
            worst[control, kind] = max(worst.get((control, kind), 0), apart)
    assert max(worst.values()) < 2.0, worst
    assert {k for k in worst if worst[k] > 0.5} <= {(c, "hair") for c, _ in worst}


def test_extra_lashes_have_controls_of_their_own(haired):
    dna, hair, _ = haired[0]
    names = dna.raw_control_names
    still = moved(dna, np.zeros(len(names), np.float32), "eyelashes_lod0_mesh")
    for control, up in (("eyelashesUpINL", 1), ("eyelashesDownOUTR", -1)):
        raw = np.zeros(len(names), np.float32)
        raw[names.index(f"CTRL_expressions.{control}")] = 1
        way = moved(dna, raw, "eyelashes_lod0_mesh") - still
        far = np.abs(way[:, 1]).argmax()
        assert np.sign(way[far, 1]) == up
        assert 0.2 < np.linalg.norm(way[far]) < 1.2  # centimetres
        assert np.sign(still[far, 0]) == (1 if control.endswith("L") else -1)
        roots = way.reshape(-1, hair.strips["eyelashes"].rows, 2, 3)[:, 0]
        assert np.abs(roots).max() < 1e-6


def test_extra_lashes_turn_with_the_lid(haired):
    """When an eye closes, its upper lashes rotate with the lid and point downwards."""
    dna, hair, _ = haired[0]
    rows = hair.strips["eyelashes"].rows
    raw = np.zeros(len(dna.raw_control_names), np.float32)
    angles = []
    for value in (0.0, 1.0):
        raw[dna.raw_control_names.index("CTRL_expressions.eyeBlinkL")] = value
        middles = moved(dna, raw, "eyelashes_lod0_mesh").reshape(-1, rows, 2, 3).mean(axis=2)
        way = middles[:, 1] - middles[:, 0]
        angles.append(np.degrees(np.arctan2(way[:, 1], way[:, 2])))
        if value == 0:
            upper = (middles[:, -1, 1] > middles[:, 0, 1]) & (middles[:, 0, 0] > 0)
            others = middles[:, 0, 0] < 0
    turned = angles[1] - angles[0]
    assert np.median(turned[upper]) < -20
    assert angles[1][upper].max() < 0
    assert np.abs(turned[others]).max() < 1


def test_extra_people_of_other_hair_can_be_mixed(haired):
    one, other = haired[0][0], haired[1][0]
    assert difference(one, other) is None
    mixed = mix_faces([one, other], Mix([0.4, 0.6]))
    assert mixed.validate() == []
    assert mixed.mesh_names == other.mesh_names
    assert len(hair_meshes(mixed)) == len(hair_meshes(other)) > 0
    number = hair_meshes(mixed)[0]
    np.testing.assert_allclose(
        mixed.meshes[number].positions, other.meshes[number].positions, atol=1e-4
    )
