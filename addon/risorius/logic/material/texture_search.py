# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the texture file of each mesh and material input by the names of files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..base import names

EXTENSIONS = (".png", ".tga", ".exr", ".tif", ".tiff", ".jpg", ".jpeg", ".bmp", ".webp")
# Folders to search, relative to the folder of the DNA file; `{stem}` stands for the DNA file's name
# without extension.
FOLDERS = (
    "{stem}_textures",
    "Maps",
    "maps",
    "Textures",
    "textures",
    "Masks",
    "masks",
    "../Maps",
    "../Textures",
    "../Masks",
)
FILE_LIMIT = 4000  # most files read per folder, so that a home folder chosen by mistake is no harm

_PART_WORDS = {
    "head": "head",
    "face": "head",
    "body": "body",
    "eye": "eyes",
    "eyes": "eyes",
    "eyeball": "eyes",
    "iris": "eyes",
    "teeth": "teeth",
    "tooth": "teeth",
    "tongue": "tongue",
    "eyelash": "lashes",
    "eyelashes": "lashes",
    "lash": "lashes",
    "lashes": "lashes",
    "eyebrow": "lashes",
    "eyebrows": "lashes",
}
_ROLE_WORDS = {
    "color": "color",
    "colour": "color",
    "basecolor": "color",
    "albedo": "color",
    "diffuse": "color",
    "bc": "color",
    "col": "color",
    "normal": "normal",
    "normals": "normal",
    "nrm": "normal",
    "n": "normal",
    "roughness": "roughness",
    "rough": "roughness",
    "specular": "specular",
    "spec": "specular",
    "cavity": "cavity",
    "alpha": "alpha",
    "opacity": "alpha",
}
# Words that are ignored in texture names.
_FILLERS = {"t", "tx", "map", "maps", "main", "base", "animated", "baked", "vt", "inst", "lod0"}
_SIZE = re.compile(r"^(\d+|\d+k|u?1001)$")
_SET = re.compile(r"^([cw]m)([1-9])$")
_MASK = re.compile(r"^(?:t_)?(head_wm\d+_[a-z]+(?:_[a-z]{1,2})?)(?:_msk|_mask)?$")
_PACKED = re.compile(r"^(?:t_)?head_(wm\d+)_msk_(\d\d)$")

# Wrinkle set and number in the name of a packed mask file, such as wm1_01 -> the regions in the
# file's red, green, blue and alpha channels.
PACKED_MASKS: Mapping[str, tuple[str, ...]] = {
    "wm1_01": ("blink_L", "blink_R", "browsRaiseInner_L", "browsRaiseInner_R"),
    "wm1_02": ("browsRaiseOuter_L", "browsRaiseOuter_R", "chinRaise_L", "chinRaise_R"),
    "wm1_03": ("jawOpen", "purse_DL", "purse_DR", "purse_UL"),
    "wm1_04": ("purse_UR", "squintInner_L", "squintInner_R"),
    "wm2_01": ("browsDown_L", "browsDown_R", "browsLateral_L", "browsLateral_R"),
    "wm2_02": ("mouthStretch_L", "mouthStretch_R", "neckStretch_L", "neckStretch_R"),
    "wm2_03": ("noseWrinkler_L", "noseWrinkler_R", "noseCrease_L", "noseCrease_R"),
    "wm3_01": (
        "cheekRaiseInner_L",
        "cheekRaiseInner_R",
        "cheekRaiseOuter_L",
        "cheekRaiseOuter_R",
    ),
    "wm3_02": ("cheekRaiseUpper_L", "cheekRaiseUpper_R", "smile_L", "smile_R"),
    "wm13_01": ("lips_DL", "lips_DR", "lips_UL", "lips_UR"),
}


@dataclass(frozen=True)
class Mask:
    """The mask of a wrinkle region: path of the image, and colour channel, 0 (red) to 3 (alpha)."""

    path: Path
    channel: int


@dataclass
class TexturePlan:
    """The textures found for a face.

    Attributes:
        files: (mesh base, role) -> file. Roles: color, normal, roughness, specular, cavity, alpha,
            `color:1` to `color:3` and `normal:1` to `normal:3` for the wrinkle sets, `map:<animated
            map>` for a mask named in the DNA file's metadata.
        masks: region such as `head_wm1_blink_l`, in lower case -> Mask.
        missing: one sentence for each texture that the DNA file names for a mesh of the face but
            that was not found.
    """

    files: dict[tuple[str, str], Path] = field(default_factory=dict)
    masks: dict[str, Mask] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)

    def of(self, base: str, role: str) -> Path | None:
        """The file for an input of a mesh's material; None if missing.

        Args:
            base: mesh name without its LOD, as in `files`.
            role: role of the input, as in `files`.
        """
        return self.files.get((base, role))

    def summary(self) -> str:
        """A summary of found textures: `head: color, normal; teeth: color`; "" if there is none."""
        found: dict[str, list[str]] = {}
        for base, role in self.files:
            found.setdefault(base, []).append(role.partition(":")[0])
        parts = [f"{base}: {', '.join(dict.fromkeys(r))}" for base, r in found.items()]
        if self.masks:
            parts.append(f"{len(self.masks)} wrinkle masks")
        return "; ".join(parts)


def from_metadata(metadata: Mapping[str, str]) -> dict[tuple[str, str], str]:
    """(mesh base, role) -> file name, from keys such as `texture:head_lod0_mesh:color`."""
    found: dict[tuple[str, str], str] = {}
    for key, value in metadata.items():
        words = key.split(":", 2)
        if len(words) == 3 and words[0] == "texture":
            found.setdefault((names.without_lod(words[1]), words[2]), value)
    return found


