# SPDX-License-Identifier: MIT
"""Tests the command `risorius plot`: computed values, written files, and refusals."""

import importlib.util
import io
import math
import os
import struct
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import oracle
import pytest
import risorius
from conftest import GOLDEN, no_room
from risorius.cli import main
from risorius.cli.info import describe
from risorius.plot.content import layers, matrix, regions
from risorius.plot.content.facts import Facts, counts, gather
from risorius.plot.drawing import shade, skeleton

FILES = sorted(path for path in GOLDEN.glob("*.dna"))
NAMES = [path.stem for path in FILES]

# Joint name of a MetaHuman file -> its region.
JOINTS = {
    "FACIAL_C_ForeheadSkin": "forehead, brow",
    "FACIAL_R_12IPV_ForeheadOut31": "forehead, brow",
    "FACIAL_L_ForeheadInA3": "forehead, brow",
    "FACIAL_C_Hair1": "forehead, brow",
    "FACIAL_L_EyelidUpperA1": "eye",
    "FACIAL_L_EyelashesUpperA2": "eye",
    "FACIAL_R_EyesackLower2": "eye",
    "FACIAL_L_12IPV_EyeCornerO1": "eye",
    "FACIAL_R_Pupil": "eye",
    "FACIAL_C_NoseBridge": "nose",
    "FACIAL_C_12IPV_NoseTip3": "nose",
    "FACIAL_L_NostrilThickness1": "nose",
    "FACIAL_L_CheekOuter4": "cheek",
    "FACIAL_R_NasolabialBulge": "cheek",
    "FACIAL_R_Sideburn3": "cheek",
    "FACIAL_L_Temple": "cheek",
    "FACIAL_L_LipCorner": "mouth, lips",
    "FACIAL_C_MouthUpper": "mouth, lips",
    "FACIAL_C_LowerLipRotation": "mouth, lips",
    "FACIAL_C_TeethLower": "teeth, tongue",
    "FACIAL_L_TongueSide2": "teeth, tongue",
    "FACIAL_C_Jaw": "jaw, chin",
    "FACIAL_L_12IPV_Jawline5": "jaw, chin",
    "FACIAL_L_12IPV_ChinS4": "jaw, chin",
    "FACIAL_R_UnderChin": "jaw, chin",
    "FACIAL_L_Ear4": "ear",
    "FACIAL_C_AdamsApple": "neck",
    "FACIAL_L_12IPV_NeckBackA1": "neck",
    "neck_01": "neck",
    "spine_04": "neck",
    "head": "other",
    "FACIAL_C_FacialRoot": "other",
    "": "other",
}


def facts_of(name: str) -> Facts:
    data = (GOLDEN / f"{name}.dna").read_bytes()
    return gather(risorius.load(data), data, f"{name}.dna")


@pytest.mark.parametrize(("joint", "region"), JOINTS.items())
def test_region_of_a_joint(joint, region):
    assert regions.joint_region(joint) == region


def test_majority_of_a_group():
    of = ["nose", "eye", "eye", "other", "other", "other"]
    assert regions.majority([0, 1, 2], of) == "eye"
    assert regions.majority([0, 3, 4, 5, 99], of) == "nose"
    assert regions.majority([3], of) == "other"
    assert regions.majority([], of) == "other"
    assert set(regions.COLORS) == set(regions.REGIONS)


def chain(**changes) -> risorius.Dna:
    """A chain of three joints listed children first: tip, its parent middle, whose parent is root.

    Args:
        changes: properties of the Dna to replace.
    """
    dna = risorius.Dna()
    dna.rotation_unit, dna.coordinate_system = "degrees", ("right", "up", "front")
    dna.joint_names = ["tip", "middle", "root"]
    dna.joint_parents = [1, 2, 2]
    dna.neutral_joint_translations = np.array([[3, 0, 0], [2, 0, 0], [10, 20, 30]], np.float32)
    dna.neutral_joint_rotations = np.array([[0, 0, 0], [90, 0, 0], [0, 0, 90]], np.float32)
    for name, value in changes.items():
        setattr(dna, name, value)
    return dna


