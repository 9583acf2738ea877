# SPDX-License-Identifier: MIT
"""Checks that git hooks, CI workflows and tests run the same checks, and that scripts exist."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[3]
WORKFLOWS = sorted((PROJECT / ".github" / "workflows").glob("*.yml"))
STYLE = "packaging/check/style.sh"


def _script(name):
    path = PROJECT / "packaging" / "check" / f"{name}.py"
    described = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(described)
    sys.modules[name] = module
    described.loader.exec_module(module)
    return module


def _checks():
    command = ["bash", PROJECT / STYLE, "--list"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()


def test_the_hooks_are_the_checks_of_the_style_script():
    hooks = (PROJECT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
    assert re.findall(rf"entry: {STYLE} (.*)", hooks) == _checks()
    assert re.findall(r"- id: (.*)", hooks) == _checks()
    (least,) = re.findall(r'minimum_pre_commit_version: "(.*)"', hooks)
    wanted = PROJECT / "packaging" / "check" / "hooks_requirements.txt"
    assert f"pre_commit=={least}\n" in wanted.read_text(encoding="utf-8")


def test_the_whole_test_command_runs_each_check():
    text = (PROJECT / "packaging" / "test.sh").read_text(encoding="utf-8")
    named = " ".join(re.findall(r"for name in ([\w -]+); do\n +check \"\$name\" .*style", text))
    # The check of layers is missing in this loop, because it consists of Python tests.
    assert [*named.split(), "layers"] == _checks()


def test_an_unknown_check_is_refused():
    command = ["bash", PROJECT / STYLE, "spelling"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("style.sh: spelling is none of ruff-check ")


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_a_workflow_calls_scripts_that_are_there_and_actions_by_commit(path):
    text = path.read_text(encoding="utf-8")
    runs = re.findall(r"^ +run: (?:python )?([\w./]+)", text, re.MULTILINE)
    for script in runs:
        assert script.startswith("packaging/")
        assert os.access(PROJECT / script, os.X_OK if script.endswith(".sh") else os.R_OK)
    for action in re.findall(r"uses: ([^.\s]\S*)", text):
        assert re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40}", action)
    for called in re.findall(r"uses: \./(\S+)", text):
        assert (PROJECT / called).is_file()
    assert runs
    assert "permissions:\n  contents: read\n" in text


def test_there_are_workflows():
    assert [path.stem for path in WORKFLOWS] == ["release", "site", "test", "wheels"]


def test_an_archive_of_blender_is_looked_for_where_blender_org_has_it():
    official = _script("blender/official_blender")
    url, sums = official.address("4.5.15", "linux-x64", ".tar.xz")
    assert url.endswith("/release/Blender4.5/blender-4.5.15-linux-x64.tar.xz")
    assert sums.endswith("/release/Blender4.5/blender-4.5.15.sha256")
    assert official.expected_sum("aa  one.zip\nbb  two.zip\n", "two.zip") == "bb"
    with pytest.raises(SystemExit, match=r"do not name three\.zip"):
        official.expected_sum("aa  one.zip\n", "three.zip")


def test_the_zip_of_this_platform_is_taken_and_not_the_one_of_the_repository(tmp_path):
    official = _script("blender/official_blender")
    name = f"risorius-1.2.3-{official.this_platform()[0]}.zip"
    for folder in (tmp_path / "1.2.3", tmp_path / "1.2.3" / "repository"):
        folder.mkdir()
        (folder / name).touch()
    assert official.extension(tmp_path) == tmp_path / "1.2.3" / name
    with pytest.raises(SystemExit, match="has 0 files"):
        official.extension(tmp_path / "1.2.3" / "repository")


@pytest.mark.parametrize("arguments", [[], ["1.2.3"], ["v1.2.3", "--now"]])
def test_publishing_takes_a_tag(arguments):
    script = PROJECT / "packaging" / "ship" / "publish.sh"
    done = subprocess.run(["bash", script, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "publish.sh: publish.sh vVERSION [--dry-run]\n"


def test_the_guide_names_files_that_are_there():
    text = (PROJECT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"packaging/[\w/]+\.(?:sh|py)", text)
    assert len(named) > 8
    assert [name for name in named if not (PROJECT / name).is_file()] == []
