# SPDX-License-Identifier: MIT
"""Draw the sample person in Cycles and in EEVEE, side by side, as the add-on's materials look.

    python tests/bench/draw_engines.py SAMPLE.dna PICTURE.jpg [--size 320] [--samples 24]

Run by a Python that has `bpy` and `risorius`; EEVEE needs OpenGL, which software can give. The
upper row is Cycles, the lower EEVEE: neutral, smile with wrinkles, raised brows, an eye. The
sample has no wrinkle maps of its own, so MetaHuman's names for them are added to a copy.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODULE = "bl_ext.user_default.risorius"
# Region of MetaHuman's wrinkle maps, its set, and the control that raises it here.
REGIONS = (
    ("browsRaiseInner", 1, "browRaiseIn"),
    ("browsRaiseOuter", 1, "browRaiseOuter"),
    ("squintInner", 1, "eyeSquintInner"),
    ("chinRaise", 1, "jawChinRaiseD"),
    ("browsDown", 2, "browDown"),
    ("mouthStretch", 2, "mouthStretch"),
    ("neckStretch", 2, "neckStretch"),
    ("noseWrinkler", 2, "noseWrinkle"),
    ("cheekRaiseOuter", 3, "eyeCheekRaise"),
    ("smile", 3, "mouthCornerPull"),
)
SMILE = {
    "mouthCornerPull": 0.9,
    "eyeCheekRaise": 0.35,
    "mouthUpperLipRaise": 0.35,
    "jawOpen": 0.25,
    "eyeSquintInner": 0.3,
}
BROWS = {"browRaiseIn": 1.0, "browRaiseOuter": 1.0, "eyeWiden": 0.5, "jawOpen": 0.12}
SHOTS = (("face", {}), ("face", SMILE), ("brows", BROWS), ("eye", {}))


def with_wrinkles(source: Path, folder: Path) -> Path:
    """A copy of the sample whose face has wrinkle maps by MetaHuman's names."""
    import risorius

    dna = risorius.load(str(source))
    raw = [n.rpartition(".")[2] for n in dna.raw_control_names]
    names = list(dna.animated_map_names)
    old = dna.animated_maps.conditionals
    inputs, outputs = list(old.input_indices), list(old.output_indices)
    for region, number, control in REGIONS:
        for side in "LR":
            for prefix in (f"head_cm{number}_color", f"head_wm{number}_normal"):
                inputs.append(raw.index(control + side))
                outputs.append(len(names))
                names.append(f"{prefix}.head_wm{number}_{region}_{side}")
    new = len(inputs) - len(old.input_indices)
    dna.animated_map_names = names
    dna.animated_maps = risorius.AnimatedMaps(
        lods=[len(inputs)] * dna.lod_count,
        conditionals=risorius.Conditionals(
            input_indices=inputs,
            output_indices=outputs,
            from_values=[*old.from_values, *[0.0] * new],
            to_values=[*old.to_values, *[1.0] * new],
            slope_values=[*old.slope_values, *[1.0] * new],
            cut_values=[*old.cut_values, *[0.0] * new],
        ),
    )
    dna.lod_animated_map_mapping = [list(range(len(names)))] * dna.lod_count
    path = folder / source.name
    dna.save(str(path))
    textures = source.with_name(f"{source.stem}_textures")
    if textures.is_dir():
        shutil.copytree(textures, path.with_name(textures.name))
    return path


def enable(user: Path) -> None:
    """The add-on of this tree, in a throw-away user folder."""
    import addon_utils
    import bpy

    target = user / "extensions" / "user_default" / "risorius"
    shutil.copytree(ROOT / "addon" / "risorius", target)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    repos = bpy.context.preferences.extensions.repos
    place = next((r for r in repos if r.module == "user_default"), None)
    place = place or repos.new(name="User Default", module="user_default")
    place.use_custom_directory, place.custom_directory = True, str(target.parent)
    addon_utils.extensions_refresh(ensure_wheels=False)
    if addon_utils.enable(MODULE) is None:
        raise SystemExit("The add-on cannot be enabled.")


