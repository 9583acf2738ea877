# SPDX-License-Identifier: MIT
"""Tests that the wheel of sample people is separate.

The package finds this wheel, or asks for it in a sentence.
"""

import tomllib
from importlib import metadata
from pathlib import Path

import pytest
import risorius
import risorius_people
from risorius import people, sample
from risorius.cli import main

PYTHON = Path(__file__).resolve().parents[3] / "native" / "python"


def test_both_wheels_have_one_version():
    text = (PYTHON / "risorius_people" / "pyproject.toml").read_text(encoding="utf-8")
    project = tomllib.loads(text)["project"]
    assert project["version"] == risorius.__version__
    assert project["dependencies"] == [f"risorius=={risorius.__version__}"]


def test_the_package_is_found_under_its_old_name_as_well():
    assert people.people() is risorius_people
    assert sample.build_sample is risorius_people.build_sample
    with pytest.raises(AttributeError):
        _ = sample.nobody


def test_without_the_wheel_the_command_asks_for_it(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(metadata, "entry_points", lambda **_: ())
    face = tmp_path / "man.dna"
    assert main(["sample", "build", str(face), "--person", "woman"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("risorius: the wheel risorius-people is not installed")
    assert f"risorius-people {risorius.__version__}" in said
    assert not face.exists()
    # Other commands work without the wheel. `info` fails here only because its argument is a
    # folder.
    assert main(["info", str(tmp_path)]) == 1
    assert "people" not in capsys.readouterr().err


def test_a_wheel_of_another_version_is_refused(monkeypatch):
    class Older:
        class dist:  # noqa: N801
            version = "0.0.9"

    monkeypatch.setattr(metadata, "entry_points", lambda **_: (Older,))
    with pytest.raises(people.NoPeopleError, match=r"0\.0\.9"):
        people.people()
