# SPDX-License-Identifier: MIT
"""Tests dragging of skin points, placing of handles, and control curves from a moving mesh."""

import math

import numpy as np
import pytest
import risorius
from risorius._native import descend
from risorius.solving.clip import CancelledError
from risorius.solving.sparse import cheapest_change
from skin_oracle import skinned, small_face

JAW, LEFT, RIGHT, PUFF, TWIN, IDLE, WIDEN = range(7)


@pytest.fixture(scope="module")
def face():
    dna = small_face()
    return dna, risorius.Surface(dna, risorius.Rig(dna))


def raw(**values):
    out = np.zeros(7, np.float32)
    for name, value in values.items():
        out[globals()[name.upper()]] = value
    return out


def pose(face, controls):
    dna, surface = face
    return skinned(dna, surface.rig.evaluate(controls))


POSES = [raw(), raw(jaw=0.6, left=0.3), raw(jaw=1, left=1, right=0.4, puff=0.7, widen=0.5)]


@pytest.mark.parametrize("controls", POSES)
def test_positions_are_those_of_the_skinned_pose(face, controls):
    np.testing.assert_allclose(face[1].positions(controls, 0), pose(face, controls), atol=2e-5)
    some = [17, 3, 170]
    found = face[1].positions(controls, 0, some)
    np.testing.assert_allclose(found, pose(face, controls)[some], atol=2e-5)


def test_derivatives_are_differences_of_the_skinned_pose(face):
    at = POSES[1]
    vertices = [30, 75, 100]
    found = face[1].jacobian(at, 0, vertices)
    assert found.shape == (3, 3, 7)
    for control in range(7):
        step = np.zeros(7, np.float32)
        step[control] = 1 / 64
        apart = pose(face, at + step)[vertices] - pose(face, at - step)[vertices]
        np.testing.assert_allclose(found[..., control], apart * 32, atol=0.02)


def test_a_drag_arrives_with_the_smallest_change(face):
    _, surface = face
    at, vertex = POSES[1], 45
    target = surface.positions(raw(jaw=0.5, left=0.6, right=0.1), 0, [vertex])[0]
    solved = risorius.solve_drag(surface, at, [(0, vertex)], [target])
    np.testing.assert_allclose(solved.positions[0], target, atol=2e-3)
    np.testing.assert_allclose(pose(face, solved.raw)[vertex], target, atol=2e-3)
    assert solved.raw.min() >= 0
    assert solved.raw.max() <= 1
    assert solved.raw[IDLE] == 0
    assert solved.change == pytest.approx(np.linalg.norm(solved.raw - at), abs=1e-5)
    # A small step equals the step by the Jacobian's pseudo-inverse, because no limit is reached.
    small = surface.positions(at, 0, [vertex])[0] + [0.0, 0.004, 0.002]
    free = {"lowest": -1, "highest": 2, "smallest": 1e-6}
    step = risorius.solve_drag(surface, at, [(0, vertex)], [small], **free).raw - at
    jacobian = surface.jacobian(at, 0, [vertex], -1, 2)[0].astype(np.float64)
    np.testing.assert_allclose(step, np.linalg.pinv(jacobian) @ [0, 0.004, 0.002], atol=2e-4)


def test_equal_controls_share_a_drag(face):
    surface = face[1]
    vertex = 14 * 7
    target = surface.positions(raw(jaw=0.4), 0, [vertex])
    solved = risorius.solve_drag(surface, raw(), [(0, vertex)], target)
    assert solved.raw[JAW] == pytest.approx(solved.raw[TWIN], abs=1e-3)
    assert solved.raw[JAW] > 0.1


def test_a_drag_on_the_screen_leaves_the_depth_free(face):
    surface = face[1]
    vertex = 14 * 6 + 7
    here = surface.positions(raw(), 0, [vertex])[0]
    target = here + np.array([0.02, 0.02, 5.0])
    flat = [np.eye(3)[:2]]
    solved = risorius.solve_drag(surface, raw(), [(0, vertex)], [target], axes=flat)
    assert solved.error < 2e-3
    np.testing.assert_allclose(solved.positions[0, :2], target[:2], atol=2e-3)
    assert abs(solved.positions[0, 2] - here[2]) < 1.5


