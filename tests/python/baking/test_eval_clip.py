# SPDX-License-Identifier: MIT
"""Tests `risorius eval CLIP DNA -o OUT`: every frame equals Rig.evaluate of its controls."""

import csv
import json
import os
import subprocess
import sys
import zipfile

import numpy as np
import pytest
import risorius
from conftest import GOLDEN
from risorius.baking import face as faces
from risorius.cli import main

FIELDS = {
    "joints": "joints",
    "shapes": "blend_shapes",
    "maps": "animated_maps",
    "controls": "controls",
}


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def write_clip(path, names, curves, rate=30.0, start=0.0):
    """Write curves[names, frames] as CSV, with enough digits to restore every float32."""
    curves = np.asarray(curves, float)
    times = start + np.arange(curves.shape[1]) / rate
    table, digits = np.column_stack([times, curves.T]), ["%.17g", *["%.9g"] * len(names)]
    header = ",".join(["time", *names])
    np.savetxt(path, table, digits, ",", newline="\r\n", header=header, comments="")
    return path


def random_clip(path, name="medium", frames=50, seed=1):
    """Write a clip with random values of about half the controls of a golden face.

    Returns the DNA file, the rig, and the raw controls of each frame, float32[frames, R].
    """
    dna = risorius.load(GOLDEN / f"{name}.dna")
    rig = risorius.Rig(dna)
    rng = np.random.default_rng(seed)
    raw = np.tile(rig.initial_raw_controls, (frames, 1))
    some = rng.permutation(np.flatnonzero(rng.random(raw.shape[1]) < 0.5))
    raw[:, some] = rng.random((frames, len(some))).astype(np.float32)
    write_clip(path, [rig.raw_control_names[i] for i in some], raw[:, some].T)
    return GOLDEN / f"{name}.dna", rig, raw


def expected(rig, raw, lod):
    poses = [rig.evaluate(row, lod=lod) for row in raw]
    return {f: np.stack([getattr(p, f) for p in poses]) for f in FIELDS.values()}


@pytest.mark.parametrize("extra", [[], ["--compress"]])
@pytest.mark.parametrize(("name", "lod"), [("medium", 0), ("medium", 2), ("rbf", 1), ("ml", 0)])
def test_npz_is_every_frame(tmp_path, name, lod, extra, monkeypatch):
    monkeypatch.setattr(faces, "_CHUNK_BYTES", 1)  # 16 frames per chunk, several chunks
    dna, rig, raw = random_clip(tmp_path / "clip.csv", name)
    out = tmp_path / "new" / "out.npz"
    arguments = ["eval", tmp_path / "clip.csv", dna, "-o", out, "--lod", lod, *extra]
    assert main([*map(str, arguments), "--what", "controls,joints,maps,shapes"]) == 0
    with np.load(out) as arrays:
        for field, values in expected(rig, raw, lod).items():
            np.testing.assert_array_equal(arrays[field], values, field)
        np.testing.assert_allclose(arrays["times"], np.arange(50) / 30, atol=1e-12)
        assert arrays["lod"] == lod
        assert arrays["translation_unit"] == risorius.load(dna).translation_unit
        assert len(arrays["control_names"]) == rig.control_count
        names = arrays["control_names"][: len(rig.raw_control_names)]
        assert names.tolist() == rig.raw_control_names
        assert len(set(arrays["joint_names"])) == rig.joint_count
        np.testing.assert_array_equal(arrays["neutral_joints"], rig.neutral_joints)
    assert [p.name for p in out.parent.iterdir()] == ["out.npz"]


def test_the_same_clip_gives_the_same_bytes(tmp_path):
    dna, _, _ = random_clip(tmp_path / "clip.csv")
    for name in ("a.npz", "b.npz"):
        assert main(["eval", str(tmp_path / "clip.csv"), str(dna), "-o", str(tmp_path / name)]) == 0
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        assert archive.testzip() is None
        assert "controls.npy" not in archive.namelist()


def test_large_arrays_wait_in_a_file(tmp_path, monkeypatch):
    from risorius.baking import writing

    monkeypatch.setattr(writing, "_SPOOL_BYTES", 1000)
    dna, rig, raw = random_clip(tmp_path / "clip.csv")
    assert main(["eval", str(tmp_path / "clip.csv"), str(dna), "-o", str(tmp_path / "a.npz")]) == 0
    with np.load(tmp_path / "a.npz") as arrays:
        np.testing.assert_array_equal(arrays["blend_shapes"], expected(rig, raw, 0)["blend_shapes"])


