# SPDX-License-Identifier: MIT
"""Numbers of any size and kind, and files without an end, are used or refused in one sentence."""

import os
import threading

import command_line
import face_shapes
import numpy as np
import pytest
from conftest import GOLDEN
from risorius.author.input import spec
from risorius.base import given
from risorius.base.budget import Budget, BudgetError

CORE = GOLDEN / "core.dna"
HUGE = 10**400
needs_pipes = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names")


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (HUGE, "0 to 9 was expected, found a number of 401 digits"),
        (-1, "0 to 9 was expected, found -1"),
        (10, "0 to 9"),
        (1.0, "a whole number was expected, found 1.0"),
        (True, "a whole number was expected, found True"),
        ("3", "a whole number was expected, found '3'"),
        ([1], "found a list"),
        ({}, "found a table"),
        (None, "found None"),
    ],
)
def test_a_whole_number_is_one_of_its_range(value, words):
    with pytest.raises(given.GivenError, match=words):
        given.whole(value, 0, 9)
    assert [given.whole(n, 0, 9) for n in (0, 9)] == [0, 9]


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (HUGE, "at most 3.40282e.38 was expected, found a number of 401 digits"),
        (float("nan"), "a finite number was expected, found nan"),
        (float("inf"), "a finite number"),
        (1e39, "at most"),
        (False, "a number was expected, found False"),
        ("1", "a number was expected, found '1'"),
    ],
)
def test_a_number_is_one_that_a_file_holds(value, words):
    with pytest.raises(given.GivenError, match=words):
        given.finite(value)
    assert given.finite(3) == 3.0
    with pytest.raises(given.GivenError, match="more than 0 was expected, found 0"):
        given.finite(0, 0.0, above=True)


@pytest.mark.parametrize("typed", ["\u00b2", "\u0663", "1_0", " 1", "", "0x1", "9" * 5000, "1e3"])
def test_whole_numbers_are_typed_in_plain_digits(typed):
    with pytest.raises(given.GivenError, match="a whole number was expected, found '"):
        given.whole_text(typed, 0)
    assert given.whole_text("-12", -20) == -12
    with pytest.raises(given.GivenError):
        given.finite_text("\u0663" + typed[:9])


def test_a_budget_says_what_no_float_holds():
    with pytest.raises(BudgetError, match="place: 1,208,925,819,614,629,174,706,176 bytes"):
        Budget.of(1).hold(HUGE, "place")


# ---- places where numbers enter


def refused(code, *arguments):
    done = command_line.run(*arguments, text=True)
    assert done.returncode == code, done.stderr
    assert done.stderr.startswith("risorius: ")
    assert len(done.stderr.splitlines()) == 1, done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def egg(tmp_path_factory):
    return face_shapes.write_all(tmp_path_factory.mktemp("given"))


SPECS = [
    ("joints", "count", "-5", "0 to 4096 was expected, found -5"),
    ("joints", "count", f"0x{'f' * 5000}", "found a number of 6,021 digits"),
    ("joints", "influences", "-1", "1 to 16 was"),
    ("joints", "rounds", "-1", "0 to 10000 was"),
    ("joints", "rounds", "1" * 30, "0 to 10000 was"),
    ("joints", "smoothness", "nan", "0 to 1e+06 was"),
    ("joints", "emphasis", str(HUGE), "0 to 100 was"),
    ("joints", "least_effect_mm", "-inf", "0 to 1e+06 was"),
    ("joints", "symmetric", "1", "true or false was"),
    ("shapes", "tolerance_mm", "nan", "0 to 1e+06 was expected, found nan"),
    ("shapes", "tolerance_mm", str(HUGE), "0 to 1e+06 was"),
    ("correctives", "most", str(HUGE), "0 to 65535 was"),
    ("correctives", "together", "[1]", "a list was expected, found 1"),
    ("lods", "vertices", f"[{HUGE}]", "found a number of 401 digits"),
    ("controls", "jawOpen", "3", "text was expected, found 3"),
    ("controls", "jawOpen", "[[]]", "text was expected, found a list"),
    ("source", "mesh", '""', "text was expected, found ''"),
    ("source", "mesh", '"\\u0000"', "text was expected"),
]


