# SPDX-License-Identifier: MIT
"""The parts of a release that release.sh puts together.

    make.py check VERSION             checks whether the tree can be released; prints the reasons if
                                      not
    make.py notes VERSION             prints the section of CHANGELOG.md
    make.py zips OUT --wheels WHEEL... [--sample FOLDER] [--website URL]
                                      makes a zip with all wheels and, with Blender's extension
                                      tool, a zip for each platform; prints their paths
    make.py repository OUT ZIP...     makes an extension repository with a page, with Blender's tool
    make.py sums OUT                  writes SHA256SUMS of all files below OUT

Equal sources give equal bytes, because zips have a fixed date and tables a fixed order.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from importlib.util import find_spec
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(PROJECT / "packaging" / "ship"))

import build_extension  # noqa: E402

# Files that contain the version -> the pattern that finds it.
VERSIONS = {
    "pyproject.toml": r'^version = "([^"]+)"',
    "native/python/risorius/base/version.py": r'^__version__ = "([^"]+)"',
    "addon/risorius/blender_manifest.toml": r'^version = "([^"]+)"',
}
# Largest size in bytes of a zip for one platform. The zip contains at most three wheels of
# 4 MB, a sample face of 8 MB, and small files.
LARGEST = 24 << 20


def troubles(version: str, project: Path = PROJECT) -> list[str]:
    """The reasons why this tree cannot be released as a version, one sentence each.

    Args:
        version: version such as 1.2.3.
        project: the folder of the clone.
    """

    def git(*words: str) -> str:
        command = ["git", "-C", str(project), *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return done.stdout.strip()

    found = []
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        found.append(f"{version} is no version as 1.2.3.")
    for name, pattern in VERSIONS.items():
        text = (project / name).read_text(encoding="utf-8")
        here = re.search(pattern, text, re.MULTILINE)
        if here is None or here.group(1) != version:
            found.append(f"{name} has version {here.group(1) if here else 'none'}, not {version}.")
    if not section(version, project):
        found.append(f"CHANGELOG.md has no section [{version}].")
    if git("status", "--porcelain"):
        found.append("Files differ from what is committed: commit or remove them.")
    if f"v{version}" not in git("tag", "--points-at", "HEAD").split():
        found.append(f"HEAD has no tag v{version}: git tag -a v{version}.")
    return found


def section(version: str, project: Path = PROJECT) -> str:
    """The section of CHANGELOG.md about a version, without the heading; "" if there is none.

    Args:
        version: version such as 1.2.3.
        project: the folder of the clone.
    """
    text = (project / "CHANGELOG.md").read_text(encoding="utf-8")
    parts = re.split(r"^## \[([^\]]+)\].*$", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True)).get(version, "").strip()


def blender_tool() -> list[str]:
    """The command that runs the extension tool of the installed bpy."""
    spec = find_spec("bpy")
    if spec is None or spec.origin is None:
        raise SystemExit("bpy is not installed: packaging/setup.sh, make_venv.")
    found = sorted(Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"))
    return [sys.executable, str(found[-1])]


def tool(*words: str | Path) -> None:
    """Run Blender's extension tool.

    Args:
        words: subcommand and arguments.

    Raises:
        SystemExit: the tool fails or prints a warning; the message contains its output.
    """
    command = [*blender_tool(), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode or "WARN" in done.stdout + done.stderr:
        raise SystemExit(f"{words[0]}: {done.stdout}{done.stderr}")


def plain(package: Path) -> None:
    """Rewrite a zip so that its bytes do not depend on time and machine."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        with zipfile.ZipFile(package) as archive:
            archive.extractall(root)
        build_extension.write_zip(root, package)