def test_quaternions(tmp_path):
    dna, _, raw = random_clip(tmp_path / "clip.csv", "quatjoints")
    rig = risorius.Rig(risorius.load(dna), rotation="quaternion")
    out = tmp_path / "out.npz"
    assert (
        main(["eval", str(tmp_path / "clip.csv"), str(dna), "-o", str(out), "--quaternions"]) == 0
    )
    with np.load(out) as arrays:
        np.testing.assert_array_equal(arrays["joints"], expected(rig, raw, 0)["joints"])
        assert arrays["joint_columns"].tolist() == "tx ty tz qx qy qz qw sx sy sz".split()


@pytest.mark.parametrize("quaternions", [[], ["--quaternions"]])
def test_csv_is_what_is_not_at_rest(tmp_path, quaternions):
    dna, rig, raw = random_clip(tmp_path / "clip.csv")
    rotation = "quaternion" if quaternions else "euler"
    rig = risorius.Rig(risorius.load(dna), rotation=rotation)
    out = tmp_path / "out.csv"
    arguments = ["eval", str(tmp_path / "clip.csv"), str(dna), "-o", str(out), "--lod", "1"]
    assert main([*arguments, "--what", "joints,shapes,maps,controls", *quaternions]) == 0
    header, *rows = csv.reader(out.read_text().splitlines())
    columns = ["tx", "ty", "tz", "rx", "ry", "rz", "sx", "sy", "sz"]
    if quaternions:
        columns[3:6] = ["qx", "qy", "qz", "qw"]
    poses, rest = expected(rig, raw, 1), rig.evaluate(rig.initial_raw_controls, lod=1)
    wanted, numbers = ["time"], []
    names = [n for n in rig.raw_control_names]
    names += [None] * (rig.control_count - len(names))
    definition = risorius.load(dna, layers="definition")
    kinds = {"shape": definition.blend_shape_channel_names, "map": definition.animated_map_names}
    identity = [c == "qw" for c in columns]
    for (j, c), _ in np.ndenumerate(rest.joints):
        values = poses["joints"][:, j, c]
        if (values != identity[c]).any():
            wanted.append(f"joint:{definition.joint_names[j]}.{columns[c]}")
            numbers.append(values)
    for kind, field in (("shape", "blend_shapes"), ("map", "animated_maps")):
        for i, values in enumerate(poses[field].T):
            if values.any():
                wanted.append(f"{kind}:{kinds[kind][i]}")
                numbers.append(values)
    assert header[: len(wanted)] == wanted
    assert len(header) > len(wanted)
    assert all(name.startswith("control:") for name in header[len(wanted) :])
    table = np.array(rows, np.float64)
    np.testing.assert_array_equal(table[:, 1 : len(wanted)].astype(np.float32).T, numbers)
    at = {f"control:{name}": i for i, name in enumerate(names) if name}
    for column, name in enumerate(header):
        if name in at:
            np.testing.assert_array_equal(
                table[:, column].astype(np.float32), poses["controls"][:, at[name]]
            )


def test_frames_and_rate(tmp_path):
    ramp = write_clip(tmp_path / "ramp.csv", ["CTRL_expressions.jawOpen"], [[0, 0.25, 0.5, 1]], 10)
    core = str(GOLDEN / "core.dna")
    out = tmp_path / "out.npz"
    jaw = risorius.load(core).raw_control_names.index("CTRL_expressions.jawOpen")
    arguments = ["eval", str(ramp), core, "-o", str(out), "--what", "controls"]
    # After resampling from 10 to 20 frames per second, every second frame is the mean of two
    # frames.
    assert main([*arguments, "--rate", "20", "--frames", "1:6"]) == 0
    with np.load(out) as arrays:
        np.testing.assert_array_equal(
            arrays["controls"][:, jaw], np.float32([0.125, 0.25, 0.375, 0.5, 0.75])
        )
        np.testing.assert_allclose(arrays["times"], [0.05, 0.1, 0.15, 0.2, 0.25], atol=1e-12)
        assert arrays["rate"] == 20
    assert main([*arguments, "--frames", "2:"]) == 0
    with np.load(out) as arrays:
        np.testing.assert_array_equal(arrays["controls"][:, jaw], [0.5, 1])
        np.testing.assert_allclose(arrays["times"], [0.2, 0.3], atol=1e-12)