@pytest.mark.parametrize(("table", "key", "value", "words"), SPECS)
def test_values_of_a_spec_are_of_their_range(table, key, value, words, egg, tmp_path):
    path = tmp_path / "spec.toml"
    neutral = f'[source]\nneutral = "{egg.parent}/neutral.obj"\nexpressions = "shapes"\n'
    if table != "source":
        neutral += f"[{table}]\n"
    path.write_text(f"{neutral}{key} = {value}\n", encoding="utf-8")
    said = refused(1, "author", path, "-o", tmp_path / "out.dna")
    assert f"spec.toml: {table}.{key}: " in said
    assert words in said


@pytest.mark.parametrize(
    ("top", "words"),
    [
        ("controls = 1", "controls: a table [controls] was expected, found 1"),
        ("name = 3", "name: text was expected, found 3"),
        ("joints = []", "joints: a table [joints] was expected, found a list"),
    ],
)
def test_tables_of_a_spec_are_tables(top, words, tmp_path):
    path = tmp_path / "spec.toml"
    path.write_text(f'{top}\n[source]\ndna = "x.dna"\n', encoding="utf-8")
    assert words in refused(1, "author", path, "-o", tmp_path / "out.dna")


def _moved(positions, faces, folder, deltas):
    """Write the OBJ files of the test head with other positions.

    Args:
        positions: float[V, 3] at rest.
        faces: polygons.
        folder: folder of the files.
        deltas: name of an expression -> float[V, 3], its displacements.
    """
    face_shapes.write_obj(folder / "neutral.obj", positions, faces)
    for name, delta in deltas.items():
        face_shapes.write_obj(folder / "shapes" / f"{name}.obj", positions + delta, faces)


