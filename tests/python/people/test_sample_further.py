# SPDX-License-Identifier: MIT
"""Tests the controls of sample people that ARKit lacks; with the real data if available."""

from pathlib import Path

import numpy as np
import pytest
import sample_people
from risorius.anim.reactions import load_reactions
from risorius_people.controls import gui_table
from risorius_people.further import CONTROLS_OF_CODE

STANDARD = Path(__file__).parents[2] / "data" / "controls" / "standard_raw.txt"
MM = 0.01  # in the data's unit, decimetres


@pytest.fixture(scope="module")
def man():
    return sample_people.body("man")


@pytest.fixture(scope="module")
def motions(man):
    """Names of controls, and the motion that each gives to vertices of the head's skin, teeth,
    tongue and eyes, float64[controls, V, 3].
    """
    kept = [v for name, v in man.groups.items() if name == "body" or "teeth" in name]
    kept += [v for name, v in man.groups.items() if "tongue" in name or "eye" in name]
    some = np.unique(np.concatenate(kept))
    some = some[man.positions[some, 1] > 13.7]
    whole = {name: unit.displacement for name, unit in man.units.items()}
    whole |= {name: way for (_, name), way in man.closing.items()}
    return list(whole), np.stack([way[some] for way in whole.values()])


def test_extra_all_but_one_of_the_standard_controls_are_there(motions):
    standard = [line.removeprefix("CTRL_expressions.") for line in STANDARD.read_text().split()]
    names, _ = motions
    assert len(names) == len(set(names)) == 250
    assert set(standard) - set(names) == {"eyeParallelLookDirection"}
    assert set(names) <= set(standard)
    assert set(CONTROLS_OF_CODE) < set(names)


def test_extra_each_control_moves_something_that_no_other_does(motions):
    """Each control moves a vertex by at least 0.5 mm, and no two controls give the same motion.

    The cosine between the motions of two controls is at most 0.95. Controls that close the lips are
    tested with the jaw open.
    """
    names, moved = motions
    assert (np.linalg.norm(moved, axis=2).max(axis=1) >= 0.5 * MM).all()
    flat = moved.reshape(len(names), -1)
    flat = flat / np.linalg.norm(flat, axis=1, keepdims=True)
    alike = np.argwhere(np.triu(flat @ flat.T, 1) > 0.95)
    # jawOpenExtreme continues the motion of jawOpen, so that this pair is allowed.
    assert [(names[a], names[b]) for a, b in alike] == [("jawOpen", "jawOpenExtreme")]


def test_extra_left_is_the_mirror_of_right(man):
    positions = man.positions
    body = man.groups["body"]
    body = body[(positions[body, 1] > 15) & (np.abs(positions[body, 0]) < 0.9)]
    mirrored = positions[body] * [-1, 1, 1]
    other = np.array([((positions[body] - p) ** 2).sum(axis=1).argmin() for p in mirrored])
    exact = np.linalg.norm(positions[body][other] - mirrored, axis=1) < 0.1 * MM
    assert exact.mean() > 0.8
    for name in ("eyeLowerLidUp", "mouthCornerWide", "browLateral", "jawClench", "eyeLidPress"):
        left, right = (man.units[name + side].displacement[body] for side in "LR")
        np.testing.assert_allclose(
            left[exact], (right[other] * [-1, 1, 1])[exact], atol=0.15 * MM, err_msg=name
        )


def test_extra_lids_slide_on_the_eye_and_the_tongue_keeps_its_root(man):
    lower = man.units["eyeLowerLidUpL"].displacement
    arm = man.positions - man.joints["FACIAL_L_Eye"]
    moved = np.linalg.norm(lower, axis=1) > 0.5 * MM
    assert moved.sum() > 30
    along = np.einsum("ij,ij->i", lower, arm)[moved] / np.linalg.norm(arm[moved], axis=1)
    # Lid vertices move towards or away from the eye's centre only where the cornea bulges;
    # test_sample_eyes tests the rest.
    assert np.abs(along).max() < 1.0 * MM
    assert np.median(np.abs(along)) < 0.1 * MM
    assert lower[moved, 1].max() > 2 * MM
    tongue = man.groups["helper-tongue"]
    z = man.positions[tongue, 2]
    root = tongue[z < np.quantile(z, 0.05)]
    for name in (n for n in CONTROLS_OF_CODE if n.startswith("tongue")):
        way = np.linalg.norm(man.units[name].displacement, axis=1)
        assert way[root].max() < 0.1 * way.max(), name


def test_extra_what_closes_lips_needs_an_open_jaw(man):
    closing = {name for name in man.units if "ticky" in name or "mouthLipsTogether" in name}
    closing |= {"mouthStretchLipsCloseL", "mouthStretchLipsCloseR"}
    assert len(closing) == 22
    assert set(man.closing) == {("jawOpen", name) for name in closing}
    for name in closing:
        assert not man.units[name].displacement.any(), name
    whole = man.closing[("jawOpen", "mouthStickyDC")]
    together = sum(man.closing[("jawOpen", f"mouthLipsTogetherD{s}")] for s in "LR")
    most = np.linalg.norm(whole, axis=1).argmax()
    np.testing.assert_allclose(whole[most], together[most], rtol=0.15)


def test_extra_no_reaction_lifts_the_lower_lip_over_the_upper_one(man):
    """A reaction must not contain controls that close an open mouth, as lips are shut at rest."""
    body = man.groups["body"]
    middle = body[np.abs(man.positions[body, 0]) < 0.02]
    still = np.zeros_like(man.positions)

    def most(*names):
        moved = sum(
            man.units[name].displacement[middle] + man.closing.get(("jawOpen", name), still)[middle]
            for name in names
        )
        return middle[np.linalg.norm(moved, axis=1).argmax()]

    lower = most("mouthLipsTogetherDL", "mouthLipsTogetherDR")
    upper = most("mouthUpperLipRaiseL", "mouthUpperLipRaiseR")
    for reaction in load_reactions().values():
        nearer = 0.0
        for part in reaction.parts:
            for name, weight in part.weights.items():
                moved = man.units[name.removeprefix("CTRL_expressions.")].displacement
                nearer += weight * (moved[lower, 1] - moved[upper, 1])
        assert nearer < 3 * MM, f"{reaction.name}: {nearer / MM:.1f} mm"


def test_one_gui_control_leads_to_several_raw_controls_in_turn():
    table = dict(gui_table())
    assert len(table) == 173

    def value(gui, raw, x):
        for name, (low, high, slope, cut) in table[gui]:
            if name == raw and low <= x <= high:
                return slope * x + cut
        return 0.0

    sticky = "CTRL_L_mouth_lipSticky.ty"
    for x, wanted in ((0, (0, 0, 0)), (0.5, (1, 0.5, 0)), (1, (1, 1, 1))):
        for phase, w in enumerate(wanted, 1):
            assert value(sticky, f"mouthLipsStickyLPh{phase}", x) == pytest.approx(w)
    for x, wanted in ((0.2, (1, 0, 0, 0)), (0.3, (0.5, 0.5, 0, 0)), (0.8, (0, 0, 0, 1))):
        for phase, w in enumerate(wanted, 1):
            assert value("CTRL_C_neck_swallow.ty", f"neckSwallowPh{phase}", x) == pytest.approx(
                w, abs=1e-9
            )
    assert value("CTRL_C_tongue_inOut.ty", "tongueIn", -1) == 1
