# SPDX-License-Identifier: MIT
"""Runs the commands of a page of docs/ in their order, in a separate folder.

python packaging/check/replay.py docs/authoring.md [FOLDER]

A TOML block that begins with `# NAME.toml` is written to that file. Blocks of commands are run line
by line with the `risorius` beside this Python. Lines that need the project's tree (python
tests/...) are printed and skipped. The input files of a page are made first: the file
tests/python/support/face_shapes.py makes the head of docs/authoring.md, the file
packaging/films/any_heads.py makes the heads of docs/anyhead.md. For docs/anyhead.md, a sheet of
each face is drawn at the end for visual inspection.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def formula_face(folder: Path) -> None:
    """Write the input head of docs/authoring.md into a folder."""
    sys.path.insert(0, str(PROJECT / "tests" / "python" / "support"))
    import face_shapes

    face_shapes.write_all(folder)


def any_heads(folder: Path) -> None:
    """Write the input files of docs/anyhead.md into a folder: heads, a voice and the sample man."""
    films = PROJECT / "packaging" / "films"
    subprocess.run([sys.executable, str(films / "any_heads.py"), str(folder)], check=True)
    shutil.copy(PROJECT / "build" / "sample" / "man.dna", folder)


def sheets(folder: Path) -> None:
    """Draw a sheet of each DNA file in a folder, one of all faces, and one of all faces that speak
    a clip."""
    maker = [sys.executable, str(PROJECT / "packaging" / "films" / "any_heads_sheet.py")]
    faces = [str(face) for face in sorted(folder.glob("*.dna"))]
    for face in faces:
        subprocess.run([*maker, face, face.removesuffix(".dna") + ".png"], check=True)
    subprocess.run([*maker, *faces, str(folder / "beside.png")], check=True)
    spoken = [*faces, str(folder / "said.rzc"), str(folder / "speaking.png")]
    subprocess.run([*maker, *spoken], check=True)


# Name of a page -> (function that makes its input files, function that runs after its commands).
AROUND = {"authoring.md": (formula_face, None), "anyhead.md": (any_heads, sheets)}


def blocks(text: str) -> list[tuple[str, str]]:
    """The language and the content of each fenced block."""
    return [(found.group(1), found.group(2)) for found in BLOCK.finditer(text)]


def run(line: str, folder: Path) -> int:
    """Run a command of the page and show its output. Returns the exit code.

    Args:
        line: the command line.
        folder: working folder.
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
    before, after = AROUND.get(page.name, (None, None))
    if before is not None:
        before(folder)
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
    if after is not None:
        after(folder)
    print(f"{ran - failed} commands passed, {failed} failed; files in {folder}")
    return 1 if failed or not ran else 0


if __name__ == "__main__":
    sys.exit(main())
