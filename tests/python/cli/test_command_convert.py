# SPDX-License-Identifier: MIT
"""Tests the command `risorius convert`: written files, messages, and refusals."""

import json
import os
import subprocess
import sys

import command_line
import numpy as np
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra
from risorius.cli import main

FILES = sorted(GOLDEN.glob("*.dna"))
MALFORMED = SHARED / "data" / "golden" / "malformed"


def convert(*arguments, stdin=b"", script=None):
    """Run the command; if there is a script, run it first, in the same separate process."""
    if script is None:
        return command_line.run("convert", *arguments, stdin=stdin)
    begin = f"{script}\nfrom risorius.cli import main; import sys; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", begin, "convert", *map(str, arguments)],
        input=stdin,
        capture_output=True,
        check=False,
    )
    assert b"Traceback" not in done.stderr, done.stderr.decode()
    return done


def words(done):
    return done.stderr.decode().replace("\r\n", "\n")


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_to_json_and_back_gives_the_same_bytes(path, tmp_path):
    text, again = tmp_path / "face.json", tmp_path / "face.dna"
    assert main(["convert", str(path), str(text)]) == 0
    assert json.loads(text.read_text())["version"]["version"] == risorius.load(path).version
    assert main(["convert", str(text), str(again)]) == 0
    assert again.read_bytes() == path.read_bytes()


def test_the_summary_says_what_was_written(tmp_path):
    done = convert(GOLDEN / "medium.dna", tmp_path / "face.dna")
    assert (done.returncode, words(done)) == (0, "")
    summary = done.stdout.decode().split(": ", 1)[1].strip()
    assert summary == "2.8, 4 LODs, 122 joints, 469,123 bytes"
    assert os.listdir(tmp_path) == ["face.dna"]


def test_standard_input_and_output():
    data = (GOLDEN / "core.dna").read_bytes()
    text = convert("-", "-", "--from", "dna", "--to", "json", stdin=data)
    assert words(text).startswith("<stdout>: 2.8, 2 LODs, 5 joints")
    back = convert("-", "-", "--from", "json", "--to", "dna", stdin=b"\xef\xbb\xbf" + text.stdout)
    assert back.stdout == data
    assert convert("-", "-", "--to", "json", stdin=data).returncode == 2


def test_names_without_a_suffix_need_a_word(tmp_path):
    odd = tmp_path / "face.txt"
    assert convert(GOLDEN / "core.dna", odd).returncode == 2
    assert convert(GOLDEN / "core.dna", odd, "--to", "dna").returncode == 0
    assert odd.read_bytes() == (GOLDEN / "core.dna").read_bytes()


@pytest.mark.parametrize("minor", range(1, 9))
def test_a_version_is_the_one_asked_for(minor, tmp_path):
    out = tmp_path / "face.dna"
    done = convert(GOLDEN / "tiny_v22.dna", out, "--version", f"2.{minor}")
    assert (done.returncode, words(done)) == (0, "")
    dna = risorius.load(out)
    assert dna.version == minor
    assert dna.joint_names == risorius.load(GOLDEN / "tiny_v22.dna").joint_names


def test_what_the_version_cannot_hold_is_a_line_each(tmp_path):
    out = tmp_path / "face.dna"
    done = convert(GOLDEN / "tiny_v28.dna", out, "--version", "2.3")
    lines = words(done).splitlines()
    assert done.returncode == 0
    assert all(line.startswith("risorius: warning: ") for line in lines)
    # These layers of the file are not empty, and were added to the format after version 2.3.
    named = [line.split("has no layer ")[1].split(";")[0] for line in lines]
    assert named == ["rbfb", "rbfe", "jbmd", "twsw", "mlbe"]
    assert "twsw" in risorius.load(out).layers


def test_what_is_left_out_takes_what_it_drove_along(tmp_path):
    """If networks are left out, columns of joint groups for their controls are left out too.

    Version 2.1 and the layer behavior contain no networks.
    """
    out = tmp_path / "face.dna"
    for options in (["--version", "2.1"], ["--layers", "behavior"]):
        done = convert(GOLDEN / "tiny_v28.dna", out, *options)
        assert done.returncode == 0
        assert "went with the controls that drove them" in words(done)
        dna = risorius.load(out)
        controls = len(dna.raw_control_names) + dna.psd_count
        assert all((group.input_indices < controls).all() for group in dna.joint_groups)