def test_a_pin_holds_a_point_and_a_mask_a_control(face):
    surface = face[1]
    moved, held = 14 * 3 + 5, 14 * 10 + 5
    here = surface.positions(raw(), 0, [moved, held])
    target = surface.positions(raw(left=0.6, right=0.5), 0, [moved])[0]
    points, targets = [(0, moved), (0, held)], [target, here[1]]
    pinned = risorius.solve_drag(surface, raw(), points, targets, weights=[1, 4])
    assert np.linalg.norm(pinned.positions[1] - here[1]) < 0.01
    free = np.arange(7) != LEFT
    masked = risorius.solve_drag(surface, raw(), points[:1], targets[:1], free=free)
    assert masked.raw[LEFT] == 0
    assert masked.error > pinned.error


def test_the_transpose_moves_only_what_moves_the_point(face):
    surface = face[1]
    vertex = 14 * 3 + 5
    target = surface.positions(raw(left=0.3), 0, [vertex])
    solved = risorius.solve_drag(surface, raw(), [(0, vertex)], target, method="transpose")
    before = np.linalg.norm(target - surface.positions(raw(), 0, [vertex]))
    assert solved.error < 0.25 * before
    reach = np.abs(surface.jacobian(raw(), 0, [vertex])[0]).max(axis=0)
    assert (solved.raw[reach < 1e-6] == 0).all()


PARTNERS = [JAW, RIGHT, LEFT, PUFF, TWIN, IDLE, WIDEN]


@pytest.mark.parametrize("method", ["least_squares", "transpose"])
def test_partners_change_alike_and_as_little_as_they_can(face, method):
    """Both partners change by the same number.

    The pseudo-inverse of the Jacobian with one column for both partners gives this number.
    """
    surface = face[1]
    vertices, begin = [14 * 3 + 5, 14 * 10 + 5], raw(left=0.2, jaw=0.1)
    here = surface.positions(begin, 0, vertices).astype(float)
    apart = np.array([[-0.003, 0.002, 0.001], [0.001, 0.002, 0.0]])  # different on both sides
    moved = here + apart
    points = [(0, v) for v in vertices]
    given = {"partners": PARTNERS, "method": method, "lowest": -1, "highest": 2, "smallest": 1e-6}
    solved = risorius.solve_drag(surface, begin, points, moved, **given)
    change = solved.raw.astype(float) - begin
    assert change[LEFT] == pytest.approx(change[RIGHT], abs=1e-6)
    assert abs(change[LEFT]) > 1e-3
    if method == "transpose":
        return
    root = np.sqrt(0.5)  # the length of a common change of 1
    jacobian = surface.jacobian(begin, 0, vertices, -1, 2).reshape(6, 7).astype(float)
    jacobian[:, LEFT] = root * (jacobian[:, LEFT] + jacobian[:, RIGHT])
    jacobian[:, RIGHT] = 0
    best = np.linalg.pinv(jacobian, rcond=1e-4) @ apart.ravel()
    best[LEFT] = best[RIGHT] = root * best[LEFT]
    np.testing.assert_allclose(change, best, atol=5e-4)  # tolerance, because the face is not linear


def test_partners_keep_the_limits_of_both(face):
    """If two partners have different limits, the narrower limits apply to both."""
    surface, points = face[1], [(0, 14 * 3 + 5), (0, 14 * 10 + 5)]
    begin = raw(left=0.5, right=0.5)
    both = {"free": np.isin(np.arange(7), [LEFT, RIGHT]), "partners": PARTNERS}
    for goal, narrow in ((0.0, LEFT), (0.0, RIGHT), (1.0, LEFT), (1.0, RIGHT)):
        targets = surface.positions(raw(left=goal, right=goal), 0, [v for _, v in points])
        low, high = np.zeros(7), np.ones(7)
        low[narrow], high[narrow] = 0.4, 0.7
        solved = risorius.solve_drag(
            surface, begin, points, targets, lowest=low, highest=high, **both
        )
        bound = 0.7 if goal else 0.4
        assert solved.raw[[LEFT, RIGHT]] == pytest.approx(bound, abs=1e-6)


