# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the material of skin: subsurface scattering, pores, and effects of animated maps.

An animated map is a value of the rig that changes colours and normals of the skin in an area, such
as the forehead. A texture set is a numbered set of textures of wrinkled skin.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...logic.material import animated_maps
from ..base import drivers, parts
from ..base.blender_types import Node, Socket
from . import image_loading
from .look import Look
from .nodes import Graph, Value

MAP_PREFIX = "risorius_map_"
AREAS = tuple(f"risorius_areas_{i}" for i in (1, 2, 3))  # mesh attributes: three areas each
# Mesh attribute: x, height and distance from the mouth, as computed by skin_folds.fold_coordinates.
FOLDS = "risorius_folds"
BORDER = "risorius_border"  # mesh attribute: 1 near an open border, 0 far away
_FRAME = "Animated maps"
_TONE, _DARK, _RED = (0.60, 0.35, 0.25), (0.50, 0.26, 0.18), (0.54, 0.22, 0.16)
_FLUSH = (1.0, 0.42, 0.38)
_CREASE = (0.66, 0.49, 0.45)
# Spatial frequency of the folds: phase in radians over the distance between the eyes, for each
# kind of fold.
_PITCH = {"level": 19.0, "upright": 24.0, "rays": 20.0, "arc": 6.0}
_FLUSH_SHARE = 0.22  # factor of blushes without a painted mask, which must stay faint
_PORE_DEPTH = 0.032
_GRAIN_DEPTH = 0.006
# Distance that light travels inside pale skin, divided by the distance between the eyes; smallest
# factor of this distance, for dark skin.
_SUBSURFACE, _DARKEST = 0.026, 0.4
_RADIUS = (1.0, 0.36, 0.2)
_IOR = 1.4
_OILY, _OIL_ROUGHNESS = 0.14, 0.6  # weight of the oily coat; its roughness / the skin's
_FOLD_DEPTH = {"level": 0.45, "upright": 0.45, "rays": 0.35, "arc": 1.8, "dimples": 0.6}

Member = tuple[str, Value]  # side of the face, value of the map


class Bucket(NamedTuple):
    """One effect that animated maps can have on the skin: reddening, a texture set, or folds.

    If several animated maps have the same effect, their values are added.
    """

    kind: str  # "flush", "color", "normal" or "bump"
    number: int = 0  # number of the texture set, for "color" and "normal"
    folds: str = ""  # kind of folds for "bump", see animated_maps.FOLDS


class Mask(NamedTuple):
    """The part of the skin that animated maps affect.

    The part is given by the texture of one map, by a region of the painted masks, or by an area.
    """

    kind: str  # "own", "atlas" or "area"
    place: str = ""  # region for "atlas", area for "area"
    map_index: int = -1  # index of the animated map, for "own"


