# SPDX-License-Identifier: MIT
"""Tests of repair: lids and lips close, and expressions without faults do not change."""

import copy
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from risorius._native import ClosestPoints
from risorius.anyhead.errors import Stopped
from risorius.anyhead.eyes.eyelids import find_eyelids
from risorius.anyhead.fittings import Bodies, sort_parts
from risorius.anyhead.repair import repair
from risorius.anyhead.repair.contact import Contacts
from risorius.anyhead.repair.lips import Lips
from risorius.anyhead.surface import Surface
from risorius.author.heads.turning import look_turn

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from support.plain_head import (
    EYE,
    HALF,
    MOUTH,
    RADIUS,
    TOGETHER,
    arch,
    eyes_and_teeth,
    mask,
    part,
)

CLOSED = ("jawOpen", *TOGETHER)


class Corners:
    points = {
        "mouth_corner_R": np.array([-HALF, MOUTH, 8.2]),
        "mouth_corner_L": np.array([HALF, MOUTH, 8.2]),
    }


@pytest.fixture(scope="module")
def head():
    return mask()


@pytest.fixture(scope="module")
def skin(head):
    return Surface.of_polygons(head.points, head.faces)


@pytest.fixture(scope="module")
def fitted(head):
    return sort_parts([part("face", head.points, head.faces), *eyes_and_teeth()])


@pytest.fixture(scope="module")
def mended(head, skin, fitted):
    return repair(skin, head.faces, fitted, Corners(), None, head.ways, {CLOSED: head.closed})


def seen(skin, points, ball):
    """How much of an eye is visible from the front, computed without the code under test.

    Parallel rays start in a grid of 0.2 mm. Returns the number of rays that hit the eye, and the
    largest number in one column of the grid.
    """
    at = np.arange(-RADIUS, RADIUS, 0.02)
    x, y = (grid.ravel() for grid in np.meshgrid(at, at))
    begin = ball.middle + np.stack([x, y, np.full(len(x), 9.0)], axis=1)
    rays = np.broadcast_to([0.0, 0.0, -1.0], begin.shape)
    eye = ClosestPoints(ball.points, ball.triangles.astype(np.int32)).first_hit(begin, rays)
    lid = ClosestPoints(points, skin.triangles.astype(np.int32)).first_hit(begin, rays)
    hit = (eye[0] >= 0) & ((lid[0] < 0) | (eye[2] < lid[2]))
    return int(hit.sum()), int(hit.reshape(len(at), -1).sum(axis=0).max())


@pytest.mark.parametrize("side", ["L", "R"])
def test_a_blink_that_stops_short_shows_nothing_of_the_eye(head, skin, fitted, mended, side):
    ball, name = fitted.eyes[side], f"eyeBlink{side}"
    assert seen(skin, skin.points + head.ways[name], ball)[1] >= 10
    assert seen(skin, skin.points + mended.expressions[name], ball)[1] <= 1
    before, after = mended.report.rows[name]
    assert before.lid_gap > 2.0
    assert after.lid_gap <= 0.15
    assert after.cut <= 0.05


def test_a_blink_moves_its_own_lids_alone(head, skin, mended):
    away = np.linalg.norm(skin.points - EYE, axis=1) > 2 * RADIUS
    change = mended.expressions["eyeBlinkL"] - head.ways["eyeBlinkL"]
    assert np.abs(change[away]).max() == 0
    assert np.abs(change).max() > 0.1


def test_lids_that_close_already_stay_as_they_are(skin, fitted, mended):
    lids = find_eyelids(skin, fitted.eyes["L"])
    closed = mended.expressions["eyeBlinkL"]
    assert np.abs(lids.closed(closed) - closed).max() < 0.02


