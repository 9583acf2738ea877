# SPDX-License-Identifier: MIT
"""Tests scripts of packaging/.

Examples: names of wheels in the zip, the table of versions, and lines on the progress of films.
"""

import importlib.util
import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

PACKAGING = Path(__file__).resolve().parents[3] / "packaging"


def _script(name):
    described = importlib.util.spec_from_file_location(name, PACKAGING / f"{name}.py")
    module = importlib.util.module_from_spec(described)
    sys.modules[name] = module
    described.loader.exec_module(module)
    return module


def _report(path, *cases):
    text = "".join(
        f'<testcase classname="{group}" name="{name}">{inside}</testcase>'
        for group, name, inside in cases
    )
    path.write_text(f"<testsuites><testsuite>{text}</testsuite></testsuites>", encoding="utf-8")
    return path


def test_the_wheel_for_3_11_has_the_name_that_sorts_last(tmp_path):
    # Blender 4.2.0 extracts all wheels of its platform and uses the one whose name sorts last.
    build = _script("ship/build_extension")
    version = build.manifest_version(
        (build.ADDON / "blender_manifest.toml").read_text(encoding="utf-8")
    )
    wheels = [
        tmp_path / f"risorius-{version}-{tag}-{tag}-linux_x86_64.whl"
        for tag in ("cp311", "cp313", "cp314")
    ]
    for wheel in wheels:
        wheel.write_bytes(b"")
    with zipfile.ZipFile(build.build(wheels, tmp_path / "out")) as package:
        inside = sorted(n for n in package.namelist() if n.endswith(".whl"))
        manifest = package.read("blender_manifest.toml").decode()
    assert len(inside) == 3
    assert "-cp311-" in inside[-1]
    assert all(f'"./{name}"' in manifest for name in inside)


def test_pure_wheels_are_carried_as_they_are_and_pinned_by_hash(tmp_path):
    build = _script("ship/build_extension")
    version = build.manifest_version(
        (build.ADDON / "blender_manifest.toml").read_text(encoding="utf-8")
    )
    ours = tmp_path / f"risorius-{version}-cp313-cp313-linux_x86_64.whl"
    pure = tmp_path / "python_osc-1.10.2-py3-none-any.whl"
    for wheel in (ours, pure):
        wheel.write_bytes(wheel.name.encode())
    with zipfile.ZipFile(build.build([ours], tmp_path / "out", [pure])) as package:
        assert package.read(f"wheels/{pure.name}") == pure.read_bytes()
        manifest = tomllib.loads(package.read("blender_manifest.toml").decode())
    assert f"./wheels/{pure.name}" in manifest["wheels"]
    assert all(len(words) <= 64 for words in manifest["permissions"].values())  # Blender's limit
    pinned = build.PINNED.read_text(encoding="utf-8")
    required = tomllib.loads((PACKAGING.parent / "pyproject.toml").read_text(encoding="utf-8"))
    (osc,) = required["project"]["optional-dependencies"]["live"]
    assert f"\n{osc} --hash=sha256:" in pinned


def test_equal_files_make_an_equal_zip_with_the_face_its_licence_and_its_origin(tmp_path):
    build = _script("ship/build_extension")
    version = build.manifest_version(
        (build.ADDON / "blender_manifest.toml").read_text(encoding="utf-8")
    )
    wheel = tmp_path / f"risorius-{version}-cp311-cp311-manylinux_2_28_x86_64.whl"
    face = tmp_path / "face"
    face.mkdir()
    made = []
    for seconds in (1_000_000_000, 1_500_000_000):
        for path in (wheel, face / "man.dna", face / ".stamp"):
            path.write_bytes(b"bytes")
            os.utime(path, (seconds, seconds))
        made.append(build.build([wheel], tmp_path / str(seconds), [], face).read_bytes())
    assert made[0] == made[1]
    with zipfile.ZipFile(tmp_path / "1000000000" / f"risorius-{version}.zip") as package:
        inside = {n for n in package.namelist() if n.startswith("sample/")}
        licence = package.read("sample/LICENSE.txt").decode()
        origin = package.read("sample/README.txt").decode()
    assert inside == {"sample/man.dna", "sample/LICENSE.txt", "sample/README.txt"}
    assert "CC0 1.0 Universal" in licence
    assert "MakeHuman" in origin


@pytest.mark.parametrize(
    ("tag", "platform"),
    [
        ("linux_x86_64", "linux-x64"),
        ("manylinux_2_27_x86_64.manylinux_2_28_x86_64", "linux-x64"),
        ("win_amd64", "windows-x64"),
        ("win_arm64", "windows-arm64"),
        ("macosx_11_0_arm64", "macos-arm64"),
        ("macosx_12_3_arm64", "macos-arm64"),
        ("macosx_11_0_x86_64", "macos-x64"),
        ("linux_aarch64", ""),
        ("musllinux_1_2_x86_64", ""),
    ],
)
def test_tags_of_wheels_lead_to_blenders_platforms(tag, platform):
    build = _script("ship/build_extension")
    wheel = Path(f"risorius-1.0.0-cp311-cp311-{tag}.whl")
    if platform:
        assert build.platform_of(wheel) == platform
    else:
        with pytest.raises(SystemExit, match="no Blender platform"):
            build.platform_of(wheel)


def test_the_table_counts_by_version_and_file(tmp_path):
    matrix = _script("check/blender/matrix_table")
    one = _report(
        tmp_path / "one.xml",
        ("test_a", "x", ""),
        ("test_a", "y", "<failure/>"),
        ("test_b", "x", '<skipped message="why"/>'),
    )
    two = _report(tmp_path / "two.xml", ("test_a", "x", ""), ("test_a", "y", ""))
    text = matrix.table({"1.0": matrix.read(one), "2.0": matrix.read(two)})
    assert text.splitlines() == [
        "| tests | 1.0 | 2.0 |",
        "|---|---|---|",
        "| a | 1, 1 failed | 2 |",
        "| b | 0, 1 not run | - |",
        "| **all** | **1, 1 failed, 1 not run** | **2** |",
    ]