def test_a_clip_of_our_own_is_taken_as_it_is(tmp_path, capsys):
    dna = GOLDEN / "core.dna"
    rig = risorius.Rig(risorius.load(dna))
    names = rig.raw_control_names
    curves = np.float32([[0.1, np.nan, 0.3], [0, -0.0, 1e-40], [np.inf, 1, -2], [0, 0, 0]])
    curves = curves[: len(names)]
    clip = risorius.Clip(
        [*names, "head.yaw"], [*curves, [1, 2, 3]], times=[0, 0.5, 3],
        events=[risorius.Event(0.5, "word", 0.25, "yes")], metadata={"take": "7"},
    )  # fmt: skip
    clip.save(tmp_path / "clip.rzc")
    out = tmp_path / "out.npz"
    arguments = ["eval", str(tmp_path / "clip.rzc"), str(dna), "-o", str(out), "--json"]
    assert main([*arguments, "--what", "joints,shapes,maps,controls"]) == 0
    facts = json.loads(capsys.readouterr().out)
    with np.load(out) as arrays:
        for field, values in expected(rig, curves.T, 0).items():
            np.testing.assert_array_equal(arrays[field], values, field)
        assert arrays["times"].tolist() == [0, 0.5, 3]
        assert arrays["event_times"].tolist() == [0.5]
        assert arrays["event_durations"].tolist() == [0.25]
        assert arrays["event_names"].tolist() == ["word"]
        assert arrays["event_values"].tolist() == ["yes"]
        assert json.loads(str(arrays["metadata"])) == {"take": "7"}
    assert facts["not_finite"] == 2
    moves = np.stack([rig.evaluate(row).joints[:, :3].astype(float) for row in curves.T])
    moves = np.linalg.norm(moves, axis=2)
    finite = moves[np.isfinite(moves)]
    assert len(finite) < moves.size
    assert facts["largest_move"] == pytest.approx(finite.max(), rel=1e-6)
    assert facts["control_ranges"][names[0]] == [np.float32(0.1), np.float32(0.3)]
    assert facts["control_ranges"][names[2]] == [-2, 1]
    assert facts["out_of_range"] == [names[2]]
    assert facts["missing_controls"] == ["head.yaw"]
    assert facts["mapping"] == ""


def test_a_capture_is_mapped(tmp_path, capsys):
    """Curves named as in Live Link Face are mapped to controls.

    Without --mapping a built-in mapping is found; a mapping of the user replaces it.
    """
    dna = GOLDEN / "core.dna"
    rig = risorius.Rig(risorius.load(dna))
    jaw = rig.raw_control_names.index("CTRL_expressions.jawOpen")
    write_clip(tmp_path / "c.csv", ["JawOpen", "Strange"], [[0, 0.5, 1], [1, 1, 1]])
    (tmp_path / "own.toml").write_text(
        'name = "own"\n[rows]\nJawOpen = { "CTRL_expressions.jawOpen" = 0.25 }\n'
    )
    out = tmp_path / "out.npz"
    arguments = ["eval", str(tmp_path / "c.csv"), str(dna), "-o", str(out), "--what", "controls"]
    for options, gain in (([], 1), (["--mapping", str(tmp_path / "own.toml")], 0.25)):
        assert main([*arguments, *options]) == 0
        assert "Strange" in capsys.readouterr().err
        with np.load(out) as arrays:
            np.testing.assert_allclose(arrays["controls"][:, jaw], np.float32([0, 0.5, 1]) * gain)
    assert main([*arguments, "--mapping", "none"]) == 2
    assert "--mapping: none: " in capsys.readouterr().err