def test_lids_of_an_eye_that_turns_are_lifted_out_of_what_bulges(skin, fitted):
    """An upper lid that is pressed into an eye that looks down is lifted out of the cornea."""
    lids = find_eyelids(skin, fitted.eyes["L"])
    arm = skin.points - EYE
    inwards = np.where(
        (np.linalg.norm(arm, axis=1) < 1.2 * RADIUS)[:, None] & (arm[:, 1:2] > 0.6), -0.12 * arm, 0
    )
    turn = look_turn("eyeLookDown")
    assert lids.cut(inwards, turn) > 0.05
    assert lids.cut(lids.lifted(inwards, turn), turn) < 0.005


def test_closed_lids_are_lifted_out_of_a_cornea_that_turns_below_them(skin, fitted, mended):
    """The lids meet and show nothing of the eye, so the cut is their only fault."""
    ball, blink, turn = fitted.eyes["L"], mended.expressions["eyeBlinkL"], look_turn("eyeLookUp")
    arm = ball.points - EYE
    front = np.clip(8 * arm[:, 2:] / RADIUS - 7, 0, 1)
    lids = find_eyelids(skin, replace(ball, points=ball.points + 0.15 * front * arm, _surface=[]))
    assert lids.gap(blink, turn) == 0
    assert lids.cut(blink, turn) > 0.05
    out = lids.closed(blink, turn)
    assert lids.gap(out, turn) <= 0.015
    assert lids.cut(out, turn) < 0.005


def test_a_cornea_that_comes_through_a_lid_is_no_gap_between_the_edges(head, skin, fitted):
    """The lid is lifted over the cornea, and not turned down by the height of the visible part."""
    ball, blink = fitted.eyes["L"], head.ways["eyeBlinkL"]
    arm = ball.points - EYE
    front = np.clip(8 * arm[:, 2:] / RADIUS - 7, 0, 1)
    lids = find_eyelids(skin, replace(ball, points=ball.points + 0.15 * front * arm, _surface=[]))
    assert lids.gap(blink) > 0.9
    assert lids.cut(blink) > 0.1
    out = lids.closed(blink)
    assert lids.gap(out) <= 0.005
    assert lids.cut(out) < 0.005
    assert np.linalg.norm(out - blink, axis=1).max() < 0.3


def test_edges_of_lids_that_rest_inside_the_eye_come_out_where_they_close(head, skin, fitted):
    ball, blink, arm = fitted.eyes["L"], head.ways["eyeBlinkL"], skin.points - EYE
    length = np.linalg.norm(arm, axis=1)
    edge = (np.hypot(arm[:, 0] / 1.05, arm[:, 1] / 0.5) < 1.02) & (length < 1.5 * RADIUS)
    inside = np.where(edge, 0.98 * RADIUS / length, 1.0)[:, None]
    lids = find_eyelids(Surface(EYE + inside * arm, skin.triangles), ball)
    assert lids.gap(blink) > 0.5
    out = lids.closed(blink)
    assert lids.gap(out) <= 0.005
    assert lids.cut(out) < 0.005


def test_an_eye_behind_skin_has_no_lids(skin, fitted):
    hidden = fitted.eyes["L"]
    back = type(hidden)("L", hidden.middle * [1, -1, 0.8], RADIUS, hidden.points, hidden.triangles)
    assert find_eyelids(skin, back) is None


def test_lips_meet_where_an_open_jaw_is_closed(head, skin, mended):
    before, after = mended.report.rows["+".join(CLOSED)]
    assert before.lip_gap > 1.5
    assert after.lip_gap <= 0.3
    assert after.lip_cut <= 0.15
    # Distances between the lower and the upper line of the lips, which coincide at rest; they are
    # measured without the tested code.
    points = skin.points + mended.combinations[CLOSED]
    line = np.flatnonzero(np.abs(skin.points[:, 1] - MOUTH) < 0.01)
    middle = line[np.abs(skin.points[line, 0]) < 0.6 * HALF]
    x = skin.points[middle, 0].round(3)
    apart = [np.ptp(points[middle[x == value], 1]) for value in np.unique(x)]
    assert len(apart) > 10
    assert max(apart) < 0.05