class Skin:
    """Builds one skin material.

    Args:
        graph: nodes.Graph of the material.
        look: look.Look of the mesh, for all its LODs: sizes, textures, regions of the face.
    """

    def __init__(self, graph: Graph, look: Look) -> None:
        self.graph, self.look = graph, look
        self.points = graph.rest_points(look.extent)
        self.areas = self._areas()
        self.folds: dict[str, Value] | None = None
        self.flush: list[Value] = []
        self.tints: list[tuple[int, Value]] = []
        self.bumps: dict[str, Value] = {}
        self.wrinkles: dict[int, Value] = {}

    def build(self) -> None:
        """Fill the node tree of the material."""
        graph, look = self.graph, self.look
        graph.set(Subsurface_Weight=0.0, Ior=_IOR)
        if not look.simple:
            self._read_maps()
        color, roughness = self._color(), self._roughness()
        graph.set(Base_Color=color, Roughness=roughness)
        if not look.simple:
            self._specular()
            self._subsurface(color)
            normal = self._normal()
            oily = graph.math("MULTIPLY", roughness, _OIL_ROUGHNESS)
            graph.set(Normal=normal, Coat_Normal=normal, Coat_Roughness=oily)
            graph.set(Coat_Weight=_OILY, Coat_Ior=_IOR)

    def _subsurface(self, color: Value) -> None:
        """Set subsurface scattering. Its distance is shorter in dark skin. It is off near an open
        border, because light would leak there."""
        graph, look = self.graph, self.look
        light = graph.node("RGBToBW")
        graph.put(color, light.inputs[0])
        share = graph.math("MULTIPLY_ADD", light.outputs[0], 1.8, _DARKEST)
        far = graph.math("MULTIPLY", graph.math("MINIMUM", share, 1.0), look.unit * _SUBSURFACE)
        weight: Value = 1.0
        if look.border:
            weight = graph.math("SUBTRACT", 1.0, graph.attribute_number(BORDER), clamp=True)
        graph.set(Subsurface_Weight=weight, Subsurface_Radius=_RADIUS, Subsurface_Scale=far)

    def _areas(self) -> dict[str, Socket]:
        """Name of an area -> its mask; "left" is the left half of the face.

        Empty for a mesh without a face.
        """
        if not self.look.areas:
            return {}
        found = {}
        for number, name in enumerate(AREAS):
            three = self.graph.split(self.graph.attribute(name))
            found.update(zip((*animated_maps.AREAS, "left")[3 * number :], three, strict=False))
        return found

    # --- animated maps -------------------------------------------------------------------

    def _read_maps(self) -> None:
        """Add a driven Value node for each animated map that is visible on this mesh.

        Maps with the same effect are summed.
        """
        frame = None
        groups = {}
        for use in self.look.uses:
            targets = self._targets(use)
            if not targets:
                continue
            if frame is None:
                frame = self.graph.tree.nodes.new("NodeFrame")
                frame.label = frame.name = _FRAME
            value = self._value(use, frame)
            for target in targets:
                groups.setdefault(target, []).append((use.side, value))
        sums = {}
        for (bucket, mask), members in groups.items():
            sums.setdefault(bucket, []).append(self._masked(bucket, mask, members))
        for bucket, amounts in sums.items():
            self._file(bucket, amounts)

    def _targets(self, use: animated_maps.MapUse) -> list[tuple[Bucket, Mask]]:
        """The effects of an animated map on this mesh, each with its mask.

        Empty if the map is not visible on this mesh.
        """
        look = self.look
        own = look.image(f"map:{use.label}", data=True)
        if own is not None:
            return [(Bucket("flush"), Mask("own", map_index=use.index))]
        mask = Mask("atlas", use.region) if use.region in look.places else Mask("area", use.area)
        if mask.kind == "area" and use.area != "all" and use.area not in look.areas:
            return []
        found = []
        if use.color:
            whole = use.number and look.image(f"color:{use.number}") is not None
            found.append((Bucket("color", use.number) if whole else Bucket("flush"), mask))
        if use.normal:
            whole = use.number and look.image(f"normal:{use.number}", data=True) is not None
            folds = Bucket("bump", folds=animated_maps.FOLDS[use.area])
            found.append((Bucket("normal", use.number) if whole else folds, mask))
        return found

    def _value(self, use: animated_maps.MapUse, frame: Node) -> Socket:
        value = self.graph.tree.nodes.new("ShaderNodeValue")
        value.name, value.label = f"{MAP_PREFIX}{use.index:03d}", use.label
        value.parent = frame
        path = f'nodes["{value.name}"].outputs[0].default_value'
        driver = self.graph.tree.driver_add(path)
        drivers.plain_driver(
            driver, parts.carrier_of(self.look.rig), f'["{parts.MAPS}"][{use.index}]'
        )
        return value.outputs[0]

    def _masked(self, bucket: Bucket, mask: Mask, members: Sequence[Member]) -> Socket:
        """The sum of the values of animated maps, multiplied by their common mask.

        If the mask is an area, a map of one side of the face affects only this side.

        Args:
            bucket: the effect of the maps.
            mask: the common mask.
            members: side of the face and value of each map.
        """
        graph = self.graph
        if mask.kind == "own":
            use = self.look.uses[mask.map_index]
            own = self.look.image(f"map:{use.label}", data=True)
            picture = graph.image(own, label=use.label, clamp=True)
            return graph.math("MULTIPLY", members[0][1], picture.outputs["Color"])
        if mask.kind == "atlas":
            amount = graph.total([v for _, v in members])
            return graph.math("MULTIPLY", amount, self._atlas_channel(mask.place))
        share = _FLUSH_SHARE if bucket.kind == "flush" else 1.0
        amount = graph.math("MINIMUM", self._sided(members), 1.0)
        amount = graph.math("MULTIPLY", amount, share)
        if mask.place == "all":
            return amount
        return graph.math("MULTIPLY", amount, self.areas[mask.place])

    def _sided(self, members: Sequence[Member]) -> Value:
        left = [v for side, v in members if side != "R"]
        right = [v for side, v in members if side != "L"]
        if len(left) == len(right) == len(members) or "left" not in self.areas:
            return self.graph.total([v for _, v in members])
        a, b = self.graph.total(right), self.graph.total(left)
        return self.graph.mix_number(self.areas["left"], a, b)

    def _atlas_channel(self, region: str) -> Socket:
        column, row, channel, side = self.look.places[region]
        cache = self.__dict__.setdefault("_tiles", {})
        if (column, row) not in cache:
            graph, rim = self.graph, 0.5 / image_loading.TILE  # keeps neighbouring tiles out
            inside = graph.vector("MAXIMUM", graph.uv(), (rim, rim, 0.0))
            inside = graph.vector("MINIMUM", inside, (1 - rim, 1 - rim, 0.0))
            small = graph.vector("SCALE", inside)
            small.node.inputs["Scale"].default_value = 1 / side
            place = graph.vector("ADD", small, (column / side, row / side, 0.0))
            picture = graph.image(self.look.atlas, place, "Wrinkle masks")
            cache[column, row] = graph.split_color(picture.outputs["Color"])
        return cache[column, row][channel]

    def _file(self, bucket: Bucket, amounts: list[Value]) -> None:
        amount = self.graph.total(amounts, clamp=bucket.kind != "flush")
        if bucket.kind == "flush":
            self.flush = amounts
        elif bucket.kind == "color":
            self.tints.append((bucket.number, amount))
        elif bucket.kind == "normal":
            self.wrinkles[bucket.number] = amount
        else:
            self.bumps[bucket.folds] = amount

    # --- colour --------------------------------------------------------------------------

    def _color(self) -> Value:
        graph, look = self.graph, self.look
        base = look.image("color")
        if base is not None:
            color = graph.image(base, label="Colour").outputs["Color"]
        else:
            color = self._tone()
        for number, amount in self.tints:
            color = self._tint(color, number, amount)
        for amount in self.flush:
            color = graph.mix(amount, color, _FLUSH, blend="MULTIPLY")
        creases = self._creases()
        if creases is not None:
            color = graph.mix(creases, color, _CREASE, blend="MULTIPLY")
        cavity = look.image("cavity", data=True)
        if cavity is not None and not look.simple:
            picture = graph.image(cavity, label="Cavity").outputs["Color"]
            color = graph.mix(0.5, color, picture, blend="MULTIPLY")
        return color

    def _tone(self) -> Value:
        """The colour of skin without a texture: blotches, and redder areas of the face."""
        graph, unit = self.graph, self.look.unit
        blotches = graph.noise(self.points, 1.1 / unit, detail=6.0, roughness=0.6)
        color = graph.ramp(blotches, (0.32, _DARK), (0.68, _TONE))
        for area, most in (("nose", 0.45), ("smile", 0.35), ("chin", 0.2), ("lips", 0.5)):
            if area in self.areas:
                amount = graph.math("MULTIPLY", self.areas[area], most)
                color = graph.mix(amount, color, _RED)
        return color

    def _tint(self, color: Value, number: int, amount: Value) -> Value:
        """Mix a colour towards the colour texture of a texture set.

        If the texture stores differences around 0.5, the differences are added instead.

        Args:
            color: the colour without this texture set.
            number: number of the texture set.
            amount: 0 to 1, how much of the texture is mixed in.
        """
        graph = self.graph
        picture = graph.image(self.look.image(f"color:{number}"), label=f"Colour {number}")
        other = picture.outputs["Color"]
        if not self.look.is_offset(f"color:{number}"):
            return graph.mix(amount, color, other)
        # Differences are between gamma-encoded values, so they are added to encoded values.
        gamma = graph.node("Gamma")
        graph.put(color, gamma.inputs[0])
        gamma.inputs[1].default_value = 1 / 2.2
        stored = graph.node("Gamma")
        graph.put(other, stored.inputs[0])
        stored.inputs[1].default_value = 1 / 2.2
        half = graph.math("MULTIPLY", amount, 0.5)  # linear light adds twice the difference
        summed = graph.mix(half, gamma.outputs[0], stored.outputs[0], blend="LINEAR_LIGHT")
        back = graph.node("Gamma")
        graph.put(graph.vector("MAXIMUM", summed, (0.0, 0.0, 0.0)), back.inputs[0])
        back.inputs[1].default_value = 2.2
        return back.outputs[0]

    # --- relief --------------------------------------------------------------------------

    def _ridges(self) -> dict[str, Value]:
        """Kind of fold -> height, 0 in the creases to 1 on the ridges; built only once."""
        if self.folds is not None:
            return self.folds
        graph = self.graph
        self.folds = {}
        if not self.bumps:
            return self.folds
        x, z, away = graph.split(graph.attribute(FOLDS))
        wander = graph.noise(self.points, 2.2 / self.look.unit, detail=3.0)
        for kind in self.bumps:
            if kind == "dimples" or not self.look.areas:
                cells = graph.cells(self.points, 9.0 / self.look.unit)
                self.folds[kind] = graph.math("MINIMUM", cells, 1.0)
                continue
            if kind == "rays":  # crow's feet, which radiate from the outer half of the eye
                aside = graph.math("SUBTRACT", graph.math("ABSOLUTE", x), 0.45)
                turn = graph.math("ARCTAN2", z, graph.math("MAXIMUM", aside, 0.001))
                along = graph.math("MULTIPLY", turn, 0.5)
            else:
                along = {"level": z, "upright": x, "arc": away}[kind]
            sway = 0.03 if kind == "arc" else 0.13
            bent = graph.math("MULTIPLY_ADD", wander, sway, along)
            wave = graph.math("SINE", graph.math("MULTIPLY", bent, _PITCH[kind]))
            self.folds[kind] = graph.math("ABSOLUTE", wave)
        return self.folds

    def _creases(self) -> Value | None:
        """Amount, 0 to 1, by which creases darken and redden the skin; None without folds."""
        graph = self.graph
        deep = []
        for kind, ridge in self._ridges().items():
            sharp = graph.math("POWER", graph.math("SUBTRACT", 1.0, ridge), 5.0)
            deep.append(graph.math("MULTIPLY", sharp, self.bumps[kind]))
        return graph.math("MULTIPLY", graph.total(deep), 0.42, clamp=True) if deep else None

    def _normal(self) -> Socket:
        """The normal of the skin, from a height field of pores and folds.

        There is only one height field, because engines evaluate each height field three times.
        """
        graph, look = self.graph, self.look
        normal = self._normal_map()
        pores = graph.cells(self.points, 75.0 / look.unit)
        grain = graph.noise(self.points, 34.0 / look.unit, detail=2.0, roughness=0.65)
        deep = _PORE_DEPTH * (0.35 if normal else 1.0)  # a normal texture already has pores
        heights = [graph.math("MULTIPLY", graph.math("ADD", pores, grain), deep)]
        # Fine grain for close views, in which the pores of a texture are blurred.
        finest = graph.noise(self.points, 260.0 / look.unit, detail=1.0)
        heights.append(graph.math("MULTIPLY", finest, _GRAIN_DEPTH))
        for kind, ridge in self._ridges().items():
            height = graph.math("MULTIPLY", self.bumps[kind], _FOLD_DEPTH[kind])
            heights.append(graph.math("MULTIPLY", ridge, height))
        return graph.bump(graph.total(heights), look.unit * 0.03, normal)

    def _normal_map(self) -> Socket | None:
        """The normal from the normal textures; None if there are none.

        The normals of the texture sets are mixed into the normal of the base texture; the
        amount of each set is its factor. If a texture stores differences around 0.5, the scaled
        differences are added instead.
        """
        graph, look = self.graph, self.look
        base = look.image("normal", data=True)
        if base is None and not self.wrinkles:
            return None
        flat = (0.5, 0.5, 1.0)
        color = flat
        if base is not None:
            color = graph.image(base, label="Normal").outputs["Color"]
        for number, amount in sorted(self.wrinkles.items()):
            role = f"normal:{number}"
            picture = graph.image(look.image(role, data=True), label=f"Normal {number}")
            if look.is_offset(role):
                half = graph.vector("SUBTRACT", picture.outputs["Color"], (0.5, 0.5, 0.5))
                scaled = graph.vector("SCALE", half)
                graph.put(amount, scaled.node.inputs["Scale"])
                color = graph.vector("ADD", color, scaled)
            else:
                color = graph.mix(amount, color, picture.outputs["Color"])
        node = graph.node("NormalMap")
        graph.put(color, node.inputs["Color"])
        return node.outputs["Normal"]

    def _roughness(self) -> Value:
        graph, look = self.graph, self.look
        picture = look.image("roughness", data=True)
        if picture is not None:
            color = graph.image(picture, label="Roughness").outputs["Color"]
            # glTF textures named *_orm have the roughness in green and the metalness in blue.
            file = look.found.of(look.base, "roughness")
            is_packed = file is not None and file.stem.endswith("_orm")
            return graph.split_color(color)[1] if is_packed else color
        uneven = graph.noise(self.points, 7.0 / look.unit, detail=4.0)
        rough = graph.math("MULTIPLY_ADD", uneven, 0.22, 0.40)
        for area, less in (("nose", 0.10), ("forehead", 0.06), ("lips", 0.14)):
            if area in self.areas:
                rough = graph.math("MULTIPLY_ADD", self.areas[area], -less, rough)
        return rough

    def _specular(self) -> None:
        picture = self.look.image("specular", data=True)
        if picture is not None:
            node = self.graph.image(picture, label="Specular")
            self.graph.set(Specular_Ior_Level=node.outputs["Color"])