def make_zips(out: Path, wheels: list[Path], sample: Path | None, website: str = "") -> list[Path]:
    """Make a zip with all wheels and a zip for each platform. Returns their paths in this order.

    Args:
        out: folder of the zips.
        wheels: wheels of risorius, one for each Python and platform.
        sample: folder with the sample face, or None.
        website: address of the documentation, to which Blender's Online Manual links.

    Raises:
        SystemExit: versions differ, Blender's tool rejects a zip, or a zip is larger than LARGEST.
    """
    pure = [
        build_extension.people_wheel(wheels),
        *build_extension.fetch_pinned(PROJECT / "build" / "dist" / "pure"),
    ]
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder) / "risorius"
        version = build_extension.make_tree(wheels, root, pure, sample, website)
        whole = out / f"risorius-{version}.zip"
        build_extension.write_zip(root, whole)
        split = Path(folder) / "split"
        split.mkdir()
        tool("build", "--source-dir", root, "--output-dir", split, "--split-platforms")
        made = []
        for package in sorted(split.glob("*.zip")):
            plain(package)
            made.append(Path(shutil.move(package, out / package.name.replace("_", "-"))))
    for package in made:
        tool("validate", package)
        if package.stat().st_size > LARGEST:
            raise SystemExit(f"{package.name} has more than {LARGEST:,} bytes.")
    tool("validate", whole)
    return [whole, *made]


def make_repository(out: Path, packages: list[Path]) -> None:
    """Make an extension repository: a folder with zips, index.json and a page for a web server.

    Args:
        out: the folder; its content is deleted first.
        packages: one zip for each platform.

    Raises:
        SystemExit: Blender's tool fails or leaves out a zip.
    """
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    for package in packages:
        shutil.copy(package, out)
    template = Path(__file__).with_name("page.html")
    tool("server-generate", "--repo-dir", out, "--html", "--html-template", template)
    index = out / "index.json"
    listed = json.loads(index.read_text(encoding="utf-8"))
    listed["data"].sort(key=lambda row: row["archive_url"])
    if len(listed["data"]) != len(packages):
        raise SystemExit(f"{len(listed['data'])} of {len(packages)} zips are in the repository.")
    index.write_text(json.dumps(listed, indent=2) + "\n", encoding="utf-8")
    page = out / "index.html"
    text = page.read_text(encoding="utf-8")
    page.write_text(re.sub(r"<!-- .* -->\n", "", text), encoding="utf-8")


def make_sums(out: Path) -> None:
    """Write SHA256SUMS of every file below a folder, in the format of `sha256sum -c`."""
    lines = []
    for path in sorted(out.rglob("*")):
        if path.is_file() and path.name != "SHA256SUMS":
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            lines.append(f"{digest}  {path.relative_to(out).as_posix()}\n")
    (out / "SHA256SUMS").write_text("".join(lines), encoding="utf-8")


def parse() -> argparse.Namespace:
    """The parsed command line arguments."""
    parser = argparse.ArgumentParser(description=__doc__)
    kinds = parser.add_subparsers(dest="kind", required=True)
    for kind in ("check", "notes"):
        kinds.add_parser(kind).add_argument("version")
    zips = kinds.add_parser("zips")
    zips.add_argument("out", type=Path)
    zips.add_argument("--wheels", nargs="+", type=Path, required=True)
    zips.add_argument("--sample", type=Path)
    zips.add_argument("--website", default="")
    repository = kinds.add_parser("repository")
    repository.add_argument("out", type=Path)
    repository.add_argument("packages", nargs="+", type=Path)
    kinds.add_parser("sums").add_argument("out", type=Path)
    return parser.parse_args()


def main() -> int:
    """Run one subcommand. `check` gives exit code 1 if the tree cannot be released."""
    args = parse()
    if args.kind == "check":
        found = troubles(args.version)
        print("\n".join(found), end="\n" if found else "")
        return 1 if found else 0
    if args.kind == "notes":
        print(section(args.version))
    elif args.kind == "zips":
        print("\n".join(map(str, make_zips(args.out, args.wheels, args.sample, args.website))))
    elif args.kind == "repository":
        make_repository(args.out, args.packages)
    else:
        make_sums(args.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
