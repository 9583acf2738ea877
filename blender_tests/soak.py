# SPDX-License-Identifier: GPL-3.0-or-later
"""Thousands of random user actions on three characters, from a printed seed.

    python blender_tests/soak.py [--actions 10000] [--seed N] [--characters 3] [--until K]
    python blender_tests/soak.py --blender /path/to/blender ...

A parent process starts Blender (or the bpy module of this Python) as a child process. It kills
the child if the child hangs, and reports the action and the seed if the child dies. The test fails
on an exception, even if Blender only prints it; on a wrong face or driver; and on memory or
data-blocks that grow with time. `--until K --check 1` repeats a run up to action K, and compares
every face with the oracle after each action.
The log is build/logs/soak-SEED.log, or the file that --log names.
"""

import argparse
import collections
import ctypes
import faulthandler
import gc
import json
import os
import random
import shutil
import sys
import tempfile
import time
import traceback
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "packaging" / "check"))

import limits  # noqa: E402

MODULE = "bl_ext.user_default.risorius"
MAX_GROWTH = 0.03  # of the last sample: allowed growth over the second half of the run
SECONDS_PER_ACTION = 1.0  # mean CPU time after which the child counts as hung


def arguments(given):
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], allow_abbrev=False)
    parser.add_argument("--actions", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--characters", type=int, default=3)
    parser.add_argument("--until", type=int, default=None, help="stop after this action")
    parser.add_argument("--check", type=int, default=250, help="look at all faces every N actions")
    parser.add_argument("--blender", default=None, help="an executable; else the bpy module")
    parser.add_argument("--log", type=Path, default=None)
    parser.add_argument("--still", type=float, default=limits.STILL, help="seconds idle")
    parser.add_argument("--child", type=Path, default=None, help=argparse.SUPPRESS)
    return parser.parse_args(given)


# -- parent process -------------------------------------------------------------------------


def command(options, folder):
    """The command line of the child process, which does the actions."""
    rest = [
        "--child", str(folder), "--actions", str(options.actions), "--seed", str(options.seed),
        "--characters", str(options.characters), "--check", str(options.check),
    ]  # fmt: skip
    if options.until is not None:
        rest += ["--until", str(options.until)]
    if options.blender is None:
        return [sys.executable, str(HERE / "soak.py"), *rest]
    flags = ["-b", "--factory-startup", "-noaudio", "--python-exit-code", "1"]
    return [options.blender, *flags, "--python", str(HERE / "soak.py"), "--", *rest]


def parent(options):
    """Run the child until it ends or dies, and write the log. Returns the exit code."""
    if options.seed is None:
        options.seed = random.SystemRandom().randrange(10**6)
    print(f"seed {options.seed}, {options.actions} actions", flush=True)
    log = options.log or HERE.parent / "build" / "logs" / f"soak-{options.seed}.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="risorius-soak-"))
    environment = dict(os.environ, BLENDER_USER_RESOURCES=str(folder / "user"))
    environment["RISORIUS_TEST_USER"] = str(folder / "user")
    begin = time.monotonic()
    limit = 120 + options.actions * SECONDS_PER_ACTION
    try:
        done = limits.run(command(options, folder), limit, options.still, env=environment)
        print(done.stdout, done.stderr, sep="", end="")
        ending = "" if done.returncode == 0 else f"the child ended with exit code {done.returncode}"
    except limits.Exceeded as error:
        ending = f"the child was killed, {error.why}"
    text, failed = report(options, folder, ending, time.monotonic() - begin)
    log.write_text(text, encoding="utf-8")
    print(text, end="")
    print(f"log: {log}")
    shutil.rmtree(folder, ignore_errors=True)
    return int(failed)


def report(options, folder, ending, seconds):
    """The text of the log of a run, and whether the run failed.

    Args:
        options: options of the command line.
        folder: folder in which the child left its result, journal and output.
        ending: reason why the child was ended, or "".
        seconds: duration of the run.
    """
    result = {}
    if (folder / "result.json").is_file():
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    errors = list(result.get("errors", []))
    journal = folder / "journal"
    done = journal.read_text(encoding="utf-8").splitlines() if journal.is_file() else []
    if not result.get("finished"):
        last = done[-1] if done else "before the first action"
        errors.append(f"{ending or 'the child left no result'}; last action: {last}")
        errors.append((folder / "output").read_text(encoding="utf-8", errors="replace")[-4000:])
    lines = [
        f"soak: seed {options.seed}, {len(done)} of {options.actions} actions, "
        f"{options.characters} characters, {seconds:.0f} s",
        f"Blender {result.get('version', 'unknown')}",
        "actions: " + ", ".join(f"{k} {v}" for k, v in sorted(result.get("counts", {}).items())),
        f"faces checked: {result.get('checks', 0)} times; worst error of a mesh's size: "
        f"{result.get('worst', 0.0):.2g}",
        "overrides that Blender locked, said and repaired by the panel's button: "
        f"{result.get('repaired', 0)}",
    ]
    for name, row in result.get("samples", {}).items():
        lines.append(f"{name}: {' '.join(str(v) for v in row)}")
    lines += [f"growth over the second half: {g}" for g in result.get("growth", [])]
    lines.append(f"errors: {len(errors)}")
    if errors:
        lines.append("the last actions: " + ", ".join(done[-30:]))
    lines += errors
    return "\n".join(lines) + "\n", bool(errors)


# -- child process --------------------------------------------------------------------------


class Output:
    """Redirects everything that this process prints, also from C code, to a file."""

    def __init__(self, path):
        self.path, self.read = path, 0
        target = os.open(path, os.O_CREAT | os.O_WRONLY | os.O_APPEND)
        sys.stdout.flush()
        sys.stderr.flush()
        for descriptor in (1, 2):
            os.dup2(target, descriptor)

    def news(self):
        """The text that was printed since the last call of this method."""
        sys.stdout.flush()
        sys.stderr.flush()
        ctypes.CDLL(None).fflush(None)
        with self.path.open("rb") as file:
            file.seek(self.read)
            new = file.read()
        self.read += len(new)
        return new.decode("utf-8", "replace")


def memory():
    """Resident memory of this process in MiB, after unused memory was given back to the system."""
    gc.collect()
    libc = ctypes.CDLL(None)
    if hasattr(libc, "malloc_trim"):
        libc.malloc_trim(0)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def growth(values):
    """Growth of samples over the second half of the run, by a fitted line, in the samples' unit.

    The result is 0 if the second half has fewer than 4 samples.
    """
    half = values[len(values) // 2 :]
    if len(half) < 4:
        return 0.0
    middle = (len(half) - 1) / 2
    mean = sum(half) / len(half)
    slope = sum((i - middle) * (v - mean) for i, v in enumerate(half))
    slope /= sum((i - middle) ** 2 for i in range(len(half)))
    return slope * (len(half) - 1)


def prepare(folder):
    """Install the add-on from the source folder into the temporary user folder."""
    import addon_utils
    import bpy

    target = folder / "user" / "extensions" / "user_default" / "risorius"
    ignored = shutil.ignore_patterns("__pycache__", "wheels")
    shutil.copytree(HERE.parent / "addon" / "risorius", target, ignore=ignored)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    repos = bpy.context.preferences.extensions.repos
    repository = next((r for r in repos if r.module == "user_default"), None)
    repository = repository or repos.new(name="User Default", module="user_default")
    repository.use_custom_directory = True
    repository.custom_directory = str(target.parent)
    addon_utils.extensions_refresh(ensure_wheels=False)
    assert addon_utils.enable(MODULE) is not None


class Run:
    """The actions of one child process and its results."""

    def __init__(self, options, world, output):
        self.options, self.world, self.output = options, world, output
        self.counts, self.errors = collections.Counter(), []
        self.samples = collections.defaultdict(list)
        self.checks, self.worst, self.finished = 0, 0.0, False

    def act(self, number, kind):
        """Do one action; printed tracebacks and exceptions are recorded as errors."""
        from support.soak_actions import NOT_PUSHED

        self.world.random = random.Random(f"{self.options.seed} {number}")
        try:
            plant(self.world, number)
            getattr(self.world, kind)()
            if kind not in NOT_PUSHED:
                self.world._push(kind)
        except Exception:  # noqa: BLE001  reported with the action's number
            self.fail(number, kind, traceback.format_exc())
        self.counts[kind] += 1
        if number % self.options.check == 0:
            self.check(number, kind)
        printed = self.output.news()
        if "Traceback" in printed:
            self.fail(number, kind, printed[-3000:])

    def check(self, number, kind):
        """Compare all faces with the oracle after action `number`; differences become errors."""
        self.checks += 1
        try:
            self.worst = max(self.worst, self.world.check())
        except Exception:  # noqa: BLE001  reported with the action's number
            self.fail(number, kind, traceback.format_exc())

    def fail(self, number, kind, text):
        """Record an error with the number and kind of its action."""
        self.errors.append(f"action {number} ({kind}): {text}")

    def sample(self, number):
        """Reload the file, and record memory and data-blocks that no character uses."""
        self.world.random = random.Random(f"{self.options.seed} calm {number}")
        self.world.calm()
        counts = self.world.leftovers()
        self.samples["at action"].append(number)
        self.samples["memory in MiB"].append(round(memory(), 1))
        kinds = ("objects", "meshes", "materials", "texts", "actions", "armatures", "collections")
        for name in kinds:
            self.samples[f"{name} left"].append(counts[name])
        self.samples["all left"].append(sum(counts.values()))

    def judge(self):
        """Texts about the growth of series of at least 8 samples; much growth becomes an error."""
        found = []
        for name, row in self.samples.items():
            if name == "at action" or len(row) < 8:
                continue
            grown = growth(row)
            found.append(f"{name} {grown:+.2f} of {row[-1]}")
            if grown > max(MAX_GROWTH * row[-1], 1.0 if name != "memory in MiB" else 6.0):
                self.errors.append(f"{name} grew by {grown:.2f} over the second half: {row}")
        return found

    def result(self):
        """The result of the run, which is written to a JSON file for the parent process."""
        import bpy

        return {
            "version": bpy.app.version_string, "counts": self.counts, "errors": self.errors,
            "samples": self.samples, "checks": self.checks, "worst": self.worst,
            "finished": self.finished, "growth": self.judge(), "repaired": self.world.repaired,
        }  # fmt: skip


def plant(world, number):
    """Cause a fault at the fifth action, to check that the soak test notices it.

    The environment variable RISORIUS_SOAK_PLANT names the fault; without it nothing happens.
    """
    kind = os.environ.get("RISORIUS_SOAK_PLANT") if number == 5 else None
    if kind == "face":
        block = world.rigs()[0]["risorius_mesh_000"].data.shape_keys.reference_key
        block.points[0].co.x += 1.0
    elif kind == "traceback":
        print("Traceback (most recent call last):\nplanted traceback", file=sys.stderr)
    elif kind == "death":
        os.abort()
    elif kind == "hang":
        time.sleep(10_000)


def child(options):
    """Do the actions in this process until the fifth error, and write the result to a file."""
    folder = options.child
    for place in os.environ.get("RISORIUS_TEST_PATH", "").split(os.pathsep):
        if place:
            sys.path.append(place)
    sys.path.insert(0, str(HERE))
    import bpy  # noqa: F401  its C output must go to the file too

    output = Output(folder / "output")
    faulthandler.enable()
    prepare(folder)
    from support.soak_actions import WEIGHTS, World

    run = Run(options, World(folder, options.seed, options.characters), output)
    kinds, weights = list(WEIGHTS), list(WEIGHTS.values())
    chosen = random.Random(options.seed).choices(kinds, weights, k=options.actions)
    last = options.until or options.actions
    every = max(10, options.actions // 40)
    with (folder / "journal").open("w", encoding="utf-8") as journal:
        run.world.begin()
        for number, kind in enumerate(chosen[:last], 1):
            journal.write(f"{number} {kind}\n")
            journal.flush()
            run.act(number, kind)
            if len(run.errors) >= 5:
                break
            if number % every == 0:
                run.sample(number)
        else:
            run.check(last, "end")
    run.finished = True
    (folder / "result.json").write_text(json.dumps(run.result()), encoding="utf-8")
    return int(bool(run.errors))


def main():
    """Run as the parent, or as a child started by the parent."""
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    options = arguments(given)
    return child(options) if options.child is not None else parent(options)


if __name__ == "__main__":
    code = 1
    try:
        code = main()
    except Exception:  # noqa: BLE001  printed, and the exit code says it
        traceback.print_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)  # Blender as a module sometimes hangs in its destructors
