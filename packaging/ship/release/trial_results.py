# SPDX-License-Identifier: MIT
"""Judges the results of trial.sh. Prints a line `check<TAB>1` or `check<TAB>0` for each check.

trial_results.py OUT BEFORE VERSION    OUT: folder of the results; BEFORE, VERSION: versions before
                                       and after the update
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

Faults = dict[str, tuple[int, str]]


def checks(
    found: dict[str, Any], faults: Faults, before: str, version: str, left: str
) -> Iterator[tuple[str, bool]]:
    """Yields (name of a check, whether it passed). Missing results fail a check and do not raise.

    Args:
        found: name of a step -> its results.
        faults: name of a fault -> (number of installed copies after it, Blender's message).
        before: version that is updated.
        version: version after the update.
        left: paths of the extension's files that remain after its removal, one per line.
    """

    def of(step: str, name: str) -> Any:
        return found.get(step, {}).get(name)

    done = ["FINISHED"]
    yield "found and installed", of("install", "install") == done
    yield "the version before runs", of("install", "version") == before
    yield "Add > Face without a network", of("install", "add") == done
    yield "its jaw moves", (of("install", "moved") or 0) > 1000
    yield "the window shows it", (of("install", "seen") or 0) > 0.003
    yield "updated with the face open", of("update", "update") == done
    yield "the open session says restart", "restart Blender" in (of("update", "problem") or "")
    yield "the next start has the new version", of("after", "version") == version
    yield "and nothing to complain of", of("after", "problem") == ""
    yield "the saved face moves", (of("after", "moved") or 0) > 1000
    yield "self-test", of("after", "self_test") == done
    yield "faults were tried", len(faults) >= 4
    for name, (there, said) in faults.items():
        # Blender installs an extension for another Python version, but does not enable it.
        refused = there == 0 or "isn't compatible" in said
        yield f"refused with a sentence: {name}", refused and bool(said)
    yield "of two, one runs", (of("twice", "handlers") or 9) == 1
    disabled = of("remove", "disabled") or {}
    yield "disabled, no class is left", disabled.get("classes") == []
    yield "removed", of("remove", "remove") == done
    last = found.get("look")
    seen = last is None or any(last.get(k) for k in ("classes", "modules", "enabled"))
    yield "a fresh start sees nothing", not seen
    yield "no file is left", left == ""


def main() -> int:
    """Print the checks. The exit code is 0 even if checks fail."""
    out, before, version = Path(sys.argv[1]), *sys.argv[2:4]
    file = out / "results.jsonl"
    text = file.read_text(encoding="utf-8") if file.exists() else ""
    found = {row["step"]: row for row in map(json.loads, text.splitlines())}
    left = (out / "left.txt").read_text(encoding="utf-8").strip()
    table = out / "faults.tsv"
    rows = table.read_text(encoding="utf-8").splitlines() if table.exists() else []
    parts = (row.split("\t", 2) for row in rows)
    faults = {name: (int(there), said) for name, there, said in parts if name != "-"}
    for name, good in checks(found, faults, before, version, left):
        print(f"{name}\t{int(bool(good))}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