@pytest.mark.parametrize("eases", [(1, 0.01), (0.01, 1)])
def test_partners_change_as_readily_as_the_readier_one(face, eases):
    """Both partners use the larger of their two `ease` values (how readily a control changes).

    The reason is that the pair moves as one.
    """
    surface, vertex = face[1], 14 * 5 + 6
    axis = np.array([0, 0.6, 0.8])
    target = surface.positions(raw(), 0, [vertex]) + 0.1 * axis

    def drag(left, right):
        ease = np.full(7, 0.2)
        ease[LEFT], ease[RIGHT] = left, right
        given = {"axes": [[axis]], "ease": ease, "partners": PARTNERS}
        return risorius.solve_drag(surface, raw(), [(0, vertex)], target, **given).raw

    ready = drag(1, 1)
    assert ready[LEFT] == ready[RIGHT] > 0.3
    np.testing.assert_array_equal(drag(*eases), ready)


def test_of_opposites_one_alone_is_used(face):
    """Two opposites, left smile and puff, raise a vertex; only one of them is used."""
    surface, vertex = face[1], 14 * 5 + 6
    target = surface.positions(raw(left=0.5, puff=0.4), 0, [vertex])
    drag = [(0, vertex)], target
    both = risorius.solve_drag(surface, raw(), *drag)
    assert min(both.raw[LEFT], both.raw[PUFF]) > 0.05
    one = risorius.solve_drag(surface, raw(), *drag, opposites=[(LEFT, PUFF)])
    assert min(one.raw[LEFT], one.raw[PUFF]) == 0
    assert max(one.raw[LEFT], one.raw[PUFF]) > 0.05
    more = LEFT if both.raw[LEFT] > both.raw[PUFF] else PUFF
    assert one.raw[more] > 0.05
    # An active control first returns to 0; only then does its opposite become active.
    begin = raw(left=0.3)
    rest, puffed, here, lower = (
        surface.positions(raw(**at), 0, [vertex])
        for at in ({}, {"puff": 0.8}, {"left": 0.3}, {"left": 0.2})
    )
    for goal, gone in ((lower, False), (puffed + 2 * (rest - here), True)):
        found = risorius.solve_drag(surface, begin, [(0, vertex)], goal, opposites=[(LEFT, PUFF)])
        assert min(found.raw[LEFT], found.raw[PUFF]) <= 1e-6
        assert (found.raw[PUFF] > 0.1) == gone
        assert (found.raw[LEFT] > 0.01) == (not gone)
    # Two opposites that are both active before the drag may stay active, but do not both increase.
    begin = raw(left=0.3, puff=0.2)
    found = risorius.solve_drag(surface, begin, *drag, opposites=[(LEFT, PUFF)])
    assert min(found.raw[LEFT], found.raw[PUFF]) <= 0.2 + 1e-6


def test_opposites_that_are_partners_rest(face):
    surface, vertex = face[1], 14 * 3 + 5
    target = surface.positions(raw(left=0.5), 0, [vertex])
    given = {"partners": PARTNERS, "opposites": [(LEFT, RIGHT)]}
    solved = risorius.solve_drag(surface, raw(), [(0, vertex)], target, **given)
    assert solved.raw[LEFT] == solved.raw[RIGHT] == 0