def test_world_positions_of_a_known_chain():
    # The rotation of the root by 90 degrees about z maps x to y. The rotation of the middle joint
    # about x keeps x.
    expected = [[10, 25, 30], [10, 22, 30], [10, 20, 30]]
    np.testing.assert_allclose(skeleton.world_positions(chain()), expected, atol=1e-5)


def test_world_positions_honour_the_unit_and_the_signs():
    turned = np.array([[0, 0, 0], [0, 0, 0], [0, 0, math.pi / 2]], np.float32)
    dna = chain(rotation_unit="radians", rotation_signs=(1, 1, -1), neutral_joint_rotations=turned)
    expected = [[10, 15, 30], [10, 18, 30], [10, 20, 30]]
    np.testing.assert_allclose(skeleton.world_positions(dna), expected, atol=1e-5)


@pytest.mark.parametrize(
    ("sequence", "place"),
    [("xyz", [0, 0, -1]), ("yxz", [0, 0, -1]), ("zxy", [0, 1, 0]), ("xzy", [0, 1, 0])],
)
def test_world_positions_honour_the_sequence(sequence, place):
    # By hand: the rotation by 90 degrees about y maps x to -z, about z it maps x to y.
    dna = chain(
        rotation_sequence=sequence,
        neutral_joint_translations=np.array([[0, 0, 0], [1, 0, 0], [0, 0, 0]], np.float32),
        neutral_joint_rotations=np.array([[0, 0, 0], [0, 0, 0], [0, 90, 90]], np.float32),
    )
    assert np.allclose(skeleton.world_positions(dna)[1], place, atol=1e-6)


def test_views_stand_upright_in_any_axes():
    dna = chain(coordinate_system=("right", "front", "up"))
    np.testing.assert_array_equal(np.array([1, 2, 3]) @ skeleton.view_axes(dna), [1, 3, 2])
    dna = chain(coordinate_system=("left", "down", "back"))
    np.testing.assert_array_equal(np.array([1, 2, 3]) @ skeleton.view_axes(dna), [-1, -2, -3])
    dna = chain(coordinate_system=("up", "down", "back"))
    np.testing.assert_array_equal(skeleton.view_axes(dna), np.eye(3))


@pytest.mark.parametrize("name", NAMES)
def test_layers_add_up_to_the_file(name):
    data = (GOLDEN / f"{name}.dna").read_bytes()
    found = layers.read_layers(data)
    assert sum(layer.size for layer in found) == len(data)
    keys = [layer.key for layer in found if layer.key]
    assert sorted(keys) == sorted([] if name == "tiny_v21" else risorius.load(data).layers)


def test_sections_of_version_2_1_are_told_apart():
    data = (GOLDEN / "tiny_v21.dna").read_bytes()
    sizes = {layer.title: layer.size for layer in layers.read_layers(data)}
    groups = risorius.load(data).joint_groups
    lists = sum(
        20 + 4 * g.values.size + 2 * sum(map(len, (g.lods, g.input_indices, g.output_indices)))
        + 2 * len(g.joint_indices) for g in groups
    )  # fmt: skip
    assert sizes["joints"] == 2 + 2 + 4 + lists
    assert sizes["end mark"] == 3


def test_bytes_that_no_layer_covers_are_listed():
    data = (GOLDEN / "core.dna").read_bytes() + bytes(50)
    found = layers.read_layers(data)
    assert (found[-1].title, found[-1].size) == ("in no layer", 50)
    assert sum(layer.size for layer in found) == len(data)


def test_networks_and_poses_are_counted_from_the_bytes():
    text = struct.pack(">I", 2) + b"m1"
    words = struct.pack(">I", 2) + text + text
    lods = struct.pack(">IH", 1, 0) + struct.pack(">IIH", 1, 1, 0)
    areas = struct.pack(">I", 1) + words + struct.pack(">IIIH", 1, 1, 1, 0)
    mlbh = words + lods + areas + struct.pack(">I", 3)
    rbfe = struct.pack(">I", 1) + text
    head = b"DNA" + struct.pack(">HHI", 2, 8, 2)
    at = len(head) + 32
    index = struct.pack(">4sIII", b"mlbh", 1 << 16, at, len(mlbh))
    index += struct.pack(">4sIII", b"rbfe", 1 << 16, at + len(mlbh), len(rbfe))
    whole = head + index + mlbh + rbfe
    assert layers.read_extras(whole) == layers.Extras(2, 1, 3)
    for cut in range(at, len(whole)):
        layers.read_extras(whole[:cut])  # a truncated layer counts fewer bytes, without an error


