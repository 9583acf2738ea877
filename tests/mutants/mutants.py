# SPDX-License-Identifier: MIT
"""Mutation tests: draws mutants by a seed, and tests each in a copy of the project.

    check/mutants.sh native|package|scene [--under PATH...] [--count N] [--seed N] [--list]
                         [--programs] [--survivors]

A mutant is killed by the first test that fails or takes much longer than without the mutant.
tests.toml lists the tests of each file, the fastest first. A mutant that does not build is replaced
by another one. Results are stored in build/mutants, so that an interrupted run continues.
--survivors tests the surviving mutants again with the present tests. --programs runs only the
GoogleTest programs.
"""

from __future__ import annotations

import argparse
import contextlib
import fnmatch
import importlib.util
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from draw import Mutant, drawn

HERE = Path(__file__).resolve().parent
PROJECT = HERE.parents[1]
SEED = 15
COUNTS = {"native": 80, "package": 60, "scene": 60}
# Part -> (patterns of files that get mutants, patterns of exceptions). Headers get none, because a
# change rebuilds all files that include them; except *_body.h, which only the kernels include.
# Bindings get none, because they are tables of names.
SOURCES = {
    "native": (["native/**/*.cpp", "native/simd/*_body.h"], ["native/bindings/*", "native/web/*"]),
    "package": (["native/python/risorius/**/*.py", "native/python/risorius_people/**/*.py"], []),
    "scene": (["addon/risorius/logic/**/*.py", "addon/risorius/scene/**/*.py"], []),
}
SLOW = 300  # limit in CPU seconds for a test whose usual time is unknown
WAITS = 10  # limit of wall time in seconds per CPU second, because the machine may be busy
MEMORY = 6 << 30  # memory limit of a program in bytes, because a mutant may allocate endlessly
# Options of CMake. They omit debug symbols and lower optimisation, because each mutant is compiled
# and linked.
OPTIONS = [
    "-DCMAKE_CXX_COMPILER_LAUNCHER=ccache", "-DCMAKE_INTERPROCEDURAL_OPTIMIZATION=OFF",
    "-DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O1 -DNDEBUG", "-DRISORIUS_QUICK_BUILD_TESTS=ON",
    "-DRISORIUS_BUILD_BINDINGS=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_benchmark=ON",
    f"-DPython_EXECUTABLE={sys.executable}",
    f"-DCMAKE_PROJECT_risorius_INCLUDE={HERE / 'bindings.cmake'}",
]  # fmt: skip


def sources(root: Path, part: str, under: Sequence[str] = ()) -> list[str]:
    """Files of a part that get mutants, as paths relative to the root.

    Args:
        root: The project's folder.
        part: native, package or scene.
        under: Folders or files, relative to the root, to which the files are limited; empty: all.

    Raises:
        SystemExit: The part has no file in an entry of `under`.
    """
    patterns, left_out = SOURCES[part]
    found = {str(p.relative_to(root)) for pattern in patterns for p in root.glob(pattern)}
    found = {f for f in found if not any(fnmatch.fnmatch(f, pattern) for pattern in left_out)}
    places = [place.rstrip("/") for place in under]
    for place in places:
        if not any(_lies_under(f, place) for f in found):
            sys.exit(f"--under {place}: no source of the part {part} lies there")
    return sorted(f for f in found if not places or any(_lies_under(f, p) for p in places))


def _lies_under(path: str, place: str) -> bool:
    return path == place or path.startswith(f"{place}/")


def tests_of(path: str, table: dict[str, list[str]]) -> list[str]:
    """The tests that the table lists for a file, in its order, from all patterns that match."""
    found: list[str] = []
    for pattern, tests in table.items():
        if fnmatch.fnmatch(path, pattern):
            found += [test for test in tests if test not in found]
    return found


def programs(table: dict[str, list[str]]) -> list[str]:
    """Names of the GoogleTest programs among the tests of a table."""
    named = {test.partition(":")[0] for tests in table.values() for test in tests}
    return sorted(name for name in named if "/" not in name)


