# SPDX-License-Identifier: MIT
"""Renders the demo's acting with a loop scarf and a lock of hair, which Blender simulates.

physics.py -- --extension ZIP --dna FILE --out FOLDER [--only FRAME ...]

Scarf and lock are cloth that collides with the moving face. The lock's root follows the skin of the
forehead by a Surface Deform modifier. The add-on's *Bake Physics* bakes both.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import acting  # noqa: E402
import bpy  # noqa: E402
import demo  # noqa: E402
import hair  # noqa: E402
import install_extension  # noqa: E402
import numpy as np  # noqa: E402
import performance  # noqa: E402
import scene as stage  # noqa: E402

SETTLE = 30  # frames in which the cloth settles; the acting begins after them
MM = 0.001
ROOT = (0.020, -0.2, 1.708)  # metres; a ray from here along +y hits the forehead at the lock's root
LOCK_ROWS, LOCK_COLUMNS = 26, 6
LOCK_LENGTH, LOCK_WIDTH = 0.160, 0.018


def parse():
    parser = argparse.ArgumentParser()
    for name in ("extension", "dna", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--only", type=int, nargs="*", help="render these frames as a still each")
    return parser.parse_args(install_extension.arguments())


def add_mesh(name, vertices, faces, material):
    """Add a mesh object to the scene and return it.

    Args:
        name: name of the mesh and of the object.
        vertices: positions [V, 3], metres.
        faces: vertex indices of each polygon.
        material: the material, or None.
    """
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(v) for v in vertices], [], faces)
    mesh.shade_smooth()
    if material is not None:
        mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def add_material(name, colour, roughness, sheen=0.0):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    surface = material.node_tree.nodes["Principled BSDF"].inputs
    surface["Base Color"].default_value = (*colour, 1)
    surface["Roughness"].default_value = roughness
    surface["Sheen Weight"].default_value = sheen
    return material


def ring_faces(rows, columns):
    """Quads between neighbouring rows. Each row is a closed ring of `columns` vertices."""
    at = np.arange(rows * columns).reshape(rows, columns)
    right = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], right[:-1], right[1:], at[1:]], axis=-1)
    return quads.reshape(-1, 4).tolist()


def rings(profile, columns, centre):
    """Vertices of stacked ellipses, metres.

    Args:
        profile: (z, half axis in x, half axis in y) of each ellipse.
        columns: number of vertices per ellipse.
        centre: x and y of the centres.
    """
    angle = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    return np.concatenate(
        [
            np.stack(
                [
                    centre[0] + x * np.sin(angle),
                    centre[1] - y * np.cos(angle),
                    np.full(columns, z),
                ],
                axis=1,
            )
            for z, x, y in profile
        ]
    )


def add_bust():
    """Add shoulders like a tailor's dummy, on which the scarf rests."""
    profile = [
        (1.300, 0.235, 0.110),
        (1.345, 0.232, 0.108),
        (1.375, 0.215, 0.102),
        (1.400, 0.190, 0.098),
        (1.424, 0.150, 0.092),
        (1.444, 0.112, 0.084),
        (1.458, 0.084, 0.072),
        (1.475, 0.050, 0.050),
        (1.490, 0.035, 0.035),
    ]
    bust = add_mesh(
        "Bust",
        rings(profile, 64, (0.0, -0.012)),
        ring_faces(len(profile), 64),
        add_material("Bust", (0.020, 0.022, 0.026), 0.75, 0.2),
    )
    bust.modifiers.new("Subdivision", "SUBSURF").levels = 1
    collide(bust, 1.5 * MM)


def collide(thing, thickness):
    """Make cloth collide with an object, with a friction like wool.

    Args:
        thing: the object.
        thickness: distance that cloth keeps from the object's surface, metres.
    """
    thing.modifiers.new("Collision", "COLLISION")
    thing.collision.thickness_outer = thickness
    thing.collision.cloth_friction = 20


def simulate(thing, mass, bending, first, last):
    """Make an object cloth that collides with other objects. Returns its cloth modifier.

    Args:
        thing: the object.
        mass: mass of each vertex, kg.
        bending: bending stiffness.
        first, last: frames of the simulation.
    """
    cloth = thing.modifiers.new("Cloth", "CLOTH")
    cloth.point_cache.frame_start, cloth.point_cache.frame_end = first, last
    settings = cloth.settings
    settings.quality = 8
    settings.mass = mass
    settings.bending_stiffness = bending
    settings.air_damping = 1.0
    cloth.collision_settings.collision_quality = 4
    cloth.collision_settings.distance_min = 1.5 * MM
    return cloth