@pytest.mark.parametrize("name", ["core", "medium", "tiny_v22", "units"])
def test_a_small_matrix_has_a_pixel_for_each_coefficient(name):
    facts = facts_of(name)
    colors = np.tile([1.0, 0.0, 0.0], (len(facts.dna.joint_groups), 1))
    cells = matrix.by_index(facts.dna, sum(count for _, count in facts.controls))
    picture = matrix.image(cells, colors, (100_000, 100_000))
    dense = np.zeros(cells.shape, bool)
    for group in facts.dna.joint_groups:
        dense[np.ix_(group.output_indices, group.input_indices)] |= group.values != 0
    np.testing.assert_array_equal(picture[..., 3] > 0, dense)
    assert np.count_nonzero(picture[..., 3]) == facts.nonzero
    assert set(map(tuple, picture[dense])) == {(255, 0, 0, 255)}

    packed, blocks = matrix.regrouped(facts.dna, facts.group_regions)
    picture = matrix.image(packed, colors, packed.shape)
    assert np.count_nonzero(picture[..., 3]) == facts.nonzero
    assert sum(block.rows * block.columns for block in blocks) == facts.stored
    assert [regions.REGIONS.index(b.region) for b in blocks] == sorted(
        regions.REGIONS.index(b.region) for b in blocks
    )