def test_a_pose_that_closes_the_mouth_is_made_where_there_is_none(head, skin, fitted):
    ways = head.ways | {"mouthClose": head.closed - head.ways["jawOpen"]}
    out = repair(skin, head.faces, fitted, Corners(), None, ways, {})
    assert list(out.combinations) == [("jawOpen", "mouthClose")]
    assert out.report.rows["jawOpen+mouthClose"][1].lip_gap <= 0.3


def test_what_works_only_together_with_others_is_an_expression_that_moves_nothing(head, mended):
    assert list(mended.expressions) == [*head.ways, *TOGETHER]
    assert not any(mended.expressions[name].any() for name in TOGETHER)


def test_lips_that_are_far_apart_are_not_torn(head, skin):
    bare = sort_parts([part("face", head.points, head.faces)])
    jaw = head.ways["jawOpen"]  # the lip controls add nothing, so the mouth stays open
    out = repair(skin, head.faces, bare, Corners(), None, head.ways, {CLOSED: jaw})
    assert np.array_equal(out.combinations[CLOSED], jaw)
    assert "too far to be brought together: is the mouth open at rest?" in out.report.notes[-1]
    assert bare.notes == out.report.notes


@pytest.mark.parametrize("together", [TOGETHER, ("mouthClose",)])
def test_lips_that_are_apart_at_rest_meet_with_and_without_an_open_jaw(head, together):
    jaw, closed = head.ways["jawOpen"], ("jawOpen", *together)
    points = head.points + 0.4 * jaw
    skin, bare = Surface.of_polygons(points, head.faces), part("face", points, head.faces)
    each = 1 / len(together)  # share of the gap of an open jaw that one control closes
    ways = {("jawOpen", name): jaw + each * (head.closed - jaw) for name in together}
    out = repair(skin, head.faces, sort_parts([bare]), Corners(), None, head.ways,
                 {**ways, closed: head.closed})  # fmt: skip
    for pose in (together, closed):
        after = out.report.rows["+".join(pose)][1]
        assert after.lip_gap <= 0.3
        assert after.lip_cut <= 0.3
    assert out.report.notes == []
    lips = Lips(skin, head.ways, np.stack([*Corners.points.values()]))
    motion = sum(out.expressions[name] for name in together)
    half = lips.meeting(points + 0.5 * motion).gap.mean()
    assert half == pytest.approx(lips.rest.gap.mean() / 2, rel=0.25)


def test_a_control_that_closes_too_far_at_rest_closes_only_an_open_jaw_further(head):
    points = head.points + 0.4 * head.ways["jawOpen"]
    skin, bare = Surface.of_polygons(points, head.faces), part("face", points, head.faces)
    ways = head.ways | {"mouthClose": head.closed - head.ways["jawOpen"]}
    out = repair(skin, head.faces, sort_parts([bare]), Corners(), None, ways, {})
    assert np.array_equal(out.expressions["mouthClose"], ways["mouthClose"])
    assert list(out.combinations) == [("jawOpen", "mouthClose")]
    assert out.report.rows["jawOpen+mouthClose"][1].lip_gap <= 0.3


def test_skin_that_is_pressed_into_teeth_comes_out(head, skin, fitted):
    flat = type(fitted)(fitted.face, copy.deepcopy(fitted.of("teeth")))
    for row in flat.rows:  # move the teeth towards the lips
        row.part.mesh.positions[:, 2] += 1.4
    bodies = Bodies(flat, skin, head.ways)
    contacts = Contacts(skin, head.faces, bodies)
    near = np.hypot(skin.points[:, 0], skin.points[:, 1] - MOUTH) < 1.2
    pressed = np.where(near[:, None], [0.0, 0.0, -0.45], 0.0)
    before = contacts.volume(pressed, ())
    assert before > 20
    assert contacts.volume_by_checker(pressed, ()) > 20
    out = contacts.pushed(pressed, ())
    assert contacts.volume(out, ()) < 0.05 * before


