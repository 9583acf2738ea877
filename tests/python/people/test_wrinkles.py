# SPDX-License-Identifier: MIT
"""Tests wrinkles of sample people: they appear where skin is compressed, across its direction."""

import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import risorius
from risorius.author.levels import extend_levels
from risorius_people import blend_shape_face, build, expressions, people, wrinkles
from risorius_people.expressions import Expression
from risorius_people.paint import textures
from risorius_people.part import Part
from risorius_people.polygons import Polygons

_LOGIC = Path(__file__).parents[3] / "addon" / "risorius" / "logic" / "material"
SIDE = 20


def _module(name):
    spec = importlib.util.spec_from_file_location(f"addon_{name}", _LOGIC / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def sheet():
    """A flat square of quads whose UV coordinates equal x and y, from 0 to 1."""
    x, y = np.meshgrid(np.linspace(0, 1, SIDE), np.linspace(0, 1, SIDE))
    positions = np.column_stack([x.ravel(), y.ravel(), np.zeros(SIDE**2)])
    faces = [
        [a, a + 1, a + SIDE + 1, a + SIDE]
        for row in range(SIDE - 1)
        for a in range(row * SIDE, row * SIDE + SIDE - 1)
    ]
    polygons = Polygons(faces, faces, positions[:, :2], SIDE**2)
    return Part("head_lod0_mesh", polygons, []), positions


def folds(sheet, change):
    """float64[V, 4]: folds of the mask blink_L if eyeBlinkL deforms the sheet by `change`.

    All other controls move nothing.
    """
    part, positions = sheet
    still = Expression(np.zeros_like(positions))
    units = {
        next(iter(region.drivers)) + side: still
        for region in wrinkles.REGIONS.values()
        for side in "LR"
    }
    units["eyeBlinkL"] = Expression(positions @ np.asarray(change, float).T - positions)
    found = wrinkles.vertex_folds(part, positions[:, :2], positions, units)
    assert all(not rows.any() for name, rows in found.items() if name != "head_wm1_blink_L")
    return found["head_wm1_blink_L"]


@pytest.mark.parametrize("share", [0.05, 0.1])
def test_skin_folds_as_far_as_it_is_pushed_together(sheet, share):
    found = folds(sheet, np.diag([1 - share, 1, 1]))
    expected = (share - wrinkles._LEAST) / (wrinkles._FULL - wrinkles._LEAST)
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-9)
    # The columns 1 to 3 are xx, xy and yy of the tensor of the folds' direction. Folds run
    # perpendicular to the compression along x, so only yy is not 0.
    np.testing.assert_allclose(found[:, 3], expected, atol=1e-9)
    np.testing.assert_allclose(found[:, 1:3], 0, atol=1e-9)


def test_lines_turn_with_the_way(sheet):
    turn = np.array([[1, -1, 0], [1, 1, 0], [0, 0, np.sqrt(2)]]) / np.sqrt(2)
    found = folds(sheet, turn @ np.diag([0.9, 1, 1]) @ turn.T)
    xx, xy, yy = found[:, 1:].T
    np.testing.assert_allclose(xx, yy, atol=1e-9)
    np.testing.assert_allclose(xy, -xx, atol=1e-9)  # compressed along (1, 1), lines along (1, -1)


@pytest.mark.parametrize("change", [np.diag([1.3, 1.2, 1]), np.eye(3), np.diag([0.99, 1, 1])])
def test_what_is_stretched_or_hardly_moved_stays_smooth(sheet, change):
    assert not folds(sheet, change).any()


def test_a_turn_folds_nothing(sheet):
    c, s = np.cos(0.7), np.sin(0.7)
    np.testing.assert_allclose(folds(sheet, [[c, 0, s], [0, 1, 0], [-s, 0, c]]), 0, atol=1e-9)


