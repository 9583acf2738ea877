# SPDX-License-Identifier: MIT
"""Tests that parts from a template get its textures, and that a head's own parts keep theirs."""

from risorius import Dna
from risorius.anyhead.borrowing import lend_materials
from risorius.author.heads.joining import FacePart
from risorius.author.heads.parts import Material


def _part(name, source, material=None):
    return FacePart(name, 0, 1, (0, 1), "head", material, source)


def test_what_is_the_templates_gets_the_templates_textures(tmp_path):
    template = Dna()
    template.metadata = {
        "texture:eyeLeft_lod0_mesh:color": "eye.png",
        "texture:lash_lod0_mesh:color": "lash.png",
        "texture:lash_lod0_mesh:normal": "gone.png",
        "texture:teeth_lod0_mesh:color": "../secret.png",
        "texture:head_lod0_mesh:color": "skin.png",
        "licence": "CC0",
    }
    (tmp_path / "man_textures").mkdir()
    (tmp_path / "man_textures" / "eye.png").write_bytes(b"an eye")
    (tmp_path / "lash.png").write_bytes(b"lashes")
    for path in (tmp_path / "skin.png", tmp_path / "man_textures" / "secret.png"):
        path.write_bytes(b"skin")
    hers = Material("Hers")
    face = _part("head", "head_lod0_mesh")  # the head's own mesh, with a name of the template
    eye, lash = _part("eyeLeft", "eyeLeft_lod0_mesh"), _part("lash", "lash_lod0_mesh")
    teeth, tongue = _part("teeth", "teeth_lod0_mesh"), _part("tongue", "Tongue", hers)
    parts = [face, eye, lash, teeth, tongue]
    lend_materials(parts, template, tmp_path / "man.dna", {"head_lod0_mesh", "Tongue"})
    assert [part.material and part.material.pictures for part in parts] == [
        None,
        {"color": b"an eye"},
        {"color": b"lashes"},
        None,
        {},
    ]
    assert tongue.material is hers
