# SPDX-License-Identifier: GPL-3.0-or-later
"""The only module that imports the `risorius` wheel, which the extension bundles."""

from __future__ import annotations

import re
import sys
import tomllib
from functools import cache, partial
from importlib import import_module, metadata, resources
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, TypedDict, cast

from .logic.base.errors import FaceError
from .logic.base.face_regions import FaceRegions
from .logic.base.sentences import told

if TYPE_CHECKING:  # for annotations only; no other module may import the wheel
    from risorius import (  # noqa: F401  # noqa: F401
        BoneSpace,
        Clip,
        ControlLimits,
        DirectFace,
        Dna,
        JointChain,
        Layer,
        Mesh,
        Mixer,
        Morph,
        Pose,
        Rig,
        Skin,
        SolvedClip,
        Surface,
    )
    from risorius.anim.reactions import Reaction  # noqa: F401
    from risorius.anyhead.conform.head import Conformed  # noqa: F401
    from risorius.anyhead.landmarks.marks import Landmarks  # noqa: F401
    from risorius.anyhead.onto import Onto  # noqa: F401
    from risorius.anyhead.surface import Surface as HeadSurface  # noqa: F401
    from risorius.author import JointRig  # noqa: F401
    from risorius.author.heads.parts import HeadPart  # noqa: F401
    from risorius.author.input.shape_face import ShapeSet  # noqa: F401
    from risorius.author.input.spec import Read  # noqa: F401
    from risorius.controls.control_names import ControlNames  # noqa: F401
    from risorius.expressions import Expression  # noqa: F401
    from risorius.importing import Report  # noqa: F401
    from risorius.live import Frame, Receiver, Shaper, Take  # noqa: F401
    from risorius.ranges import Ranges  # noqa: F401

_risorius: ModuleType | None
try:
    import risorius as _found
except ImportError as _error:
    _risorius = None
    _reason = str(_error)
else:
    _risorius = _found
    _reason = ""

_HERE = Path(__file__).parent
ADDON = str(__package__)  # the name by which Blender knows this add-on


@cache
def addon_version() -> str:
    """The version of the add-on, from its manifest."""
    text = (_HERE / "blender_manifest.toml").read_text(encoding="utf-8")
    found = re.search(r'^version = "([^"]+)"', text, re.MULTILINE)
    return found.group(1) if found else "unknown"


@cache
def website() -> str:
    """The address of the documentation with a final slash, or "" if the manifest has none."""
    text = (_HERE / "blender_manifest.toml").read_text(encoding="utf-8")
    found = re.search(r'^website = "([^"]+)"', text, re.MULTILINE)
    return found.group(1).rstrip("/") + "/" if found else ""


def other_copy() -> str:
    """The module of an enabled copy of this add-on from another repository; "" if there is none."""
    last = ADDON.rpartition(".")[2]
    for name, module in list(sys.modules.items()):
        same = name.startswith("bl_ext.") and name.count(".") == 2 and name.endswith(f".{last}")
        if same and name != ADDON and getattr(module, "__addon_enabled__", False):
            return name
    return ""


def installed_version() -> str:
    """The version of the wheel on disk; after an update it differs from the loaded version."""
    try:
        return metadata.version("risorius")
    except metadata.PackageNotFoundError:
        return ""


def problem() -> str:
    """Why the native module cannot be used, in one or two sentences; "" if it can be used."""
    running = f"{sys.version_info.major}.{sys.version_info.minor}"
    if _risorius is None:
        wheels = sorted(p.name for p in (_HERE / "wheels").glob("*.whl"))
        tags = sorted({t for w in wheels for t in re.findall(r"-cp3(\d+)-", w)}, key=int)
        have = ", ".join(f"3.{t}" for t in tags) if tags else told("no version of Python")
        return told(
            "The native module for Python {running} is missing: this package has wheels for "
            "{have}. Install the package made for this Blender. ({reason})",
            running=running,
            have=have,
            reason=_reason,
        )
    version = getattr(_risorius, "__version__", "unknown")
    if version != addon_version() == installed_version():
        return told(
            "Risorius was updated from {version} to {own} while it was in use: save your work and "
            "restart Blender.",
            version=version,
            own=addon_version(),
        )
    if version != addon_version():
        return told(
            "The native module is version {version}, the add-on is {own}. "
            "Install the add-on anew, then restart Blender.",
            version=version,
            own=addon_version(),
        )
    return ""


def module() -> ModuleType:
    """The `risorius` package.

    Raises:
        UnusableError: the package is missing or has another version, as the text says.
    """
    trouble = problem()
    if trouble or _risorius is None:
        raise UnusableError(trouble)
    return _risorius


def bundled_sample(person: str) -> Path | None:
    """The DNA file of a sample person that is bundled with the add-on, or None.

    Args:
        person: name of the person, as in the package's PEOPLE.
    """
    path = _HERE / "sample" / f"{person}.dna"
    return path if path.is_file() else None


def sample_module() -> ModuleType:
    """The package that makes sample people; it is loaded only when a person is built.

    Raises:
        UnusableError: a wheel is missing or has another version, as the text says.
    """
    finder = part("people")
    try:
        return finder.people()
    except finder.NoPeopleError as error:
        raise UnusableError(str(error)) from error


def part(name: str) -> ModuleType:
    """A module of the `risorius` package, loaded at its first use.

    Args:
        name: name of the module inside the package, such as `importing` or `speech`.

    Raises:
        UnusableError: the wheel is missing, has another version or lacks the module, as the text
            says.
    """
    module()
    try:
        return import_module(f"risorius.{name}")
    except ModuleNotFoundError as error:
        # The error may name a parent folder instead of the module. An error about any other module
        # is a fault of the program.
        if not error.name or not f"risorius.{name}.".startswith(f"{error.name}."):
            raise
        raise UnusableError(
            told("The native module has no {name}: install the add-on anew.", name=name)
        ) from error


@cache
def regions() -> FaceRegions:
    """The regions of a face; the object has no regions if the native module cannot be used."""
    if problem():
        return FaceRegions({}, lambda _: "", lambda _: "")
    known, sides = part("controls.regions"), part("controls.sides")
    of_slider = partial(known.region_of, by_last_part=True)
    return FaceRegions(
        known.TITLES, of_slider, known.region_of, sides.mirrored_name, sides.name_across
    )


class LiveSource(TypedDict):
    """A program that sends captured faces, as a table of the file live/sources.toml describes it.

    The file is a part of the `risorius` wheel.
    """

    port: int  # UDP port
    title: str
    description: str


@cache
def live_sources() -> dict[str, LiveSource]:
    """Programs that send captured faces, by name; empty if the native module cannot be used.

    Blender needs these names when it starts. To be quick, this reads only the TOML file and loads
    no receiver.
    """
    if problem():
        return {}
    file = resources.files("risorius").joinpath("live/sources.toml")
    return cast(dict[str, LiveSource], tomllib.loads(file.read_text(encoding="utf-8")))


def dna_error() -> type[Exception]:
    """The class of errors about bad DNA files; `_Never` if the native module is missing."""
    return _risorius.DnaError if _risorius is not None else _Never


def user_errors() -> tuple[type[Exception], ...]:
    """The errors that an operator reports, because a user can mend them.

    Any other exception is a fault of the program and must stay visible.
    """
    return FaceError, getattr(_risorius, "RisoriusError", _Never), OSError


class UnusableError(FaceError, RuntimeError):
    """The native module is missing, has another version, or lacks a module of the package."""


class _Never(Exception):  # noqa: N818
    """A class that is never raised; used if the native module is missing."""
