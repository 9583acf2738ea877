# SPDX-License-Identifier: MIT
"""Tests how the jaw of a head is measured by its skin or by its own teeth.

Other tests of heads: pairs of balls may be eyes, the search for a face can be stopped, and lids
move until they meet.
"""

from __future__ import annotations

import dataclasses
from functools import cache

import jointed_face
import numpy as np
import pytest
from risorius.anyhead.balls import paired_balls
from risorius.anyhead.conform.jaw import joint_shifts
from risorius.anyhead.errors import Stopped
from risorius.anyhead.form.fitting import Pose
from risorius.anyhead.form.heads import head_form
from risorius.anyhead.form.teeth import JawChange, jaw_change, shown_by
from risorius.anyhead.landmarks.find import Hints, find_form
from risorius.anyhead.surface import Surface
from risorius.anyhead.transfer.carrying import Carrying
from risorius.anyhead.transfer.form import softened
from risorius.anyhead.transfer.template import Jaw, TemplateFace
from risorius.author.geometry import skeleton as sk
from risorius.author.geometry.rigid import rigid_way
from risorius.author.heads.parts import HeadPart
from risorius.author.input.obj import ObjMesh

Y, Z = np.eye(3)[1], np.eye(3)[2]


@cache
def mean() -> Surface:
    form = head_form()
    return Surface(form.mean[: form.skin], form.triangles)


def still() -> Pose:
    return Pose(np.eye(3), 1.0, np.zeros(3))


def turn(degrees: float) -> np.ndarray:
    s, c = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def changed(points: np.ndarray) -> JawChange:
    found = jaw_change(mean(), points, mean(), still())
    assert found is not None
    return found


def test_the_same_head_has_the_same_jaw_and_a_turned_large_one_a_turned_large_one() -> None:
    same = changed(mean().points)
    assert np.abs(same.linear - np.eye(3)).max() < 1e-9
    assert np.abs(same.after - same.before).max() < 1e-9
    assert -8 < same.before[1] < -4  # below the eyes, cm
    other = changed(1.3 * mean().points @ turn(20).T + [1, 120, -3])
    assert np.abs(other.linear - 1.3 * turn(20)).max() < 1e-9
    assert np.abs(other.after - (1.3 * turn(20) @ same.before + [1, 120, -3])).max() < 1e-9


def test_a_skin_of_no_human_form_does_not_make_a_jaw_of_no_human_size() -> None:
    noise = np.random.default_rng(3).normal(size=mean().points.shape)
    found, told = changed(mean().points + 3.0 * noise), head_form().teeth
    size = np.cbrt(np.linalg.det(found.linear))
    assert 0.5 < size < 2.0
    assert np.abs(found.after - found.before).max() < 3 * told.spread[:3].max() + 2.0
    half = Surface(mean().points, mean().triangles[:50])
    assert jaw_change(half, half.points, half, still()) is None


def test_own_teeth_show_the_jaw_unless_they_are_of_another_model() -> None:
    teeth = np.random.default_rng(5).uniform(-1, 1, (200, 3)) * [2.5, 0.5, 2.0] + [0, -6, 3]
    told = JawChange(np.array([0.0, -6.0, 3.0]), np.array([0.0, -6.0, 3.0]), np.eye(3))
    own = shown_by(told, teeth, 1.04 * teeth + [0, -0.1, 0.2])
    middle = (teeth.min(axis=0) + teeth.max(axis=0)) / 2
    assert np.abs(own.after - (1.04 * middle + [0, -0.1, 0.2])).max() < 1e-9
    assert np.abs(own.linear - 1.04**0.5 * np.eye(3)).max() < 1e-9
    for other in (1.5 * teeth, teeth - np.array([0, 1.0, 0]), teeth * [1, 0, 1]):
        assert shown_by(told, teeth, other) is told


