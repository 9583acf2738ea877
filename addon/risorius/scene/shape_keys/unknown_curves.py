# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores the curves of the last import that match no control, and the user's assignments.

The control armature stores them as JSON. The assignments can be added to a mapping.
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
    """Unknown curves of an import.

    Attributes:
        mapping: mapping of the import: a name, the path of a file, or "" for none.
        settings: settings of the import by the operator's property names.
        names: names of the curves.
        said: name of a curve -> value of an assigned.Choice; "" for curves to leave out.
    """

    mapping: str
    settings: Mapping[str, object]
    names: Sequence[str]
    said: Mapping[str, str] = field(default_factory=dict)


def of(controls: ArmatureObject) -> Unknown | None:
    """The unknown curves of a face's last import, or None.

    Args:
        controls: the character's control armature.
    """
    return _parsed(saved.text(controls, parts.CURVES))


@session.cached(("unregister",), 16)
def _parsed(text: str) -> Unknown | None:
    """Parse a stored text; None if it is invalid."""
    try:
        found = Unknown(**json.loads(text))
        said = {str(name): str(value) for name, value in found.said.items()}
        names = [str(name) for name in found.names]
        return Unknown(str(found.mapping), dict(found.settings), names, said) if names else None
    except (ValueError, TypeError, AttributeError):
        return None


def keep(controls: ArmatureObject, found: Unknown) -> None:
    """Store unknown curves; earlier assignments of the same names stay.

    Args:
        controls: the control armature.
        found: the curves; if it has no names, the stored curves are removed.
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
        name: name of the curve.
        value: value of an assigned.Choice; "" leaves the curve out; None removes the assignment.
    """
    found = of(controls)
    if found is None or name not in found.names:
        return
    said = {key: one for key, one in found.said.items() if key != name}
    if value is not None:
        said[name] = value
    controls[parts.CURVES] = json.dumps(asdict(found) | {"said": said})


def mapping_text(found: Unknown) -> str:
    """The text of the import's mapping with the user's assignments added.

    Args:
        found: unknown curves of a face.

    Raises:
        MappingError: the earlier mapping cannot be read.
    """
    rows = {name: _row(value) for name, value in found.said.items()}
    text: str = native.part("importing").mapping_with(found.mapping, rows)
    return text


def _row(value: str) -> Mapping[str, float]:
    if value.startswith("@"):
        return {value: 1.0}
    return assigned.weights_of(value) if value else {}
