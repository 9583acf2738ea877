# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of the last imported file that no mapping knew, and what the user says that they are.

They lie on the control armature as JSON; what is said becomes a mapping of the user's own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field

from ... import native
from ..base import parts, saved, session
from ..base.blender_types import ArmatureObject
from . import assigned


@dataclass(frozen=True)
class Unknown:
    """Curves without a meaning.

    Attributes:
        mapping: that the file was read by: a name, the path of a file, or "" where none knew it.
        settings: what the import was asked for, by the names of the operator's properties.
        names: of the curves.
        said: what the user says that they are, as assigned.Choice has it; "" where one is left out.
    """

    mapping: str
    settings: Mapping[str, object]
    names: Sequence[str]
    said: Mapping[str, str] = field(default_factory=dict)


def of(controls: ArmatureObject) -> Unknown | None:
    """The unknown curves of a face's last import, or None. Args: controls  its control armature."""
    return _parsed(saved.text(controls, parts.CURVES))


@session.cached(("unregister",), 16)
def _parsed(text: str) -> Unknown | None:
    """What a text says; None of one that somebody else wrote."""
    try:
        found = Unknown(**json.loads(text))
        said = {str(name): str(value) for name, value in found.said.items()}
        names = [str(name) for name in found.names]
        return Unknown(str(found.mapping), dict(found.settings), names, said) if names else None
    except (ValueError, TypeError, AttributeError):
        return None


def keep(controls: ArmatureObject, found: Unknown) -> None:
    """Remember unknown curves; what was said of curves of these names before still counts.

    Args:
        controls: the control armature.
        found: of no names: there are none, and those of before are forgotten.
    """
    before = of(controls)
    if not found.names:
        if parts.CURVES in controls:
            del controls[parts.CURVES]
        return
    said = {**(before.said if before is not None else {}), **found.said}
    mine = {name: said[name] for name in found.names if name in said}
    controls[parts.CURVES] = json.dumps(asdict(found) | {"said": mine})


def put(controls: ArmatureObject, name: str, value: str | None) -> None:
    """Store the meaning that the user gave to a curve of an imported file.

    Args:
        controls: the control armature.
        name: of the curve.
        value: of an assigned.Choice; "": it is left out; None: nothing is said.
    """
    found = of(controls)
    if found is None or name not in found.names:
        return
    said = {key: one for key, one in found.said.items() if key != name}
    if value is not None:
        said[name] = value
    controls[parts.CURVES] = json.dumps(asdict(found) | {"said": said})


def mapping_text(found: Unknown) -> str:
    """The mapping that the file was read by, with what the user said.

    Args:
        found: of a face.

    Raises:
        MappingError: the mapping of before cannot be read.
    """
    rows = {name: _row(value) for name, value in found.said.items()}
    text: str = native.part("importing").mapping_with(found.mapping, rows)
    return text


def _row(value: str) -> Mapping[str, float]:
    if value.startswith("@"):
        return {value: 1.0}
    return assigned.weights_of(value) if value else {}