def test_easy_are_the_controls_that_do_most_there(face):
    surface = face[1]
    far = np.linalg.norm(surface.jacobian(raw(), 0, np.arange(196)), axis=1)
    most, spread = far.max(axis=0), np.sqrt((far**2).mean(axis=0))
    np.testing.assert_allclose(surface.strongest(), most, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(surface.spread(), spread, rtol=1e-4, atol=1e-6)
    vertex = 14 * 3 + 5  # at the left corner of the mouth
    reach = surface.jacobian(raw(), 0, [vertex])
    here = np.linalg.norm(reach[0], axis=0)
    share = here / np.maximum(most, 1e-9)
    ease = risorius.local_ease(surface, reach)
    assert ease[RIGHT] == ease[IDLE] == 0.001
    local = share >= 0.1 * share.max()
    assert local[LEFT]
    alone = here / np.maximum(spread, 1e-9)
    expected = np.where(local, np.sqrt(alone / alone[local].max()), 0.001)
    np.testing.assert_allclose(ease, expected, rtol=1e-4)
    assert len(set(ease[local])) > 1


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_sparse_drag_beyond_reach_ends_about_as_near_as_all_controls(face, mirrored):
    """A sparse drag ends at most 1.3 mm farther from the goal than a drag with all controls.

    No two opposites are both active afterwards.
    """
    surface, mm = face[1], face[1].mm
    random = np.random.default_rng(3)
    given = {"axes": np.eye(3)[None, ::2], "opposites": [(LEFT, PUFF)]}
    if mirrored:
        given |= {"partners": PARTNERS, "opposites": []}
    more = 0
    for vertex in random.choice(196, 25, replace=False):
        start = surface.positions(raw(), 0, [vertex])[0].astype(float)
        goal = start + random.uniform(0.05, 0.6) * random.standard_normal(3)
        drag = [(0, int(vertex))], [goal]
        every = risorius.solve_drag(surface, raw(), *drag, **given)
        few = risorius.solve_drag(surface, raw(), *drag, method="sparse", **given)
        assert few.error * mm <= every.error * mm + 1.3 + 1e-3
        assert ((few.raw >= 0) & (few.raw <= 1)).all()
        if mirrored:
            assert few.raw[LEFT] == few.raw[RIGHT]
        else:
            assert min(few.raw[LEFT], few.raw[PUFF]) <= 1e-6
        more += (few.raw > 1e-4).sum() < (every.raw > 1e-4).sum()
    assert more > 5


def test_a_sparse_drag_moves_few_and_arrives(face):
    """To move a point along two axes, two controls are enough; least squares uses more."""
    surface, vertex = face[1], 14 * 5 + 6
    axes = np.eye(3)[None, 1:]
    target = surface.positions(raw(left=0.5, jaw=0.2), 0, [vertex])
    way = np.linalg.norm((target - surface.positions(raw(), 0, [vertex]))[0, 1:])
    drag = {"axes": axes, "opposites": [(LEFT, PUFF)]}
    exact = risorius.solve_drag(surface, raw(), [(0, vertex)], target, **drag)
    few = risorius.solve_drag(surface, raw(), [(0, vertex)], target, method="sparse", **drag)
    assert (few.raw > 0).sum() <= 2 < (exact.raw > 1e-4).sum()
    assert few.error < 0.03 * way
    assert ((few.raw >= 0) & (few.raw <= 1)).all()
    assert min(few.raw[LEFT], few.raw[PUFF]) == 0
    pair = risorius.solve_drag(
        surface, raw(), [(0, vertex)], target, method="sparse", partners=PARTNERS, axes=axes
    )
    assert pair.raw[LEFT] == pair.raw[RIGHT] > 0.1


def test_a_sparse_drag_leaves_what_belongs_elsewhere(face):
    surface, vertex = face[1], 14 * 3 + 5
    target = surface.positions(raw(jaw=0.4), 0, [vertex])
    ease = np.where(np.arange(7) == JAW, 0.001, 1.0)  # the twin moves the same
    given = {"ease": ease, "method": "sparse"}
    near = risorius.solve_drag(surface, raw(), [(0, vertex)], target, **given)
    assert near.raw[JAW] == 0 < near.raw[TWIN]
    alone = np.isin(np.arange(7), [JAW, IDLE, PUFF])  # idle cannot help: the jaw does
    helped = risorius.solve_drag(surface, raw(), [(0, vertex)], target, free=alone, **given)
    assert helped.raw[JAW] == pytest.approx(0.4, abs=0.02)


def test_a_sparse_drag_is_continuous_in_its_target(face):
    surface, vertex = face[1], 14 * 5 + 6
    start = surface.positions(raw(), 0, [vertex])[0].astype(float)

    def drag(turn):
        target = start + 0.1 * np.array([0, np.cos(turn), np.sin(turn)])
        given = {"axes": np.eye(3)[None, 1:], "method": "sparse"}
        return risorius.solve_drag(surface, raw(), [(0, vertex)], [target], **given).raw

    turns = np.linspace(0, np.pi, 90)
    found = [drag(turn) for turn in turns]
    assert np.abs(np.diff(found, axis=0)).max() < 0.15
    assert np.ptp(found, axis=0).max() > 0.2
    np.testing.assert_array_equal(drag(turns[40]), found[40])


@pytest.mark.parametrize("seed", range(4))
def test_the_cheapest_change_is_the_cheapest(seed):
    """The change costs as much as a solution by coordinate descent with the same error.

    The penalty of the coordinate descent is chosen so that the errors are equal.
    """
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(3, 12)), rng.normal(size=3) * 2
    low, high = -rng.uniform(0, 1, 12), rng.uniform(0.1, 1, 12)
    price = rng.uniform(1, 2, 12)
    x = cheapest_change(a, b, low, high, price, np.zeros(12, bool), 0.2, 0.2)
    assert ((x >= low) & (x <= high)).all()
    missing = np.linalg.norm(a @ x - b)
    below, above = 0.0, 10.0
    for _ in range(50):
        half = (below + above) / 2
        other = descend(a.T @ a, a.T @ b, low, high, np.zeros(12), half * price, np.zeros(12), 1e-9)
        below, above = (below, half) if np.linalg.norm(a @ other - b) > missing else (half, above)
    assert price @ np.abs(x) == pytest.approx(price @ np.abs(other), rel=1e-3)


