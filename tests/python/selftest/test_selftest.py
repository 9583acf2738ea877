# SPDX-License-Identifier: MIT
"""Checks that the self-test of the wheel passes, and that it reports faults planted by a test."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import risorius
from risorius import selftest
from risorius.selftest import checks

PROJECT = Path(__file__).resolve().parents[3]


@pytest.fixture(autouse=True)
def hurry(monkeypatch):
    monkeypatch.setattr(checks, "TIMED", 0.01)


def failures(rows):
    return [row.name for row in selftest.failed(rows)]


def test_it_passes_here_with_every_instruction_set():
    rows = selftest.run()
    assert failures(rows) == []
    names = [row.name for row in rows]
    for simd in risorius.available_simd().split(", "):
        assert f"evaluate, {simd}" in names
    assert selftest.text(rows).endswith(f"all {len(rows)} checks passed")


def test_the_values_are_those_of_the_reference_at_every_lod():
    """The self-test's faces equal files of tests/data/golden, and it compares all their outputs."""
    golden = PROJECT / "tests" / "data" / "golden"
    for name, source in (("core", "core"), ("units", "units"), ("solvers", "tiny_v28")):
        assert checks.content(f"{name}.dna") == (golden / f"{source}.dna").read_bytes()
        cases = list(checks._cases(name))
        assert len(cases) >= 10
        lods = range(risorius.load(golden / f"{source}.dna").lod_count)
        assert {case.lod for case in cases} == set(lods)
        for part in ("joints", "shapes", "maps"):
            assert any(np.abs(getattr(case, part)).max() > 0.1 for case in cases)


def test_a_wrong_value_is_seen(monkeypatch):
    whole = checks.content

    def bent(name):
        data = bytearray(whole(name))
        if name == "units.f32":
            values = np.frombuffer(data, "<f4").copy()
            values[np.argmax(np.abs(values))] *= 1.01
            data = values.tobytes()
        return bytes(data)

    monkeypatch.setattr(checks, "content", bent)
    sets = risorius.available_simd().split(", ")
    assert failures(selftest.run()) == [f"evaluate, {simd}" for simd in sets]


def test_other_bits_damage_and_folders_are_seen(monkeypatch, tmp_path):
    monkeypatch.setattr(checks, "scalar_hash", lambda: "0" * 64)
    monkeypatch.setattr(checks, "DnaError", ZeroDivisionError)
    monkeypatch.setattr(checks.tempfile, "tempdir", str(tmp_path / "gone"))
    rows = selftest.run()
    assert failures(rows) == ["scalar bits", "damaged file", "write and read"]
    text = selftest.text(rows)
    assert text.endswith(f"3 of {len(rows)} checks failed")
    assert str(tmp_path) not in text


def test_the_script_prints_the_report_and_says_what_to_do_without_a_wheel():
    script = [sys.executable, PROJECT / "packaging" / "ship" / "selftest.py"]
    done = subprocess.run(script, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 0
    assert "checks passed" in done.stdout
    alone = [sys.executable, "-I", "-S", script[1]]  # without site-packages
    done = subprocess.run(alone, capture_output=True, text=True, encoding="utf-8", check=False)
    assert done.returncode == 1
    assert "Install the wheel made for this Python" in done.stdout
    assert done.stdout.count("\n") == 1
