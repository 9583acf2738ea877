# SPDX-License-Identifier: MIT
"""The licence fields of a VRM file; a person must state them, they are never assumed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ...base import toml
from ...base.words import joined
from ..errors import GameFaceError

VERSIONS = ("1.0", "0.x")
TEXT, TEXTS, YES_NO = "a text", "a list of texts", "true or false"
# Field with its VRM 1.0 name -> kind of its value, or the allowed values.
_BOTH: dict[str, str | tuple[str, ...]] = {
    "name": TEXT,
    "authors": TEXTS,
    "avatarPermission": ("onlyAuthor", "onlySeparatelyLicensedPerson", "everyone"),
    "allowExcessivelyViolentUsage": YES_NO,
    "allowExcessivelySexualUsage": YES_NO,
    "commercialUsage": ("personalNonProfit", "personalProfit", "corporation"),
}
ASKED: dict[str, dict[str, str | tuple[str, ...]]] = {
    "1.0": {
        **_BOTH,
        "allowPoliticalOrReligiousUsage": YES_NO,
        "allowAntisocialOrHateUsage": YES_NO,
        "creditNotation": ("required", "unnecessary"),
        "allowRedistribution": YES_NO,
        "modification": ("prohibited", "allowModification", "allowModificationRedistribution"),
    },
    "0.x": {
        **_BOTH,
        "licenseName": (
            "Redistribution_Prohibited", "CC0", "CC_BY", "CC_BY_NC", "CC_BY_SA", "CC_BY_NC_SA",
            "CC_BY_ND", "CC_BY_NC_ND", "Other",
        ),
    },
}  # fmt: skip
"""Version -> required field -> kind of its value, or the allowed values."""
_MORE: dict[str, str | tuple[str, ...]] = {
    "version": TEXT, "copyrightInformation": TEXT, "contactInformation": TEXT,
    "references": TEXTS, "thirdPartyLicenses": TEXT, "otherLicenseUrl": TEXT,
}  # fmt: skip
_USERS = {
    "onlyAuthor": "OnlyAuthor", "onlySeparatelyLicensedPerson": "ExplicitlyLicensedPerson",
    "everyone": "Everyone",
}  # fmt: skip


def read(path: Path, version: str) -> dict[str, Any]:
    """Reads and checks a TOML file with a licence.

    Args:
        path: path of the file.
        version: VRM version, "1.0" or "0.x".

    Raises:
        GameFaceError: a field is missing, empty, unknown, or has a value that is not allowed.
        ArgumentError: not a TOML file.
        OSError: the file cannot be read.
    """
    return checked(toml.read(path), version, str(path))


def checked(table: Mapping[str, Any], version: str, where: str) -> dict[str, Any]:
    """Checks the fields of a licence, and returns them.

    Args:
        table: field with its VRM 1.0 name -> value.
        version: VRM version, "1.0" or "0.x".
        where: source of the fields, for errors.

    Raises:
        GameFaceError: a field is missing, empty, unknown, or has a value that is not allowed.
    """
    asked = ASKED[version]
    known = {**asked, **_MORE, **{f: k for own in ASKED.values() for f, k in own.items()}}
    for field, value in table.items():
        if field not in known:
            raise GameFaceError(f"{where}: {field}: a field of {joined(known)} was expected")
        if not _is_good(value, known[field]):
            raise GameFaceError(
                f"{where}: {field}: {_said(known[field])} was expected, found {value!r}"
            )
    if missing := [field for field in asked if field not in table]:
        raise GameFaceError(
            f"{where}: VRM {version} asks for {joined(missing)}: say each "
            "of these fields, because Risorius assumes no licence"
        )
    return dict(table)


def _is_good(value: object, kind: str | tuple[str, ...]) -> bool:
    if kind == YES_NO:
        return isinstance(value, bool)
    if kind == TEXTS:
        return isinstance(value, list) and bool(value) and all(_is_text(one) for one in value)
    return _is_text(value) and (kind == TEXT or value in kind)


def _is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _said(kind: str | tuple[str, ...]) -> str:
    if isinstance(kind, str):
        return kind
    return f"{', '.join(kind[:-1])} or {kind[-1]}"


def meta_1(said: Mapping[str, Any]) -> dict[str, Any]:
    """The meta table of VRM 1.0. Args: said: licence fields from `checked`."""
    own = {**ASKED["1.0"], **_MORE}
    out = {field: value for field, value in said.items() if field in own}
    return {**out, "licenseUrl": "https://vrm.dev/licenses/1.0/"}


def meta_0(said: Mapping[str, Any]) -> dict[str, Any]:
    """The meta table of VRM 0.x. Args: said: licence fields from `checked`."""
    out = {
        "title": said["name"],
        "author": ", ".join(said["authors"]),
        "allowedUserName": _USERS[said["avatarPermission"]],
        "violentUssageName": _allowed(said["allowExcessivelyViolentUsage"]),
        "sexualUssageName": _allowed(said["allowExcessivelySexualUsage"]),
        "commercialUssageName": _allowed(said["commercialUsage"] != "personalNonProfit"),
        "licenseName": said["licenseName"],
    }
    return {**out, **dict(_more_of_0(said))}


def _more_of_0(said: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for field in ("version", "contactInformation", "otherLicenseUrl"):
        if field in said:
            yield field, said[field]
    if "references" in said:
        yield "reference", ", ".join(said["references"])


def _allowed(value: bool) -> str:
    return "Allow" if value else "Disallow"