def test_what_is_not_easy_helps_where_others_do_not_reach(face):
    surface, vertex = face[1], 14 * 3 + 5
    target = surface.positions(raw(left=0.3, jaw=0.2), 0, [vertex])
    ease = np.where(np.arange(7) == LEFT, 1.0, 0.1)
    points = [(0, vertex)]
    loath = risorius.solve_drag(surface, raw(), points, target, ease=ease)
    assert loath.error < 2e-3  # the error is as small
    twin = np.where(np.arange(7) == TWIN, 0.1, 1.0)  # the twin moves like the jaw
    alone = risorius.solve_drag(surface, raw(), points, target, ease=twin)
    assert 0 < alone.raw[TWIN] < 0.02 * alone.raw[JAW]
    # A small step equals a least squares solution that weights the square of each control's change
    # by 1 / ease², so a control with a large `ease` changes most.
    small = surface.positions(raw(), 0, [vertex])[0] + [0.0, 0.0008, 0.0004]
    free = {"lowest": -1, "highest": 2, "smallest": 1e-6, "ease": ease}
    step = risorius.solve_drag(surface, raw(), points, [small], **free).raw
    jacobian = surface.jacobian(raw(), 0, [vertex], -1, 2)[0].astype(np.float64)
    best = ease * (np.linalg.pinv(jacobian * ease) @ [0, 0.0008, 0.0004])
    np.testing.assert_allclose(step, best, atol=3e-4)


def test_what_cannot_be_reached_ends_at_the_limits(face):
    surface = face[1]
    vertex = 14 * 7
    far = surface.positions(raw(), 0, [vertex])[0] + [0, -50, 0]
    solved = risorius.solve_drag(surface, raw(), [(0, vertex)], [far])
    assert solved.raw[JAW] == 1
    assert solved.raw[TWIN] == 1
    assert ((solved.raw >= 0) & (solved.raw <= 1)).all()


@pytest.mark.parametrize("method", ["least_squares", "transpose"])
def test_a_control_beyond_its_limits_stays_or_comes_back(face, method):
    """A drag neither moves a control farther beyond its limits nor makes it jump to the limit."""
    surface, vertex = face[1], 14 * 7
    only = {"free": np.arange(7) == JAW, "method": method}
    for start, wanted, found in (
        (1.4, 1.4, 1.4), (1.4, 1.8, 1.4), (1.4, 1.2, 1.2),
        (-0.3, -0.3, -0.3), (-0.3, -0.6, -0.3), (-0.3, -0.1, -0.1),
    ):  # fmt: skip
        target = surface.positions(raw(jaw=wanted), 0, [vertex])
        solved = risorius.solve_drag(surface, raw(jaw=start), [(0, vertex)], target, **only)
        assert solved.raw[JAW] == pytest.approx(found, abs=1e-4)
        assert (np.delete(solved.raw, JAW) == 0).all()


def test_the_best_control_is_the_one_that_was_moved(face):
    surface = face[1]
    vertex = 14 * 3 + 5
    target = surface.positions(raw(left=0.7), 0, [vertex])[0]
    ranked = risorius.best_controls(surface, raw(), (0, vertex), target)
    control, value, left = ranked[0]
    assert control == LEFT
    assert value == pytest.approx(0.7, abs=0.01)
    assert left < 0.01
    assert [row[2] for row in ranked] == sorted(row[2] for row in ranked)
    assert IDLE not in [row[0] for row in ranked]


