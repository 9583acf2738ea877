# SPDX-License-Identifier: MIT
"""results.py counts every failure of a lane (group of stages), a test program or a report."""

import subprocess
import sys
from pathlib import Path

import pytest

PACKAGING = Path(__file__).resolve().parents[3] / "packaging"
sys.path.insert(0, str(PACKAGING / "check"))

import results  # noqa: E402

PASS = '<testcase classname="a.test_one" name="x"/>'
FAIL = '<testcase classname="a.test_one" name="y"><failure message="no"/></testcase>'
SKIP = '<testcase classname="a.test_two.TestX" name="z"><skipped message="no ship"/></testcase>'
XFAIL = (
    '<testcase classname="a.test_one" name="w"><skipped type="pytest.xfail" message="later"/>'
    "</testcase>"
)
GOOGLE_SKIP = (
    '<testcase name="Simd.X" classname="Simd.X" status="notrun">'
    '<skipped message="SKIP_REGULAR_EXPRESSION_MATCHED"/>'
    "<system-out>kernels_test.cpp:319: Skipped\nthis CPU has no SSE4\n\n</system-out></testcase>"
)


def _report(tmp_path, *cases):
    path = tmp_path / "report.xml"
    path.write_text(f"<testsuites><testsuite>{''.join(cases)}</testsuite></testsuites>")
    return path


@pytest.mark.parametrize(
    ("cases", "code", "row"),
    [
        ([PASS], 0, "1\t0\t0"),
        ([PASS, FAIL, FAIL], 1, "1\t2\t0"),
        ([PASS, SKIP, XFAIL], 0, "1\t0\t2"),
        ([PASS, GOOGLE_SKIP], 0, "1\t0\t1"),
        ([PASS], 139, "1\t1\t0"),  # the program crashed after its report
        ([SKIP], 0, "0\t1\t1"),  # no test was run
        ([], 0, "0\t1\t0"),
    ],
)
def test_a_row_counts_what_ran_and_what_did_not(tmp_path, cases, code, row):
    assert results.rows("n", _report(tmp_path, *cases), code)[0] == f"row\tn\t{row}"


@pytest.mark.parametrize("text", [None, "", "<testsuites><testcase"])
def test_no_report_is_a_failure(tmp_path, text):
    path = tmp_path / "report.xml"
    if text is not None:
        path.write_text(text)
    assert results.rows("n", path, 0) == ["row\tn\t0\t1\t0"]


def test_what_did_not_run_is_named_with_its_reason(tmp_path):
    lines = results.rows("n", _report(tmp_path, PASS, SKIP, SKIP, GOOGLE_SKIP), 0)
    assert lines[1:] == [
        "say\tNOT RUN, n: no ship (2 tests)",
        "say\tNOT RUN, n: this CPU has no SSE4",
    ]


def test_a_test_file_of_which_nothing_was_collected_is_a_failure(tmp_path):
    files = [Path("a/test_one.py"), Path("a/test_two.py"), Path("b/test_gone.py")]
    lines = results.rows("n", _report(tmp_path, PASS, SKIP), 0, files)
    assert lines[0] == "row\tn\t1\t1\t1"
    assert "say\tFAILED, n: no test of b/test_gone.py was run" in lines


def _lanes(tmp_path, **lanes):
    for name, text in lanes.items():
        (tmp_path / name).write_text(text)
    return results.table(tmp_path, [*lanes])


def test_the_table_adds_up_and_shows_the_seconds(tmp_path):
    lines, failed = _lanes(
        tmp_path,
        one="row\tA\t3\t0\t1\ntime\tbuilding\t12\t20\nend\n",
        two="row\tB\t4\t0\t0\nsay\tNOT RUN: C\nend\n",
    )
    assert failed == 0
    assert lines[-1] == "7 passed, 0 failed"
    assert "  NOT RUN: C" in lines
    assert [line.split() for line in lines if "building" in line] == [
        ["one:", "building", "12", "s", "20", "s", "of", "CPU"]
    ]


@pytest.mark.parametrize("second", ["", "row\tB\t4\t0\t0\n"])
def test_a_lane_without_its_end_is_a_failure(tmp_path, second):
    lines, failed = _lanes(tmp_path, one="row\tA\t3\t0\t1\nend\n", two=second)
    assert failed == 1
    assert "  FAILED: the lane two ended early" in lines


def test_a_lane_that_wrote_nothing_at_all_is_a_failure(tmp_path):
    assert results.table(tmp_path, ["gone"])[1] == 1


def _lane(tmp_path, commands):
    """Run commands as a lane, with the shell functions that test.sh uses, and print the results.

    Returns: the finished process; its exit code is the exit code of `results table`.
    """
    script = f"""
      set -uo pipefail; source {PACKAGING}/setup.sh; logs={tmp_path}; mkdir -p {tmp_path}/rows
      source {PACKAGING}/check/rows.sh
      lane_of_test() {{ {commands}
      }}
      run_lane one lane_of_test & wait
      results table {tmp_path}/rows one
    """
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=False)


def test_a_lane_runs_to_its_end(tmp_path):
    done = _lane(tmp_path, "step first; check tool true; say 'NOT RUN: that'")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "one: === first" in done.stdout
    assert "NOT RUN: that" in done.stdout


@pytest.mark.parametrize(
    "commands",
    [
        "check tool true; exit 0; check other true",
        "check tool true; kill -9 $BASHPID; check other true",
        "check tool true; check other false || return",
        "check tool true; note 'no test' 0 0",
        "check tool true; note_report tests gone.xml 0",
        "check tool true; note_report tests gone.xml 0 --no-such-option",
    ],
)
def test_a_lane_that_dies_midway_is_a_failure(tmp_path, commands):
    done = _lane(tmp_path, commands)
    assert done.returncode == 1, done.stdout + done.stderr


def test_an_exit_code_outlives_what_computes_the_name(tmp_path):
    report = _report(tmp_path, PASS)
    done = _lane(tmp_path, f'(exit 5); code=$?; note_report "a $(echo b)" {report} $code')
    assert done.returncode == 1
    assert "a b" in done.stdout


def test_a_word_that_is_none_of_its_options_is_refused():
    done = subprocess.run(
        ["bash", PACKAGING / "test.sh", "--fast"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "--quick" in done.stderr


def test_help_says_what_there_is():
    done = subprocess.run(
        ["bash", PACKAGING / "test.sh", "--help"], capture_output=True, text=True, check=True
    )
    assert "--quick" in done.stdout
    assert "set -uo" not in done.stdout
