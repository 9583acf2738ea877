# SPDX-License-Identifier: MIT
"""Tests the logic of materials: textures by name, effects of animated maps, folds of a face."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import test_addon_logic  # loads the package of the add-on's logic under its own name

assert test_addon_logic.LOGIC.is_dir()
textures = importlib.import_module("risorius_addon_logic.material.texture_search")
maps = importlib.import_module("risorius_addon_logic.material.animated_maps")
folds = importlib.import_module("risorius_addon_logic.material.skin_folds")

MESHES = [
    ("head", "skin"),
    ("body", "skin"),
    ("teeth", "teeth"),
    ("eyeLeft", "eyes"),
    ("eyeRight", "eyes"),
    ("eyelashes", "lashes"),
    ("eyeshell", "wet"),
]


class TestNames:
    @pytest.mark.parametrize(
        ("stem", "said"),
        [
            ("head_color_map", ("head", "", "color")),
            ("head_cm2_color_map", ("head", "", "color:2")),
            ("HEAD_WM3_NORMAL_MAP", ("head", "", "normal:3")),
            ("head_roughness_map", ("head", "", "roughness")),
            ("head_specular_map", ("head", "", "specular")),
            ("head_cavity_map", ("head", "", "cavity")),
            ("eyes_color_map", ("eyes", "", "color")),
            ("eyeLeft_normal_map", ("eyes", "left", "normal")),
            ("eyelashes_color_map", ("lashes", "", "color")),
            ("teeth_normal_map", ("teeth", "", "normal")),
            ("T_Head_BC", ("head", "", "color")),
            ("T_head_N", ("head", "", "normal")),
            ("Head_Basecolor", ("head", "", "color")),
            ("Head_BaseColor_MAIN", ("head", "", "color")),
            ("Head_Basecolor_Animated_CM1", ("head", "", "color:1")),
            ("Head_Normal_Animated_WM2", ("head", "", "normal:2")),
            ("FaceColor_MAIN", ("head", "", "color")),
            ("FaceNormal_WM3", ("head", "", "normal:3")),
            ("FaceRoughness_MAIN", ("head", "", "roughness")),
            ("Color_MAIN", ("head", "", "color")),
            ("Normal_WM1", ("head", "", "normal:1")),
            ("Ada_head_color_map_2k", ("head", "", "color")),
            ("Body_Basecolor", ("body", "", "color")),
            ("Teeth_Color", ("teeth", "", "color")),
        ],
    )
    def test_names_of_all_exports(self, stem: str, said: tuple[str, str, str]) -> None:
        assert textures.read_name(stem) == said

    @pytest.mark.parametrize(
        "stem",
        ["holiday", "head", "color", "head_color_backup", "head_wm1_msk_01", "n", "Head_SRMF", ""],
    )
    def test_other_names_say_nothing(self, stem: str) -> None:
        assert textures.read_name(stem) is None

    def test_masks_of_one_region_and_of_four(self) -> None:
        assert textures.read_mask("head_wm1_blink_L_msk") == {"head_wm1_blink_l": 0}
        assert textures.read_mask("head_wm13_lips_DL") == {"head_wm13_lips_dl": 0}
        assert textures.read_mask("T_head_wm1_msk_03") == {
            "head_wm1_jawopen": 0,
            "head_wm1_purse_dl": 1,
            "head_wm1_purse_dr": 2,
            "head_wm1_purse_ul": 3,
        }
        for stem in ("head_wm1_normal_map", "head_wm1_msk_99", "head_color_map"):
            assert textures.read_mask(stem) == {}, stem


def _touch(folder: Path, *names: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / name).write_bytes(b"")


class TestFinding:
    def test_every_mesh_gets_its_own(self, tmp_path: Path) -> None:
        _touch(tmp_path / "Maps", "head_color_map.tga", "head_color_map.png", "eyes_color_map.jpg")
        _touch(tmp_path / "Maps", "eyeRight_color_map.tga", "T_Body_N.png", "notes.txt")
        _touch(tmp_path / "Masks", "head_wm1_msk_01.tga")
        found = textures.find({}, MESHES, textures.folders_of(tmp_path / "ada.dna"))
        assert {k: p.name for k, p in found.files.items()} == {
            ("head", "color"): "head_color_map.png",
            ("eyeLeft", "color"): "eyes_color_map.jpg",
            ("eyeRight", "color"): "eyeRight_color_map.tga",
            ("body", "normal"): "T_Body_N.png",
        }
        assert found.masks["head_wm1_browsraiseinner_r"].channel == 3
        assert found.missing == []
        assert "head: color" in found.summary()
        assert "4 wrinkle masks" in found.summary()

    def test_the_chosen_folder_comes_first_and_one_above_counts(self, tmp_path: Path) -> None:
        place = tmp_path / "dna"
        _touch(place, "ada.dna")
        _touch(tmp_path / "Maps", "head_color_map.png", "head_normal_map.png")
        _touch(tmp_path / "mine" / "Maps", "head_color_map.tga")
        folders = textures.folders_of(place / "ada.dna", str(tmp_path / "mine"))
        found = textures.find({}, MESHES, folders)
        assert found.of("head", "color") == tmp_path / "mine" / "Maps" / "head_color_map.tga"
        assert found.of("head", "normal").name == "head_normal_map.png"
        assert found.of("teeth", "color") is None

    def test_names_in_the_file_come_before_others_and_stay_inside(self, tmp_path: Path) -> None:
        _touch(tmp_path / "ada_textures", "skin.png", "head_color_map.png")
        _touch(tmp_path, "out.png")
        wanted = {("head", "color"): "skin.png", ("teeth", "color"): "../out.png"}
        found = textures.find(wanted, MESHES, [tmp_path / "ada_textures"])
        assert found.of("head", "color").name == "skin.png"
        assert found.of("teeth", "color") is None
        assert found.missing == ["The texture ../out.png was not found beside the file."]

    def test_metadata_names_meshes_with_their_lod(self) -> None:
        metadata = {"texture:head_lod1_mesh:map:a:b": "x.png", "licence": "CC0", "texture:x": "y"}
        assert textures.from_metadata(metadata) == {("head", "map:a:b"): "x.png"}

    def test_a_folder_that_is_gone_is_no_error(self, tmp_path: Path) -> None:
        gone = tmp_path / "gone"
        assert textures.folders_of(gone / "ada.dna", str(gone)) == []
        assert textures.list_files(gone) == []


class TestMaps:
    @pytest.mark.parametrize(
        ("label", "color", "normal", "number", "region", "area", "side"),
        [
            ("head_cm1_color.head_wm1_blink_L", 1, 0, 1, "head_wm1_blink_l", "eye", "L"),
            ("head_wm1_normal.head_wm1_jawOpen", 0, 1, 1, "head_wm1_jawopen", "smile", ""),
            ("head_wm3_normal.head_wm13_lips_DR", 0, 1, 3, "head_wm13_lips_dr", "lips", "R"),
            (
                "head_wm1.head_wm1_browsRaiseInner_L",
                0,
                1,
                1,
                "head_wm1_browsraiseinner_l",
                "forehead",
                "L",
            ),
            (
                "head_cm2_color_head_wm2_browsDown_R",
                1,
                0,
                2,
                "head_wm2_browsdown_r",
                "glabella",
                "R",
            ),
            ("flush", 1, 0, 0, "", "all", ""),
            ("wrinkle", 0, 1, 0, "", "all", ""),
            ("browRaiseL", 1, 1, 0, "", "forehead", "L"),
            ("map07", 1, 1, 0, "", "all", ""),
        ],
    )
    def test_what_a_map_does(
        self,
        label: str,
        color: int,
        normal: int,
        number: int,
        region: str,
        area: str,
        side: str,
    ) -> None:
        use = maps.use_of(3, label)
        assert (use.index, use.label) == (3, label)
        assert (use.color, use.normal, use.number) == (bool(color), bool(normal), number)
        assert (use.region, use.area, use.side) == (region, area, side)

    def test_every_packed_region_lies_in_an_area(self) -> None:
        for regions in textures.PACKED_MASKS.values():
            for region in regions:
                assert maps.area_of(region) in maps.AREAS, region
        assert set(maps.FOLDS) == {*maps.AREAS, "all"}


class TestFolds:
    """A head of 18 x 20 x 25 cm, with eyes 6 cm apart and the mouth 7 cm below the eyes."""

    eyes = (np.array([0.03, -0.06, 1.6]), np.array([-0.03, -0.06, 1.6]))
    head = np.array([[-0.09, -0.10, 1.47], [0.09, 0.10, 1.72]])

    def frame(self) -> Any:
        return folds.find_frame(self.eyes, self.head, np.array([0.0, -0.08, 1.53]))

    def test_the_frame_follows_the_eyes(self) -> None:
        frame = self.frame()
        np.testing.assert_allclose(frame.origin, [0, -0.06, 1.6])
        assert frame.unit == pytest.approx(0.06)
        assert frame.drop == pytest.approx(0.07)

    def test_without_eyes_or_with_odd_ones_the_head_decides(self) -> None:
        for eyes in ((), (np.array([0.0, 0, 0]),), (np.array([9.0, 0, 0]),)):
            frame = folds.find_frame(eyes, self.head, None)
            assert frame.unit == pytest.approx(0.36 * 0.18)
            assert self.head[0, 2] < frame.origin[2] < self.head[1, 2]

    @pytest.mark.parametrize(
        ("area", "place"),
        [
            ("forehead", (0.0, -0.09, 1.65)),
            ("glabella", (0.0, -0.09, 1.62)),
            ("eye", (0.06, -0.06, 1.6)),
            ("nose", (0.01, -0.10, 1.583)),
            ("smile", (0.03, -0.08, 1.545)),
            ("lips", (0.0, -0.09, 1.53)),
            ("chin", (0.0, -0.09, 1.50)),
        ],
    )
    def test_each_area_is_where_anatomy_has_it(self, area: str, place: tuple[float, ...]) -> None:
        points = np.array([place, (-place[0], *place[1:]), (place[0], 0.1, place[2])])
        masks = folds.area_masks(points, self.frame())
        assert masks[area][0] > 0.6
        assert masks[area][1] == pytest.approx(masks[area][0])  # both sides are equal
        assert masks[area][2] == 0.0  # nothing at the back of the head
        assert all(m.min() >= 0 and m.max() <= 1 for m in masks.values())

    def test_sides(self) -> None:
        shares = folds.left_share(
            np.array([[0.05, 0, 1.6], [-0.05, 0, 1.6], [0, 0, 1.6]]), self.frame()
        )
        np.testing.assert_allclose(shares, [1, 0, 0.5])


def test_light_goes_nowhere_beside_the_necks_border_and_through_lids():
    frame = folds.FaceFrame(np.zeros(3), 0.062, 0.07)
    heights = np.linspace(-0.2, 0.0, 41)
    neck = np.column_stack([0 * heights, 0 * heights, heights])
    lids = np.array([[0.03, 0.0, 0.005]])
    points = np.concatenate([neck, lids])
    near = folds.border_share(points, np.array([0, 41]), frame)
    assert near.dtype == np.float32
    np.testing.assert_array_equal(near[heights.searchsorted([-0.2, -0.191])], 1)
    assert 0 < near[heights.searchsorted(-0.182)] < 1
    assert not near[(points[:, 2] > -0.174)].any()  # nor at the rim of an eyelid
    assert not folds.border_share(points, np.array([41]), frame).any()
    assert not folds.border_share(points, np.array([], int), frame).any()
