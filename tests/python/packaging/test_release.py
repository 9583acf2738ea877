# SPDX-License-Identifier: MIT
"""Tests parts of release.sh: refusals, notes, zips of platforms, the repository, checksums."""

import hashlib
import importlib.util
import json
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

PROJECT = Path(__file__).resolve().parents[3]
PLATFORMS = {
    "manylinux_2_28_x86_64": "linux-x64",
    "win_amd64": "windows-x64",
    "macosx_11_0_arm64": "macos-arm64",
}


def _module(name):
    path = PROJECT / "packaging" / "ship" / "release" / f"{name}.py"
    described = importlib.util.spec_from_file_location(f"release_{name}", path)
    module = importlib.util.module_from_spec(described)
    sys.modules[described.name] = module
    described.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def make():
    return _module("make")


@pytest.fixture
def clone(tmp_path, make):
    """A small project in a git repository whose commit has a tag."""
    for name in make.VERSIONS:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        word = "__version__" if name.endswith(".py") else "version"
        (tmp_path / name).write_text(f'{word} = "1.2.3"\n', encoding="utf-8")
    (tmp_path / "CHANGELOG.md").write_text(
        "# Changelog\n\n## [Unreleased]\n\n## [1.2.3] - 2026-01-01\n\n### Added\n\n- A face.\n\n"
        "## [1.2.2] - 2025-01-01\n\n- Older.\n",
        encoding="utf-8",
    )
    _git(tmp_path, "init", "-q")
    _git(tmp_path, "add", ".")
    _git(tmp_path, "commit", "-q", "-m", "All")
    _git(tmp_path, "tag", "v1.2.3")
    return tmp_path


