# SPDX-License-Identifier: MIT
"""Compares the mixer with a NumPy version that follows the comment in clip/mixer/mixer.h."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import risorius
from risorius import Clip, Event, Layer, Mixer
from risorius.anim.mixer import load_exclusives, load_reactions
from risorius.anim.reactions import Exclusives, Reaction, ReactionPart, Yield
from risorius.controls.regions import REGIONS, TITLES, mask, region_of

NAMES = ["CTRL_expressions.jawOpen", "browDownL", "browDownR", "mouthLeft", "mouthRight", "spare"]
JAW, BROW_L, BROW_R, LEFT, RIGHT, SPARE = range(6)


def noise(names=tuple(NAMES[:5]), frames=25, seed=3, **settings):
    rng = np.random.default_rng(seed)
    curves = rng.uniform(0, 0.4, (len(names), frames))
    curves[-1] = 0.25  # a curve that never changes
    return Clip(names, curves, 24.0, **settings)


# -- the NumPy version of the mixer
# -----------------------------------------------------------------


def clip_time(layer, clip, t):
    """The time in the clip that a layer shows at the scene time t, both in seconds."""
    if layer.warp is not None:
        assert not layer.reverse  # refused: a descending warp plays backwards
        return float(np.interp(t, *layer.warp))
    first, last = layer.clip_range or (clip.frame_times()[0], clip.frame_times()[-1])
    start = first if layer.start is None else layer.start
    turns = (t - start) / ((last - first) * layer.scale)
    whole = round(turns)
    turns = whole if abs(turns - whole) < 1e-9 * max(1, whole) else turns
    part = math.fmod(turns, 1.0)
    if part == 0.0 and turns > 0 and turns >= layer.repeat:
        part = 1.0
    return last - part * (last - first) if layer.reverse else first + part * (last - first)


def range_of(layer, clip):
    if layer.warp is not None:
        return layer.warp[0][0], layer.warp[0][-1]
    if clip.frame_count < 2:
        return (-np.inf if layer.start is None else layer.start), (
            np.inf if layer.end is None else layer.end
        )
    first, last = layer.clip_range or (clip.frame_times()[0], clip.frame_times()[-1])
    start = first if layer.start is None else layer.start
    return start, start + (last - first) * layer.scale * layer.repeat


def moment(layer, clip, time):
    """The time within the layer's range whose values it shows at a scene time, both in seconds.

    None if the layer has no effect at this scene time.
    """
    start, end = range_of(layer, clip)
    if start <= time <= end:
        return time
    if layer.extend == "nothing" or (layer.extend == "hold_forward" and time < start):
        return None
    if layer.extend == "repeat":
        turns = (time - start) / (end - start)
        turns = round(turns) if abs(turns - round(turns)) < 1e-9 else turns
        return start + (turns - math.floor(turns)) * (end - start)
    return start if time < start else end


def weight_at(layer, clip, t):
    start, end = range_of(layer, clip)
    points = layer.weight if isinstance(layer.weight, tuple) else ([0.0], [layer.weight])
    fade = 1.0
    if layer.fade_in:
        fade = min(fade, (t - start) / layer.fade_in)
    if layer.fade_out:
        fade = min(fade, (end - t) / layer.fade_out)
    return np.float32(np.interp(t, *points) * fade)


def mixed(names, layers, time, base=None):
    """The mixed controls at a time, without reactions and exclusive controls.

    These are steps 1, 2 and 5 of the five steps that the comment in mixer.h describes.
    """
    out = np.zeros(len(names), np.float32) if base is None else np.array(base, np.float32)
    solo = any(layer.solo for layer in layers)
    for layer in layers:
        clip = layer.clip()
        t = moment(layer, clip, time)
        if layer.mute or (solo and not layer.solo) or t is None or not clip.frame_count:
            continue
        weight = weight_at(layer, clip, t)
        if weight <= 0:
            continue
        wanted = clip_time(layer, clip, t) if clip.frame_count > 1 else 0.0
        values = clip.sample([wanted])[0]
        masks = np.ones(len(names), np.float32) if layer.mask is None else layer.mask
        if isinstance(masks, dict):
            masks = mask(names, masks)
        for name, value in zip(clip.names, values, strict=True):
            if name not in names:
                continue
            i = list(names).index(name)
            m = np.float32(masks[i]) * weight
            if m == 0:
                continue
            if layer.blend == "additive":
                out[i] = out[i] + value * m
            else:
                v = max(out[i], value) if layer.blend == "max" else value
                out[i] = out[i] * (np.float32(1) - m) + v * m
    return np.clip(out, 0, 1)


STACKS = {
    "one": [Layer(noise())],
    "blends": [
        Layer(noise()),
        Layer(noise(seed=4), blend="additive", weight=0.7),
        Layer(noise(seed=5), blend="max", weight=0.6),
    ],
    "weight curve": [Layer(noise()), Layer(noise(seed=4), weight=([0.1, 0.5, 0.9], [0, 1, 0.2]))],
    "masked": [
        Layer(noise()),
        Layer(noise(seed=4), mask={"brow": 1.0, "jawOpen": 0.3}),
        Layer(noise(seed=6), mask=np.float32([0, 0.5, 1, 0, 0.25, 1]), blend="additive"),
    ],
    "own order": [Layer(noise(("spare", "unknown", "browDownR", "browDownL")))],
    "trimmed": [Layer(noise(), start=0.3, clip_range=(0.1, 0.7))],
    "slow": [Layer(noise(), start=0.1, scale=1.7)],
    "repeated": [Layer(noise(), start=0.1, scale=0.25, repeat=2.6)],
    "whole repeats": [Layer(noise(), start=0.25, scale=0.25, repeat=2)],
    "backwards": [Layer(noise(), scale=0.5, repeat=2, reverse=True)],
    "for ever": [Layer(noise(), start=0.4, scale=0.3, extend="repeat")],
    "forward": [Layer(noise(), start=0.4, scale=0.3, extend="hold_forward")],
    "nothing": [Layer(noise(), start=0.4, scale=0.3, extend="nothing")],
    "faded": [
        Layer(noise(seed=8)),
        Layer(noise(), start=0.2, scale=0.6, fade_in=0.2, fade_out=0.3, extend="hold"),
    ],
    "warped": [Layer(noise(), warp=([0.2, 0.5, 0.8], [0.0, 0.9, 0.3]))],
    "own times": [Layer(Clip(["spare"], [[0, 1, 0.2]], 24, times=[0.1, 0.15, 0.8]))],
    "pose": [Layer(noise()), Layer({"jawOpen": 1.0, NAMES[0]: 0.8, "spare": 0.5}, weight=0.5)],
    "pose in time": [Layer({"spare": 0.5}, start=0.2, end=0.8, extend="nothing", fade_in=0.1)],
    "muted": [Layer(noise()), Layer(noise(seed=4), mute=True)],
    "solo": [Layer(noise()), Layer(noise(seed=4), solo=True), Layer(noise(seed=7))],
    "empty": [Layer(Clip(["spare"], np.zeros((1, 0)))), Layer({})],
}
TIMES = np.concatenate([np.arange(-6, 60) / 24.0, np.random.default_rng(1).uniform(-0.3, 2.2, 60)])


@pytest.mark.parametrize("stack", STACKS)
def test_equals_the_second_implementation(stack):
    base = np.linspace(0.1, 0.6, 6).astype(np.float32)
    mixer = Mixer(NAMES, STACKS[stack])
    for under in (None, base):
        wanted = [mixed(NAMES, STACKS[stack], t, under) for t in TIMES]
        np.testing.assert_allclose(mixer.evaluate_batch(TIMES, under), wanted, rtol=0, atol=1e-6)


def test_a_clip_alone_comes_out_as_it_is():
    clip = noise(tuple(NAMES))
    frames = Mixer(NAMES, [Layer(clip)]).evaluate_batch(clip.frame_times())
    assert (clip.curves == frames.T).all()


def test_one_frame_equals_its_row_of_a_batch_and_writes_where_it_is_told():
    mixer = Mixer(NAMES, STACKS["blends"])
    base = np.full(6, 0.2, np.float32)
    rows = mixer.evaluate_batch(TIMES, np.tile(base, (len(TIMES), 1)))
    out = np.full(6, 9, np.float32)
    for time, row in zip(TIMES, rows, strict=True):
        assert (mixer.evaluate(time, base) == row).all()
        assert mixer.evaluate(time, base, out) is out
        assert (out == row).all()
    given = base.copy()
    mixer.evaluate(TIMES[0], given, given)  # in place
    assert (given == rows[0]).all()


def test_clamps_to_the_ranges_and_leaves_rotations_alone():
    names = ["a", "b", "head.yaw"]
    clip = Clip(names, [[2.0], [2.0], [-3.0]])
    assert Mixer(names, [Layer(clip)], ranges={"b": (-1, 1.5)}).evaluate(0).tolist() == [1, 1.5, -3]
    nan = Clip(names[:1], [[np.nan]])
    assert Mixer(names, [Layer(nan)]).evaluate(0).tolist() == [0, 0, 0]


def test_layers_change_one_by_one():
    mixer = Mixer(NAMES)
    assert mixer.add(noise()) == 0
    assert mixer.add("joy", weight=0.5, name="happy") == 1
    assert "CTRL_expressions.mouthCornerPullL" in mixer.missing(1)
    before = mixer.evaluate(0.3)
    mixer.change(1, mute=True)
    mixer.remove(0)
    assert mixer.layers[0].name == "happy"
    assert not mixer.evaluate(0.3).any()
    assert before.any()


def test_bakes_what_it_evaluates():
    mixer = Mixer(NAMES, STACKS["warped"])
    clip = mixer.bake(0.25, 0.75, 24.0)
    assert clip.names == tuple(NAMES)
    assert clip.start == 0.25
    assert (mixer.evaluate_batch(0.25 + np.arange(13) / 24) == clip.curves.T).all()


def test_a_warp_that_falls_plays_backwards():
    """The warp maps the scene time t to the clip time 0.75 - t / 2.

    The value of the clip's curve is the clip time, so the mixed control must show this time.
    """
    ramp = Clip(["mouth"], [np.arange(25) / 24], 24.0)
    mixer = Mixer(["mouth"], [Layer(ramp, warp=([0.25, 1.25], [0.625, 0.125]))])
    times = np.linspace(0.25, 1.25, 11)
    shown = mixer.evaluate_batch(times)[:, 0]
    np.testing.assert_allclose(shown, 0.75 - times / 2, rtol=0, atol=1e-6)


# Settings that the warp of a layer replaces; a layer with both is refused.
BESIDE_A_WARP = (
    {"start": 0.5}, {"end": 3.0}, {"clip_range": (0.25, 0.5)}, {"scale": 2.0}, {"repeat": 2.0},
    {"reverse": True},
)  # fmt: skip


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"blend": "screen"}, "blend: one of override, additive, max was expected, found screen"),
        ({"extend": "loop"}, "extend: one of hold, hold_forward, nothing, repeat"),
        ({"weight": 1.5}, r"values from 0 to 1 .* \[layers\[0\].weight\]"),
        ({"weight": ([0, 0], [1, 1])}, r"layers\[0\].weight"),
        ({"scale": 0.0}, r"above 0 .*layers\[0\].scale"),
        ({"repeat": math.inf}, r"layers\[0\].repeat"),
        ({"fade_in": -1.0}, r"layers\[0\].fade_in"),
        ({"fade_out": math.nan}, r"layers\[0\].fade_out"),
        ({"clip_range": (0.5, 0.5)}, r"layers\[0\].clip_range"),
        ({"start": math.inf}, r"layers\[0\].start"),
        ({"end": 3.0}, r"layers\[0\].end: a clip ends by its length"),
        ({"warp": ([0.0], [1.0])}, r"two or more .*layers\[0\].warp"),
        *(({"warp": ([0, 1], [0, 1]), **beside}, "a warp alone") for beside in BESIDE_A_WARP),
        ({"mask": [1.0]}, r"one value per control .*mask"),
        ({"mask": {"brow": 2.0}}, "a weight from 0 to 1"),
        ({"mask": {"brwo": 1.0}}, "mask brwo: a region, a control or a pattern"),
    ],
)
def test_refuses(settings, sentence):
    mixer = Mixer(NAMES, STACKS["one"])
    with pytest.raises(ValueError, match=sentence):
        mixer.layers = [replace(Layer(noise()), **settings)]
    assert mixer.layers == tuple(STACKS["one"])  # the earlier layers are still there


def test_refuses_what_does_not_fit():
    with pytest.raises(ValueError, match="twice"):
        Mixer(["a", "a"])
    with pytest.raises(ValueError, match="a: a range whose lower end"):
        Mixer(["a"], ranges={"a": (1, 0)})
    with pytest.raises(ValueError, match=r"\[1, 2\] was expected"):
        Mixer(["a"], ranges=[0.0, 1.0])
    with pytest.raises(ValueError, match="base: an array of shape"):
        Mixer(["a"]).evaluate(0.0, [1.0, 2.0])
    with pytest.raises(ValueError, match="out: a writeable contiguous float32"):
        Mixer(["a"]).evaluate(0.0, None, np.zeros(1))
    with pytest.raises(ValueError, match="such as joy"):
        Mixer(["a"], [Layer("joi")])


# -- reactions -------------------------------------------------------------------------------------

REACTIONS = {
    "one": Reaction("one", (ReactionPart({"a": 1.0, "b": 0.5, "none": 1.0}, 0.1, 0.2, 0.3, 0.4),)),
    "two": Reaction("two", (ReactionPart({"a": 0.8}, 0.0, 0.3, 0.0, 0.3),)),
}


def envelope(part, t):
    t -= part.delay
    up, down = part.attack, part.attack + part.hold
    x = np.interp(t, [0, up, down, down + part.release], [0, 1, 1, 0])
    return x * x * (3 - 2 * x)


def test_reactions_join_softly_over_what_is_there():
    mixer = Mixer(["a", "b"], reactions=REACTIONS)
    fired = [("one", 0.0, 1.0), ("two", 0.05, 0.9), ("one", 0.31, 0.6)]
    assert all(mixer.fire(*firing) for firing in fired)
    base = np.float32([0.3, 0.1])
    times = np.linspace(-0.2, 1.8, 301)
    rest = np.tile(1.0 - base.astype(np.float64), (len(times), 1))
    for name, when, strength in fired:
        part = REACTIONS[name].parts[0]
        for i, control in enumerate("ab"):
            amount = strength * part.weights.get(control, 0.0)
            rest[:, i] *= 1 - amount * envelope(part, times - when)
    np.testing.assert_allclose(mixer.evaluate_batch(times, base), 1 - rest, atol=1e-6)


def test_firing_again_makes_no_step_and_never_goes_beyond_one():
    mixer = Mixer(["a"], reactions=REACTIONS)
    times = np.linspace(0, 4, 40001)
    for when in np.arange(0, 2, 0.037):
        mixer.fire("two", when)
    curve = mixer.evaluate_batch(times)[:, 0]
    assert curve.max() <= 1.0
    # A step in time raises x by step / attack (0.3 s); the slope of x * x * (3 - 2 * x) is at most
    # 1.5, the weight 0.8, and at most sixteen attacks overlap.
    assert np.abs(np.diff(curve)).max() < 16 * 0.8 * 1.5 / 0.3 * (times[1] - times[0])


def test_no_more_than_the_limit_sound_at_once():
    mixer = Mixer(["a"], reactions=REACTIONS, max_fired=2)
    assert mixer.fire("two", 0.0)
    assert mixer.fire("two", 0.1)
    assert not mixer.fire("two", 0.2)
    assert mixer.fire("two", 0.6)  # the first firing has ended
    mixer.clear_fired()
    assert mixer.evaluate(0.7).tolist() == [0.0]


def test_events_fire_by_name():
    mixer = Mixer(["a"], reactions=REACTIONS)
    events = [Event(0.0, "two", value="0.5"), Event(0.1, "word"), Event(5.0, "two")]
    assert mixer.fire_events(events, offset=1.0) == 2
    assert mixer.evaluate(1.3)[0] == pytest.approx(0.4)
    with pytest.raises(ValueError, match="fire two"):
        mixer.fire("two", 0.0, 2.0)
    with pytest.raises(KeyError):
        mixer.fire("three", 0.0)


def test_a_reaction_does_not_go_beyond_one_where_sliders_may():
    mixer = Mixer(["a", "b"], ranges={"a": (0, 1.5), "b": (0, 0.5)}, reactions=REACTIONS)
    mixer.fire("one", 0.0)
    assert mixer.evaluate(0.4).tolist() == [1.0, 0.25]
    assert mixer.evaluate(0.4, [1.25, 0.0])[0] == 1.25


def test_a_reaction_needs_an_upper_limit():
    with pytest.raises(ValueError, match="upper limit"):
        Mixer(["a"], ranges={"a": (0, np.inf)}, reactions=REACTIONS)


# -- exclusive controls ----------------------------------------------------------------------------


@pytest.mark.parametrize(("measure", "on"), [("max", 0.9), ("min", 0.2), ("mean", 0.55)])
def test_what_yields_is_scaled_down(measure, on):
    rules = Exclusives((Yield("", ("a", "b", "none"), ("c", "d"), measure, 0.5),), (("d", "e"),))
    mixer = Mixer(["a", "b", "c", "d", "e"], exclusives=rules)
    found = mixer.evaluate(0, [0.9, 0.2, 0.6, 0.8, 0.1])
    left = 1 - 0.5 * on
    wanted = [0.9, 0.2, 0.6 * left, 0.8 * left - 0.1, 0.0]
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_yields_see_values_before_any_of_them():
    both = (Yield("", ("a",), ("b",)), Yield("", ("b",), ("a",)))
    assert Mixer(["a", "b"], exclusives=Exclusives(both)).evaluate(0, [1, 1]).tolist() == [0, 0]


def test_the_seal_of_an_open_jaw_stills_the_lips():
    """The lips-together controls suppress the upper lip only while the jaw is open.

    With a shut jaw they suppress no control, and they never change the jaw.
    """
    lips = [f"CTRL_expressions.mouthLipsTogether{q}" for q in ("UL", "UR", "DL", "DR")]
    names = [*lips, "CTRL_expressions.jawOpen", "CTRL_expressions.mouthUpperLipRaiseL"]
    for jaw, left in ((0.8, 1 - 0.7 * 0.8), (0.0, 1.0)):
        base = np.float32([1, 1, 1, 1, jaw, 1])
        found = Mixer(names, exclusives="default").evaluate(0, base)
        np.testing.assert_allclose(found, [1, 1, 1, 1, jaw, left], atol=1e-6)


def test_a_jaw_cannot_go_both_ways():
    names = ["CTRL_expressions.jawLeft", "CTRL_expressions.jawRight"]
    found = Mixer(names, exclusives="default").evaluate(0, [0.75, 0.25])
    np.testing.assert_allclose(found, [0.5, 0.0], atol=1e-6)


def test_files_of_rules_and_reactions(tmp_path):
    own = load_reactions()
    assert {"flash", "blink", "startle"} <= set(own)
    flash = own["flash"].parts[0].weights
    assert flash == {"CTRL_expressions.eyeBlinkL": 1.0, "CTRL_expressions.eyeBlinkR": 1.0}
    for text, sentence in [
        ("[a]\n", "a: a table with parts"),
        ("[a]\n[[a.parts]]\nattack = 0\nweights = {x = 1}\n", r"a.parts\[0\].attack: .* above 0"),
        ("[a]\n[[a.parts]]\nweights = {x = 2}\n", "x: a weight from 0 to 1 .* found 2"),
        ("[a]\n[[a.parts]]\nweight = {x = 2}\n", "found weight"),
        ("[a", "a TOML file was expected"),
    ]:
        path = tmp_path / "own.toml"
        path.write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=sentence) as error:
            load_reactions(path)
        assert str(path) in str(error.value)
    path.write_text('[[yields]]\nby = ["a"]\n', encoding="utf-8")
    with pytest.raises(ValueError, match="yields with by and of"):
        load_exclusives(path)


# -- regions ---------------------------------------------------------------------------------------


def test_every_region_has_standard_controls_and_a_title(standard_controls):
    """The order of regions must not change, because the add-on stores their indices."""
    assert " ".join(REGIONS) == "brow eye nose cheek mouth jaw tongue teeth neck ear other"
    assert {region_of(name) for name in standard_controls} == set(REGIONS) - {"other"}
    assert TITLES["brow"] == "Brows"
    assert region_of("head.yaw") == "neck"


def test_masks_by_region_side_control_and_pattern():
    parts = {"brow": 0.5, "brow.L": 1.0, "jawOpen": 0.25, "mouth*t": 0.75, "mouthLeft": 0.0}
    assert mask(NAMES, parts).tolist() == [0.25, 1.0, 0.5, 0.0, 0.75, 0.0]
    assert mask(NAMES, {"tongue": 1.0}, default=0.5).tolist() == [0.5] * 6


def test_is_public():
    assert {"Mixer", "Layer"} <= set(risorius.__all__)


def test_a_base_without_axes_is_refused():
    with pytest.raises(ValueError, match="base"):
        Mixer(["a"]).evaluate_batch([0.0], 0.5)


@pytest.mark.parametrize("scale", [1.0, 0.7, 1.3, 3.1])
def test_a_layer_holds_its_end_however_late_it_is(scale):
    clip = Clip(["a"], [[0.1, 0.3, 0.5, 0.7, 0.9]], 30.0)
    mixer = Mixer(["a"], [Layer(clip, start=1.7e9, scale=scale)])
    assert mixer.evaluate(1.7e9 + 100.0)[0] == pytest.approx(0.9)


def test_events_of_other_values_fire_at_full_strength():
    mixer = Mixer(["CTRL_expressions.eyeBlinkL"])
    events = [Event(0.0, "blink", 0.0, text) for text in ("left", "nan", "")]
    assert mixer.fire_events(events) == 3