def test_a_newer_minor_becomes_the_newest_known_with_a_word(tmp_path):
    newer = bytearray((GOLDEN / "core.dna").read_bytes())
    newer[6] = 11
    (tmp_path / "newer.dna").write_bytes(newer)
    done = convert(tmp_path / "newer.dna", tmp_path / "face.dna")
    assert words(done) == "risorius: 2.11 becomes 2.8\n"
    assert (tmp_path / "face.dna").read_bytes() == (GOLDEN / "core.dna").read_bytes()


@pytest.mark.parametrize(
    ("lods", "kept"), [("0", [0]), ("0-2", [0, 1, 2]), ("0,3", [0, 3]), ("3, 1-2", [1, 2, 3])]
)
def test_lods(lods, kept, tmp_path):
    out = tmp_path / "face.dna"
    assert convert(GOLDEN / "medium.dna", out, "--lods", lods).returncode == 0
    whole, cut = risorius.load(GOLDEN / "medium.dna"), risorius.load(out)
    assert cut.lod_count == len(kept)
    for new, old in enumerate(kept):
        names = [whole.mesh_names[i] for i in whole.lod_mesh_mapping[old]]
        assert [cut.mesh_names[i] for i in cut.lod_mesh_mapping[new]] == names


@pytest.mark.parametrize("suffix", ["dna", "json"])
def test_layers_of_either_kind_of_file(suffix, tmp_path):
    source, out = tmp_path / f"in.{suffix}", tmp_path / "out.dna"
    assert convert(GOLDEN / "tiny_v28.dna", source).returncode == 0
    assert convert(source, out, "--layers", "geometry, joint_behavior_metadata").returncode == 0
    dna = risorius.load(out)
    assert len(dna.meshes) == len(dna.mesh_names) > 0
    assert len(dna.joint_behavior_metadata.joint_representations) == 14
    assert (len(dna.joint_groups), len(dna.twist_swing_behavior.twists)) == (0, 0)


def test_unknown_layers_stay_or_go(tmp_path):
    dna = risorius.load(GOLDEN / "tiny_v22.dna")
    dna.unknown_layers = [("xyzw", "3.1", b"\x01\x02")]
    dna.save(tmp_path / "in.dna", version="2.2")
    out = tmp_path / "out.dna"
    for policy, left in (("preserve", [("xyzw", "3.1", b"\x01\x02")]), ("ignore", [])):
        done = convert(tmp_path / "in.dna", out, "--unknown-layers", policy)
        assert (done.returncode, words(done)) == (0, "")
        assert risorius.load(out).unknown_layers == left
    done = convert(tmp_path / "in.dna", out, "--version", "2.1")
    assert "warning" in words(done)
    assert "xyzw" in words(done)


def test_coordinates_are_handed_on_as_the_properties_spell_them(tmp_path, monkeypatch):
    asked = []

    def fake(self, **target):
        asked.append(target)
        return risorius.Dna(face_winding_order="cw", name="turned")

    monkeypatch.setattr(risorius.Dna, "convert", fake, raising=False)
    out = tmp_path / "face.dna"
    arguments = "--axes right down front --rotation-sequence zyx --rotation-signs 1 -1 1 "
    arguments += "--winding cw --translation-unit m --rotation-unit radians"
    assert main(["convert", str(GOLDEN / "tiny_v24.dna"), str(out), *arguments.split()]) == 0
    assert asked == [
        {
            "axes": ["right", "down", "front"],
            "rotation_sequence": "zyx",
            "rotation_signs": [1, -1, 1],
            "face_winding_order": "cw",
            "translation_unit": "m",
            "rotation_unit": "radians",
        }
    ]
    assert risorius.load(out).face_winding_order == "cw"
    assert main(["convert", str(GOLDEN / "tiny_v24.dna"), str(out)]) == 0
    assert len(asked) == 1