class Copy:
    """A copy of the project's files in build/mutants, in which mutants are tested."""

    def __init__(self, part: str, targets: list[str]):
        """Choose the folder of the copy, which refresh() fills.

        Args:
            part: native, package or scene.
            targets: CMake targets that refresh() builds.
        """
        self.part = part
        self.targets = targets
        self.root = PROJECT / "build" / "mutants" / part
        self._times = self.root.with_suffix(".json")
        # Test -> CPU seconds without a mutant.
        self.usual: dict[str, float] = (
            json.loads(self._times.read_text()) if self._times.exists() else {}
        )
        self._fresh = False  # whether the Python module is built from the present sources

    def refresh(self) -> None:
        """Copy changed files, and build the copy or, for package and scene, take the wheel's
        module.

        Unchanged copies keep their times, so Ninja skips them.
        """
        listed = subprocess.run(
            ["git", "ls-files", "-co", "--exclude-standard"],
            cwd=PROJECT, check=True, capture_output=True, text=True,
        ).stdout.splitlines()  # fmt: skip
        for name in listed:
            here, there = PROJECT / name, self.root / name
            if here.exists() and not (there.exists() and _same(here, there)):
                there.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(here, there)
        for folder in ("native", "addon", "tests", "blender_tests"):
            for old in (self.root / folder).rglob("*"):
                gone = (
                    old.suffix in (".py", ".cpp", ".h")
                    and not (PROJECT / old.relative_to(self.root)).exists()
                )
                if gone:
                    old.unlink()
        if self.part != "native":
            package = importlib.util.find_spec("risorius")
            if package is None or package.origin is None:
                sys.exit("the wheel is not installed: packaging/demo.sh builds it")
            installed = Path(package.origin).parent
            self._copy_module(next(installed.glob("_native.*.so")))
            compiled = ["compileall", "-q", "--invalidation-mode", "checked-hash", "native/python"]
            self._checked([sys.executable, "-m", *compiled])
            return
        if not (self.root / "build" / "dev" / "build.ninja").exists():
            self._checked(["cmake", "--preset", "dev", *OPTIONS])
        self._checked(["cmake", "--build", "build/dev", "-j2", "--target", *self.targets])

    def _built(self) -> Path:
        return next((self.root / "build" / "dev").rglob("_native.*.so"))

    def _copy_module(self, module: Path) -> None:
        shutil.copyfile(module, self.root / "native" / "python" / "risorius" / module.name)
        self._fresh = True

    def _checked(self, command: list[str]) -> None:
        code, _, text = self._run(command, 3600)
        if code != 0:
            sys.exit(f"{' '.join(command)}\n{text[-2000:]}")

    def try_one(self, mutant: Mutant, tests: list[str]) -> tuple[str, str]:
        """Test a mutant. Returns killed, slow, survived, unbuildable or unsure, and the last test.

        Unsure means that the test also fails without the mutant.
        """
        place = self.root / mutant.path
        source = place.read_text(encoding="utf-8")
        place.write_text(mutant.applied(source), encoding="utf-8")
        self._fresh = self.part != "native"
        try:
            for test in tests:
                outcome, said = self.outcome(test)
                if outcome in ("killed", "slow") and not self._passes(test, said, mutant, source):
                    return "unsure", f"{test} fails without it too: {said}"
                if outcome != "passed":
                    return outcome, f"{test} {said}".strip()
            return "survived", ""
        finally:
            place.write_text(source, encoding="utf-8")
            if self.part == "native":
                os.utime(place)

    def _passes(self, test: str, said: str, mutant: Mutant, source: str) -> bool:
        """Whether the failed test passes without the mutant; if not, its failure proves nothing.

        A test that has passed before is not run again.
        """
        named = re.search(r"(?:FAILED|ERROR) (\S+::.+?)(?: - |$)|\[ *FAILED *\] (\S+)", said)
        if named and named.group(1):
            test = named.group(1)
        elif named:
            test = f"{test.partition(':')[0]}:{named.group(2).rstrip(',')}"
        if test in self.usual:
            return True
        place = self.root / mutant.path
        place.write_text(source, encoding="utf-8")
        os.utime(place)
        self._fresh = self.part != "native"
        return self.outcome(test)[0] == "passed"

    def outcome(self, test: str) -> tuple[str, str]:
        """Run a test on the present sources.

        Returns: passed, killed, slow or unbuildable, and a line of the test's output about it.
        """
        if "/" not in test.partition(":")[0]:
            target = test.partition(":")[0]
            if self._run(["cmake", "--build", "build/dev", "--target", target], 1200)[0] != 0:
                return "unbuildable", ""
            program = next(p for p in (self.root / "build/dev/tests").rglob(target) if p.is_file())
            command = [str(program), "--gtest_fail_fast", "--gtest_brief=1"]
            command += [f"--gtest_filter={test.partition(':')[2]}"] if ":" in test else []
        else:
            if not self._fresh:
                build = ["cmake", "--build", "build/dev", "--target", "_native"]
                if self._run(build, 1200)[0] != 0:
                    return "unbuildable", ""
                self._copy_module(self._built())
            command = [sys.executable, "-m", "pytest", "-q", "-x", test]
            if test.startswith("blender_tests/"):
                command = [sys.executable, "blender_tests/run.py", "--", "-x", test]
        limit = max(60, 6 * self.usual[test]) if test in self.usual else SLOW
        code, seconds, text = self._run(command, limit)
        if code == 0:
            self.usual[test] = max(seconds, self.usual.get(test, 0))
            self._times.write_text(json.dumps(self.usual, indent=1))
            return "passed", ""
        if code is None:
            return "slow", f"{limit:.0f} s"
        lines = [line for line in text.splitlines() if "FAILED" in line or line.startswith("ERROR")]
        return "killed", lines[-1] if lines else f"exit {code}"

    def _run(self, command: list[str], limit: float) -> tuple[int | None, float, str]:
        """Run a command. Returns exit code (None after the limit), CPU seconds, and output.

        Args:
            command: program and arguments.
            limit: CPU seconds that each process may use.
        """
        began = _seconds_of_children()
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as room:
            environment = {
                **os.environ, "TMPDIR": room, "XDG_CACHE_HOME": f"{room}/cache",
                "BLENDER_USER_RESOURCES": f"{room}/blender", "PYTHONDONTWRITEBYTECODE": "1",
                "PYTHONPATH": str(self.root / "native" / "python"),
            }  # fmt: skip
            with open(f"{room}/printed", "w+b") as printed:
                process = subprocess.Popen(
                    command, cwd=self.root, env=environment, stdin=subprocess.DEVNULL,
                    stdout=printed, stderr=subprocess.STDOUT, start_new_session=True,
                )  # fmt: skip
                with contextlib.suppress(ProcessLookupError):  # its children inherit it
                    resource.prlimit(process.pid, resource.RLIMIT_CPU, (int(limit),) * 2)
                try:
                    code = process.wait(WAITS * limit)
                except subprocess.TimeoutExpired:
                    code = None
                finally:
                    _kill_group(process)
                printed.seek(0)
                text = printed.read().decode(errors="replace")
        if code is not None and -code in (signal.SIGXCPU, signal.SIGKILL):
            code = None
        return code, _seconds_of_children() - began, text