def add_scarf(first, last):
    """Add a loop scarf of wool around the neck, wide enough to fall into folds."""
    rows, columns = 18, 110
    angle = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    height = np.linspace(0, 1, rows)[:, None]
    wave = 0.006 * np.sin(9 * angle + 2.4 * height) + 0.003 * np.sin(17 * angle + 5 * height)
    radius = 0.082 + 0.010 * np.cos(np.pi * height) + wave
    vertices = np.stack(
        [
            radius * np.sin(angle),
            -0.012 - 1.02 * radius * np.cos(angle),
            1.448 + 0.105 * height - 0.012 * np.cos(angle) * height,
        ],
        axis=-1,
    ).reshape(-1, 3)
    wool = add_material("Wool", (0.36, 0.045, 0.035), 0.85, 0.6)
    scarf = add_mesh("Scarf", vertices, ring_faces(rows, columns), wool)
    cloth = simulate(scarf, 0.25, 1.2, first, last)
    cloth.settings.tension_stiffness = cloth.settings.compression_stiffness = 12
    cloth.settings.shear_stiffness = 4
    cloth.settings.tension_damping = cloth.settings.compression_damping = 8
    cloth.collision_settings.use_self_collision = True
    cloth.collision_settings.self_distance_min = 2.5 * MM
    thick = scarf.modifiers.new("Solidify", "SOLIDIFY")
    thick.thickness, thick.offset = 3 * MM, 0
    scarf.modifiers.new("Subdivision", "SUBSURF").levels = 1
    scarf.modifiers["Subdivision"].render_levels = 2
    return scarf


def add_lock(head, first, last):
    """Add a lock over the forehead: a band of cloth, and hair that follows its long edges."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    hit, root, normal, *_ = bpy.context.scene.ray_cast(depsgraph, ROOT, (0, 1, 0))
    if not hit:
        raise RuntimeError("the ray of the lock meets no forehead")
    root, normal = np.array(root), np.array(normal)
    across = np.array([1.0, 0.0, 0.0]) - normal * normal[0]
    across /= np.linalg.norm(across)
    way = np.linspace(0, 1, LOCK_ROWS)[:, None]
    # The lock rises from the skin in an arc, then hangs straight down and drifts to the side.
    arc = np.minimum(way / 0.35, 1) * 2.5
    out = 0.028 * np.sin(arc / 2) ** 2
    up = 0.014 * np.sin(arc)
    down = np.maximum(way - 0.35, 0) * LOCK_LENGTH
    middle = root + normal * (0.5 * MM + out) + [0, 0, 1] * (up - down) + [1, 0, 0] * (0.018 * way)
    side = np.linspace(-0.5, 0.5, LOCK_COLUMNS)
    width = LOCK_WIDTH * (1 - 0.7 * way)
    vertices = (middle[:, None] + across * (width * side)[:, :, None]).reshape(-1, 3)
    at = np.arange(len(vertices)).reshape(LOCK_ROWS, LOCK_COLUMNS)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1)
    lock = add_mesh("Lock", vertices, quads.reshape(-1, 4).tolist(), None)
    along = lock.data.attributes.new("along", "BOOLEAN", "EDGE")
    for edge in lock.data.edges:
        a, b = edge.vertices
        along.data[edge.index].value = abs(a - b) != 1
    pin = lock.vertex_groups.new(name="Root")
    for row, weight in enumerate((1.0, 1.0, 0.6, 0.2)):
        pin.add(at[row].tolist(), weight, "REPLACE")
    follow_skin(lock, head)
    cloth = simulate(lock, 0.02, 0.35, first, last)
    cloth.settings.vertex_group_mass = "Root"
    cloth.settings.tension_stiffness = cloth.settings.compression_stiffness = 40
    cloth.settings.shear_stiffness = 20
    hair.grow(lock, add_material("Hair", (0.035, 0.019, 0.011), 0.3))
    return lock


def follow_skin(thing, head):
    """Bind an object to the posed skin by a Surface Deform modifier. Raises if this fails."""
    bound = thing.modifiers.new("Skin", "SURFACE_DEFORM")
    bound.target = head
    with bpy.context.temp_override(object=thing, active_object=thing):
        bpy.ops.object.surfacedeform_bind(modifier=bound.name)
    if not bound.is_bound:
        raise RuntimeError("the lock was not bound to the face")


def bake(controls):
    performance.choose(controls)
    performance.must(bpy.ops.risorius.bake_physics())


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    demo.timed("install the extension", lambda: install_extension.install(args.extension))
    controls = performance.import_face(args.dna, 0)
    collection = controls.users_collection[0]
    scene = bpy.context.scene
    scene.render.fps = acting.FRAME_RATE
    first, last = 1, SETTLE + acting.LAST_FRAME
    scene.frame_start, scene.frame_end = first, last
    demo.act(controls)
    for curve in demo.curves(controls.animation_data.action):
        for point in curve.keyframe_points:
            point.co_ui.x += SETTLE
    scene.frame_set(first)
    stage.build(collection)
    head = next(o for o in collection.all_objects if o.name.endswith("_head_lod0_mesh"))
    add_lock(head, first, last)
    collide(head, 1 * MM)
    add_bust()
    add_scarf(first, last)
    bpy.ops.wm.save_as_mainfile(filepath=str(args.out / "physics.blend"))
    demo.timed("bake physics", lambda: bake(controls))
    bpy.ops.wm.save_mainfile()
    if args.only:
        for frame in args.only:
            demo.still(args.out / f"still_{frame:04d}.png", frame, 480)
        return
    frames = stage.empty_folder(args.out / "frames")
    demo.timed("render", lambda: demo.film(frames, range(SETTLE + 1, last + 1)))


if __name__ == "__main__":
    stage.end_with(main)
