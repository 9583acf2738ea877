# SPDX-License-Identifier: MIT
"""Tests that the check of random acting finds penetrations and measures their depth."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from risorius import expressions
from risorius.anim.reactions import load_exclusives

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
import acting_bodies as bodies
from acting_random import random_acting


def sphere(radius=1.4, bulge=0.1):
    """Vertices of an eyeball with a cornea that looks along z."""
    up, side = np.meshgrid(np.linspace(0.01, np.pi - 0.01, 40), np.linspace(-np.pi, np.pi, 80))
    rays = np.stack([np.sin(up) * np.sin(side), np.cos(up), np.sin(up) * np.cos(side)], axis=-1)
    rays = rays.reshape(-1, 3)
    return rays * (radius + bulge * np.exp(-8 * (1 - rays[:, 2:]) ** 2 / 0.1))


def test_a_motion_is_found_again():
    random = np.random.default_rng(3)
    rest = random.normal(size=(30, 3))
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    found, shift = bodies.rigid_motion(rest, rest @ turn.T + [1.0, 2.0, 3.0])
    assert np.allclose(found, turn)
    assert np.allclose(shift, [1.0, 2.0, 3.0])


def test_how_deep_something_lies_in_an_eye():
    ball = bodies.Ball(np.add(sphere(), [3.0, 160.0, 12.0]))
    middle = ball.middle
    assert np.allclose(middle, [3.0, 160.0, 12.0], atol=0.05)
    ways = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0], [0.6, 0, 0.8]])
    for inside in (-0.2, 0.05, 0.3):
        surface = 1.4 + 0.1 * np.exp(-8 * (1 - ways[:, 2]) ** 2 / 0.1)
        deep = ball.depth([3.0, 160.0, 12.0] + ways * (surface - inside)[:, None])
        assert deep == pytest.approx([inside] * 4, abs=0.02)


def test_what_lies_within_an_eye_is_no_part_of_its_surface():
    iris = sphere(0.9, 0.0)
    both = np.concatenate([sphere(), iris[iris[:, 2] > 0.7]])
    front = np.array([[0.0, 0.0, 1.45]])
    assert bodies.Ball(both).depth(front) == pytest.approx(
        bodies.Ball(sphere()).depth(front), abs=0.02
    )


def teeth():
    """Vertices and triangles of an arc of a wall: radius 3 to 3.4, height 0 to 1, z above 0."""
    angle, height = np.meshgrid(np.radians(np.arange(-80, 81, 5)), [0.0, 1.0], indexing="ij")
    places = np.concatenate(
        [
            np.stack([r * np.sin(angle), height, r * np.cos(angle)], axis=-1).reshape(-1, 3)
            for r in (3.0, 3.4)
        ]
    )
    half = len(places) // 2
    quads = np.arange(0, half - 2, 2)
    triangles = [(q, q + 1, q + 2) for q in quads] + [(q + 1, q + 3, q + 2) for q in quads]
    both = np.array(triangles + [(a + half, b + half, c + half) for a, b, c in triangles])
    return places, both


@pytest.mark.parametrize(
    ("radius", "height", "own", "other"),
    [
        (3.6, 0.5, 0.0, 0.0),  # in front of the teeth
        (3.3, 0.5, 0.1, 0.1),  # inside, near the front
        (3.05, 0.5, 0.35, 0.05),  # inside, near the back
        (2.5, 0.5, 0.9, 0.0),  # behind the teeth, where only the other lip may be
        (3.3, 1.5, 0.0, 0.0),  # above the teeth
    ],
)
def test_how_deep_a_lip_lies_in_teeth(radius, height, own, other):
    arch = bodies.Arch(*teeth(), back=0.0)
    place = np.array([[radius * np.sin(0.3), height, radius * np.cos(0.3)]])
    assert arch.depth(place, np.array([False])) == pytest.approx([own], abs=0.01)
    assert arch.depth(place, np.array([True])) == pytest.approx([other], abs=0.01)


def test_hair_under_the_skin_is_seen():
    places = np.array([[x, y, 0.0] for x in range(4) for y in range(4)], float)
    faces = [
        [4 * x + y, 4 * x + y + 4, 4 * x + y + 5, 4 * x + y + 1] for x in range(3) for y in range(3)
    ]
    triangles = np.array([t for f in faces for t in (f[:3], [f[0], f[2], f[3]])])
    hairs = np.array([[1.2, 1.4, 0.5], [2.1, 0.6, 0.1]])
    cards = bodies.Cards(hairs, places, triangles)
    assert cards.rest == pytest.approx([0.5, 0.1])
    raised = np.add(places, [0.0, 0.0, 0.3])
    assert bodies.Cards.height(hairs, raised[cards.corners]) == pytest.approx([0.2, -0.2])


def test_where_skin_folds_far_its_other_side_is_found_among_more_triangles():
    """A hair that is far from its neutral place needs more triangles to be measured correctly.

    The skin is a tube, and the hair moves from one side of the tube to the other side. The NEAR
    triangles nearest to its neutral place are all on the first side, so the hair seems to be
    inside the skin. The AROUND nearest triangles contain the other side.
    """
    around, along = 24, 5
    angle = 2 * np.pi * np.arange(around) / around
    ring = np.column_stack([np.sin(angle), np.cos(angle)])
    places = np.array([[x, y, z] for z in range(along) for x, y in ring])
    rings = np.arange(along * around).reshape(along, around)
    after = np.roll(rings, -1, axis=1)
    corners = np.stack([rings[:-1], after[:-1], after[1:], rings[1:]], axis=-1)
    faces = corners.reshape(-1, 4).tolist()
    triangles = np.array([t for f in faces for t in (f[2::-1], [f[3], f[2], f[0]])])
    cards = bodies.Cards(np.array([[0.0, 1.1, 2.0]]), places, triangles)
    assert cards.rest[0] > 0
    beyond = np.array([[0.0, -1.1, 2.0]])
    few, more = (
        bodies.Cards.height_over_nearest(beyond, places[cards.around[:, :count]])[0]
        for count in (cards.NEAR, cards.AROUND)
    )
    assert few < -1
    assert more == pytest.approx(0.1, abs=0.02)


def test_samples_are_vertices_edges_and_faces():
    places = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], float)
    skin = bodies.skin_samples(places, [[0, 1, 2, 3], [1, 4, 2]])
    found = {tuple(np.round(p, 3)) for p in skin.places}
    assert {(0.5, 0.5, 0.0), (0.5, 0.0, 0.0), (2.0, 0.5, 0.0), (1.0, 0.5, 0.0)} <= found
    assert np.allclose(skin.normals, [0, 0, 1])


def test_a_seed_gives_the_same_acting_and_the_rules_hold(standard_controls):
    one, same, other = (random_acting(standard_controls, seed, 300) for seed in (5, 5, 6))
    assert np.array_equal(one.raw, same.raw)
    assert one.words == same.words
    assert not np.array_equal(one.raw, other.raw)
    assert one.raw.min() >= 0.0
    assert one.raw.max() <= 1.0
    where = {name: i for i, name in enumerate(standard_controls)}
    for a, b in load_exclusives().opposites:
        assert np.minimum(one.raw[:, where[a]], one.raw[:, where[b]]).max() < 1e-6
    shown = " ".join(one.words)
    assert all(name in shown for name in expressions.load() if name != "sil")


def test_a_blind_sheet_has_both_and_only_its_key_knows_which(tmp_path):
    script = Path(__file__).resolve().parents[3] / "packaging" / "films" / "blind.py"
    for which, tint in (("old", 40), ("new", 200)):
        (tmp_path / which).mkdir()
        for name in ("a.png", "b.png", f"{which}.png"):
            Image.new("RGB", (20, 20), (tint, 0, 0)).save(tmp_path / which / name)
    sheet, key = tmp_path / "sheet.png", tmp_path / "key.json"
    folders = ["--old", str(tmp_path / "old"), "--new", str(tmp_path / "new")]
    command = [sys.executable, str(script), str(sheet), str(key), *folders]
    orders = set()
    for seed in range(6):
        more = ["--seed", str(seed), "--size", "20", "--columns", "4"]
        subprocess.run([*command, *more], check=True)
        rows = json.loads(key.read_text())
        assert sorted((r["which"], r["picture"]) for r in rows.values()) == [
            ("new", "a.png"), ("new", "b.png"), ("old", "a.png"), ("old", "b.png")
        ]  # fmt: skip
        orders.add(tuple(r["which"] for r in rows.values()))
        with Image.open(sheet) as picture:
            seen = [picture.getpixel((20 * i + 10, 38))[0] for i in range(4)]
        assert seen == [{"old": 40, "new": 200}[rows[str(i + 1)]["which"]] for i in range(4)]
    assert len(orders) > 1


def test_a_hair_beside_a_step_of_the_skin_lies_over_the_step():
    """Heights near a step in the skin are measured from its nearer plane, the floor or the side."""
    floor = np.array(
        [[[0, 0, 0], [1, 0, 0], [0, 0, -1]], [[1, 0, 0], [1, 0, -1], [0, 0, -1]]], float
    )
    side = np.array(
        [[[1, -1, 0], [1, -1, -1], [1, 0, -1]], [[1, -1, 0], [1, 0, -1], [1, 0, 0]]], float
    )
    skin = np.concatenate([floor, side])
    hairs = np.array([[1.2, -0.5, -0.5], [0.8, -0.5, -0.5], [0.5, 0.3, -0.5], [1.3, 0.4, -0.5]])
    found = bodies.Cards.height_over_nearest(hairs, np.broadcast_to(skin, (4, 4, 3, 3)))
    np.testing.assert_allclose(found, [0.2, -0.2, 0.3, 0.5], atol=1e-12)