def test_facts(tmp_path, capsys):
    core = GOLDEN / "core.dna"
    rig = risorius.Rig(risorius.load(core))
    jaw = "CTRL_expressions.jawOpen"
    nobody = "CTRL_expressions.nobody"
    names = [jaw, nobody, "strange"]
    clip = write_clip(tmp_path / "c.csv", names, [[0, 1.5, -0.25], [0, 1, 0], [1, 1, 1]])
    out = str(tmp_path / "out.npz")
    assert main(["eval", str(clip), str(core), "-o", out, "--json"]) == 0
    output = capsys.readouterr()
    facts = json.loads(output.out)
    assert facts["frames"] == 3
    assert facts["control_ranges"] == {jaw: [-0.25, 1.5]}
    assert facts["out_of_range"] == [jaw]
    assert facts["missing_controls"] == [nobody]
    assert facts["unmapped_curves"] == ["strange"]
    assert facts["mapping"] == "controls"
    assert f"1 control of the clip that the character does not have: {nobody}" in output.err
    assert "1 curve of the clip that is no control and not mapped: strange" in output.err
    raw = np.zeros(4, np.float32)
    raw[rig.raw_control_names.index(jaw)] = 1.5
    moves = np.linalg.norm(rig.evaluate(raw).joints[:, :3].astype(float), axis=1)
    assert facts["largest_move"] == pytest.approx(moves.max(), rel=1e-6)
    assert facts["largest_move_joint"] == risorius.load(core).joint_names[int(moves.argmax())]
    assert facts["largest_move_frame"] == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "out.txt"], ".npz or .csv"),
        (["-o", "out.csv", "--compress"], "--compress"),
        (["-o", "out.npz", "--lod", "2"], "0 to 1"),
        (["-o", "out.npz", "--lod", "-1"], "--lod: 0 to"),
        (["-o", "out.npz", "--rate", "0"], "'0'"),
        (["-o", "out.npz", "--rate", "nan"], "'nan'"),
        (["-o", "out.npz", "--frames", "3"], "A:B"),
        (["-o", "out.npz", "--frames", "3:3"], "A below B"),
        (["-o", "out.npz", "--frames", "-3:3"], None),
        (["-o", "out.npz", "--what", "bones"], "'bones'"),
        (["-o", "out.npz", "--what", "maps,maps"], "each once"),
        (["-o", "out.npz", "--gui"], "--gui"),
        (["-o", "out.npz", "--explain"], "--explain"),
        (["-o", "out.npz", "more.dna"], "CLIP DNA"),
        (["--rate", "30"], "-o is missing"),
        ([], "-o OUT.npz"),
        (["-o", "clip.csv"], "the input itself"),
    ],
)
def test_bad_command_line_is_exit_code_2(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    write_clip("clip.csv", ["CTRL_expressions.jawOpen"], [[0, 1, 0.5, 0]])
    before = set(tmp_path.iterdir())
    try:
        code = main(["eval", "clip.csv", str(GOLDEN / "core.dna"), *arguments])
    except SystemExit as error:  # raised by argparse
        code = error.code
    assert code == 2
    assert message is None or message in capsys.readouterr().err
    assert set(tmp_path.iterdir()) - before <= {tmp_path / "cache"}


def test_a_folder_that_cannot_be_is_said_before_the_inputs_are_read(tmp_path, capsys):
    (tmp_path / "file").touch()
    out = tmp_path / "file" / "out.npz"
    assert main(["eval", str(tmp_path / "no.csv"), str(tmp_path / "no.dna"), "-o", str(out)]) == 1
    error = capsys.readouterr().err
    assert error == f"risorius: {out}: cannot write it: a file stands where its folder should be\n"


@pytest.mark.skipif(os.name == "nt", reason="limits are those of POSIX")
@pytest.mark.parametrize("kind", ["npz", "csv"])
def test_without_room_the_target_is_named_and_the_old_file_stays(kind, tmp_path):
    write_clip(tmp_path / "clip.csv", ["CTRL_expressions.jawOpen"], [[0, 1]])
    path = tmp_path / f"out.{kind}"
    path.write_text("old")
    script = (
        "import resource, sys; from risorius.cli import main\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)); sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, "eval", str(tmp_path / "clip.csv"),
         str(GOLDEN / "core.dna"), "-o", str(path)], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stderr == f"risorius: {path}: File too large\n"
    assert done.returncode == 1
    assert path.read_text() == "old"
    assert {p.name for p in tmp_path.iterdir()} <= {"clip.csv", path.name, "cache"}


@pytest.mark.parametrize(
    ("clip", "dna", "message"),
    [
        ("absent.csv", "core.dna", "absent.csv: cannot read it"),
        ("clip.csv", "absent.dna", "absent.dna"),
        ("bad.csv", "core.dna", "bad.csv"),
        ("clip.csv", "bad.csv", "bad.csv"),
        ("empty.csv", "core.dna", "empty.csv: rows"),
        ("none.rzc", "core.dna", "none.rzc"),
        ("bad.rzc", "core.dna", "bad.rzc"),
    ],
)
def test_bad_input_is_exit_code_1_and_no_file(tmp_path, capsys, clip, dna, message):
    write_clip(tmp_path / "clip.csv", ["CTRL_expressions.jawOpen"], [[0, 1]])
    (tmp_path / "bad.csv").write_text("time,a\n0,x\n")
    (tmp_path / "empty.csv").write_text("time,a\n")
    (tmp_path / "bad.rzc").write_bytes(b"no clip")
    dna = GOLDEN / dna if dna == "core.dna" else tmp_path / dna
    out = tmp_path / "out" / "out.npz"
    assert main(["eval", str(tmp_path / clip), str(dna), "-o", str(out)]) == 1
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not out.parent.exists()