def test_handles_are_few_spread_and_alike_on_both_sides(face):
    dna, surface = face
    found = risorius.place_handles(surface, 0, count=8)
    assert 4 <= len(set(found.tolist())) == len(found) <= 8
    places = dna.meshes[0].positions[found]
    apart = np.linalg.norm(places[:, None] - places, axis=2)[~np.eye(len(found), dtype=bool)]
    assert apart.min() > 0.9
    mirrored = {(round(-x, 3), round(y, 3)) for x, y, _ in places.tolist()}
    assert mirrored == {(round(x, 3), round(y, 3)) for x, y, _ in places.tolist()}
    reach = np.linalg.norm(surface.jacobian(raw(), 0, np.arange(196)), axis=(1, 2))
    assert reach[found].mean() > np.median(reach)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"points": [], "targets": np.zeros((0, 3))}, "points: one at least was expected, found 0"),
        ({"points": [(0, 999)]}, "a vertex below 196 was expected, found 999"),
        ({"points": [(3, 0)]}, "a mesh below 1 was expected, found 3"),
        ({"points": [(0, -1)]}, "a vertex below 196 was expected, found -1"),
        ({"targets": [[0, np.nan, 0]]}, "targets: finite numbers"),
        ({"targets": [[0, 0]]}, r"targets: .* shape \[1, 3\]"),
        ({"weights": [-1]}, "weights: numbers from 0"),
        ({"axes": np.eye(3)}, "axes: finite numbers"),
        ({"raw": np.zeros(3)}, "raw: 7 numbers"),
        ({"lowest": 0.5, "highest": 0.25}, r"lowest\[0\]: at most highest\[0\] 0.25"),
        ({"ease": 0}, "ease: numbers above 0 were expected, found 0"),
        ({"partners": [0, 1]}, r"partners: whole numbers of shape \[7\]"),
        ({"partners": [0, 2, 3, 1, 4, 5, 6]}, "partners: each control's partner was expected"),
        ({"partners": [0, 1, 2, 3, 4, 5, 7]}, "partners: each control's partner was expected"),
        ({"opposites": [(0, 7)]}, "opposites: pairs of whole numbers below 7"),
        ({"opposites": [(0, 1, 2)]}, "opposites: pairs of whole numbers below 7"),
        ({"method": "newton"}, "least_squares or transpose"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(face, change, said):
    given = {"raw": raw(), "points": [(0, 5)], "targets": [[0, 0, 0]], **change}
    with pytest.raises(risorius.RisoriusError, match=said):
        risorius.solve_drag(face[1], **given)


GIVEN = {
    "free": [True] * 5 + [False, True],
    "lowest": -0.1,
    "highest": [0.9] * 7,
    "ease": [1, 1, 0.5, 0.01, 1, 1, 0.2],
    "partners": PARTNERS,
    "opposites": [(PUFF, WIDEN)],
}


def drag_of(face, method="sparse", **given):
    goal = face[1].positions(raw(left=0.6, puff=0.3), 0, [75])
    return risorius.solve_drag(face[1], raw(jaw=0.1), [(0, 75)], goal, method=method, **given)


def structures():
    limits = risorius.ControlLimits(**{name: GIVEN[name] for name in ("free", "lowest", "highest")})
    return limits, risorius.ControlSharing(GIVEN["ease"], GIVEN["partners"], GIVEN["opposites"])


@pytest.mark.parametrize("method", ["least_squares", "transpose", "sparse"])
def test_structures_and_their_fields_as_keywords_solve_the_same(face, method):
    limits, sharing = structures()
    solved = drag_of(face, method, limits=limits, sharing=sharing)
    np.testing.assert_array_equal(solved.raw, drag_of(face, method, **GIVEN).raw)
    assert (solved.raw != drag_of(face, method).raw).any()


def test_limits_are_the_same_structure_for_a_drag_a_ranking_and_a_clip(face):
    limits, surface = structures()[0], face[1]
    fields = {name: GIVEN[name] for name in ("free", "lowest", "highest")}
    goal = surface.positions(raw(left=0.6, puff=0.3), 0, [75])[0]
    ranked = risorius.best_controls(surface, raw(), (0, 75), goal, limits=limits)
    assert ranked == risorius.best_controls(surface, raw(), (0, 75), goal, **fields)
    frames = np.stack([surface.positions(raw(left=share), 0) for share in (0.0, 0.5, 0.95)])
    both = [
        risorius.solve_clip(surface, frames, rate=30, **given).clip
        for given in ({"limits": limits}, fields)
    ]
    assert both[0].to_bytes() == both[1].to_bytes()


def test_a_structure_beside_its_fields_or_an_unknown_keyword_is_refused(face):
    limits, sharing = structures()
    with pytest.raises(risorius.RisoriusError, match="limits: no free, lowest beside it"):
        drag_of(face, limits=limits, free=True, lowest=0)
    with pytest.raises(risorius.RisoriusError, match="sharing: no ease beside it"):
        drag_of(face, sharing=sharing, ease=1)
    with pytest.raises(TypeError, match="unexpected keyword argument 'higest'"):
        drag_of(face, higest=1)


def performance(face, frames=40):
    """Curves float32[F, 7] of four controls that move the mesh, and vertices float32[F, V, 3]."""
    t = np.arange(frames) / 30
    curves = np.zeros((frames, 7), np.float32)
    curves[:, JAW] = 0.5 - 0.5 * np.cos(7 * t)
    curves[:, LEFT] = np.clip(np.sin(3 * t), 0, 1)
    curves[:, RIGHT] = np.clip(1.3 * np.sin(2 * t + 0.4), 0, 1)
    curves[10:20, PUFF] = 0.8
    vertices = np.stack([face[1].positions(row, 0) for row in curves])
    return curves, vertices


FREE = [control != TWIN for control in range(7)]


def table(clip, names):
    out = np.zeros((clip.frame_count, len(names)), np.float32)
    for name, curve in zip(clip.names, clip.curves, strict=True):
        out[:, names.index(name)] = curve
    return out


def test_a_baked_clip_comes_back(face):
    dna, surface = face
    curves, vertices = performance(face)
    told = []
    solved = risorius.solve_clip(surface, vertices, rate=30, free=FREE, progress=told.append)
    found = table(solved.clip, list(dna.raw_control_names))
    assert np.abs(found - curves).max() < 0.02
    assert solved.largest * surface.mm < 0.1
    assert (solved.clip.rate, solved.clip.frame_count) == (30, 40)
    assert not {"CTRL_expressions.idle", "CTRL_expressions.widen"} & set(solved.clip.names)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1, abs=0.01)
    # The reported residual equals the error of the mesh that the solved curves give.
    left = np.stack([pose(face, row) for row in found]) - vertices
    rms = np.sqrt((left**2).sum(axis=2).mean(axis=1))
    np.testing.assert_allclose(solved.frame_residual, rms, atol=1e-4)


