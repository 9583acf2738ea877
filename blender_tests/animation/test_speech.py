# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests keyframes made from speech: the fewest that its curves need, or one on every frame."""

import bpy
import numpy as np
import pytest
from risorius import expressions, speech
from risorius.speech.audio import RATE
from risorius.speech.phones import Phoneme
from support import scene
from support.layout import Recorder, drawn

JAW = "CTRL_expressions.jawOpen"
JAW_PATH = f'pose.bones["face"]["{JAW}"]'
SAID = "SIL HH.hello AH L OW SIL B.bob AA B SIL W.why AY SIL".split()
LENGTH = 0.1  # seconds per sound


def heard():
    """A recognised voice of 1.3 s: three words, with silence before and after each word."""
    phones = []
    for i, said in enumerate(SAID):
        name, _, word = said.partition(".")
        phones.append(Phoneme(i * LENGTH, (i + 1) * LENGTH, name, word=word))
    time = np.arange(int(len(SAID) * LENGTH * RATE)) / RATE
    loud = 0.3 * np.sin(2 * np.pi * 150 * time) * (0.6 + 0.4 * np.sin(9 * time))
    return speech.Heard(phones, loud.astype(np.float32), True, [])


@pytest.fixture
def rig(dna_file, monkeypatch):
    """A face in a scene with 24 frames per second; the recogniser always returns `heard()`."""

    class Task:
        error = None

        def __init__(self, path, transcript, **options):
            self.result = speech.animate(heard(), **options)

        def run(self):
            pass

    listening = scene.submodule("scene.animation.speech_task")
    monkeypatch.setattr(listening, "has_recogniser", lambda: True)
    monkeypatch.setattr(listening, "SpeechTask", Task)
    face = scene.load(dna_file, "LIVE")
    bpy.context.scene.render.fps = 24
    return face


def speak(**options):
    """Speak from frame 11 on. Returns the action of the voice."""
    options = {"target": "ACTION", "start": 11.0, "use_sound": False, **options}
    assert bpy.ops.risorius.speak(filepath="bob.wav", **options) == {"FINISHED"}
    return bpy.context.object.animation_data.action


def curves(action):
    found = scene.submodule("scene.base.compat").curves_of(action)
    return {(c.data_path, c.array_index): c for c in found}


def test_a_voice_has_as_few_keys_as_its_curves_need(rig):
    every = curves(speak(use_every_frame=True))
    frames = np.arange(11, 11 + 40)
    wanted = {path: [c.evaluate(f) for f in frames] for path, c in every.items()}
    count = sum(len(c.keyframe_points) for c in every.values())
    straight = {k.interpolation for c in every.values() for k in c.keyframe_points}
    assert straight == {"LINEAR"}
    few = curves(speak())
    assert few.keys() == every.keys()
    for path, curve in few.items():
        tolerance = 0.005 if "CTRL_" in path[0] else 0.0005
        found = [curve.evaluate(frame) for frame in frames]
        assert np.abs(np.subtract(found, wanted[path])).max() <= tolerance, path
        assert all(k.co.x == round(k.co.x) for k in curve.keyframe_points)
    assert count > 3.5 * sum(len(c.keyframe_points) for c in few.values())
    coarse = curves(speak(tolerance=0.02))
    assert sum(len(c.keyframe_points) for c in coarse.values()) < 0.85 * sum(
        len(c.keyframe_points) for c in few.values()
    )


def test_a_layer_shows_the_voice_at_every_frame(rig):
    """A layer plays the F-curves of a voice, within the tolerance of their fitted Bezier keys."""
    wanted = speech.animate(heard(), rate=24.0).curve(JAW)
    bpy.ops.risorius.speak(filepath="bob.wav", target="LAYER", start=11.0, use_sound=False)
    (layer,) = scene.controls(rig).risorius_layers
    layer.fade_in = layer.fade_out = 0.0
    present = scene.submodule("scene.see_why.present")
    for frame in (14, 19, 23, 30, 37):
        bpy.context.scene.frame_set(frame)
        now = present.of(rig)
        jaw = now.raw[now.live.labels.index(JAW)]
        assert jaw == pytest.approx(wanted[frame - 11], abs=0.006)