def test_coordinates_are_those_asked_for(tmp_path):
    out = tmp_path / "face.dna"
    arguments = "--axes right front up --translation-unit m --rotation-unit radians --winding cw"
    done = convert(GOLDEN / "tiny_v22.dna", out, *arguments.split())
    assert done.returncode == 0
    assert "risorius: 2.2 becomes 2.8" in words(done).splitlines()  # 2.2 lacks the winding
    old, new = risorius.load(GOLDEN / "tiny_v22.dna"), risorius.load(out)
    assert old.coordinate_system == ("right", "up", "front")
    assert new.coordinate_system == ("right", "front", "up")
    assert (new.translation_unit, new.rotation_unit) == ("m", "radians")
    assert new.face_winding_order == "cw"
    for a, b in zip(old.meshes, new.meshes, strict=True):
        np.testing.assert_allclose(b.positions, a.positions[:, [0, 2, 1]] / 100, rtol=1e-6)
    moved = old.neutral_joint_translations[:, [0, 2, 1]] / 100
    np.testing.assert_allclose(new.neutral_joint_translations, moved, rtol=1e-6)


def test_a_version_that_was_asked_for_stays_with_a_warning(tmp_path):
    out = tmp_path / "face.dna"
    done = convert(GOLDEN / "tiny_v22.dna", out, "--version", "2.2", "--winding", "cw")
    assert done.returncode == 0
    assert "warning" in words(done)
    assert "clockwise" in words(done)
    assert risorius.load(out).version == 2


def test_axes_that_make_no_sense_are_refused(tmp_path):
    done = convert(GOLDEN / "core.dna", tmp_path / "x.dna", "--axes", "right", "left", "up")
    assert (done.returncode, words(done).count("\n")) == (2, 1)
    assert "axes" in words(done)
    assert os.listdir(tmp_path) == []


def test_indent_changes_spaces_and_nothing_else(tmp_path):
    texts = {}
    for indent in (0, 1, 4):
        out = tmp_path / f"{indent}.json"
        assert convert(GOLDEN / "core.dna", out, "--indent", indent).returncode == 0
        texts[indent] = out.read_text()
    assert texts[1] == risorius.load(GOLDEN / "core.dna").to_json()
    assert json.loads(texts[0]) == json.loads(texts[1]) == json.loads(texts[4])
    assert "\n " not in texts[0]
    assert '\n        "generation"' in texts[4]
    for bad in (["--indent", "9"], ["--indent", "1", "--to", "dna"]):
        assert convert(GOLDEN / "core.dna", tmp_path / "x.json", *bad).returncode == 2


def test_the_input_is_only_replaced_by_force(tmp_path):
    path, link = tmp_path / "face.dna", tmp_path / "link.dna"
    path.write_bytes((GOLDEN / "medium.dna").read_bytes())
    link.symlink_to(path)
    for out in (path, link):
        done = convert(path, out, "--lods", "0")
        assert done.returncode == 2
        assert "--force" in words(done)
        assert path.read_bytes() == (GOLDEN / "medium.dna").read_bytes()
    assert convert(path, link, "--lods", "0", "--force").returncode == 0
    assert link.is_symlink()
    assert risorius.load(path).lod_count == 1
    other = tmp_path / "other.dna"
    other.write_bytes(b"anything")
    assert convert(path, other).returncode == 0  # other existing files are replaced


FULL = (
    "import resource, signal\n"
    "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
    "resource.setrlimit(resource.RLIMIT_FSIZE, (50000, 50000))\n"
)


@pytest.mark.parametrize("name", ["face.dna", "face.json"])
def test_a_full_disk_leaves_the_old_file(name, tmp_path):
    """A limit of the file size simulates a full disk, because root can write everywhere."""
    out = tmp_path / name
    out.write_bytes(b"old")
    done = convert(GOLDEN / "medium.dna", out, script=FULL)
    assert (done.returncode, done.stdout) == (1, b"")
    assert words(done).count("\n") == 1
    assert name in words(done)
    assert out.read_bytes() == b"old"
    assert os.listdir(tmp_path) == [name]


