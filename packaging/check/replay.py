# SPDX-License-Identifier: MIT
"""Runs the commands of a page of docs/ in its order, in a folder of their own.

python packaging/check/replay.py docs/authoring.md [FOLDER]

Blocks of TOML that begin with a file's name are written, blocks of commands are run line by line
with the `risorius` beside this Python; what needs the project's tree (python tests/...) is named
and left out. What a page begins with is made first: the head of docs/authoring.md is the formula's
face of face_shapes.py, in tests/python/support; those of docs/anyhead.md are packaging/films/
any_heads.py's, and in the end there is a sheet of each face, to be looked at.
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
    """The head of docs/authoring.md. Args: folder  where it is written."""
    sys.path.insert(0, str(PROJECT / "tests" / "python" / "support"))
    import face_shapes

    face_shapes.write_all(folder)


def any_heads(folder: Path) -> None:
    """Heads, a face and a word that is said, of docs/anyhead.md. Args: folder  for all of them."""
    films = PROJECT / "packaging" / "films"
    subprocess.run([sys.executable, str(films / "any_heads.py"), str(folder)], check=True)
    shutil.copy(PROJECT / "build" / "sample" / "man.dna", folder)


def sheets(folder: Path) -> None:
    """A picture of each face that was made, and of all as they speak. Args: folder  has them."""
    maker = [sys.executable, str(PROJECT / "packaging" / "films" / "any_heads_sheet.py")]
    faces = [str(face) for face in sorted(folder.glob("*.dna"))]
    for face in faces:
        subprocess.run([*maker, face, face.removesuffix(".dna") + ".png"], check=True)
    subprocess.run([*maker, *faces, str(folder / "beside.png")], check=True)
    spoken = [*faces, str(folder / "said.rzc"), str(folder / "speaking.png")]
    subprocess.run([*maker, *spoken], check=True)


# By the name of the page: what comes before it, and after it.
AROUND = {"authoring.md": (formula_face, None), "anyhead.md": (any_heads, sheets)}


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
