# SPDX-License-Identifier: MIT
"""Tests `risorius check`: all errors and warnings with their places, and the exit code."""

import json
import os
import struct
import subprocess
import sys

import command_line
import pytest
import risorius
from conftest import GOLDEN, SHARED, require_extra
from risorius.cli import main

FILES = sorted(GOLDEN.glob("*.dna"))
MALFORMED = SHARED / "data" / "golden" / "malformed"


def check(*arguments):
    return command_line.run("check", *arguments, text=True)


@pytest.fixture
def two_errors(tmp_path):
    """(DNA file, byte offset of its wrong name length, offset of its wrong GUI input count)."""
    data = bytearray((GOLDEN / "tiny_v22.dna").read_bytes())
    entries = struct.unpack_from(">16I", data, 11)
    descriptor, behavior = entries[2], entries[10]
    data[descriptor : descriptor + 4] = b"\x7f\xff\xff\xff"
    struct.pack_into(">I", data, behavior + 2, 0x7FFFFFFF)  # after psd_count
    path = tmp_path / "two.dna"
    path.write_bytes(data)
    return path, descriptor, behavior + 2


def test_good_files_are_ok_with_what_they_hold():
    done = check(*FILES)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert f"ok: {GOLDEN / 'medium.dna'} (2.8, 4 LODs, 122 joints)" in lines
    assert f"ok: {GOLDEN / 'tiny_v24.dna'} (2.4, 2 LODs, 14 joints" in done.stdout
    assert lines[-1] == f"{len(FILES)} files: {len(FILES)} ok, 0 bad"
    # Additional lines say that solvers of synthetic files read rotations of joints which these
    # files do not have.
    odd = [line for line in lines if "and no joint has that name" in line]
    assert len(lines) - len(odd) == len(FILES) + 1


def test_every_error_has_its_file_byte_and_field(two_errors):
    path, first, second = two_errors
    done = check(path)
    lines = done.stdout.splitlines()
    assert (done.returncode, done.stderr) == (1, "")
    errors = [line for line in lines if ": error: " in line]
    assert len(errors) == 2
    assert errors[0].startswith(f"{path}: byte {first}: descriptor.name: error: ")
    assert errors[1].startswith(
        f"{path}: byte {second}: behavior.gui_to_raw.input_indices: error: "
    )
    assert lines[-1].startswith(f"bad: {path} (2 errors")


def test_warnings_pass_unless_strict(tmp_path):
    data = (GOLDEN / "tiny_v21.dna").read_bytes()
    assert data.endswith(b"AND")
    path = tmp_path / "cut.dna"
    path.write_bytes(data[:-3])
    done = check(path)
    lines = done.stdout.splitlines()
    assert done.returncode == 0
    assert lines[0].startswith(f"{path}: byte {len(data) - 3}: geometry: warning: ")
    assert lines[1:] == [f"ok: {path} (2.1, 2 LODs, 14 joints, 1 warning)"]
    strict = check("--strict", path)
    assert strict.returncode == 1
    assert strict.stdout.splitlines()[-1].startswith(f"bad: {path} ")


def test_options_may_stand_between_files(two_errors):
    path = two_errors[0]
    done = check(GOLDEN / "core.dna", "--strict", path)
    assert done.returncode == 1
    assert done.stdout.splitlines()[-1] == "2 files: 1 ok, 1 bad"


def test_programs_get_the_same(two_errors):
    path, first, _ = two_errors
    done = check("--json", path, GOLDEN / "core.dna")
    facts = json.loads(done.stdout)
    assert (done.returncode, facts["ok"]) == (1, False)
    bad, good = facts["files"]
    assert (bad["ok"], bad["errors"], good["ok"], good["findings"]) == (False, 2, True, [])
    found = bad["findings"][0]
    assert (found["where"], found["offset"], found["code"]) == (
        "descriptor.name", first, "invalid_count",
    )  # fmt: skip