@pytest.mark.parametrize("way", [0, 1])
def test_folds_run_along_their_lines(way):
    tensors = np.zeros((96, 96, 3))
    tensors[..., 2 * way] = 1
    there = np.ones((96, 96), bool)
    there[:, :10] = False
    heights = wrinkles.relief(tensors, there)
    assert not heights[:, :10].any()
    inner = heights[20:76, 30:86]
    assert inner.min() < -0.9
    assert inner.max() <= 0
    # If `way` is 0, lines are along x, so that neighbours in x are similar and neighbours in y are
    # not.
    along = np.abs(np.diff(inner, axis=1 - way)).mean()
    across = np.abs(np.diff(inner, axis=way)).mean()
    assert across > 4 * along


def test_normals_are_those_of_the_slope():
    x, y = np.meshgrid(np.arange(32) * 0.5, np.arange(32) * 0.25)
    places = np.stack([x, y, 0 * x], axis=2)
    found = wrinkles.normals(0.3 * x - 0.2 * y, places)[5:-5, 5:-5]
    wanted = np.array([-0.3, 0.2, 1.0])
    wanted /= np.linalg.norm(wanted)
    np.testing.assert_allclose(found, np.broadcast_to(0.5 + 0.5 * wanted, found.shape), atol=1e-6)


def test_the_add_on_knows_each_map_and_its_mask():
    uses = _module("animated_maps").uses_of(wrinkles.map_names())
    search = (_LOGIC / "texture_search.py").read_text(encoding="utf-8")
    mask = re.compile(re.search(r'_MASK = re.compile\(r"(.*)"\)', search).group(1))
    for use, name in zip(uses, wrinkles.map_names(), strict=True):
        region = name.partition("_normal_")[2]
        assert use.normal
        assert not use.color
        assert use.region == region.lower()
        assert use.number == int(region[7])
        assert use.side == region[-1]
        assert use.area != "all"
        assert mask.match(f"{region}_msk".lower()).group(1) == region.lower()
        assert region in wrinkles.masks_of(use.number)


def test_coarse_levels_have_no_wrinkles():
    dna = risorius.Dna()
    names = [*blend_shape_face.FLUSH, *wrinkles.map_names()]
    dna.lod_count = 2
    dna.raw_control_names = ["CTRL_expressions.a"]
    dna.animated_map_names = names
    dna.lod_animated_map_mapping = [range(len(names))] * 2
    rows = [(0, output, 0, 1, 1, 0) for output in range(len(names))]
    maps = risorius.AnimatedMaps(
        lods=[len(rows)] * 2, conditionals=blend_shape_face.conditionals(rows)
    )
    dna.animated_maps = maps
    extend_levels(dna, 8)
    build.leave_maps(dna)
    listed = [list(dna.lod_animated_map_mapping[lod]) for lod in range(8)]
    assert listed == [list(range(len(names)))] * 4 + [[0, 1]] * 4
    assert list(dna.animated_maps.lods) == [len(rows)] * 4 + [2] * 4


def test_each_map_has_a_driver():
    drivers = wrinkles.drivers()
    assert {number for _, number, _ in drivers} == set(range(len(wrinkles.map_names())))
    for control, number, slope in drivers:
        assert control[-1] == wrinkles.map_names()[number][-1]
        assert 0 < slope <= 1


def test_a_smile_folds_the_cheek_from_the_nose_past_the_mouth():
    eye = np.array([0.3, 16.3, 1.3])
    x, y = np.meshgrid(np.linspace(-0.8, 0.8, 161), np.linspace(-1.2, 0.3, 151))
    places = np.stack([x, y + eye[1], np.full_like(x, 0.1 + eye[2])], axis=2)
    height, there = wrinkles.laugh_fold(places, eye)
    np.testing.assert_allclose(height, height[:, ::-1], atol=1e-12)
    row = height[np.argmin(np.abs(y[:, 0] + 0.62)), 80:]
    deepest = x[0, 80:][row.argmin()]
    assert deepest == pytest.approx(0.27, abs=0.011)
    assert row.min() < -0.7 * wrinkles._FOLD_DEPTH
    assert 0.03 < x[0, 80:][row.argmax()] - deepest < 0.12  # on the outer side
    assert row.max() > 0.4 * wrinkles._FOLD_DEPTH
    assert not height[(y > -0.35) | (y < -0.91)].any()
    assert not there[(y > -0.35) | (y < -0.91)].any()


