# SPDX-License-Identifier: MIT
"""Tests the add-on's logic without Blender: names, regions, spaces, plans."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import risorius
from risorius.controls.regions import TITLES, region_of
from risorius.controls.sides import mirrored_name, name_across
from risorius.rigs.joint_controls import turned_joints

STANDARD = Path(__file__).resolve().parents[2] / "data" / "controls" / "standard_raw.txt"
LOGIC = Path(__file__).resolve().parents[3] / "addon" / "risorius" / "logic"


def _load_logic() -> ModuleType:
    """Load the logic as package risorius_addon_logic, so that addon/ need not be on sys.path."""
    name = "risorius_addon_logic"
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(
            name, LOGIC / "__init__.py", submodule_search_locations=[str(LOGIC)]
        )
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


_load_logic()
names = importlib.import_module("risorius_addon_logic.base.names")
face_regions = importlib.import_module("risorius_addon_logic.base.face_regions")
sentences = importlib.import_module("risorius_addon_logic.base.sentences")
first_sliders = importlib.import_module("risorius_addon_logic.character.first_sliders")
slider_rows = importlib.import_module("risorius_addon_logic.character.slider_rows")
slider_words = importlib.import_module("risorius_addon_logic.character.slider_words")
lod_distance = importlib.import_module("risorius_addon_logic.character.lod_distance")
space = importlib.import_module("risorius_addon_logic.base.space")
plans = importlib.import_module("risorius_addon_logic.character.plans")
recogniser = importlib.import_module("risorius_addon_logic.animation.recogniser")
bezier_keys = importlib.import_module("risorius_addon_logic.animation.bezier_keys")


def test_logic_needs_neither_blender_nor_the_native_module() -> None:
    for path in LOGIC.rglob("*.py"):
        lines = path.read_text(encoding="utf-8").splitlines()
        imports = [line for line in lines if line.startswith(("import ", "from "))]
        assert not [line for line in imports if "bpy" in line or "risorius" in line], path.name


class TestNames:
    def test_short_names_stay(self) -> None:
        assert names.unique_labels(["a", "b.c", "ü"]) == ["a", "b.c", "ü"]

    def test_repeated_and_long_names_differ_and_fit(self) -> None:
        labels = names.unique_labels(["x" * 100, "x" * 100, "é" * 40, "same", "same", "same"])
        assert len(set(labels)) == 6
        assert all(0 < len(label.encode()) <= 63 for label in labels)
        assert labels[3:] == ["same", "same.001", "same.002"]

    def test_a_number_that_is_taken_is_passed_over(self) -> None:
        assert names.unique_labels(["a", "a.001", "a"]) == ["a", "a.001", "a.002"]

    def test_a_sentence_names_the_first_and_counts_the_rest(self) -> None:
        assert names.listed(["a"]) == "a"
        assert names.listed(list("abcdefgh")) == "a, b, c, d, e, f, g, h"
        assert names.listed(list("abcde"), 3) == "a, b, c and 2 more"

    def test_names_that_are_no_text(self) -> None:
        labels = names.unique_labels(["", "\udcff", "a\0b"])
        assert all(label.encode("utf-8") for label in labels)
        assert len(set(labels)) == 3

    @pytest.mark.parametrize(
        ("name", "wanted"),
        [("head_lod0_mesh", "head"), ("eyeLeft_lod3_mesh", "eyeLeft"), ("mesh", "mesh")],
    )
    def test_meshes_of_one_part_share_a_base(self, name: str, wanted: str) -> None:
        assert names.without_lod(name) == wanted


class TestRegions:
    @pytest.mark.parametrize(
        ("control", "region"),
        [
            ("CTRL_expressions.browDownL", "brow"),
            ("CTRL_expressions.eyeCheekRaiseL", "eye"),
            ("CTRL_expressions.eyelashesUpINL", "eye"),
            ("CTRL_expressions.mouthCheekBlowL", "cheek"),
            ("CTRL_expressions.mouthStickyUC", "mouth"),
            ("CTRL_expressions.jawChinRaiseDL", "jaw"),
            ("CTRL_expressions.noseNostrilDilateL", "nose"),
            ("CTRL_expressions.tongueOut", "tongue"),
            ("CTRL_expressions.teethUpU", "teeth"),
            ("CTRL_expressions.neckSwallowPh1", "neck"),
            ("CTRL_expressions.earUpL", "ear"),
            ("spine_04.qx", "other"),
        ],
    )
    def test_region_by_name(self, control: str, region: str) -> None:
        assert region_of(control) == region
        assert region_of(control, by_last_part=True) == region

    def test_a_turn_has_its_region_before_the_dot(self) -> None:
        turns = ["head.yaw", "eyeL.pitch", "CTRL:neck_01.x"]
        assert [region_of(turn) for turn in turns] == ["neck", "eye", "neck"]
        assert {region_of(turn, by_last_part=True) for turn in turns} == {"other"}

    def test_groups_hold_every_control_once(self) -> None:
        controls = ["a.jawOpen", "a.browDownL", "zzz", "a.jawLeft"]
        regions = face_regions.FaceRegions(
            {"jaw": "Jaw", "eye": "Eyes", "brow": "Brows", "other": "Other"},
            lambda name: "brow" if "brow" in name else "jaw" if "jaw" in name else "other",
            lambda _: "",
        )
        groups = slider_words.group_controls(controls, regions)
        assert list(groups.items()) == [("jaw", [0, 3]), ("brow", [1]), ("other", [2])]

    @pytest.mark.parametrize(
        ("control", "sided", "wanted"),
        [
            ("CTRL_expressions.mouthCornerPullL", False, "Corner Pull"),
            ("CTRL_expressions.mouthCornerPullL", True, "Corner Pull L"),
            ("CTRL_expressions.mouthFunnelUL", False, "Funnel Upper"),
            ("CTRL_expressions.jawOpen", True, "Open"),
            ("CTRL_expressions.mouthStickyUINL", False, "Sticky Upper Inner"),
            ("CTRL_expressions.mouthStickyDC", True, "Sticky Lower Centre"),
            ("CTRL_expressions.mouthLipsStickyRPh2", False, "Lips Sticky Phase 2"),
            ("CTRL_expressions.teethFwdD", True, "Forward Lower"),
            ("jaw", True, "Jaw"),
        ],
    )
    def test_words_under_a_heading(self, control: str, sided: bool, wanted: str) -> None:
        region = region_of(control)
        assert slider_words.title_in_region(control, region, sided) == wanted

    def test_search_looks_at_name_and_words(self) -> None:
        control = "CTRL_expressions.mouthCornerPullL"
        assert slider_words.matches(control, "corner pull")
        assert slider_words.matches(control, "MOUTH")
        assert not slider_words.matches(control, "mouth brow")
        assert not slider_words.matches(control, "smile")
        assert slider_words.matches(control, "Smile", "grin smile")
        assert slider_words.matches(control, "SÜSS corner", "süss")
        assert slider_words.matches(control, "smi", "grin smile")
        assert not slider_words.matches(control, "ear", "fear tears")


def test_levels_give_way_at_doubled_distances_and_come_back_late() -> None:
    assert lod_distance.default_distances(4, 0.25) == [1.5, 3.0, 6.0]
    assert (
        lod_distance.default_distances(1, 0.25) == lod_distance.default_distances(2, 0.25) == [1.5]
    )
    limits, built = [1.5, 3.0, 6.0], [0, 1, 3]
    at = [lod_distance.level_at(d, limits, built) for d in (1.49, 1.5, 3.0, 6.0, 99.0)]
    assert at == [0, 1, 3, 3, 3]  # level 2 has no mesh
    assert lod_distance.level_at(1.6, limits, built, current=0) == 0
    assert lod_distance.level_at(1.66, limits, built, current=0) == 1
    assert lod_distance.level_at(1.4, limits, built, current=1) == 1
    assert lod_distance.level_at(1.34, limits, built, current=1) == 0


def test_a_sentence_remembers_what_it_was_made_of() -> None:
    reason = sentences.told("only the first {count} are shown", count=3)
    whole = sentences.told("{layer}: {reason}.", layer="Idle", reason=reason)
    assert whole == "Idle: only the first 3 are shown."
    assert whole.template == "{layer}: {reason}."
    assert whole.values["reason"].values == {"count": 3}
    assert sentences.told("100 % {plain}") == "100 % {plain}"  # without values, a % stays


REGIONS = face_regions.FaceRegions(
    {"mouth": "Mouth", "eye": "Eyes"}, region_of, region_of, mirrored_name, name_across
)


class TestLeftAndRight:
    def test_sides_stand_where_they_are_seen(self) -> None:
        pair = ["a.mouthDimpleL", "a.mouthDimpleR"]
        for names in (pair, pair[::-1]):
            (seen,) = slider_rows.rows_of(names, "mouth", REGIONS, True)
            (own,) = slider_rows.rows_of(names, "mouth", REGIONS, False)
            assert seen == slider_rows.Row("Dimple", ("a.mouthDimpleR", "a.mouthDimpleL"))
            assert own == slider_rows.Row("Dimple", ("a.mouthDimpleL", "a.mouthDimpleR"))
            assert own.is_pair

    def test_directions_share_a_row_and_go_to_their_own_side(self) -> None:
        (row,) = slider_rows.rows_of(["mouthLeft", "mouthRight"], "mouth", REGIONS, True)
        assert row == slider_rows.Row("Sideways", ("mouthRight", "mouthLeft"))
        (row,) = slider_rows.rows_of(["mouthLeft", "mouthRight"], "mouth", REGIONS, False)
        assert row.sliders == ("mouthLeft", "mouthRight")

    def test_gaze_has_a_row_for_each_direction_named_as_seen(self) -> None:
        names = [f"eyeLook{way}{side}" for way in ("Left", "Right") for side in "LR"]
        rows = slider_rows.rows_of(names, "eye", REGIONS, True)
        assert [row.title for row in rows] == ["Look Right", "Look Left"]
        assert rows[0].sliders == ("eyeLookLeftR", "eyeLookLeftL")
        rows = slider_rows.rows_of(names, "eye", REGIONS, False)
        assert [row.title for row in rows] == ["Look Left", "Look Right"]

    def test_phases_have_their_side_before_the_end(self) -> None:
        names = ["mouthLipsStickyLPh1", "mouthLipsStickyRPh1"]
        (row,) = slider_rows.rows_of(names, "mouth", REGIONS, False)
        assert row == slider_rows.Row("Lips Sticky Phase 1", tuple(names))

    def test_one_side_alone_says_which_it_is(self) -> None:
        rows = slider_rows.rows_of(["mouthDimpleL", "mouthUp"], "mouth", REGIONS, True)
        assert [(row.title, row.is_pair) for row in rows] == [("Dimple R", False), ("Up", False)]
        rows = slider_rows.rows_of(["mouthDimpleL"], "mouth", REGIONS, False)
        assert rows[0].title == "Dimple L"

    def test_what_is_used_most_stands_first_in_at_most_ten_lines(self) -> None:
        names, regions = STANDARD.read_text(encoding="utf-8").split(), _all_regions()
        groups = slider_words.group_controls(names, regions)
        known = {slider_words.short_name(name) for name in names}
        for region, listed in first_sliders.table().items():
            assert set(listed) <= known
            rows = slider_rows.rows_of([names[i] for i in groups[region]], region, regions, True)
            first, more = first_sliders.part(rows, region)
            assert sorted((*first, *more), key=str) == sorted(rows, key=str)
            assert more == [row for row in rows if row in more]  # the order of the file
            assert 1 <= len(first) <= 10
            shown = [slider_words.short_name(name) for row in first for name in row.sliders]
            assert set(shown) == set(listed), region
        mouth = [names[i] for i in groups["mouth"]]
        first, more = first_sliders.part(
            slider_rows.rows_of(mouth, "mouth", regions, False), "mouth"
        )
        assert [row.title for row in first[:2]] == ["Corner Pull", "Corner Depress"]
        assert len(first) == 10
        assert len(more) > 50

    def test_a_face_with_names_of_its_own_has_all_its_lines(self) -> None:
        rows = slider_rows.rows_of(["grin", "gap"], "mouth", REGIONS, True)
        assert first_sliders.part(rows, "mouth") == (rows, [])

    def test_every_control_of_a_standard_face_has_its_place_once(self) -> None:
        names = STANDARD.read_text(encoding="utf-8").split()
        for seen in (True, False):
            groups = slider_words.group_controls(names, _all_regions())
            rows = [
                row
                for region, places in groups.items()
                for row in slider_rows.rows_of(
                    [names[i] for i in places], region, _all_regions(), seen
                )
            ]
            assert sorted(n for row in rows for n in row.sliders) == sorted(names)
            assert all(row.title for row in rows)
            pairs = [row.sliders for row in rows if row.is_pair]
            assert all(len({mirrored_name(a), name_across(a)} & {b}) == 1 for a, b in pairs)

    def test_a_mirrored_pose_is_the_pose_when_mirrored_again(self) -> None:
        values = {"mouthDimpleL": 0.7, "mouthDimpleR": 0.1, "jawLeft": 0.3, "jawRight": 0.0}
        values |= {"eyeLookLeftL": 0.5, "eyeLookRightR": 0.0, "jawOpen": 0.2, "alone_L": 0.9}
        once = slider_rows.mirrored(values, REGIONS)
        assert once["mouthDimpleR"] == 0.7
        assert once["jawRight"] == 0.3
        assert once["eyeLookRightR"] == 0.5
        assert once["jawOpen"] == 0.2
        assert once["alone_L"] == 0.9
        assert slider_rows.mirrored(once, REGIONS) == values
        assert slider_rows.flipped({"jawLeft": 0.3}, REGIONS) == {"jawRight": 0.3}

    def test_the_other_side_is_made_alike_and_eyes_look_the_same_way(self) -> None:
        values = {"mouthDimpleL": 0.7, "mouthDimpleR": 0.1, "jawLeft": 0.3, "jawRight": 0.0}
        values |= {"eyeLookLeftL": 0.5, "eyeLookLeftR": 0.0, "eyeLookRightR": 0.0}
        assert slider_rows.across_from(values, REGIONS, True) == {
            "mouthDimpleR": 0.7,
            "eyeLookLeftR": 0.5,
        }
        assert slider_rows.across_from(values, REGIONS, False) == {
            "mouthDimpleL": 0.1,
            "eyeLookLeftL": 0.0,
        }

    def test_pairs_are_left_then_right(self) -> None:
        names = ["mouthDimpleR", "mouthDimpleL", "jawLeft", "jawRight", "eyeBlinkL"]
        assert slider_rows.pairs(names, REGIONS) == [("mouthDimpleL", "mouthDimpleR")]


def _all_regions() -> Any:
    def of_slider(name: str) -> str:
        return region_of(name, by_last_part=True)

    return face_regions.FaceRegions(TITLES, of_slider, region_of, mirrored_name, name_across)


def _space(**changes: object) -> Any:
    words: dict[str, Any] = {
        "coordinate_system": ("right", "up", "front"),
        "translation_unit": "cm",
        "rotation_unit": "degrees",
        "rotation_sequence": "xyz",
        "rotation_signs": (1, 1, 1),
        "face_winding_order": "ccw",
    }
    return space.make_space(**{**words, **changes})


class TestSpace:
    def test_axes_and_units(self) -> None:
        made = _space()
        points = made.points(np.array([[100.0, 0, 0], [0, 100, 0], [0, 0, 100]]))
        np.testing.assert_allclose(points, [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-15)
        assert not made.flip_faces

    def test_scene_scale(self) -> None:
        points = _space(unit_scale=0.01).points(np.array([[1.0, 2.0, 3.0]]))
        np.testing.assert_allclose(points, [[1, -3, 2]])

    def test_mirrored_axes_flip_faces_and_clockwise_flips_back(self) -> None:
        mirrored = ("left", "up", "front")
        assert _space(coordinate_system=mirrored).flip_faces
        assert not _space(coordinate_system=mirrored, face_winding_order="cw").flip_faces
        assert _space(face_winding_order="cw").flip_faces

    @pytest.mark.parametrize(
        "changes",
        [
            {"coordinate_system": ("up", "up", "front")},
            {"coordinate_system": ("up", "down", "front")},
            {"coordinate_system": ("#17", "up", "front")},
            {"translation_unit": "#9"},
            {"rotation_sequence": "xxz"},
        ],
    )
    def test_unknown_conventions_are_refused_in_a_sentence(self, changes: dict[str, Any]) -> None:
        with pytest.raises(space.SpaceError, match=r"file's .*\.$"):
            _space(**changes)

    @pytest.mark.parametrize("sequence", ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"])
    @pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, 1), (-1, -1, 1)])
    @pytest.mark.parametrize(
        "axes", [("right", "up", "front"), ("left", "up", "front"), ("front", "right", "up")]
    )
    def test_rotation_carries_points_as_in_the_file(
        self, sequence: str, signs: tuple[int, int, int], axes: tuple[str, str, str]
    ) -> None:
        # A rotation in the file and then conversion to Blender equals conversion and then rotation
        # in Blender.
        made = _space(rotation_sequence=sequence, rotation_signs=signs, coordinate_system=axes)
        angles = np.array([[20.0, -70.0, 130.0]])
        point = np.array([1.0, 2.0, 3.0])
        turned = point
        for letter in sequence:
            i = "xyz".index(letter)
            a = np.radians(angles[0, i]) * signs[i]
            j, k = (i + 1) % 3, (i + 2) % 3
            new = turned.copy()
            new[j] = np.cos(a) * turned[j] - np.sin(a) * turned[k]
            new[k] = np.sin(a) * turned[j] + np.cos(a) * turned[k]
            turned = new
        direct = made.points(turned[None])[0]
        matrix = made.rotations(angles)[0]
        np.testing.assert_allclose(matrix @ made.points(point[None])[0], direct, atol=1e-12)
        assert np.linalg.det(matrix) == pytest.approx(1.0)

    @pytest.mark.parametrize("sequence", ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"])
    @pytest.mark.parametrize("axes", [("right", "up", "front"), ("left", "up", "front")])
    def test_the_native_bones_rebuild_the_posed_joint(
        self, axes: tuple[str, str, str], sequence: str
    ) -> None:
        made = _space(coordinate_system=axes, rotation_sequence=sequence, rotation_signs=(1, -1, 1))
        random = np.random.default_rng(5)
        neutral = random.uniform(-170, 170, (40, 3)).astype(np.float32)
        deltas = random.uniform(-1, 1, (40, 9)).astype(np.float32)
        deltas[:, 3:6] *= 170
        bones = [1, 3, *range(39, 3, -1)]
        native = risorius.BoneSpace(
            neutral,
            bones,
            axes=made.axes,
            scale=made.scale,
            radians=made.radians,
            sequence=made.sequence,
            signs=made.signs,
        )
        for joint, place, turn, size in zip(bones, *native.evaluate(deltas), strict=True):
            rest = made.rotations(neutral[joint : joint + 1])[0]
            wanted = made.rotations((neutral + deltas[:, 3:6])[joint : joint + 1])[0]
            assert turn[0] >= 0
            np.testing.assert_allclose(rest @ _matrix(turn), wanted, atol=2e-6)
            moved = made.points(deltas[joint : joint + 1, :3])[0]
            np.testing.assert_allclose(rest @ place, moved, atol=2e-8)
            np.testing.assert_allclose(size - 1, np.abs(made.axes) @ deltas[joint, 6:9], atol=2e-7)

    def test_the_native_bones_refuse_what_does_not_fit(self) -> None:
        neutral, axes = np.zeros((2, 3), np.float32), np.eye(3)
        with pytest.raises(ValueError, match="joint 2 of 2"):
            risorius.BoneSpace(neutral, [2], axes=axes)
        with pytest.raises(ValueError, match="sequence"):
            risorius.BoneSpace(neutral, [1], axes=axes, sequence=(0, 0, 1))
        with pytest.raises(ValueError, match=r"\(2, 9\)"):
            risorius.BoneSpace(neutral, [1], axes=axes).evaluate(np.zeros((2, 10), np.float32))

    def test_parents_may_stand_after_their_children(self) -> None:
        offsets = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
        turn = np.broadcast_to(np.eye(3), (3, 3, 3))
        world = space.world_matrices(turn, offsets, np.array([1, 2, 2], np.uint16))
        np.testing.assert_allclose(world[0][:3, 3], [1, 1, 1])


def _matrix(q: Any) -> Any:
    """The rotation matrix of a quaternion w x y z."""
    w, v = float(q[0]), np.asarray(q[1:], np.float64)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


class TestPlans:
    @pytest.mark.parametrize(
        ("name", "kind"),
        [
            ("head_lod0_mesh", "skin"),
            ("teeth_lod0_mesh", "teeth"),
            ("saliva_lod0_mesh", "wet"),
            ("eyeLeft_lod0_mesh", "eyes"),
            ("eyeshell_lod0_mesh", "wet"),
            ("eyelashes_lod0_mesh", "lashes"),
            ("eyebrows_lod0_mesh", "lashes"),
            ("hair_lod0_mesh", "hair"),
            ("brows_lod0_mesh", "hair"),
            ("beard_lod1_mesh", "hair"),
            ("eyeEdge_lod0_mesh", "wet"),
            ("cartilage_lod0_mesh", "gum"),
        ],
    )
    def test_kind_of_mesh(self, name: str, kind: str) -> None:
        assert plans.kind_of(name) == kind

    def test_anchors_by_name(self) -> None:
        found = plans.find_anchors(["spine", "neck_01", "neck_02", "head", "FACIAL_R_Eye"])
        assert (found.neck, found.head, found.eyes) == ((1, 2), 3, {"R": 4})

    @pytest.mark.parametrize("joints", [["Neck", "HEAD"], ["neck.02", "Neck_01", "neck", "head"]])
    def test_scene_and_clips_turn_the_same_joints(self, joints: list[str]) -> None:
        found = plans.find_anchors(joints)
        shares = {joint: ("neck", 1.0 / len(found.neck)) for joint in found.neck}
        assert turned_joints(joints) == {**shares, found.head: ("head", 1.0)}

    def test_a_file_without_geometry_is_refused_in_a_sentence(self) -> None:
        with pytest.raises(plans.PlanError, match="no geometry"):
            plans.plan_character(risorius.Dna(), "nothing")

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ("joint_names", "The file has no joints"),
            ("lods", "no meshes at the chosen levels of detail"),
            ("vertices", "The chosen meshes have no vertices"),
            ("parents", "joint names, parents and neutral pose differ in length"),
            ("parent", "names a parent joint that does not exist"),
            ("circle", "form a circle of parents"),
            ("rotation", "neutral joint rotations are not all finite numbers"),
            ("positions", "positions of mesh .* are not all finite numbers"),
            ("layout", "layout of mesh .* leads to number 9999999 of"),
            ("faces", "faces leads to number 9999999 of"),
            ("skin", "skin of mesh .* leads to number 60000 of"),
        ],
    )
    def test_what_leads_nowhere_is_refused_in_a_sentence(self, change: str, words: str) -> None:
        golden = LOGIC.parents[2] / "tests" / "data" / "golden" / "medium.dna"
        dna = risorius.load(str(golden))
        mesh = dna.meshes[0]
        parents = np.array(dna.joint_parents)

        def spoilt(values: Any, value: float) -> Any:
            out = np.array(values)
            out[5] = value
            return out

        if change == "joint_names":
            dna.joint_names = []
        elif change == "lods":
            dna.lod_mesh_mapping = [[], list(range(len(dna.meshes)))]
        elif change == "vertices":
            mesh = risorius.Mesh()
            dna.lod_mesh_mapping = [[0]]
        elif change == "parents":
            dna.joint_parents = parents[:-1]
        elif change == "parent":
            parents[-1] = len(parents)
            dna.joint_parents = parents
        elif change == "circle":
            parents[-2:] = [len(parents) - 1, len(parents) - 2]
            dna.joint_parents = parents
        elif change == "rotation":
            rotations = np.array(dna.neutral_joint_rotations)
            rotations[3, 1] = np.nan
            dna.neutral_joint_rotations = rotations
        elif change == "positions":
            mesh.positions = spoilt(mesh.positions, np.inf)
        elif change == "layout":
            mesh.layout_positions = spoilt(mesh.layout_positions, 9999999)
        elif change == "faces":
            mesh.face_layouts = spoilt(mesh.face_layouts, 9999999)
        else:
            mesh.skin_joint_indices = spoilt(mesh.skin_joint_indices, 60000)
        dna.meshes = [mesh, *dna.meshes[1:]]
        with pytest.raises(plans.PlanError, match=words):
            plans.plan_character(dna, "medium", (0,))

    def test_a_golden_file_becomes_a_plan(self) -> None:
        golden = LOGIC.parents[2] / "tests" / "data" / "golden" / "medium.dna"
        dna = risorius.load(str(golden))
        plan = plans.plan_character(dna, "medium", (0, 1))
        wanted = set(dna.lod_mesh_mapping[0].tolist()) | set(dna.lod_mesh_mapping[1].tolist())
        assert {m.index for m in plan.meshes} == wanted
        assert [c.label for c in plan.controls] == names.unique_labels(dna.raw_control_names)
        order = plan.armature.order
        assert sorted(order) == list(range(len(dna.joint_names)))
        where = {joint: i for i, joint in enumerate(order)}
        parents = enumerate(plan.armature.parents)
        assert all(p < 0 or where[p] < where[j] for j, p in parents)
        for mesh in plan.meshes:
            source = dna.meshes[mesh.index]
            np.testing.assert_allclose(mesh.positions[:, 2], source.positions[:, 1] * 0.01, 1e-5)


def test_sliders_of_a_rotation_reach_below_0_and_rest_at_no_turn():
    raw_names = ["CTRL.jawOpen", "neck.x", "neck.y", "neck.z", "neck.w", "other.x"]
    plain, *turn, other = plans.plan_controls(raw_names, [0, 0, 0, 0, 1])
    assert [(c.rest, c.lowest) for c in (plain, other)] == [(0.0, 0.0)] * 2
    assert [c.rest for c in turn] == [0.0, 0.0, 0.0, 1.0]
    assert [c.lowest for c in turn] == [-1.0] * 4
    assert all((c.rest, c.lowest) == (0.0, 0.0) for c in plans.plan_controls(raw_names))


# Output of pip 23.2 if the package index has a self-signed certificate.
_CERTIFICATE = """\
Looking in indexes: https://127.0.0.1:8443/simple
WARNING: Retrying (Retry(total=0, connect=None, read=None, redirect=None, status=None)) after \
connection broken by 'SSLError(SSLCertVerificationError(1, '[SSL: CERTIFICATE_VERIFY_FAILED] \
certificate verify failed: self-signed certificate (_ssl.c:1006)'))': /simple/pocketsphinx/
Could not fetch URL https://127.0.0.1:8443/simple/pocketsphinx/: There was a problem confirming \
the ssl certificate: HTTPSConnectionPool(host='127.0.0.1', port=8443): Max retries exceeded with \
url: /simple/pocketsphinx/ (Caused by SSLError(SSLCertVerificationError(1, '[SSL: \
CERTIFICATE_VERIFY_FAILED] certificate verify failed: self-signed certificate (_ssl.c:1006)'))) - \
skipping
ERROR: Could not find a version that satisfies the requirement pocketsphinx==5.1.1 (from versions: \
none)
ERROR: No matching distribution found for pocketsphinx==5.1.1
"""


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (
            _CERTIFICATE,
            "the certificate of the package index was not accepted (self-signed certificate)",
        ),
        ("python: No module named pip\n\n", "python: No module named pip"),
        (
            "ERROR: Could not install packages due to an OSError: [Errno 28] No space left on "
            "device\n\n[notice] A new release of pip is available: 23.2 -> 25.0\n",
            "Could not install packages due to an OSError: [Errno 28] No space left on device",
        ),
        ("", "no reason was given"),
    ],
)
def test_the_reason_why_a_package_is_not_installed(said: str, why: str) -> None:
    assert recogniser.reason(said, "Python 3.14 on Linux x86_64") == why


def _along(keys: Any, frames: Any) -> Any:
    """Values of a Bezier curve at frames; its handles are at a third of the keyframes' distance."""
    place = np.clip(np.searchsorted(keys.co[:, 0], frames, "right") - 1, 0, len(keys.co) - 2)
    first, after = keys.co[place], keys.co[place + 1]
    t = (frames - first[:, 0]) / (after[:, 0] - first[:, 0])
    middle = 3 * t * (1 - t) ** 2 * keys.right[place, 1]
    middle += 3 * t**2 * (1 - t) * keys.left[place + 1, 1]
    return (1 - t) ** 3 * first[:, 1] + middle + t**3 * after[:, 1]


@pytest.mark.parametrize("even", [True, False])
def test_few_keys_stay_near_every_sample_and_between_them(even: bool) -> None:
    random = np.random.default_rng(5)
    frames = np.arange(80.0) if even else np.cumsum(random.uniform(0.2, 2.0, 80))
    smooth = np.convolve(random.uniform(0, 1, 100), np.hanning(21) / 10, "valid")
    values = np.where(frames < frames[60], smooth, 0.0)  # a jump, then a constant
    keys = bezier_keys.Fitter(0.01).keys(frames, values)
    assert len(keys.co) < 40
    assert np.abs(_along(keys, frames) - values).max() <= 0.01
    middles = 0.5 * (frames[1:] + frames[:-1])
    off = np.abs(_along(keys, middles) - np.interp(middles, frames, values))
    assert off.max() <= 0.04
    assert len(bezier_keys.Fitter(0.01).keys(frames, values * 0.009).co) == 1