def test_controls_that_do_the_same_agree_on_the_mesh_only(face):
    _, surface = face
    curves, vertices = performance(face, 8)
    solved = risorius.solve_clip(surface, vertices, rate=30)
    found = table(solved.clip, list(face[0].raw_control_names))
    assert solved.largest * surface.mm < 0.1
    np.testing.assert_allclose(found[:, JAW] + found[:, TWIN], curves[:, JAW], atol=0.02)


def test_a_noisy_mesh_gives_quiet_curves(face):
    dna, surface = face
    curves, vertices = performance(face)
    noise = np.random.default_rng(5).normal(0, 0.1, vertices.shape)  # 1 mm
    solved = risorius.solve_clip(surface, vertices + noise, rate=30, free=FREE)
    found = table(solved.clip, list(dna.raw_control_names))
    assert solved.noise * surface.mm == pytest.approx(1, abs=0.15)

    def flicker(values):
        smooth = np.delete(values, PUFF, axis=1)  # which jumps by itself
        return np.sqrt((np.diff(smooth, 2, axis=0) ** 2).mean())

    loose = risorius.solve_clip(surface, vertices + noise, rate=30, free=FREE, smooth=0, sparse=0)
    unquiet = table(loose.clip, list(dna.raw_control_names))
    assert flicker(found) < 1.1 * flicker(curves)
    assert flicker(found - curves) < 0.5 * flicker(unquiet - curves)
    assert np.sqrt(((found - curves) ** 2).mean()) < 0.05