def test_what_the_jaw_takes_along_moves_as_the_teeth_do() -> None:
    points = mean().points
    hinge, shift, rotation = np.array([0.0, -1.0, -7.0]), np.array([0.0, -0.4, 0.5]), turn(20)
    way = np.where(points[:, 1:2] < -7, rigid_way(points, hinge, rotation, shift), 0.0)
    pose = ("jawOpen",)
    face = TemplateFace("", mean(), 0, pose, {pose: way.astype(np.float32)},
                        Jaw(hinge, {pose: (rotation, shift)}))  # fmt: skip
    teeth = JawChange(np.array([0.0, -6.0, 3.0]), np.array([0.0, -6.3, 3.1]), 1.1 * np.eye(3))
    got = Carrying(face, points, np.ones(len(points)), teeth).carried(pose)
    chin = np.argmax((points[:, 2] - points[:, 1]) * (np.abs(points[:, 0]) < 1))
    change = np.log(1.1)
    size = np.exp(change * (change**2 + 0.75 * 0.1**2) / (change**2 + 0.1**2))
    moved = size * rigid_way(teeth.before[None], hinge, rotation, shift)[0]
    wanted = rigid_way(points, teeth.after, rotation, moved)
    assert np.linalg.norm(got[chin] - wanted[chin]) < 0.01
    unsure = dataclasses.replace(teeth, sure=False)
    by_skin, same = (
        Carrying(face, points, np.ones(len(points)), told).carried(pose) for told in (None, unsure)
    )
    assert np.array_equal(same, by_skin)
    assert np.linalg.norm(by_skin[chin] - got[chin]) > 0.02


def test_a_closed_mouth_stays_closed_on_another_jaw() -> None:
    points = mean().points
    hinge, rotation = np.array([0.0, -1.0, -7.0]), turn(20)
    opening = np.where(points[:, 1:2] < -7, rigid_way(points, hinge, rotation, np.zeros(3)), 0.0)
    ways = {("jawOpen",): opening.astype(np.float32), ("mouthClose",): -opening.astype(np.float32)}
    face = TemplateFace("", mean(), 0, ("jawOpen", "mouthClose"), ways,
                        Jaw(hinge, {("jawOpen",): (rotation, np.zeros(3))}))  # fmt: skip
    other = points * [1.2, 0.9, 1.1]
    both = [Carrying(face, other, np.ones(len(points))).carried(pose) for pose in ways]
    assert np.abs(both[0]).max() > 1.0
    assert np.abs(both[0] + both[1]).max() < 1e-6


def test_small_changes_of_form_count_less_than_large_ones() -> None:
    turned = turn(30) @ np.diag([1.05, 1.0, 1.6])
    soft = softened(turned, 0.6)
    left, stretch, right = np.linalg.svd(soft)
    assert np.abs(left @ right - turn(30)).max() < 1e-9
    small, large = np.log([1.05, 1.6])
    assert 0.6 < np.log(stretch[1]) / small < 0.7
    assert abs(stretch[2] - 1) < 1e-9
    assert 0.95 < np.log(stretch[0]) / large < 1


def test_the_joint_of_the_jaw_moves_so_that_the_teeth_do() -> None:
    dna = jointed_face.build()
    columns, none = sk.column_count(dna), np.zeros((len(dna.joint_names), 9))
    rotated = np.abs(sk.column_deltas(dna, columns)[:, :, 3:6]).max(axis=(0, 2))
    joint = int(rotated.argmax())
    at = sk.world_matrices(dna, none)[joint]
    teeth = JawChange(at[:3, 3] + [0, -2, 3], at[:3, 3] + [0, -2.2, 3.1], 1.2 * np.eye(3))
    after = at[:3, 3] + [0.1, 0.2, 0.3]
    shifts = joint_shifts(dna, joint, teeth, np.eye(3), (at[:3, 3], after))
    for column in range(columns):
        alone = none.copy()
        alone[joint] = sk.column_deltas(dna, columns)[column, joint]
        motion = sk.world_matrices(dna, alone)[joint] @ np.linalg.inv(at)
        own = motion[:3, :3] @ teeth.before + motion[:3, 3] - teeth.before
        there = after + shifts[column] + motion[:3, :3] @ (teeth.after - after)
        assert np.abs(there - teeth.after - 1.2 * own).max() < 1e-9


