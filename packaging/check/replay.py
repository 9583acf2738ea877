# SPDX-License-Identifier: MIT
"""Runs the commands of a page of docs/ in its order, in a folder of their own.

python packaging/check/replay.py docs/authoring.md [FOLDER]

Blocks of TOML that begin with a file's name are written, blocks of commands are run line by line
with the `risorius` beside this Python; what needs the project's tree (python tests/...) is named
and left out. The head of docs/authoring.md is the formula's face of face_shapes.py, in
tests/python/support.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def blocks(text: str) -> list[tuple[str, str]]:
    """The language and the content of each fenced block."""
    return [(found.group(1), found.group(2)) for found in BLOCK.finditer(text)]


def run(line: str, folder: Path) -> int:
    """A command of the page; its output is shown.

    Args:
        line: as it stands there.
        folder: where it runs.
    """
    print(f"$ {line}", flush=True)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    begin = time.monotonic()
    done = subprocess.run(
        line, shell=True, cwd=folder, env={**os.environ, "PATH": path}, check=False
    )
    print(f"  exit code {done.returncode}, {time.monotonic() - begin:.1f} s", flush=True)
    return done.returncode


def main() -> int:
    page = Path(sys.argv[1])
    folder = Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    if page.name == "authoring.md":
        sys.path.insert(0, str(PROJECT / "tests" / "python" / "support"))
        import face_shapes

        face_shapes.write_all(folder)
    failed = ran = 0
    for language, content in blocks(page.read_text(encoding="utf-8")):
        name = re.match(r"# (\S+\.toml)\n", content)
        if language == "toml" and name:
            (folder / name.group(1)).write_text(content, encoding="utf-8")
        elif language in ("", "bash"):
            for line in content.splitlines():
                if line.startswith("python tests/"):
                    print(f"left out: {line}")
                elif line.strip():
                    ran += 1
                    failed += run(line, folder) != 0
    print(f"{ran - failed} commands passed, {failed} failed; files in {folder}")
    return 1 if failed or not ran else 0


if __name__ == "__main__":
    sys.exit(main())