def test_teeth_of_the_jaw_go_with_it(head, skin, fitted):
    bodies = Bodies(fitted, skin, head.ways | {"jawOpen": turned_jaw(skin)})
    upper, lower = bodies.posed(("jawOpen",))
    assert np.array_equal(upper, arch(MOUTH + 0.05, 1)[0])
    assert lower[:, 1].max() < arch(MOUTH - 0.05, -1)[0][:, 1].max() - 0.5


def turned_jaw(skin):
    arm = skin.points - [0, 0, 0]
    c, s = np.cos(0.3), np.sin(0.3)
    turned = np.stack([arm[:, 0], c * arm[:, 1] - s * arm[:, 2], s * arm[:, 1] + c * arm[:, 2]], 1)
    return np.where(skin.points[:, 1:2] < MOUTH, turned - arm, 0.0)


def test_what_is_told_of_the_progress_can_stop_it(head, skin, fitted):
    told = []

    def tell(share):
        told.append(share)
        return len(told) < 2

    with pytest.raises(Stopped):
        repair(skin, head.faces, fitted, Corners(), None, head.ways, {}, tell)
    assert told == sorted(told)


def test_a_face_without_eyes_and_lips_stays_as_it_is(head, skin):
    bare = sort_parts([part("face", head.points, head.faces)])
    ways = {"browDownL": np.where(skin.points[:, 1:2] > 4, [0.0, -0.2, 0.0], 0.0)}
    out = repair(skin, head.faces, bare, None, None, ways, {})
    assert np.array_equal(out.expressions["browDownL"], ways["browDownL"])
    assert out.report.rows == {}


def test_lips_of_long_triangles_that_touch_have_no_gap():
    """Only inner points of the sides lie on the line between the lips in most columns."""
    x = np.arange(-3.2, 3.21, 0.8)
    rows = [np.stack([x + shift, np.full(9, y), np.full(9, 8.0)], axis=1)
            for y, shift in ((0, 0), (0.7, 0.4), (0, 0.3), (-0.7, -0.1))]  # fmt: skip
    right = np.arange(8)
    strips = [np.stack([[a, a + 1, b], [a + 1, b + 1, b]])[:, ::order].transpose(2, 0, 1)
              for a, b, order in ((right, right + 9, 1), (right + 18, right + 27, -1))]  # fmt: skip
    skin = Surface(np.concatenate(rows), np.concatenate(strips).reshape(-1, 3))
    low = np.repeat([0.0, 1.0], 18)[:, None]
    ways = {"jawOpen": low * [0, -1, 0], "mouthFunnelUL": np.full((36, 3), 0.2)}
    lips = Lips(skin, ways, np.array([[-HALF, 0, 8], [HALF, 0, 8]]))
    assert lips.found
    assert np.abs(lips.rest.gap).max() < 0.01
    apart = skin.points + 0.1 * low * [0, -1, 0]
    assert lips.meeting(apart).gap == pytest.approx(0.1, abs=0.01)


def test_lips_that_a_triangle_connects_are_counted_as_welded(head, skin):
    corners = np.stack([Corners.points[f"mouth_corner_{side}"] for side in "RL"])
    assert Lips(skin, head.ways, corners).welded() == 0
    lips = Lips(skin, head.ways, corners)
    upper, lower = (np.unique(triangles) for triangles in (lips._upper, lips._lower))
    above = upper[np.abs(skin.points[upper] - [0, MOUTH, 9]).sum(axis=1).argsort()[:2]]
    below = lower[np.abs(skin.points[lower] - [0, MOUTH, 9]).sum(axis=1).argmin()]
    welded = Surface(skin.points, np.concatenate([skin.triangles, [[*above, below]]]))
    assert Lips(welded, head.ways, corners).welded() == 1
