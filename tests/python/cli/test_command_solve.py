# SPDX-License-Identifier: MIT
"""Tests the command `risorius solve`, and the files that it reads."""

import json
import re

import numpy as np
import pytest
import risorius
from command_line import run
from conftest import GOLDEN
from risorius.cli import main
from risorius.solving.performance import PerformanceError, fitted, read_performance
from skin_oracle import skinned, small_face


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """A face's DNA file, its control curves, and its vertices in each frame."""
    dna = small_face()
    path = tmp_path_factory.mktemp("solve") / "face.dna"
    dna.save(path)
    rig = risorius.Rig(dna)
    curves = np.zeros((12, 7), np.float32)
    curves[:, 1] = np.linspace(0, 0.9, 12)
    curves[:, 3] = np.linspace(0.5, 0, 12)
    frames = np.array([skinned(dna, rig.evaluate(row)) for row in curves], np.float32)
    return path, curves, frames


def test_a_performance_becomes_a_clip(take, tmp_path):
    path, curves, frames = take
    np.savez(tmp_path / "take.npz", vertices=frames, rate=24.0)
    out = tmp_path / "take.rzc"
    done = run("solve", path, tmp_path / "take.npz", "-o", out, "--json", "--report", text=True)
    assert (done.returncode, done.stderr) == (0, "")
    facts = json.loads(done.stdout)
    assert (facts["frames"], facts["rate"], facts["placed"]) == (12, 24.0, "")
    assert facts["largest_mm"] < 0.1
    assert len(facts["frame_residual_mm"]) == 12
    clip = risorius.Clip.load(out)
    np.testing.assert_allclose(clip.curve("CTRL_expressions.smileLeft"), curves[:, 1], atol=0.02)
    np.testing.assert_allclose(clip.curve("CTRL_expressions.puff"), curves[:, 3], atol=0.02)
    page = run("solve", path, tmp_path / "take.npz", "-o", out, "--report", text=True).stdout
    assert "12 frames at 24 fps" in page
    assert "the frames with most left over:" in page


def test_other_units_and_axes_are_known_by_the_mesh(take, tmp_path):
    path, curves, frames = take
    blender = np.stack([frames[..., 0], -frames[..., 2], frames[..., 1]], axis=-1) / 100
    np.savez(tmp_path / "take.npz", vertices=blender, neutral=blender[0])
    out = tmp_path / "take.rzc"
    done = run("solve", path, tmp_path / "take.npz", "-o", out, text=True)
    assert "placed: 100 times as large, axes turned" in done.stdout
    clip = risorius.Clip.load(out)
    np.testing.assert_allclose(clip.curve("CTRL_expressions.smileLeft"), curves[:, 1], atol=0.02)


def test_relative_takes_the_movement(take, tmp_path):
    path, curves, frames = take
    rest = risorius.load(path).meshes[0].positions
    larger = frames - rest + rest * [1.05, 1.0, 1.0]
    np.savez(tmp_path / "take.npz", vertices=larger, neutral=rest * [1.05, 1.0, 1.0])
    out = tmp_path / "take.rzc"
    run("solve", path, tmp_path / "take.npz", "-o", out, "--relative", text=True)
    clip = risorius.Clip.load(out)
    np.testing.assert_allclose(clip.curve("CTRL_expressions.smileLeft"), curves[:, 1], atol=0.02)


def test_a_turned_mesh_is_brought_back():
    rest = np.asarray(small_face().meshes[0].positions, np.float64)
    c, s = np.cos(0.3), np.sin(0.3)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    take = read_like((0.37 * rest @ turn.T + [3, -2, 1])[None])
    brought = fitted(take, rest)
    np.testing.assert_allclose(brought.frames[0], rest, atol=1e-4)
    assert "where it fits best" in brought.note


def read_like(frames):
    from risorius.solving.performance import Performance

    return Performance(np.asarray(frames, np.float32), 30.0, 0.0, None)