def test_a_lone_coefficient_survives_a_large_matrix():
    at = np.array([7000]), np.array([1200]), np.array([0])
    cells = matrix.Cells(*at, (7830, 1360))
    picture = matrix.image(cells, np.array([[0.0, 0.0, 1.0]]), (500, 300))
    assert picture.shape == (500, 300, 4)
    assert np.count_nonzero(picture[..., 3]) == 1
    assert picture[7000 * 500 // 7830, 1200 * 300 // 1360, 3] >= 0.3 * 255


def test_the_nearer_triangle_hides_the_farther():
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    points = np.concatenate([corners, corners + np.array([0, 0, 1])])
    triangles = np.array([[3, 4, 5], [0, 1, 2]])
    normals = np.tile([0.0, 0.0, 1.0], (6, 1))
    paint = np.repeat([0.2, 1.0], 3)
    shape = shade.Surface(points, normals, triangles, paint)
    picture = shade.render(shape, (0, 4, 0, 4), 40, smooth=1)
    back = shade.render(
        shade.Surface(points, normals, triangles[1:], paint), (0, 4, 0, 4), 40, smooth=1
    )
    assert picture[35, 5, 0] > 3 * back[35, 5, 0] > 0
    # The triangle covers the lower left half of the picture, and the rest is transparent.
    covered = picture[..., 3] == 255
    assert abs(covered.mean() - 0.5) < 0.03
    assert covered[38, 1]
    assert not covered[1, 38]


def test_polygons_become_fans():
    mesh = risorius.Mesh(
        positions=np.zeros((5, 3)), layout_positions=[4, 3, 2, 1, 0],
        layout_texture_coordinates=[0] * 5, layout_normals=[0] * 5,
        face_offsets=[0, 4, 6, 9], face_layouts=[0, 1, 2, 3, 0, 1, 2, 3, 4],
    )  # fmt: skip
    np.testing.assert_array_equal(shade.triangles_of(mesh), [[4, 3, 2], [4, 2, 1], [2, 1, 0]])


def test_counts_are_those_of_the_file():
    facts = facts_of("medium")
    table = dict(counts(facts))
    assert table["joints"] == 122
    assert table["coefficients stored"] == 58533
    assert table["vertices"] == 1252
    described = describe(facts.dna)["meshes"]
    assert table["blend shape deltas"] == sum(mesh["deltas"] for mesh in described) > 5000
    assert [sum(lod.joints.values()) for lod in facts.lods] == [120, 80, 45, 20]
    groups = facts.dna.joint_groups
    coarse = sum(int(g.lods[3]) * len(g.input_indices) for g in groups)
    assert facts.lods[3].coefficients == coarse < facts.lods[0].coefficients == facts.stored


class Page(HTMLParser):
    """Reads a page: counts images, collects text, and fails on external links and open elements."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images, self.ids, self.text = 0, [], ""

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.images += tag == "svg" and found.get("role") == "img"
        if tag not in ("meta", "link", "br", "img"):
            self.open.append(tag)
        if "id" in found:
            self.ids.append(found["id"])
        for name in ("src", "href", "xlink:href"):
            assert (found.get(name) or "#").startswith(("#", "data:")), found[name]

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def read_page(path) -> Page:
    page = Page()
    page.feed(path.read_text(encoding="utf-8"))
    page.close()
    assert page.open == []
    return page


drawing = pytest.mark.skipif(
    importlib.util.find_spec("matplotlib") is None, reason="the extra `plot` is not installed"
)


@drawing
@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_every_version_becomes_a_page(path, tmp_path, capsys):
    out = tmp_path / "page.html"
    assert main(["plot", str(path), "-o", str(out), "--dpi", "40"]) == 0
    assert capsys.readouterr().err == ""
    page = read_page(out)
    assert page.images == 4
    assert len(page.ids) == len(set(page.ids))
    assert f"{path.stat().st_size:,}" in page.text
    assert str(path.parent) not in out.read_text()
    assert [p.name for p in tmp_path.iterdir()] == ["page.html"]


@drawing
@pytest.mark.parametrize("name", ["core", "tiny_v21", "units"])
def test_a_sheet_is_a_picture_with_colours(name, tmp_path):
    image = pytest.importorskip("PIL.Image")
    out = tmp_path / "picture.PNG"
    path = GOLDEN / f"{name}.dna"
    assert main(["plot", str(path), "-o", str(out), "--dpi", "50", "--lod", "1"]) == 0
    pixels = np.asarray(image.open(io.BytesIO(out.read_bytes())).convert("RGB"))
    assert pixels.shape[1] == 22 * 50
    facts = facts_of(name)
    for region in set(facts.group_regions[i] for i, g in enumerate(facts.dna.joint_groups)
                      if g.values.size):  # fmt: skip
        colour = [int(regions.COLORS[region][i : i + 2], 16) for i in (1, 3, 5)]
        assert np.any(np.all(pixels == colour, axis=-1)), region
    assert 0.5 < np.mean(np.all(pixels == 255, axis=-1)) < 0.97


@drawing
def test_a_file_with_nothing_in_it_says_so(tmp_path):
    path, out = tmp_path / "empty.dna", tmp_path / "empty.html"
    risorius.Dna().save(path)
    assert main(["plot", str(path), "-o", str(out)]) == 0
    assert main(["plot", str(path), "-o", str(tmp_path / "empty.png"), "--dpi", "40"]) == 0
    assert "would stand here" in read_page(out).text


@drawing
def test_meshes_without_joints_and_joints_without_meshes(tmp_path):
    dna = risorius.load(GOLDEN / "medium.dna", layers="definition")
    dna.save(tmp_path / "joints.dna")
    bare = risorius.load(GOLDEN / "tiny_v28.dna", layers="descriptor")
    bare.save(tmp_path / "bare.dna")
    for name in ("joints", "bare"):
        path, out = tmp_path / f"{name}.dna", tmp_path / f"{name}.html"
        assert main(["plot", str(path), "-o", str(out), "--dpi", "40"]) == 0
        assert read_page(out).images == 4


@drawing
def test_the_title_is_text_and_not_markup(tmp_path):
    out = tmp_path / "page.html"
    title = "<b>$A$ & B</b>"
    path = str(GOLDEN / "core.dna")
    assert main(["plot", path, "-o", str(out), "--title", title, "--dpi", "40"]) == 0
    assert "&lt;b&gt;$A$ &amp; B&lt;/b&gt;" in out.read_text()
    sheet = tmp_path / "page.png"
    assert main(["plot", path, "-o", str(sheet), "--title", title, "--dpi", "40"]) == 0


@drawing
def test_the_same_file_gives_the_same_page_and_leaves_settings_alone(tmp_path):
    import matplotlib

    before = dict(matplotlib.rcParams)
    pages = [tmp_path / "one.html", tmp_path / "two.html"]
    for page in pages:
        assert main(["plot", str(GOLDEN / "core.dna"), "-o", str(page), "--dpi", "40"]) == 0
    assert pages[0].read_bytes() == pages[1].read_bytes()
    assert dict(matplotlib.rcParams) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "page.pdf"], ".html or .png"),
        (["-o", "page"], ".html or .png"),
        (["-o", "page.html", "--dpi", "0"], "--dpi"),
        (["-o", "page.html", "--dpi", "5000"], "--dpi"),
        pytest.param(["-o", "page.html", "--lod", "9"], "--lod", marks=drawing),
        pytest.param(["-o", "page.html", "--lod", "-1"], "--lod", marks=drawing),
    ],
)
def test_bad_command_line_is_exit_code_2(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["plot", str(GOLDEN / "core.dna"), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@drawing
def test_bad_input_is_exit_code_1_and_the_old_page_stays(tmp_path, capsys):
    out = tmp_path / "page.html"
    out.write_text("old")
    bad = tmp_path / "bad.dna"
    bad.write_bytes(b"not a face")
    assert main(["plot", str(bad), "-o", str(out)]) == 1
    assert main(["plot", str(tmp_path / "absent.dna"), "-o", str(out)]) == 1
    core = str(GOLDEN / "core.dna")
    assert main(["plot", core, "-o", str(tmp_path / "absent" / "page.html")]) == 1
    assert out.read_text() == "old"
    assert len(capsys.readouterr().err.splitlines()) == 3
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.dna", "page.html"]


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
@drawing
def test_without_room_the_page_is_named_and_the_old_one_stays(tmp_path, capsys):
    out = tmp_path / "page.png"
    out.write_text("old")
    with no_room(1000):
        assert main(["plot", str(GOLDEN / "core.dna"), "-o", str(out), "--dpi", "40"]) == 1
    assert capsys.readouterr().err == f"risorius: {out}: File too large\n"
    assert out.read_text() == "old"
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("place", ["none/page.png", "none/page.html"])
def test_a_folder_that_is_not_there_is_said_before_the_face_is_looked_at(place, tmp_path, capsys):
    out = tmp_path / place
    assert main(["plot", str(tmp_path / "absent.dna"), "-o", str(out)]) == 1
    error = capsys.readouterr().err
    assert error == f"risorius: {out}: cannot write it: its folder is not there\n"


def test_without_matplotlib_one_sentence_says_what_to_install(tmp_path):
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from risorius.cli import main\n"
        f"sys.exit(main(['plot', {str(GOLDEN / 'core.dna')!r}, '-o', 'page.html']))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 1
    assert "pip install risorius[plot]" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_rotation_order_that_nobody_knows_is_drawn_as_x_y_z():
    dna = risorius.Dna()
    dna.joint_names, dna.joint_parents = ["root", "jaw"], [0, 0]
    dna.neutral_joint_translations = [[0, 0, 0], [0, 1, 0]]
    dna.neutral_joint_rotations = angles = np.float32([[30, 40, 50], [-10, 5, 80]])
    known = [oracle.rotation_matrix(dna, np.asarray(row, float)) for row in angles]
    dna.rotation_sequence, dna.rotation_signs, dna.rotation_unit = "#40", (0, 1, 65536), "#3"
    dna = risorius.load(dna.to_bytes())
    assert dna.rotation_sequence == "#40"
    np.testing.assert_allclose(skeleton.rotations(dna), known, atol=1e-12)
    dna.rotation_signs = (0, -7, 1)
    dna.rotation_unit = "radians"
    known = [
        oracle.rotation_matrix(risorius.Dna(), np.degrees(np.asarray(row, float)) * [1, -1, 1])
        for row in angles
    ]
    np.testing.assert_allclose(skeleton.rotations(dna), known, atol=1e-12)