def test_a_full_device_and_a_folder_that_is_not_there(tmp_path):
    source = GOLDEN / "core.dna"
    if os.path.exists("/dev/full"):
        for out in ("/dev/full", "-"):
            with open("/dev/full", "wb") as full:
                done = subprocess.run(
                    [sys.executable, "-m", "risorius", "convert", "--to", "json", source, out],
                    stdout=full if out == "-" else None,
                    stderr=subprocess.PIPE,
                    check=False,
                )
            assert (done.returncode, done.stderr.count(b"\n")) == (1, 1)
            assert b"No space left" in done.stderr
        assert not os.path.isfile("/dev/full")
    done = convert(GOLDEN / "core.dna", tmp_path / "no" / "face.dna")
    assert (done.returncode, words(done).count("\n")) == (1, 1)
    assert "face.dna" in words(done)
    (tmp_path / "folder.dna").mkdir()
    assert convert(GOLDEN / "core.dna", tmp_path / "folder.dna").returncode == 1
    assert sorted(os.listdir(tmp_path)) == ["folder.dna"]


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("bad.dna", b"PNG", ["bad.dna", "not a DNA file"]),
        ("bad.dna", b"", ["bad.dna", "empty"]),
        ("bad.json", b'{"version": \xff}', ["bad.json", "UTF-8", "byte 12"]),
        ("bad.json", b"DNA", ["bad.json", "not JSON", "byte 0"]),
        ("bad.json", b"[" * 99, ["bad.json", "nesting"]),
        ("bad.json", b"[]", ["bad.json", "object"]),
    ],
)
def test_bad_input_is_one_line_with_its_place(name, data, said, tmp_path):
    (tmp_path / name).write_bytes(data)
    done = convert(tmp_path / name, tmp_path / "out.dna")
    assert (done.returncode, done.stdout, words(done).count("\n")) == (1, b"", 1)
    for part in said:
        assert part in words(done)
    assert os.listdir(tmp_path) == [name]


def test_a_wrong_field_of_json_is_named(tmp_path):
    facts = json.loads(risorius.load(GOLDEN / "core.dna").to_json())
    facts["defn1.1"]["jointNames"][2] = 7
    (tmp_path / "bad.json").write_text(json.dumps(facts))
    done = convert(tmp_path / "bad.json", tmp_path / "out.dna")
    assert (done.returncode, words(done).count("\n")) == (1, 1)
    assert "bad.json" in words(done)
    assert "defn1.1.jointNames[2]" in words(done)


def test_a_missing_file_or_a_folder_is_one_line(tmp_path):
    for name in ("none.dna", "none.json", "folder.dna", "folder.json"):
        if name.startswith("folder"):
            (tmp_path / name).mkdir()
        done = convert(tmp_path / name, tmp_path / "out.dna")
        assert (done.returncode, words(done).count("\n")) == (1, 1)
        assert name in words(done)


@pytest.mark.parametrize(
    "options",
    [
        ["--version", "2.9"],
        ["--lods", "x"],
        ["--lods", "2-1"],
        ["--lods", "65536"],
        ["--lods", "4"],
        ["--lods", ""],
        ["--layers", "hair"],
        ["--axes", "right", "up"],
        ["--rotation-signs", "1", "2", "1"],
        ["--unknown-layers", "burn"],
    ],
)
def test_a_bad_command_line_is_exit_code_2(options, tmp_path):
    done = convert(GOLDEN / "medium.dna", tmp_path / "out.dna", *options)
    assert done.returncode == 2
    assert options[0] in words(done)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("signature_2", ["not a DNA file", "byte 0"]),
        ("count_descname_7fffffff", ["descriptor.name", "byte 187"]),
        ("psd_values_empty", ["behavior.psds", "byte 1295"]),
        ("am_in_ge", ["behavior.animated_maps.input_indices[0]", "7000"]),
        ("group_value_nan", None),
        ("trailing_garbage", None),
    ],
)
def test_malformed_golden_files(name, said, tmp_path):
    source, text = GOLDEN / "malformed" / f"{name}.dna", tmp_path / "face.json"
    done = convert(source, text)
    if said:
        assert (done.returncode, words(done).count("\n")) == (1, 1)
        assert all(part in words(done) for part in [source.name, *said])
        assert os.listdir(tmp_path) == []
        return
    assert (done.returncode, words(done)) == (0, "")
    assert convert(text, tmp_path / "again.dna").returncode == 0
    length = 4330  # bytes of core.dna's layers; bytes after them are not read
    assert (tmp_path / "again.dna").read_bytes() == source.read_bytes()[:length]


def test_extra_malformed_files_are_converted_or_refused(tmp_path, capsys):
    require_extra(MALFORMED / "manifest.json", "malformed golden files")
    refused = 0
    for path in sorted(MALFORMED.glob("*.dna")):
        out = tmp_path / "out.json"
        code = main(["convert", str(path), str(out)])
        said = capsys.readouterr().err.splitlines()
        if code == 0:
            np.testing.assert_equal(risorius.Dna.from_json(out.read_text()).generation, 2)
            out.unlink()
            continue
        assert code == 1
        assert path.name in said[-1]
        assert not out.exists()
        refused += 1
    assert refused >= 200