def test_a_face_speaks_by_its_own_visemes(rig, tmp_path):
    """A face uses its own visemes from the folder beside its DNA file, such as anna_expressions.

    A viseme with a control that the face lacks is ignored.
    """
    slider = "CTRL_expressions.eyeLookUpL"  # a control that our visemes do not move
    dna = tmp_path / "anna.dna"
    rig["risorius_source"] = str(dna)
    folder = tmp_path / "anna_expressions"
    folder.mkdir()
    for name, control in (("aa", slider), ("nn", "CTRL_expressions.ofAnother")):
        weights = {control: 1.0}
        own = expressions.Expression(name, name, "viseme", "", weights)
        (folder / f"{name}.toml").write_text(expressions.text_of(own))
    library = {"aa": expressions.load(folder / "aa.toml")["aa"]}
    wanted = speech.animate(heard(), rate=24.0, library=library).curve(slider)
    plain = curves(speak(use_own_visemes=False))
    assert (f'pose.bones["face"]["{slider}"]', 0) not in plain
    action = speak()
    curve = curves(action)[f'pose.bones["face"]["{slider}"]', 0]
    assert wanted.max() > 0.3
    frames = 11 + np.arange(len(wanted))
    np.testing.assert_allclose([curve.evaluate(f) for f in frames], wanted, atol=0.006)
    # A correction of a sound uses the same visemes, even if their file has been deleted.
    (folder / "aa.toml").unlink()
    before = max(k.co.y for k in curve.keyframe_points)
    for sound in action.risorius_spoken.sounds:
        if sound.name == "AA":
            sound.length = 1.0
    curve = curves(action)[f'pose.bones["face"]["{slider}"]', 0]
    assert 0.0 < max(k.co.y for k in curve.keyframe_points) < before


# ---- corrections of sounds ----


def sounds(action):
    """Start frame, phoneme and word of each sound of the voice in an action."""
    return [(round(s.begin, 2), s.name, s.word) for s in action.risorius_spoken.sounds]


def keys(action):
    """F-curve of an action -> place, handles and types of its keys, for comparisons."""
    found = {}
    for path, curve in curves(action).items():
        rows = [
            (*k.co, *k.handle_left, *k.handle_right, k.interpolation, k.handle_left_type)
            for k in curve.keyframe_points
        ]
        found[path] = rows
    return found


def frame_of(place):
    return 11.0 + place * LENGTH * 24


def jaw_of(action):
    """The values of the jaw at each frame of a new voice that is made from the action's sounds."""
    said = [*action.risorius_spoken.sounds]
    ends = [sound.begin for sound in said[1:]] + [frame_of(len(SAID))]
    phones = [
        Phoneme((sound.begin - 11) / 24, (end - 11) / 24, sound.name)
        for sound, end in zip(said, ends, strict=True)
    ]
    return speech.animate(heard()._replace(phonemes=phones), rate=24.0).curve(JAW)