def test_lines_of_age_make_no_grid_between_the_brows(sheet):
    part, positions = sheet
    face = positions * [1.2, 1.2, 0] + [-0.6, -0.5, 0]  # decimetres around the eyes
    still = Expression(np.zeros_like(face))
    units = {
        control + side: still
        for region in wrinkles.REGIONS.values()
        for control in region.drivers
        for side in "LR"
    }
    up = {f"browRaiseIn{side}": Expression(face * [0, -0.06, 0]) for side in "LR"}
    down = {f"browDown{side}": Expression(face * [-0.06, 0, 0]) for side in "LR"}
    person = people.PEOPLE["elder"]

    def lines(moves):
        found = textures.head_wrinkles(
            person, part, face, np.array([0.3, 0, 0]), units | moves, 256
        )
        return found.still

    raised, frowned, both = lines(up), lines(down), lines(up | down)
    columns = 128 + np.array([-14, 14])  # 6.5 mm to each side of the middle
    between = slice(110, 140), slice(*columns)  # from the height of the eyes to 16 mm above
    forehead = slice(190, 230), slice(*columns)
    assert frowned[between].max() > 0.05
    assert raised[forehead].max() > 0.05
    np.testing.assert_array_equal(both[between], frowned[between])
    np.testing.assert_array_equal(both[forehead], raised[forehead])


@pytest.mark.parametrize("side", "LR")
def test_a_true_smile_lifts_its_own_cheek_and_no_lip(side):
    sign = 1 if side == "L" else -1
    places = np.array(
        [[0.42, -0.36, 0.0], [-0.42, -0.36, 0.0], [0.1, -0.72, 0.3], [-0.1, -0.72, 0.3], [0, 0, 0]]
    )
    there = Expression(np.full((5, 3), 0.05))
    units = {name + side: there for name in ("mouthCornerPull", "eyeCheekRaise")}
    moved = expressions.cheek_mass(units, places, side)
    still = Expression(np.zeros((5, 3)))  # teeth: no control moves them
    assert not expressions.cheek_mass(dict.fromkeys(units, still), places, side).any()
    own, other = (0, 1) if side == "L" else (1, 0)
    assert moved[own, 2] > 0.02
    assert sign * moved[own, 0] > 0
    assert not moved[other].any()
    np.testing.assert_allclose(moved[2:], 0, atol=1e-3)


def test_no_fold_is_made_where_two_sides_meet(sheet):
    """Each side alone compresses the middle, but both sides together only shift the skin."""
    part, positions = sheet
    surface = wrinkles.Surface(part.polygons, positions[:, :2], positions)
    left = np.clip(0.5 + (positions[:, :1] - 0.5) / 0.3, 0, 1)
    way = np.array([[0.1, 0.0, 0.0]])
    assert surface.folds(positions + (1 - left) * way)[:, 0].max() > 0.5

    def shared(move):
        return wrinkles.folds_of_sides(
            surface, positions, {"L": left * move, "R": (1 - left) * move}
        )

    assert max(rows[:, 0].max() for rows in shared(way).values()) < 0.01
    # If both sides together make folds, each side's control shows the folds of its side.
    together = positions * [[-0.4, 0, 0]]
    found, whole = shared(together), surface.folds(positions + together)
    np.testing.assert_allclose(found["L"] + found["R"], whole, atol=1e-9)
    assert found["R"][positions[:, 0] > 0.9].max() < 0.01 < whole.max()