def _seconds_of_children() -> float:
    """CPU seconds of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _kill_group(process: subprocess.Popen[bytes]) -> None:
    """Kill a test and its processes. Ninja gets SIGTERM first, so that it ends its compilers."""
    with contextlib.suppress(ProcessLookupError):
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(5)
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _same(one: Path, other: Path) -> bool:
    return one.stat().st_size == other.stat().st_size and one.read_bytes() == other.read_bytes()


def told(mutant: Mutant, outcome: str, said: str) -> str:
    """Three lines about a mutant: outcome and place, the line before, and the line after."""
    head = f"{outcome}: {mutant.path}:{mutant.line} {said}"
    return f"{head}\n    - {mutant.before.strip()}\n    + {mutant.after.strip()}"


def summary(outcomes: list[str]) -> str:
    """The last line of the output, which contains the number of each outcome."""
    counts = Counter(outcomes)
    tried = sum(counts.values()) - counts["unbuildable"]
    return (
        f"{tried} mutants: {counts['killed'] + counts['slow']} killed ({counts['slow']} by the "
        f"clock), {counts['survived']} survived, {counts['unsure']} unsure; "
        f"{counts['unbuildable']} more do not build"
    )


def main() -> None:
    """Draw mutants, test them, and print the number of each outcome."""
    parser = argparse.ArgumentParser()
    parser.add_argument("part", choices=SOURCES)
    parser.add_argument("--under", nargs="+", default=[], metavar="PATH", help="only of these")
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--list", action="store_true", help="draw only")
    parser.add_argument("--survivors", action="store_true", help="try again those that lived")
    parser.add_argument("--programs", action="store_true", help="GoogleTest alone, for a first run")
    options = parser.parse_args()
    # A shell's background jobs ignore SIGINT, and programs of tests would inherit this.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))  # child processes inherit it
    part, wanted = options.part, options.count or COUNTS[options.part]
    paths = sources(PROJECT, part, options.under)
    order = drawn(PROJECT, paths, options.seed)
    if options.list:
        for mutant, _ in zip(order, range(wanted), strict=False):
            print(told(mutant, "drawn", ""))
        return
    table = tomllib.loads((HERE / "tests.toml").read_text(encoding="utf-8"))[part]
    # With --programs, the Python module is not built, because building it takes long.
    used = {"": [test for path in paths for test in tests_of(path, table)]}
    copy = Copy(part, programs(used) + ([] if options.programs else ["_native"]))
    copy.root.mkdir(parents=True, exist_ok=True)
    kept = PROJECT / "build" / "mutants" / f"{part}-{options.seed}.jsonl"
    before = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    known = {(b["path"], b["line"], b["after"]): b["outcome"] for b in before}
    copy.refresh()
    outcomes: list[str] = []
    for mutant in order:
        if sum(o != "unbuildable" for o in outcomes) == wanted:
            break
        name = (mutant.path, mutant.line, mutant.after)
        outcome = known.get(name)
        if outcome is None or (options.survivors and outcome == "survived"):
            began = time.monotonic()
            tests = tests_of(mutant.path, table)
            tests = [t for t in tests if not (options.programs and t.endswith(".py"))]
            outcome, said = copy.try_one(mutant, tests)
            print(told(mutant, outcome, said), flush=True)
            line = {**asdict(mutant), "outcome": outcome, "by": said}
            line["seconds"] = round(time.monotonic() - began)
            if outcome != "unsure":  # the next run tries it again
                with kept.open("a") as file:
                    file.write(json.dumps(line) + "\n")
        outcomes.append(outcome)
    print(summary(outcomes))


if __name__ == "__main__":
    main()