def test_heads_of_no_size_or_of_any(tmp_path):
    path = face_shapes.write_all(tmp_path / "egg", joints=4, more="rounds = 0\n")
    out = tmp_path / "out.dna"
    positions, faces = face_shapes.head()
    deltas = face_shapes.expressions(positions)
    _moved(0 * positions + 1, faces, path.parent, deltas)
    assert "some size was expected" in refused(1, "author", path, "-o", out)
    _moved(1e30 * positions, faces, path.parent, {k: 1e30 * d for k, d in deltas.items()})
    assert "coordinates up to 1e+09 were expected" in refused(1, "author", path, "-o", out)
    assert not out.exists()
    _moved([1, 0, 1] * positions, faces, path.parent, deltas)  # without height: still a face
    done = command_line.run("author", path, "-o", out, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    for file in (path.parent / "shapes").iterdir():
        file.write_text("v 0 1 0\n")
    (path.parent / "neutral.obj").write_text("v 0 0 0\nf 1 1 1\n")
    assert "some size was expected" in refused(1, "author", path, "-o", out)


def test_a_vertex_without_weights_goes_with_the_root(egg, tmp_path):
    dna = spec.read_face(spec.read_spec(egg)).dna
    mesh = dna.meshes[0]
    weights = np.array(mesh.skin_weights)
    weights[19] = 0
    mesh.skin_weights = weights
    dna.meshes = [mesh]
    dna.save(tmp_path / "face.dna")
    path = tmp_path / "spec.toml"
    path.write_text('[source]\ndna = "face.dna"\n[joints]\ncount = 3\nrounds = 0\n')
    done = command_line.run("author", path, "-o", tmp_path / "out.dna", text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("weight", [str(HUGE), f"0x{'f' * 5000}", "nan", "1e39", "[]", "true"])
def test_weights_of_a_mapping(weight, tmp_path):
    path = tmp_path / "m.toml"
    for text in (f"[rows]\na = {{ b = {weight} }}", f"[controls]\na = {{ gain = {weight} }}"):
        path.write_text(text)
        assert "m.toml: " in refused(1, "clip", "check", path, "--rig", CORE)


def test_numbers_of_jobs_and_people(tmp_path):
    path = tmp_path / "x.toml"
    for rate in (HUGE, "nan", f"0x{'f' * 5000}"):
        path.write_text(
            f'output = "o"\n[[jobs]]\nclips = "x.toml"\ncharacters = "x.toml"\nrate = {rate}\n'
        )
        assert "jobs[0].rate: " in refused(1, "batch", path)
    out = tmp_path / "p.dna"
    for like, found in (("[]", "a list"), ("{}", "a table"), (HUGE, "a number of 401")):
        path.write_text(f"like = {like}")
        said = refused(1, "sample", "build", out, "--person", path, "--offline")
        assert "like: one of man, " in said
        assert f"found {found}" in said
    path.write_text(f'like = "man"\nmuscle = {HUGE}')
    assert "muscle: a number from 0 to 1" in refused(1, "sample", "build", out, "--person", path)


@pytest.mark.parametrize(
    "words",
    [
        "web {core} -o x.html --lods \u00b2",
        "sample build x.dna --joints -5",
        "sample build x.dna --joints 99999",
        "author spec.toml -o x.dna --threads -1",
        "author spec.toml -o x.dna --correctives 99999999999999999999",
        "eval {core} jawOpen=\u0661",
        "eval {core} --lod 1e3",
        "eval x.csv {core} -o x.npz --frames \u00b2:",
        "clip convert x.csv -o y.csv --neutral \u0663",
        "clip convert x.csv -o y.csv --input-rate nan",
        "clip convert x.csv -o y.csv --shift 1e400",
        "clip convert x.csv -o y.csv --gain a=nan",
        "live --seconds inf",
        "live --gain nan",
        "solve {core} x.npz -o x.rzc --smooth -1",
        "solve {core} x.npz -o x.rzc --rate -1",
        "edit regroup {core} x.dna --foreign-share nan",
        "batch jobs.toml --workers 1e9",
        "plot {core} -o x.png --dpi 1_0",
        "mix {core}=1 -o x.dna --nose {core}=inf",
    ],
)
def test_options_are_numbers_of_their_range(words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(2, *words.format(core=CORE).split(" "))
    assert list(tmp_path.iterdir()) == []


# ---- files without an end


LARGE = [
    ("spec.toml", ["author", "{}", "-o", "out.dna"]),
    ("jobs.toml", ["batch", "{}"]),
    ("map.toml", ["clip", "check", "{}", "--rig", str(CORE)]),
    ("person.toml", ["sample", "build", "out.dna", "--person", "{}"]),
    ("rig.toml", ["sample", "build", "out.dna", "--spec", "{}"]),
    ("regions.json", ["edit", "regroup", str(CORE), "out.dna", "--regions", "{}"]),
    ("take.csv", ["clip", "info", "{}"]),
    ("face.json", ["convert", "{}", "out.dna"]),
    ("face.dna", ["plot", "{}", "-o", "out.png"]),
    ("voice.wav", ["speech", "{}", "-o", "out.rzc", "--text", "a"]),
    ("said.txt", ["speech", "voice.wav", "-o", "out.rzc", "--transcript", "{}"]),
    ("data.whl", ["sample", "build", "out.dna", "--data", "{}"]),
]


@pytest.mark.parametrize(("name", "words"), LARGE)
def test_a_file_that_is_too_large_or_has_no_end_is_not_read(name, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if name != "data.whl":  # the hash in its name identifies it
        with open(name, "wb") as file:
            file.truncate(5 << 30)  # a sparse file, which takes no disk space
        said = refused(1, *[word.format(name) for word in words])
        assert "were expected, found 5,368,709,120" in said
        os.unlink(name)
    if os.path.exists("/dev/zero"):
        os.symlink("/dev/zero", name)
        said = refused(1, *[word.format(name) for word in words])
        assert f"{name}: a file was expected, found a device" in said


@needs_pipes
def test_what_is_found_in_a_folder_is_a_file(tmp_path):
    path = face_shapes.write_all(tmp_path / "egg")
    odd = path.parent / "shapes" / "odd.obj"
    makers = (os.mkfifo, os.mkdir, lambda p: p.symlink_to(p), lambda p: p.symlink_to("/dev/zero"))
    for make in makers:
        make(odd)
        assert str(odd) in refused(1, "author", path, "-o", tmp_path / "out.dna")
        odd.rmdir() if odd.is_dir() else odd.unlink()
    for key in ("dna", "neutral"):
        os.mkfifo(odd)
        path.write_text(f'[source]\n{key} = "shapes/odd.obj"\nexpressions = "shapes"\n')
        assert f"{odd}: a file was expected, found a pipe" in refused(
            1, "author", path, "-o", tmp_path / "out.dna"
        )
        odd.unlink()


@needs_pipes
def test_a_pipe_that_was_typed_is_read_once(tmp_path):
    take = tmp_path / "take.csv"
    take.write_text("time,jawOpen\n0,0\n1,1\n")
    pipe = tmp_path / "face.dna"
    os.mkfifo(pipe)
    writer = threading.Thread(target=lambda: pipe.open("wb").close())
    writer.start()
    said = refused(1, "eval", take, pipe, "-o", tmp_path / "out.npz")
    writer.join()
    assert f"{pipe}: the file is empty" in said