@pytest.mark.parametrize(("inside", "code"), [("", 0), ("<failure/>", 1), ("<error/>", 1)])
def test_the_exit_code_tells_of_failures(tmp_path, inside, code):
    report = _report(tmp_path / "one.xml", ("test_a", "x", inside))
    assert _script("check/blender/matrix_table").main([f"1.0={report}"]) == code


def test_a_blender_that_died_without_a_report_is_a_failure(tmp_path, capsys):
    report = _report(tmp_path / "one.xml", ("test_a", "x", ""))
    arguments = [f"1.0={report}", f"2.0={tmp_path / 'gone.xml'}"]
    assert _script("check/blender/matrix_table").main(arguments) == 1
    assert "Failed: 2.0" in capsys.readouterr().out


def test_a_rendering_says_how_far_it_is_and_what_is_left():
    module = _script("films/progress")
    now, said = [100.0], []
    progress = module.Progress(240, "frame", clock=lambda: now[0], say=said.append)
    for _ in range(240):
        now[0] += 2.0
        progress.step()
    assert said[0] == "frame 1 of 240, about 7 min 58 s left"
    assert said[1] == "frame 4 of 240, about 7 min 52 s left"  # at least 5 s later
    assert said[-1] == "frame 240 of 240"
    assert len(said) == 1 + 79 + 1
    assert [module.duration(s) for s in (59.4, 80, 3900)] == ["59 s", "1 min 20 s", "1 h 05 min"]


def _shown(tmp_path, command):
    script = f"set -euo pipefail; source {PACKAGING}/setup.sh; shown {tmp_path}/log {command}"
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)


def test_progress_is_seen_and_the_rest_is_in_the_log(tmp_path):
    done = _shown(tmp_path, "printf '    frame 1 of 2\\nnoise\\n    frame 2 of 2\\n'")
    assert (done.returncode, done.stdout) == (0, "    frame 1 of 2\n    frame 2 of 2\n")
    assert "noise" in (tmp_path / "log").read_text()
    failed = _shown(tmp_path, "bash -c 'echo why; exit 3'")
    assert (failed.returncode, failed.stdout) == (1, "why\n")
    assert _shown(tmp_path, "true").returncode == 0


def test_blenders_says_what_it_needs(tmp_path):
    tools = tmp_path / "bin"
    tools.mkdir()
    for name in ("bash", "dirname"):
        (tools / name).symlink_to(shutil.which(name))
    done = subprocess.run(
        ["bash", PACKAGING / "check" / "blender" / "blenders.sh"],
        env={"PATH": str(tools)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "apt-get install debootstrap" in done.stderr
    assert done.stderr.count("\n") == 1


def test_lines_that_never_ran_are_listed_by_function(tmp_path):
    never = _script("check/never_run")
    unnamed = "risorius::dna::(anonymous namespace)::f(int)"
    method = "void risorius::core::List<A<B> >::g(int)"
    never.PROJECT = tmp_path
    (tmp_path / "native/core").mkdir(parents=True)
    code = ["if (a) {", "}", "", "b();  // c", "return out;", "", "", "", "return 1;", "}"]
    (tmp_path / "native/core/a.h").write_text("\n".join(code), encoding="utf-8")
    report = {
        "files": [
            {
                "file": "native/core/a.h",
                "lines": [
                    {"line_number": 1, "count": 0, "function_name": unnamed},
                    {"line_number": 2, "count": 0, "function_name": unnamed},
                    {"line_number": 4, "count": 0, "function_name": method},
                    {"line_number": 4, "count": 1, "function_name": method},  # another type
                    {"line_number": 5, "count": 0, "function_name": method},  # clean-up only
                    {"line_number": 9, "count": 0, "function_name": method},
                ],
            }
        ]
    }
    package = {
        "files": {
            "native/python/risorius/b.py": {
                "summary": {"num_statements": 7},
                "functions": {"": {"missing_lines": []}, "C.h": {"missing_lines": [3, 5, 6]}},
            }
        }
    }
    assert never.told(never.native_files(report) + never.python_files(package)).splitlines() == [
        "native/core/a.h: 3 of 5",
        "    f: 1-2",
        "    List::g: 9",
        "native/python/risorius/b.py: 3 of 7",
        "    C.h: 3, 5-6",
        "native: no test runs 3 of 5 lines",
        "package: no test runs 3 of 7 lines",
        "add-on: no test runs 0 of 0 lines",
    ]


def test_what_nobody_tried_has_a_row_of_the_table():
    facts = runpy.run_path(str(PACKAGING / "ship" / "cross" / "facts.py"))
    text = (PACKAGING / "ship" / "wheels.sh").read_text(encoding="utf-8")
    found = re.search(r"declare -A versions=\((.*?)\)\n", text, re.DOTALL)
    rows = re.findall(r'\[([\w-]+)\]="([^"]+)"', found.group(1))
    assert facts["PLANNED"] == {name: tuple(all_of.split()) for name, all_of in rows}
    known = facts["read"](["linux-x64\t3.11\tbuilt\tx.whl, sha256 0123\n"])
    table = facts["table"](known)
    assert table.count("\n") == 1 + sum(len(all_of.split()) for _, all_of in rows)
    assert "| linux-x64 | 3.11 | x.whl, sha256 0123 | NOT DONE |" in table
    assert "| macos-x64 | 3.11 | NOT DONE | NOT DONE | NOT DONE | NOT RUN: no macOS here |" in table