def test_alembic_needs_its_package_or_is_read(take, tmp_path):
    archive = tmp_path / "take.abc"
    archive.write_bytes(b"no archive")
    done = run("solve", take[0], archive, "-o", tmp_path / "take.rzc", text=True)
    assert done.returncode == 1
    assert "risorius[alembic]" in done.stderr or "an Alembic file was expected" in done.stderr


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"points": np.zeros((2, 196, 3))}, r"vertices of shape \[F, V, 3\]"),
        ({"vertices": np.zeros((2, 3))}, r"vertices of shape \[F, V, 3\]"),
        ({"vertices": np.full((2, 196, 3), np.inf)}, "finite vertices"),
        ({"vertices": np.full((2, 196, 3), 1e38)}, "vertices up to 1e.09"),
        ({"vertices": np.full((2, 196, 3), 1e300)}, "finite vertices"),
        ({"vertices": np.zeros((2, 196, 3)), "neutral": np.zeros((4, 3))}, "neutral of shape"),
        ({"vertices": np.zeros((2, 196, 3)), "rate": 0.0}, "a rate above 0"),
        ({"vertices": np.zeros((2, 196, 3)), "rate": [24.0, 25.0]}, "a rate above 0"),
        ({"vertices": np.full((2, 196, 3), "far")}, "vertices of numbers"),
    ],
)
def test_a_file_that_makes_no_sense_is_one_sentence(tmp_path, content, said):
    np.savez(tmp_path / "take.npz", **content)
    with pytest.raises(PerformanceError, match=said):
        read_performance(tmp_path / "take.npz")


def test_a_damaged_file_is_one_sentence_or_read(tmp_path):
    """NumPy raises various exceptions for flipped bits and cut files; each becomes one sentence."""
    path = tmp_path / "take.npz"
    np.savez(path, vertices=np.zeros((2, 4, 3)), rate=24.0)
    plain = path.read_bytes()
    np.savez_compressed(path, vertices=np.zeros((2, 4, 3)), rate=24.0)
    random, refused = np.random.default_rng(5), 0
    for data in (plain, path.read_bytes()):
        for _ in range(200):
            broken = bytearray(
                data[: random.integers(len(data))] if random.random() < 0.2 else data
            )
            for at in random.integers(max(len(broken), 1), size=3 * bool(broken)):
                broken[at] ^= 1 << random.integers(8)
            path.write_bytes(broken)
            try:
                read_performance(path)
            except PerformanceError as error:
                refused += 1
                assert str(error).startswith(f"{path}: ")
    assert refused > 200


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["take.npz", "-o", "out.csv"], 2, "-o: a name ending in .rzc was expected"),
        (["take.npz", "-o", "out.rzc", "--lod", "3"], 2, "--lod: 0 to 0 was expected, found 3"),
        (["take.npz", "-o", "out.rzc", "--mesh", "ear"], 2, "--mesh: one of head was expected"),
        (["take.npz", "-o", "out.rzc"], 1, "vertices of head 196 were expected, found 5"),
        (["take.obj", "-o", "out.rzc"], 1, "a name ending in .abc or .npz was expected"),
        (["gone.npz", "-o", "out.rzc"], 1, "gone.npz"),
    ],
)
def test_errors_are_one_sentence(take, tmp_path, monkeypatch, arguments, code, said):
    monkeypatch.chdir(tmp_path)
    np.savez("take.npz", vertices=np.zeros((2, 5, 3)))
    done = run("solve", take[0], *arguments, text=True)
    assert done.returncode == code
    assert said in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out.rzc").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda mesh: np.full_like(mesh.positions, np.nan),
            "coordinates up to 1e.09 were expected",
        ),
        (lambda mesh: 1e30 * np.asarray(mesh.positions), "coordinates up to 1e.09 were expected"),
        (None, "a face with meshes was expected"),
    ],
)
def test_a_face_that_cannot_be_computed_with_is_one_sentence(tmp_path, change, said):
    dna = small_face()
    if change is None:
        dna = risorius.load(dna.to_bytes(), layers="behavior")
    else:
        mesh = dna.meshes[0]
        mesh.positions = change(mesh)
        dna.meshes = [mesh]
    dna.save(tmp_path / "face.dna")
    np.savez(tmp_path / "take.npz", vertices=np.zeros((2, 196, 3)))
    words = ("solve", tmp_path / "face.dna", tmp_path / "take.npz", "-o", tmp_path / "out.rzc")
    done = run(*words, text=True)
    assert done.returncode == 1
    assert re.search(f"face.dna: .*{said}", done.stderr)


@pytest.mark.parametrize("layers", ["descriptor", "definition", "behavior"])
def test_a_face_without_meshes_is_one_sentence(tmp_path, capsys, layers):
    face = tmp_path / "face.dna"
    risorius.load(GOLDEN / "core.dna", layers=layers).save(face)
    np.savez(tmp_path / "take.npz", vertices=np.zeros((2, 5, 3)))
    command = ["solve", str(face), str(tmp_path / "take.npz"), "-o", str(tmp_path / "out.rzc")]
    for more in ([], ["--mesh", "head_lod0_mesh"]):
        assert main([*command, *more]) == 1
        expected = f"risorius: {face}: a face with meshes was expected\n"
        assert capsys.readouterr().err == expected
