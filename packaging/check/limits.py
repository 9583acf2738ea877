# SPDX-License-Identifier: MIT
"""Runs a command with a limit on CPU seconds, and kills it if it hangs.

    limits.py CPU_SECONDS COMMAND [ARGUMENT...]

A limit in wall time would kill working programs on a busy machine: beside twenty jobs on two cores,
everything takes ten times as long. CPU seconds do not depend on other jobs. A program that waits
for ever uses no CPU, so a second limit kills it. The limits cover the command and all processes
that it starts. The exit code is the command's. After a kill it is 137 (like `timeout -s KILL`), and
a sentence on standard error gives the reason.

Linux counts the CPU seconds of each process (proc(5)). On other systems the limit is
10 * CPU_SECONDS + 300 s of wall time.
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

STILL = 300.0  # wall time in seconds in which a command must use LEAST_SHARE of a core
# Least fraction of a core that a command must use; a command that uses less hangs. Beside twenty
# other jobs, a process of low priority still gets 0.03, six times this fraction.
LEAST_SHARE = 0.005
LOOK = 1.0  # seconds between two checks
KILLED = 128 + 9


class Exceeded(subprocess.TimeoutExpired):
    """The command was killed; `why` names the limit."""

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
        cpu: CPU seconds that the command and its children may use together.
        still: wall time in seconds in which they must use at least 0.5 % of a core.
        text: whether the output is text.
        options: options of subprocess.Popen; `input` is written to the standard input.

    Raises:
        Exceeded: a limit was reached, and all processes of the command were killed.
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
            given = None  # the first communicate() keeps the input for later calls
            watch.look()
    except BaseException:
        watch.kill()
        raise


class Watch:
    """Counts the CPU seconds of a process and its descendants. The process must lead a session."""

    def __init__(self, process: subprocess.Popen[Any], cpu: float, still: float) -> None:
        self.process, self.cpu, self.still = process, cpu, still
        self.used, self._total = 0.0, 0.0
        self._since, self._then = time.monotonic(), 0.0

    def look(self) -> None:
        """Check the limits once. If one is exceeded, kill all processes and raise Exceeded."""
        now = time.monotonic()
        if not _PROC.is_dir():
            if now - self._since > 10 * self.cpu + self.still:
                self._stop(f"after {now - self._since:.0f} s by the clock")
            return
        # The seconds of a child leave the total if it ends and no process waits for it. So only
        # increases of the total are added to `used`.
        total = sum(map(_seconds, _family(self.process.pid).values()))
        self.used, self._total = self.used + max(0.0, total - self._total), total
        if self.used > self.cpu:
            self._stop(f"{self.used:.0f} s of CPU used, {self.cpu:.0f} were allowed")
        if self.used - self._then > LEAST_SHARE * self.still:
            self._since, self._then = now, self.used
        elif now - self._since > self.still:
            self._stop(f"it stood still for {self.still:.0f} s, after {self.used:.0f} s of CPU")

    def kill(self) -> None:
        """Kill the process and all its descendants."""
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
    """Process id -> result of _fields(), for all processes of a session.

    Descendants of the session's leader that have left the session are included.

    Args:
        leader: process id of the leader, which is also the id of the session.
    """
    known: dict[int, list[str]] = {}
    for entry in os.listdir("/proc") if _PROC.is_dir() else ():
        if entry.isdecimal() and (fields := _fields(int(entry))):
            known[int(entry)] = fields
    found = {pid for pid, fields in known.items() if leader in (pid, int(fields[3]))}
    while below := {pid for pid, fields in known.items() if int(fields[1]) in found} - found:
        found |= below
    return {pid: known[pid] for pid in found}


def _fields(pid: int) -> list[str]:
    """The fields of /proc/PID/stat after the program's name; [] if the process has ended."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(errors="replace")
    except OSError:
        return []
    # The name may contain blanks and brackets.
    return text[text.rindex(")") + 2 :].split()


def _seconds(fields: list[str]) -> float:
    """CPU seconds of a process and of its children that have ended.

    Args:
        fields: result of _fields() for the process.
    """
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def main(arguments: list[str]) -> int:
    """Run the command line with the input and output of this process. Returns the exit code."""
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