def test_a_voice_keeps_its_words_and_sounds_with_its_action(rig, tmp_path):
    action = speak()
    wanted = []
    for i, said in enumerate(SAID):
        name, _, word = said.partition(".")
        wanted.append((pytest.approx(frame_of(i), abs=0.01), name, word))
    assert sounds(action) == wanted
    name, path = action.name, str(tmp_path / "a.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bpy.ops.risorius.sound_remove(place=6) == {"FINISHED"}
    assert len(bpy.data.actions[name].risorius_spoken.sounds) == len(SAID) - 1
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b.blend"))
    with bpy.data.libraries.load(path) as (_there, taken):
        taken.actions = [name]
    assert sounds(taken.actions[0]) == wanted


def test_a_replaced_sound_changes_the_mouth_around_it_and_nothing_else(rig):
    action = speak()
    before, frames = keys(action), np.arange(11, 11 + 32)
    assert bpy.ops.risorius.sound_set(place=7, sound="Oo") == {"FINISHED"}  # in the word "bob"
    assert sounds(action)[7][1:] == ("UH", "")
    after = keys(action)
    assert after.keys() == before.keys()
    changed = {path for path in after if after[path] != before[path]}
    assert (JAW_PATH, 0) in changed
    assert not any("eyeBlink" in p or "brow" in p or "head" in p for p, _ in changed)
    for path in changed:
        rows = [row[0] for row in after[path] if row not in before[path]]
        rows += [row[0] for row in before[path] if row not in after[path]]
        assert frame_of(7) - 12 < min(rows), path  # half a second before and after
        assert max(rows) < frame_of(8) + 12, path
    found = [curves(action)[JAW_PATH, 0].evaluate(f) for f in frames]
    assert np.abs(found - jaw_of(action)[: len(frames)]).max() < 0.0101
    present = scene.submodule("scene.see_why.present")
    bpy.context.scene.frame_set(29)  # the evaluated face
    now = present.of(rig)
    assert now.raw[now.live.labels.index(JAW)] == pytest.approx(found[29 - 11], abs=1e-5)


def test_keys_that_somebody_made_elsewhere_and_locked_curves_stay(rig):
    action = speak()
    jaw = curves(action)[JAW_PATH, 0]
    for key in (jaw.keyframe_points[0], jaw.keyframe_points[-1]):
        key.co.y = 0.9
    jaw.update()
    ends = keys(action)[JAW_PATH, 0]
    bpy.ops.risorius.sound_set(place=7, sound="UW")
    after = keys(action)[JAW_PATH, 0]
    assert (after[0][:4], after[-1]) == (ends[0][:4], ends[-1])
    assert after != ends
    jaw.lock = True
    bpy.ops.risorius.sound_set(place=7, sound="AA")
    assert keys(action)[JAW_PATH, 0] == after


def test_every_frame_stays_every_frame_and_a_layer_is_corrected_too(rig):
    bpy.ops.risorius.speak(
        filepath="bob.wav", target="LAYER", start=11.0, use_sound=False, use_every_frame=True
    )
    (layer,) = scene.controls(rig).risorius_layers
    layer.fade_in = layer.fade_out = 0.0
    before = keys(layer.action)[JAW_PATH, 0]
    assert bpy.ops.risorius.sound_set(place=7, sound="SIL") == {"FINISHED"}
    after = keys(layer.action)[JAW_PATH, 0]
    assert [row[0] for row in after] == [row[0] for row in before]
    assert {row[6] for row in after} == {"LINEAR"}
    bpy.context.scene.frame_set(29)
    now = scene.submodule("scene.see_why.present").of(rig)
    jaw = now.raw[now.live.labels.index(JAW)]
    assert jaw == pytest.approx(jaw_of(layer.action)[18], abs=0.005)
    assert jaw < before[18][1] - 0.05


def test_start_and_length_move_sounds_between_their_neighbours(rig):
    action = speak()
    rows = action.risorius_spoken.sounds
    rows[7].start = 26.0
    assert [round(rows[i].begin, 2) for i in (6, 7, 8)] == [25.4, 26.0, 30.2]
    rows[7].length = 2.0
    assert round(rows[8].start, 2) == 28.0
    rows[7].start = 99.0  # the next sound stays
    assert rows[7].begin == pytest.approx(27.75)
    rows[0].start = 3.0  # the first sound begins with the voice
    assert rows[0].begin == 11.0
    found = [curves(action)[JAW_PATH, 0].evaluate(f) for f in range(11, 43)]
    assert np.abs(found - jaw_of(action)[:32]).max() < 0.02  # the tolerance of four corrections
    action.risorius_spoken.active = 8
    assert bpy.context.scene.frame_current == 28


def test_words_are_spelled_anew_and_sounds_inserted_and_removed(rig):
    action = speak()
    said = action.risorius_spoken
    said.active = 7
    assert bpy.ops.risorius.word_set(text="mama bill") == {"FINISHED"}
    words = [(name, word) for _, name, word in sounds(action)[6:-3]]
    assert [word for _, word in words if word] == ["mama", "bill"]
    assert words[0][0] == "M"
    assert sounds(action)[-3:][0][0] == pytest.approx(frame_of(10), abs=0.01)
    count = len(said.sounds)
    assert bpy.ops.risorius.sound_insert(place=1, sound="f v") == {"FINISHED"}
    assert sounds(action)[1:3] == [(13.4, "HH", "hello"), (14.6, "F", "")]
    assert bpy.ops.risorius.sound_remove(place=1) == {"FINISHED"}
    assert sounds(action)[1] == (14.6, "F", "hello")
    assert len(said.sounds) == count


WRONG = (
    (lambda do: do.sound_set(sound="Q"), "a mouth such as M B P or a phoneme such as AA was"),
    (lambda do: do.sound_set(sound="M", place=99), "a sound from 0 to 12 was expected, found 99"),
    (lambda do: do.word_set(text="!"), "a word of the letters a to z was expected"),
    (lambda do: do.word_set(text="a" * 90, place=11), "do not fit into"),
)


def test_corrections_that_cannot_be_made_change_nothing(rig):
    action = speak()
    before = sounds(action), keys(action)
    for call, sentence in WRONG:
        with pytest.raises(RuntimeError, match=sentence):
            call(bpy.ops.risorius)
        assert (sounds(action), keys(action)) == before


def test_a_voice_that_lost_its_list_or_never_had_one_is_a_sentence(rig):
    with pytest.raises(RuntimeError, match="This face speaks no voice: use Speak from Audio"):
        bpy.ops.risorius.sound_remove()
    action = speak()
    action.risorius_spoken.built = "[]"
    with pytest.raises(RuntimeError, match="has lost what its keys were made of"):
        bpy.ops.risorius.sound_remove()
    action = speak()
    while len(action.risorius_spoken.sounds) > 1:
        bpy.ops.risorius.sound_remove()
    with pytest.raises(RuntimeError, match="a voice keeps one sound at least"):
        bpy.ops.risorius.sound_remove()


def test_a_correction_is_undone_in_one_step_with_its_keys(rig):
    action = speak()
    name, before = action.name, (sounds(action), keys(action))
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.risorius.sound_remove(place=6)
    bpy.ops.ed.undo_push(message="after")
    assert bpy.ops.ed.undo() == {"FINISHED"}
    action = bpy.data.actions[name]
    assert (sounds(action), keys(action)) == before
    assert bpy.ops.risorius.sound_remove(place=6) == {"FINISHED"}


# ---- corrections by markers ----


def marker(frame):
    """The marker at this frame of the scene; fails unless there is exactly one."""
    (found,) = [m for m in bpy.context.scene.timeline_markers if m.frame == frame]
    return found


def markers():
    """Frame and name of all markers, sorted."""
    return sorted((m.frame, m.name) for m in bpy.context.scene.timeline_markers)


def test_markers_stand_for_sounds_and_changed_ones_are_followed(rig, capfd):
    own = bpy.context.scene.timeline_markers.new("mine", frame=21)
    action = speak()
    assert bpy.ops.risorius.speech_markers() == {"FINISHED"}
    shown = markers()
    assert (25, "bob: M B P") in shown
    assert len(shown) == len(SAID) + 1
    own.frame = 22  # the user's own marker
    marker(28).frame = 27
    marker(30).name = "F V"
    with pytest.raises(RuntimeError, match="choose Update Speech first"):
        bpy.ops.risorius.sound_remove()
    assert bpy.ops.risorius.speech_update() == {"FINISHED"}
    assert sounds(action)[7:9] == [(27.0, "AA", ""), (30.2, "F", "")]
    assert {(27, "Ah"), (30, "F V")} <= set(markers())
    bpy.context.scene.timeline_markers.remove(marker(27))
    bpy.context.scene.timeline_markers.new("Oo", frame=41)  # a copied or new marker
    assert bpy.ops.risorius.speech_update() == {"FINISHED"}
    assert [name for _, name, _ in sounds(action)] == (
        "SIL HH AH L OW SIL B F SIL W AY SIL UH".split()
    )
    marker(13).frame = 45  # beyond all others
    capfd.readouterr()
    assert bpy.ops.risorius.speech_update() == {"FINISHED"}
    assert "hello: K G was moved past its neighbour" in capfd.readouterr().out
    assert sounds(action)[1] == (pytest.approx(15.55), "HH", "hello")
    assert bpy.ops.risorius.speech_markers() == {"FINISHED"}
    assert markers() == [(22, "mine")]


def test_markers_that_stand_for_no_sound_are_a_sentence(rig):
    action = speak()
    bpy.ops.risorius.speech_markers()
    before, there = sounds(action), bpy.context.scene.timeline_markers
    marker(18).name = "bob: hum"
    with pytest.raises(RuntimeError, match="the marker bob: hum at frame 18: a mouth such as"):
        bpy.ops.risorius.speech_update()
    for one in list(there):
        there.remove(one)
    with pytest.raises(RuntimeError, match="no marker of this voice is left: show its markers"):
        bpy.ops.risorius.speech_update()
    assert sounds(action) == before
    bpy.context.scene["risorius_markers"] = "somebody wrote here"
    assert bpy.ops.risorius.speech_markers() == {"FINISHED"}
    assert len(markers()) == len(SAID)


def test_markers_lie_where_a_layer_plays_the_voice(rig):
    bpy.ops.risorius.speak(filepath="bob.wav", target="LAYER", start=11.0, use_sound=False)
    (layer,) = scene.controls(rig).risorius_layers
    layer.start, layer.scale = 101.0, 2.0
    bpy.ops.risorius.speech_markers()
    marker(round(101 + 2 * (25.4 - 11))).frame = 126
    bpy.ops.risorius.speech_update()
    assert sounds(layer.action)[6][0] == 23.5


def test_the_panel_lists_sounds_and_what_can_be_done(rig):
    panel = scene.submodule("ui.speech.panel")
    assert not panel.RISORIUS_PT_speech.poll(bpy.context)
    action = speak()
    assert panel.RISORIUS_PT_speech.poll(bpy.context)
    layout = drawn(panel.RISORIUS_PT_speech)
    wanted = "sound_insert sound_remove word_set speech_markers speech_update".split()
    assert {f"risorius.{name}" for name in wanted} <= set(layout.operators)
    line = Recorder()
    panel.RISORIUS_UL_sounds.draw_item(
        None, bpy.context, line, None, action.risorius_spoken.sounds[6], 0, None, ""
    )
    assert line.labels == ["bob", "M B P"]
    assert line.properties == ["start", "length"]
    assert drawn(panel.RISORIUS_MT_mouths).operators == ["risorius.sound_set"] * 15
