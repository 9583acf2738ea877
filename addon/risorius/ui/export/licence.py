# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The form for the licence in a VRM file; all fields are unset until the user sets them."""

from collections.abc import Iterator

import bpy

_UNSAID = ("UNSAID", "Not Said", "Not chosen yet; a VRM file must state this field")
_YES, _NO = "ALLOWED", "FORBIDDEN"


def _choice(name: str, *items: tuple[str, str, str]) -> object:
    return bpy.props.EnumProperty(name=name, items=(_UNSAID, *items), default="UNSAID")


def _allowed(name: str) -> object:
    return _choice(name, (_YES, "Allowed", ""), (_NO, "Not Allowed", ""))


class LicenceForm:
    """The fields of a VRM's licence, as properties of the export operator."""

    vrm: bpy.props.EnumProperty(
        name="VRM",
        description="Write a VRM file, which viewers and games for avatars read",
        items=(
            ("NONE", "None", "A glTF file without data for VRM"),
            ("1.0", "VRM 1.0", "For three-vrm and newer programs"),
            ("0.x", "VRM 0.x", "For older programs"),
        ),
    )
    title: bpy.props.StringProperty(name="Name", description="Name of the character")
    authors: bpy.props.StringProperty(
        name="Authors", description="Names of the authors, separated by commas"
    )
    avatar: _choice(
        "Who May Use the Avatar",
        ("onlyAuthor", "The Author", ""),
        ("onlySeparatelyLicensedPerson", "Separately Licensed Persons", ""),
        ("everyone", "Everyone", ""),
    )
    violence: _allowed("Violence")
    sexuality: _allowed("Sexuality")
    commerce: _choice(
        "Commercial Use",
        ("personalNonProfit", "Persons without Profit", ""),
        ("personalProfit", "Persons", ""),
        ("corporation", "Companies", ""),
    )
    politics: _allowed("Politics and Religion")
    hate: _allowed("Antisocial Use")
    credit: _choice(
        "Naming the Author", ("required", "Required", ""), ("unnecessary", "Not Required", "")
    )
    redistribution: _allowed("Passing It On")
    modification: _choice(
        "Changes",
        ("prohibited", "Not Allowed", ""),
        ("allowModification", "Allowed", ""),
        ("allowModificationRedistribution", "Allowed, with Redistribution", ""),
    )
    licence_name: bpy.props.EnumProperty(
        name="Licence",
        items=(
            _UNSAID, ("Redistribution_Prohibited", "Not Passed On", ""), ("CC0", "CC0", ""),
            ("CC_BY", "CC BY", ""), ("CC_BY_NC", "CC BY-NC", ""), ("CC_BY_SA", "CC BY-SA", ""),
            ("CC_BY_NC_SA", "CC BY-NC-SA", ""), ("CC_BY_ND", "CC BY-ND", ""),
            ("CC_BY_NC_ND", "CC BY-NC-ND", ""), ("Other", "Other", ""),
        ),
    )  # fmt: skip

    def draw_licence(self, layout: bpy.types.UILayout) -> None:
        """Draw the licence fields of the chosen VRM version.

        Args:
            layout: layout of the dialog.
        """
        for name, _ in self._fields():
            layout.prop(self, name)

    def licence(self) -> dict[str, str | bool | list[str]]:
        """VRM's name of a field -> value, without the fields that the user left unset."""
        out: dict[str, str | bool | list[str]] = {}
        for name, field in self._fields():
            value = getattr(self, name)
            if field == "authors":
                value = [one.strip() for one in value.split(",") if one.strip()]
            elif value in (_YES, _NO):
                value = value == _YES
            if value not in ("", [], "UNSAID"):
                out[field] = value
        return out

    def _fields(self) -> Iterator[tuple[str, str]]:
        yield from (("title", "name"), ("authors", "authors"), ("avatar", "avatarPermission"))
        yield from (
            ("violence", "allowExcessivelyViolentUsage"),
            ("sexuality", "allowExcessivelySexualUsage"),
            ("commerce", "commercialUsage"),
        )
        if self.vrm == "0.x":
            yield "licence_name", "licenseName"
            return
        yield from (
            ("politics", "allowPoliticalOrReligiousUsage"),
            ("hate", "allowAntisocialOrHateUsage"),
            ("credit", "creditNotation"),
            ("redistribution", "allowRedistribution"),
            ("modification", "modification"),
        )