def _git(folder, *words):
    who = ["-c", "user.name=A", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
    subprocess.run(["git", "-C", folder, *who, *words], check=True, capture_output=True)


def test_a_clean_tree_at_its_tag_can_be_released(make, clone):
    assert make.troubles("1.2.3", clone) == []


def test_what_is_not_so_is_said(make, clone):
    assert make.troubles("1.2", clone)[0] == "1.2 is no version as 1.2.3."
    found = make.troubles("1.2.2", clone)
    assert [t.split(" has ")[0] for t in found[:3]] == list(make.VERSIONS)
    assert found[3:] == ["HEAD has no tag v1.2.2: git tag -a v1.2.2."]
    assert make.troubles("2.0.0", clone)[3] == "CHANGELOG.md has no section [2.0.0]."
    (clone / "more").write_text("", encoding="utf-8")
    assert make.troubles("1.2.3", clone) == [
        "Files differ from what is committed: commit or remove them."
    ]
    _git(clone, "add", ".")
    _git(clone, "commit", "-q", "-m", "More")
    assert make.troubles("1.2.3", clone) == ["HEAD has no tag v1.2.3: git tag -a v1.2.3."]


def test_the_notes_are_the_section_of_the_version(make, clone):
    assert make.section("1.2.3", clone) == "### Added\n\n- A face."
    assert make.section("Unreleased", clone) == ""
    assert make.section("1.2.2", clone) == "- Older."


def test_the_changelog_has_the_present_version(make):
    text = (PROJECT / "pyproject.toml").read_text(encoding="utf-8")
    version = tomllib.loads(text)["project"]["version"]
    assert make.section(version)
    assert not [t for t in make.troubles(version) if " has version " in t]


@pytest.fixture(scope="module")
def made(make, tmp_path_factory):
    """(folder, version, zips of fake wheels, the same zips made again).

    folder / "repository" is a repository of all zips except the first.
    """
    folder = tmp_path_factory.mktemp("release")
    version = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    wheels = [
        folder / f"risorius-{version}-{tag}-{tag}-{label}.whl"
        for label in PLATFORMS
        for tag in ("cp311", "cp313")
    ]
    for wheel in wheels:
        wheel.write_bytes(wheel.name.encode())
    (folder / f"risorius_people-{version}-py3-none-any.whl").write_bytes(b"people")
    face = folder / "face"
    face.mkdir()
    (face / "man.dna").write_bytes(b"a face")
    with pytest.MonkeyPatch.context() as patch:
        pure = folder / "python_osc-1.10.2-py3-none-any.whl"
        pure.write_bytes(b"osc")
        patch.setattr(make.build_extension, "fetch_pinned", lambda _: [pure])
        zips = make.make_zips(folder / "out", wheels, face, "https://a.example/docs")
        again = make.make_zips(folder / "again", wheels, face, "https://a.example/docs")
    make.make_repository(folder / "repository", zips[1:])
    return folder, version, zips, again


def test_each_platform_has_its_wheels_and_the_face(made):
    _, version, zips, again = made
    names = [z.name for z in zips]
    platforms = sorted(PLATFORMS.values())
    assert names == [f"risorius-{version}.zip", *(f"risorius-{version}-{p}.zip" for p in platforms)]
    for path, other in zip(zips, again, strict=True):
        assert path.read_bytes() == other.read_bytes()
    for path, platform in zip(zips[1:], platforms, strict=True):
        with zipfile.ZipFile(path) as package:
            inside = package.namelist()
            manifest = tomllib.loads(package.read("blender_manifest.toml").decode())
        wheels = sorted(Path(n).name for n in inside if n.endswith(".whl"))
        label = next(tag for tag, its in PLATFORMS.items() if its == platform)
        assert len(wheels) == 4
        assert f"risorius_people-{version}-py3-none-any.whl" in wheels
        assert [label in name for name in wheels].count(True) == 2
        assert "sample/man.dna" in inside
        assert "sample/LICENSE.txt" in inside
        assert manifest["website"] == "https://a.example/docs"
        assert manifest["build"]["generated"]["platforms"] == [platform]


def test_the_repository_lists_them_and_its_page_links_them(made):
    folder, version, zips, _ = made
    listed = json.loads((folder / "repository" / "index.json").read_text(encoding="utf-8"))
    assert [row["archive_url"] for row in listed["data"]] == [f"./{z.name}" for z in zips[1:]]
    for row, path in zip(listed["data"], zips[1:], strict=True):
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        assert row["archive_hash"] == f"sha256:{digest}"
        assert row["version"] == version
        assert len(row["platforms"]) == 1
    page = (folder / "repository" / "index.html").read_text(encoding="utf-8")
    assert all(f"{z.name}?repository=" in page for z in zips[1:])
    assert "${" not in page


def test_the_sums_are_those_of_sha256sum(make, made):
    folder, *_ = made
    make.make_sums(folder / "out")
    command = ["sha256sum", "-c", "--strict", "SHA256SUMS"]
    done = subprocess.run(command, cwd=folder / "out", capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.count(": OK") == 4


def test_the_sbom_reads_versions_where_they_are_pinned():
    # The text is read, because a library that the script imports is not installed for tests.
    text = (PROJECT / "packaging" / "ship" / "release" / "sbom.py").read_text(encoding="utf-8")
    named = re.findall(r'pinned\("([\w-]+)", "([\w./]+)"\)', text)
    assert len(named) == 3
    for name, file in named:
        lines = (PROJECT / "packaging" / file).read_text(encoding="utf-8").splitlines()
        assert any(line.startswith(f"{name}==") for line in lines)


def test_release_refuses_a_tree_that_it_cannot_be_made_of():
    script = PROJECT / "packaging" / "release.sh"
    for arguments in ([], ["1.0.0", "--other"]):
        done = subprocess.run(
            ["bash", script, *arguments], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert done.stderr == "release.sh: release.sh VERSION [--trial]\n"


def test_the_release_before_differs_in_its_version_alone(tmp_path):
    older = _module("older")
    info, name = "risorius-1.2.3.dist-info", "risorius-1.2.3-cp311-cp311-linux_x86_64.whl"
    inside = {
        "risorius/base/version.py": b'__version__ = "1.2.3"\n',
        "risorius/_native.so": b"1.2.3",
        f"{info}/METADATA": b"Name: risorius\nVersion: 1.2.3\nRequires: numpy\n",
        f"{info}/RECORD": b"old",
    }
    with zipfile.ZipFile(tmp_path / name, "w") as wheel:
        for path, data in inside.items():
            wheel.writestr(path, data)
    manifest = f'version = "1.2.3"\nwheels = ["./wheels/{name}"]\n'
    with zipfile.ZipFile(tmp_path / "risorius-1.2.3.zip", "w") as package:
        package.writestr("blender_manifest.toml", manifest)
        package.write(tmp_path / name, f"wheels/{name}")
    out = tmp_path / "out"
    out.mkdir()
    made = older.extension_as(tmp_path / "risorius-1.2.3.zip", "1.0.0", out)
    assert made.name == "risorius-1.0.0.zip"
    with zipfile.ZipFile(made) as package:
        assert package.read("blender_manifest.toml").decode() == manifest.replace("1.2.3", "1.0.0")
        package.extract(f"wheels/{name.replace('1.2.3', '1.0.0')}", tmp_path)
    with zipfile.ZipFile(tmp_path / "wheels" / name.replace("1.2.3", "1.0.0")) as wheel:
        assert wheel.read("risorius/base/version.py") == b'__version__ = "1.0.0"\n'
        assert wheel.read("risorius/_native.so") == b"1.2.3"
        info = info.replace("1.2.3", "1.0.0")
        assert b"\nVersion: 1.0.0\n" in wheel.read(f"{info}/METADATA")
        rows = wheel.read(f"{info}/RECORD").decode().splitlines()
    assert [row.split(",")[0] for row in rows] == [n.replace("1.2.3", "1.0.0") for n in inside]


def test_a_trial_that_found_nothing_has_passed_nothing():
    results = _module("trial_results")
    judged = list(results.checks({}, {}, "1.0.0", "1.2.3", "a file"))
    assert len(judged) == len({name for name, _ in judged}) > 14
    assert not [name for name, good in judged if good]
