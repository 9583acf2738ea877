# SPDX-License-Identifier: MIT
"""Run a command until it ends, has used up its CPU seconds, or stands still.

    limits.py CPU_SECONDS COMMAND [ARGUMENT...]

A limit by the clock kills sound programs on a busy machine: beside twenty jobs on two cores, all
takes ten times as long. CPU seconds count the same on every machine, and a program that waits for
ever uses none. The limit covers the command and all processes that it starts. The exit code is the
command's, or 137 (as of `timeout -s KILL`) after a kill, with a sentence on the standard error.

Linux counts the seconds of each process (proc(5)). On other systems the limit is ten times as many
seconds of the clock.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

STILL = 300.0  # seconds by the clock
LEAST_SHARE = 0.005  # of a core: a process of low priority beside twenty others gets six times that
LOOK = 1.0  # seconds between two looks
KILLED = 128 + 9


class Exceeded(subprocess.TimeoutExpired):
    """The command was killed; `why` says at which limit."""

    def __init__(self, command: object, limit: float, why: str) -> None:
        super().__init__(command, limit)  # type: ignore[arg-type]
        self.why = why

    def __str__(self) -> str:
        return f"{self.cmd}: killed, {self.why}"


def run(
    command: list[str], cpu: float, still: float = STILL, text: bool = True, **options: Any
) -> subprocess.CompletedProcess[Any]:
    """Run a command and return what it printed, like subprocess.run with capture_output.

    Args:
        command: program and arguments.
        cpu: seconds of CPU that it and its children may use together.
        still: seconds by the clock in which it must use at least 0.5 % of a core.
        text: whether the output is text.
        options: of subprocess.Popen; `input` is given to the standard input.

    Raises:
        Exceeded: a limit was reached, and all its processes were killed.
    """
    given = options.pop("input", None)
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    if given is not None:
        pipes["stdin"] = subprocess.PIPE
    process = subprocess.Popen(command, text=text, **pipes, **options, **_own_session())
    watch = Watch(process, cpu, still)
    try:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                out, err = process.communicate(given, timeout=LOOK)
                return subprocess.CompletedProcess(command, process.returncode, out, err)
            given = None  # communicate() keeps it
            watch.look()
    except BaseException:
        watch.kill()
        raise


class Watch:
    """Counts the CPU seconds of a process that leads a session of its own."""

    def __init__(self, process: subprocess.Popen[Any], cpu: float, still: float) -> None:
        self.process, self.cpu, self.still = process, cpu, still
        self.used, self._total = 0.0, 0.0
        self._since, self._then = time.monotonic(), 0.0

    def look(self) -> None:
        """Count once; raises Exceeded when a limit is reached."""
        now = time.monotonic()
        if not _PROC.is_dir():
            if now - self._since > 10 * self.cpu + self.still:
                self._stop(f"after {now - self._since:.0f} s by the clock")
            return
        # The sum falls when a child ends that nobody waits for: its seconds were counted before.
        total = sum(map(_seconds, _family(self.process.pid).values()))
        self.used, self._total = self.used + max(0.0, total - self._total), total
        if self.used > self.cpu:
            self._stop(f"{self.used:.0f} s of CPU used, {self.cpu:.0f} were allowed")
        if self.used - self._then > LEAST_SHARE * self.still:
            self._since, self._then = now, self.used
        elif now - self._since > self.still:
            self._stop(f"it stood still for {self.still:.0f} s, after {self.used:.0f} s of CPU")

    def kill(self) -> None:
        """End the process and all that it started."""
        for pid in _family(self.process.pid):
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def _stop(self, why: str) -> None:
        self.kill()
        raise Exceeded(self.process.args, self.cpu, why)


_PROC = Path("/proc/self")


def _own_session() -> dict[str, bool]:
    return {"start_new_session": True} if os.name == "posix" else {}


def _family(leader: int) -> dict[int, list[str]]:
    """All processes of a session and all descendants of its leader, with their fields."""
    known: dict[int, list[str]] = {}
    for entry in os.listdir("/proc") if _PROC.is_dir() else ():
        if entry.isdecimal() and (fields := _fields(int(entry))):
            known[int(entry)] = fields
    found = {pid for pid, fields in known.items() if leader in (pid, int(fields[3]))}
    while below := {pid for pid, fields in known.items() if int(fields[1]) in found} - found:
        found |= below
    return {pid: known[pid] for pid in found}


def _fields(pid: int) -> list[str]:
    """The fields of /proc/PID/stat behind the program's name; [] if the process is gone."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(errors="replace")
    except OSError:
        return []
    # The name may hold blanks and brackets.
    return text[text.rindex(")") + 2 :].split()


def _seconds(fields: list[str]) -> float:
    """Seconds of CPU of a process and of its children that have ended."""
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def main(arguments: list[str]) -> int:
    """Run the command line with this process's own input and output."""
    if len(arguments) < 2 or not arguments[0].isdecimal():
        print("limits.py CPU_SECONDS COMMAND [ARGUMENT...]", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + 15))
    process = subprocess.Popen(arguments[1:], **_own_session())
    watch = Watch(process, float(arguments[0]), float(os.environ.get("STILL", STILL)))
    try:
        while True:
            with contextlib.suppress(subprocess.TimeoutExpired):
                code = process.wait(LOOK)
                return code if code >= 0 else 128 - code
            watch.look()
    except Exceeded as error:
        print(f"limits.py: {error}", file=sys.stderr)
        return KILLED
    except BaseException:
        watch.kill()
        raise


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
