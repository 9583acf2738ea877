# SPDX-License-Identifier: MIT
"""Names of VRM are recognised in files as in live captures; single letters alone are not."""

from __future__ import annotations

import json

import numpy as np
import pytest
from risorius import Clip, importing
from risorius.cli import main
from risorius.controls import arkit
from risorius.live import Frame, Shaper

VRM_0 = ["A", "I", "U", "E", "O", "Blink_L", "Blink_R", "Joy", "LookUp", "Neutral"]
VRM_1 = ["aa", "ih", "ou", "ee", "oh", "blinkLeft", "blinkRight", "happy", "lookUp", "neutral"]


def table(names, moving=None):
    """CSV text with a column for each name. In the first frame all values are 0.

    A further frame for each name in `moving` (None: all names) has the value 1 for it alone.
    """
    rows = [["0"] * len(names)]
    for i, name in enumerate(names):
        if moving is None or name in moving:
            rows.append(["1" if k == i else "0" for k in range(len(names))])
    lines = (f"{i / 30:.4f},{','.join(row)}" for i, row in enumerate(rows))
    return "\n".join([f"time,{','.join(names)}", *lines]) + "\n"


def read(tmp_path, text, name="take.csv"):
    (tmp_path / name).write_text(text)
    return importing.read(tmp_path / name)


@pytest.mark.parametrize("names", [VRM_0, VRM_1, [n.lower() for n in VRM_0]])
def test_names_of_vrm_move_in_files_what_they_move_live(tmp_path, names):
    found = read(tmp_path, table(names))
    assert found.mapping == "vrm"
    clip, report = found.apply()
    assert report.unmapped == []
    shaper = Shaper()
    for i, name in enumerate(names, start=1):
        frame = Frame("x", i, i, i, (name,), np.ones(1, np.float32))
        live = shaper.apply(frame)
        want = {c: v for c, v in zip(live.names, live.values.tolist(), strict=True) if v}
        mine = {c: v for c, v in zip(clip.names, clip.curves[:, i].tolist(), strict=True) if v}
        assert mine == pytest.approx(want)


@pytest.mark.parametrize("moving", ["A", "E", "AE", "AIUEO"])
def test_the_five_vowels_together_are_vrm_whichever_moves(tmp_path, moving):
    assert read(tmp_path, table("AIUEO", moving)).mapping == "vrm"
    lists = {"time": [0.0, 0.1], **{v: [0.0, float(v in moving)] for v in "AIUEO"}}
    assert read(tmp_path, json.dumps(lists), "take.json").mapping == "vrm"


def test_vowels_beside_words_are_what_the_words_say(tmp_path):
    assert read(tmp_path, table(["AI", "E", "O", "U", "WQ", "L", "MBP"])).mapping == "papagayo"
    assert read(tmp_path, table(["sil", "PP", "E", "I", "O", "U"], "EIOU")).mapping == "oculus"


@pytest.mark.parametrize("names", ["A", "E", "ABCDEFGHX", "AEO", "X", "EIOU"])
def test_letters_alone_are_asked_about(tmp_path, names, capsys):
    path, out = tmp_path / "take.csv", tmp_path / "out.rzc"
    path.write_text(table(names))
    assert main(["clip", "convert", str(path), "-o", str(out)]) == 1
    said = capsys.readouterr().err
    assert "names longer than a letter were expected" in said
    assert "give one of these mappings (--mapping; Mapping in Blender)" in said
    chosen = "vrm" if names in ("A", "E", "AEO") else "rhubarb" if "X" in names else "oculus"
    assert main(["clip", "convert", str(path), "-o", str(out), "--mapping", chosen]) == 0
    assert bool(Clip.load(out).names) == (names != "X")  # X means rest


def test_expressions_of_vrm_beside_the_units_are_left_out_as_live(tmp_path):
    units = list(arkit.mapping())[: arkit.FULL_SET]
    assert read(tmp_path, table([*units, *VRM_0])).mapping == "arkit"
    few = read(tmp_path, table([*units[:3], "Blink_L", "Joy"]))
    assert few.mapping == "vrm"
    assert few.apply()[1].unmapped == []
    assert read(tmp_path, table(units[:3])).mapping == "arkit"