def split_words(stem: str) -> list[str]:
    """Words of a file name in lower case: `FaceColor_CM1` gives face, color, cm1."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", stem)
    return [w.lower() for w in re.split(r"[^A-Za-z0-9]+", spaced) if w]


def read_name(stem: str) -> tuple[str, str, str] | None:
    """Read the part, side and role from a texture's name.

    Args:
        stem: the file's name without its ending.

    Returns:
        Part (head, body, eyes, teeth, tongue, lashes), side (left, right or empty) and role, as in
        TexturePlan. None if the part or the role is missing, if an unknown word follows the part,
        or if a wrinkle set has another role than color or normal.
    """
    part = role = number = side = ""
    for word in split_words(stem):
        match = _SET.match(word)
        if match:
            number = match.group(2)
        elif word in _ROLE_WORDS and (part or word not in ("n", "bc", "col")):
            role = _ROLE_WORDS[word]
        elif word in _PART_WORDS:
            part = _PART_WORDS[word]
        elif word in ("left", "right") and part == "eyes":
            side = word
        elif part and not (word in _FILLERS or _SIZE.match(word)):
            return None  # unknown words are allowed before the part, such as a character's name
    if not part and (number or stem.lower().endswith("_main")):
        part = "head"  # exports of a single face: Color_MAIN, Normal_WM1
    if not part or not role or (number and role not in ("color", "normal")):
        return None
    return part, side, f"{role}:{number}" if number else role


def read_mask(stem: str) -> dict[str, int]:
    """Region in lower case -> colour channel of a mask file, 0 (red) to 3 (alpha).

    Empty if the file is no mask.
    """
    word = stem.lower()
    packed = _PACKED.match(word)
    if packed:
        regions = PACKED_MASKS.get(f"{packed.group(1)}_{packed.group(2)}", ())
        return {f"head_{packed.group(1)}_{r}".lower(): c for c, r in enumerate(regions)}
    single = _MASK.match(word)
    if single and not set(word.split("_")) & {"normal", "color", "colour", "map", "msk"}:
        return {single.group(1): 0}
    if single and word.endswith(("_msk", "_mask")):
        return {single.group(1): 0}
    return {}


def part_of(base: str, kind: str, skins: Sequence[str]) -> tuple[str, str]:
    """The part and side of a mesh, named as in the result of `read_name`; part "" if it has none.

    Args:
        base: mesh name without its LOD.
        kind: kind of the mesh, such as skin or eyes.
        skins: base names of all skin meshes.
    """
    word = base.lower()
    if kind == "skin":
        if "body" in word:
            return "body", ""
        heads = [s for s in skins if "head" in s.lower() or "face" in s.lower()]
        return ("head" if base in heads or (not heads and len(skins) == 1) else ""), ""
    side = next((s for s in ("left", "right") if s in word), "")
    return (kind if kind in ("eyes", "teeth", "tongue", "lashes") else ""), side


def folders_of(dna_path: Path, chosen: str = "") -> list[Path]:
    """Existing folders to search, the user's folder first.

    Args:
        dna_path: path of the DNA file.
        chosen: the folder that the user chose, or "".
    """
    places = [Path(chosen)] if chosen else []
    if chosen:
        places += [Path(chosen) / n for n in ("Maps", "maps", "Masks", "masks")]
    places += [dna_path.parent / f.format(stem=dna_path.stem) for f in FOLDERS]
    places.append(dna_path.parent)
    found: dict[Path, Path] = {}
    for place in places:
        try:
            if place.is_dir():
                found.setdefault(place.resolve(), place)
        except OSError:
            continue
    return list(found)


def list_files(folder: Path) -> list[Path]:
    """Image files of a folder, sorted by length of name, name, and the order of EXTENSIONS."""
    try:
        entries = [p for _, p in zip(range(FILE_LIMIT), folder.iterdir(), strict=False)]
    except OSError:
        return []
    images = [p for p in entries if p.suffix.lower() in EXTENSIONS]
    order = {e: i for i, e in enumerate(EXTENSIONS)}
    return sorted(images, key=lambda p: (len(p.stem), p.stem.lower(), order[p.suffix.lower()]))


def find(
    wanted: Mapping[tuple[str, str], str],
    meshes: Iterable[tuple[str, str]],
    folders: Sequence[Path],
) -> TexturePlan:
    """Find textures: first the files that the DNA file names, then files with known names.

    Args:
        wanted: (mesh base, role) -> file name that the metadata of the DNA file gives.
        meshes: base name and kind of each mesh.
        folders: folders to search; a match in an earlier folder wins.

    Returns:
        The plan. A name in the DNA file that contains a folder matches no file.
    """
    plan = TexturePlan()
    known = dict(meshes)
    listings = [list_files(f) for f in folders]
    for key, name in wanted.items():
        path = next((p for files in listings for p in files if p.name == name), None)
        if path is not None:
            plan.files[key] = path
        elif key[0] in known:
            plan.missing.append(f"The texture {name} was not found beside the file.")
    plan.missing = list(dict.fromkeys(plan.missing))
    for files in listings:
        for path in files:
            for region, channel in read_mask(path.stem).items():
                plan.masks.setdefault(region, Mask(path, channel))
    _by_name(plan, known, [p for files in listings for p in files])
    return plan


def _by_name(plan: TexturePlan, known: Mapping[str, str], files: Sequence[Path]) -> None:
    found: dict[tuple[str, str, str], Path] = {}
    for path in files:
        said = read_name(path.stem)
        if said is not None:
            found.setdefault(said, path)
    skins = [base for base, kind in known.items() if kind == "skin"]
    for base, kind in known.items():
        part, side = part_of(base, kind, skins)
        for (its_part, its_side, role), path in found.items():
            if part and its_part == part and its_side in (side, ""):
                own = found.get((part, side, role), path)
                plan.files.setdefault((base, role), own)