def test_json_files_are_checked_too(tmp_path):
    dna = risorius.load(GOLDEN / "core.dna")
    good, odd, bad = (tmp_path / f"{name}.JSON" for name in ("good", "odd", "bad"))
    good.write_text(dna.to_json())
    facts = json.loads(dna.to_json())
    facts["desc1.1"]["gender"] = 9
    odd.write_text(json.dumps(facts))
    facts["defn1.1"]["jointNames"][2] = 7
    bad.write_text(json.dumps(facts))
    done = check(good, odd, bad)
    lines = done.stdout.splitlines()
    assert done.returncode == 1
    assert lines[0] == f"ok: {good} (2.8, 2 LODs, 5 joints)"
    assert lines[1].startswith(f"{odd}: descriptor.gender: warning: ")
    assert lines[3].startswith(f"{bad}: defn1.1.jointNames[2]: error: ")
    assert lines[-1] == "3 files: 2 ok, 1 bad"


@pytest.mark.parametrize(
    ("data", "place"), [(b'{"a": \xff}', "byte 6: "), (b"{", "byte 1: "), (b"[]", "byte 0: ")]
)
def test_what_is_not_json_is_an_error_with_its_byte(data, place, tmp_path):
    path = tmp_path / "bad.json"
    path.write_bytes(data)
    first, last = check(path).stdout.splitlines()
    assert first.startswith(f"{path}: {place}error: ")
    assert last == f"bad: {path} (1 error)"


def test_what_cannot_be_read_does_not_hide_the_next_file(tmp_path):
    missing, folder = tmp_path / "none.dna", tmp_path / "folder.json"
    folder.mkdir()
    done = check(missing, folder, GOLDEN / "core.dna")
    lines = done.stdout.splitlines()
    assert (done.returncode, done.stderr) == (1, "")
    assert lines[0].startswith(f"{missing}: error: ")
    assert lines[2].startswith(f"{folder}: error: ")
    assert lines[4].startswith("ok: ")
    assert lines[5] == "3 files: 1 ok, 2 bad"
    assert check().returncode == 2
    assert check("--what", folder).returncode == 2


def test_a_name_that_is_not_utf8_is_printed(tmp_path):
    name = os.fsdecode(bytes(tmp_path) + b"/\xff.dna")
    with open(name, "wb") as file:
        file.write(b"PNG")
    done = subprocess.run(
        [sys.executable, "-m", "risorius", "check", name],
        capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": "utf-8", "LC_ALL": "C.UTF-8"},
        check=False,
    )
    assert (done.returncode, done.stderr) == (1, b"")
    assert b"\\udcff.dna: signature: error: not a DNA file" in done.stdout.replace(b"byte 0: ", b"")


WRONG = {  # file: expected place and kind of the finding
    "signature_2": "byte 0: signature: error",
    "version_3_8": "byte 3: version: error",
    "count_descname_7fffffff": "byte 187: descriptor.name: error",
    "index_bhvr_offset_past_eof": "byte 4330: behavior: error: the file ends",
    "psd_values_empty": "behavior.psds: error",
    "am_in_ge": "behavior.animated_maps.input_indices[0]: error: index 7000",
    "desc_archetype_99": "byte 195: descriptor.archetype: warning",
    "group_value_nan": "behavior.joint_groups[0].values[1]: warning",
    "group_in_dup": None,
    "trailing_garbage": None,
}


@pytest.mark.parametrize("name", WRONG)
def test_malformed_golden_files(name, capsys):
    path = GOLDEN / "malformed" / f"{name}.dna"
    said = WRONG[name]
    code = main(["check", str(path)])
    lines = capsys.readouterr().out.splitlines()
    assert code == (1 if said and ": error" in said else 0)
    assert lines[-1].startswith("bad: " if code else "ok: ")
    if said is None:
        assert len(lines) == 1
    else:
        assert lines[0].startswith(f"{path}: ")
        assert any(said in line for line in lines[:-1])


def test_extra_malformed_files_have_places(capsys):
    manifest = require_extra(MALFORMED / "manifest.json", "malformed golden files")
    bad = 0
    for entry in json.loads(manifest.read_text())["files"]:
        code = main(["check", "--json", str(MALFORMED / entry["file"])])
        facts = json.loads(capsys.readouterr().out)["files"][0]
        assert code == (0 if facts["ok"] else 1)
        try:
            risorius.load(MALFORMED / entry["file"])
        except risorius.DnaError as error:
            bad += 1
            assert code == 1
            assert error.code in {f["code"] for f in facts["findings"] if f["is_error"]}
        else:
            assert code == 0
    assert bad >= 200