def test_another_face_of_the_topology_gives_its_movement(face):
    dna, surface = face
    curves, vertices = performance(face, 12)
    other = dna.meshes[0].positions * [1.0, 1.1, 0.9] + [0.3, 0.0, 0.0]
    moved = vertices - dna.meshes[0].positions + other
    solved = risorius.solve_clip(surface, moved, rate=30, neutral=other, free=FREE)
    found = table(solved.clip, list(dna.raw_control_names))
    assert np.abs(found - curves).max() < 0.02


def test_the_result_does_not_depend_on_threads(face):
    _, vertices = performance(face, 30)
    one, two = (
        risorius.solve_clip(face[1], vertices, rate=30, threads=threads) for threads in (1, 2)
    )
    np.testing.assert_array_equal(one.clip.curves, two.clip.curves)


def test_a_solve_can_be_cancelled(face):
    _, vertices = performance(face, 30)
    with pytest.raises(CancelledError, match="cancelled"):
        risorius.solve_clip(face[1], vertices, rate=30, progress=lambda share: share < 0.2)


@pytest.mark.parametrize(
    ("frames", "change", "said"),
    [
        (np.zeros((2, 5, 3)), {}, r"frames: \[F, 196, 3\] was expected for mesh 0"),
        (np.full((2, 196, 3), np.nan), {}, "frames: finite numbers"),
        (np.zeros((0, 196, 3)), {}, "frames: as many"),
        ({4: np.zeros((2, 196, 3))}, {}, "frames: meshes below 1 were expected, found 4"),
        ({}, {}, "frames: one mesh at least"),
        (np.zeros((2, 196, 3)), {"rate": 0}, "rate: 0.01 to 1e.06 was expected, found 0"),
        (np.zeros((2, 196, 3)), {"smooth": -1}, "smooth: 0 to 1e.09 was expected"),
        (np.zeros((2, 196, 3)), {"neutral": np.zeros((5, 3))}, "neutral: "),
    ],
)
def test_frames_that_make_no_sense_are_one_sentence(face, frames, change, said):
    with pytest.raises(risorius.RisoriusError, match=said):
        risorius.solve_clip(face[1], frames, **{"rate": 30, **change})


HUGE = 10**400
ODD = {
    "raw": (1e39, HUGE, "a"),
    "points": ([(2**70, 0)], [(0, 1e38)], [(0, 0.5)], [3], "a"),
    "targets": ([[1e39, 0, 0]], [[HUGE, 0, 0]], "a"),
    "axes": ([[[HUGE, 0, 0]]],),
    "weights": (2**70 * 10**300,),
    "highest": (1e39, 1e308),
    "partners": ([2**70],),
    "opposites": ([(2**70, 0)],),
    "smallest": (math.nan, 1e308, HUGE, -1),
    "rounds": (-1, 1e38, 2**70),
}


@pytest.mark.parametrize("name", ODD)
def test_numbers_of_a_drag_are_of_any_size_and_refused(face, name):
    for odd in ODD[name]:
        given = {
            "raw": np.zeros(face[1].control_count),
            "points": [(0, 3)],
            "targets": np.zeros((1, 3)),
        }
        given[name] = odd
        with pytest.raises(risorius.RisoriusError, match=rf"^({name}|points\[0\]): "):
            risorius.solve_drag(face[1], **given)


@pytest.mark.parametrize(
    ("name", "odd"),
    [("threads", -1), ("threads", 2**70), ("rate", 2**70), ("start", HUGE), ("sparse", math.nan),
     ("smooth", -1), ("most_points", 0), ("frames", 1e39), ("frames", {2**70: 0})],
)  # fmt: skip
def test_numbers_of_a_clip_are_of_any_size_and_refused(face, name, odd):
    given = {"frames": np.zeros((2, face[1].vertex_counts[0], 3)), "rate": 30.0} | {name: odd}
    with pytest.raises(risorius.RisoriusError, match=rf"^{name}: "):
        risorius.solve_clip(face[1], given.pop("frames"), **given)