def ball(middle: tuple[float, float, float], radius: float, name: str) -> HeadPart:
    up, around = np.meshgrid(np.linspace(0.2, 2.9, 9), np.linspace(0, 6, 12), indexing="ij")
    points = np.stack([np.sin(up) * np.cos(around), np.cos(up), np.sin(up) * np.sin(around)], -1)
    points = radius * points.reshape(-1, 3) + middle
    rows = np.arange(9 * 12).reshape(9, 12)
    faces = np.stack([rows[:-1, :-1], rows[1:, :-1], rows[1:, 1:], rows[:-1, 1:]], -1)
    faces = faces.reshape(-1, 4).tolist()
    mesh = ObjMesh(points, np.zeros((0, 2)), faces, [[]] * len(faces))
    return HeadPart(name, mesh, source=name)


def test_balls_that_come_in_pairs_may_be_eyes() -> None:
    head = ball((0, 0, 0), 1, "head")
    head.mesh.positions[:] *= [9, 12, 10]
    eyes = [ball((3, 0, 9), 1.2, "a"), ball((-3, 0, 9), 1.21, "b")]
    button = ball((0, -12, 9), 0.4, "button")
    found = np.array(paired_balls([head, *eyes, button]))
    assert np.abs(found - [[3, 0, 9], [-3, 0, 9]]).max() < 0.01
    assert paired_balls([head, eyes[0], button]) == []


def test_the_search_for_a_face_tells_how_far_it_is_and_stops() -> None:
    heard: list[float] = []
    find_form(mean(), Hints(up=Y, front=Z), heard.append)
    assert heard == sorted(heard)
    assert heard[0] == 0.0
    assert heard[-1] == 1.0
    assert len(heard) > 20
    told: list[float] = []

    def stop(share: float) -> bool:
        told.append(share)
        return share < 0.1

    with pytest.raises(Stopped):
        find_form(mean(), Hints(up=Y, front=Z), stop)
    assert len(told) < len(heard)


def test_lids_go_until_they_meet() -> None:
    height = np.linspace(-1, 1, 21)
    grid = np.array([[x, y, 0.0] for y in height for x in np.linspace(-1, 1, 11)])
    cells = np.arange(21 * 11).reshape(21, 11)
    a, b, c, d = cells[:-1, :-1], cells[:-1, 1:], cells[1:, 1:], cells[1:, :-1]
    open_ = np.ones((20, 10), bool)
    open_[8:12] = False  # the opening between the lids
    triangles = np.concatenate([np.stack([a, b, c], -1)[open_], np.stack([a, c, d], -1)[open_]])
    way = np.zeros_like(grid)
    upper = grid[:, 1] > 0.15
    way[upper, 1] = -0.4 * np.clip((1 - grid[upper, 1]) / 0.8, 0, 1)
    way[~upper & (grid[:, 1] < -0.15), 1] = -0.03
    way[(grid[:, 1] == height[8]), 1] = 0.0
    way[grid[:, 1] == height[8], 1] = -0.03
    way[grid[:, 1] == height[12], 1] = -0.43
    pose = ("eyeBlinkL",)
    face = TemplateFace("", Surface(grid, triangles), 0, pose, {pose: way.astype(np.float32)}, None)
    narrow = grid.copy()
    narrow[grid[:, 1] > 0, 1] -= 0.1  # the form of the lids is the same, the opening is not
    got = Carrying(face, narrow, np.ones(len(grid))).carried(pose)
    edge, below = grid[:, 1] == height[12], grid[:, 1] == height[8]
    gap = (narrow + got)[edge, 1] - (narrow + got)[below, 1]
    assert np.abs(gap).max() < 0.02
    brow = grid[:, 1] > 0.85
    assert np.abs(got[brow] - way[brow]).max() < 0.02
    aside = narrow + [[0.03, 0, 0.05]] * (grid[:, 1:2] > 0)  # the upper lid stands elsewhere
    met = aside + Carrying(face, aside, np.ones(len(grid))).carried(pose)
    assert np.abs(met[edge] - met[below]).max() < 0.02