def pose(rig, values) -> None:
    """Set controls by their names without prefix and side; all others to rest."""
    import bpy

    controls = rig["risorius_controls"]
    bone = controls.pose.bones["face"]
    for name in [k for k in bone.keys() if k.startswith("CTRL_")]:  # noqa: SIM118
        word = name.rpartition(".")[2]
        bone[name] = values.get(word, values.get(word.rstrip("LR"), 0.0))
    controls.update_tag()
    bpy.context.view_layer.update()


class Stage:
    """The demo's lights and three camera places."""

    def __init__(self, rig):
        import bpy
        from mathutils import Vector

        sys.path.insert(0, str(ROOT / "packaging" / "demo"))
        import scene as demo

        demo.build(rig.users_collection[0])
        self.demo, self.vector, self.scene = demo, Vector, bpy.context.scene
        self.camera = self.scene.camera
        self.first = (self.camera.location.copy(), self.camera.rotation_euler.copy())
        self.lens = self.camera.data.lens
        eye = next(o for o in bpy.data.objects if "eyeLeft" in o.name)
        corners = [eye.matrix_world @ Vector(c) for c in eye.bound_box]
        self.eye = sum(corners, Vector()) / 8
        self.unit = 2 * abs(self.eye.x)

    def look(self, kind):
        """Place the camera."""
        camera, vector = self.camera, self.vector
        camera.location, camera.rotation_euler = self.first
        camera.data.lens = self.lens
        if kind == "face":
            return
        middle = vector((0.0, self.eye.y, self.eye.z + 0.25 * self.unit))
        aim, away, lens = (self.eye, (0.3, -4.2, 0.1), 100) if kind == "eye" else (
            middle, (0.8, -10.0, 0.3), 60)  # fmt: skip
        camera.location = aim + vector(away) * self.unit
        camera.data.lens = lens
        self.demo.aim(camera, aim)

    def render(self, engine, size, samples, path):
        """A still as float32[size, size, 3], row 0 at the bottom."""
        import bpy
        import numpy as np

        scene = self.scene
        scene.render.resolution_x = scene.render.resolution_y = size
        if engine == "CYCLES":
            scene.render.engine = "CYCLES"
            scene.cycles.samples, scene.cycles.max_bounces = samples, 5
            scene.cycles.transparent_max_bounces = 12
        else:
            eevee = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
            scene.render.engine = eevee
            scene.eevee.taa_render_samples = samples
            scene.eevee.use_shadows = True
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(str(path))
        pixels = np.array(image.pixels[:], np.float32).reshape(size, size, 4)[..., :3]
        bpy.data.images.remove(image)
        return pixels


def write_picture(rows, path) -> None:
    """Rows of stills, the first at the top, as one JPEG."""
    import bpy
    import numpy as np

    whole = np.concatenate([np.concatenate(row, axis=1) for row in rows[::-1]], axis=0)
    height, width = whole.shape[:2]
    image = bpy.data.images.new("engines", width, height)
    full = np.ones((height, width, 4), np.float32)
    full[..., :3] = whole
    image.pixels.foreach_set(full.ravel())
    image.filepath_raw, image.file_format = str(path), "JPEG"
    image.save(quality=88)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("sample", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--size", type=int, default=320)
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--engines", default="CYCLES,EEVEE")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        user = Path(name)
        os.environ["BLENDER_USER_RESOURCES"] = name  # read when bpy is first imported
        import bpy

        enable(user)
        bpy.ops.risorius.import_dna(filepath=str(with_wrinkles(options.sample.resolve(), user)))
        rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
        stage = Stage(rig)
        rows = []
        for engine in options.engines.split(","):
            rows.append([])
            for kind, values in SHOTS:
                pose(rig, values)
                stage.look(kind)
                still = user / "still.png"
                rows[-1].append(stage.render(engine, options.size, options.samples, still))
        write_picture(rows, options.picture.resolve())


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # Blender as a module sometimes hangs in its destructors
