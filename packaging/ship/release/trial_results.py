# SPDX-License-Identifier: MIT
"""What a trial found, judged: a line `check<TAB>1 or 0` each.

trial_results.py OUT BEFORE VERSION
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
    """(what is checked, whether it is so), whatever is missing.

    Args:
        found: result of each step by its name.
        faults: of each fault how many copies were installed after it, and what Blender said.
        before, version: the release that is updated, and the one that it is updated to.
        left: files of ours that remain after all.
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
        # A file for another Python is taken and not enabled.
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
    """Print the checks; exit code 0."""
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
