# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes faces with every kind of mesh, small textures, and renders of them."""

import bpy
import numpy as np
import risorius
from mathutils import Vector

from .faces import small_face

# Name of a mesh without the ending for its LOD -> kind of its material, as plans.kind_of gives it.
KINDS = {
    "head": "skin",
    "body": "skin",
    "eyeLeft": "eyes",
    "eyeshell": "wet",
    "eyeEdge": "wet",
    "cartilage": "gum",
    "saliva": "wet",
    "teeth": "teeth",
    "tongue": "tongue",
    "eyelashes": "lashes",
}


def copy_mesh(mesh, offset=(0.0, 0.0, 0.0), scale=1.0):
    """A copy of a mesh without blend shapes, scaled about its middle and shifted.

    Args:
        mesh: the mesh.
        offset: the shift, in the axes and unit of the Dna.
        scale: factor of the size.
    """
    middle = mesh.positions.mean(axis=0)
    moved = (mesh.positions - middle) * scale + middle + np.array(offset, np.float32)
    names = ("normals", "texture_coordinates", "layout_positions", "layout_normals")
    names += ("layout_texture_coordinates", "face_offsets", "face_layouts")
    names += ("maximum_influence_per_vertex", "skin_offsets", "skin_weights", "skin_joint_indices")
    kept = {n: getattr(mesh, n) for n in names}
    return risorius.Mesh(positions=moved.astype(np.float32), **kept)


def set_meshes(dna, meshes):
    """Replace the meshes of a face, which then has one LOD. Returns the same Dna.

    Args:
        dna: the face.
        meshes: name -> new Mesh.
    """
    dna.mesh_names, dna.meshes = list(meshes), list(meshes.values())
    dna.lod_count = 1
    dna.lod_mesh_mapping = [list(range(len(meshes)))]
    for name in ("joint", "blend_shape", "animated_map"):
        kept = list(getattr(dna, f"lod_{name}_mapping")[0])
        setattr(dna, f"lod_{name}_mapping", [kept])
    for owner in (dna.blend_shape_channels, dna.animated_maps):
        owner.lods = list(owner.lods)[:1]
    for group in dna.joint_groups:
        group.lods = list(group.lods)[:1]
    dna.mesh_blend_shape_channel_mapping = [
        (m, t.blend_shape_channel_index)
        for m, mesh in enumerate(dna.meshes)
        for t in mesh.blend_shape_targets
    ]
    return dna


def every_kind():
    """A Dna with one mesh for each name in KINDS; MetaHumans have meshes with these names."""
    dna = small_face()
    patch = dna.meshes[1]
    meshes = {"head_lod0_mesh": dna.meshes[0]}
    for name in KINDS:
        if name != "head":
            meshes[f"{name}_lod0_mesh"] = copy_mesh(patch, scale=0.5 if "eye" in name else 1.0)
    return set_meshes(dna, meshes)


def write_image(path, pixels):
    """Write pixels as a PNG file, without conversion between colour spaces.

    Args:
        path: path of the file.
        pixels: float[H, W, 3 or 4], values from 0 to 1, row 0 at the bottom.
    """
    height, width, channels = pixels.shape
    image = bpy.data.images.new(path.stem, width, height, alpha=channels == 4)
    image.colorspace_settings.is_data = True
    image.alpha_mode = "CHANNEL_PACKED"
    full = np.ones((height, width, 4), np.float32)
    full[..., :channels] = pixels
    image.pixels.foreach_set(full.ravel())
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)


def halves(left, right, size=16):
    """Square pixels with one colour in each half, float32[size, size, n].

    Args:
        left: colour with n channels of the left half, u < 0.5.
        right: colour of the right half.
        size: width and height in pixels.
    """
    pixels = np.empty((size, size, len(left)), np.float32)
    pixels[:, : size // 2], pixels[:, size // 2 :] = left, right
    return pixels


def stage(items, size=32, engine="CYCLES", samples=4):
    """Add two suns, and an orthographic camera that sees some objects from the front (-y).

    Args:
        items: the objects to show.
        size: width and height of the render in pixels.
        engine: render engine.
        samples: samples per pixel.

    Returns:
        The scene, and the x and z coordinates that each pixel shows: float[size, size] each.
    """
    setup = bpy.context.scene
    setup.render.engine = engine
    if engine == "CYCLES":
        setup.cycles.samples, setup.cycles.device = samples, "CPU"
        setup.cycles.use_denoising = False
        setup.cycles.seed, setup.cycles.max_bounces = 3, 4
        setup.cycles.diffuse_bounces = setup.cycles.glossy_bounces = 0
    else:
        setup.eevee.taa_render_samples = samples
    setup.render.resolution_x = setup.render.resolution_y = size
    setup.render.image_settings.file_format = "PNG"
    setup.view_settings.view_transform = "Standard"
    corners = [i.matrix_world @ Vector(c) for i in items for c in i.bound_box]
    low = np.min([list(c) for c in corners], axis=0)
    high = np.max([list(c) for c in corners], axis=0)
    middle, reach = (low + high) / 2, float(max(high[0] - low[0], high[2] - low[2])) * 1.1
    data = bpy.data.cameras.new("camera")
    data.type, data.ortho_scale = "ORTHO", reach
    camera = bpy.data.objects.new("camera", data)
    camera.location = (middle[0], low[1] - 1.0, middle[2])
    camera.rotation_euler = (np.pi / 2, 0, 0)
    setup.collection.objects.link(camera)
    setup.camera = camera
    for name, turn, power in (("key", (0.9, 0.0, 0.5), 4.0), ("fill", (1.2, 0.0, -0.7), 1.0)):
        sun = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
        sun.data.energy = power
        sun.rotation_euler = turn
        setup.collection.objects.link(sun)
    steps = (np.arange(size) + 0.5) / size - 0.5
    x, z = np.meshgrid(middle[0] + steps * reach, middle[2] + steps * reach)
    return setup, (x, z)


def render(setup, path):
    """Render the current frame to a file. Returns its pixels, float32[size, size, 4].

    Row 0 of the pixels is at the bottom.
    """
    setup.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path), check_existing=False)
    flat = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(flat)
    size = tuple(image.size)
    bpy.data.images.remove(image)
    return flat.reshape(size[1], size[0], 4)


def upstream(socket):
    """All nodes whose output reaches an input socket, directly or through other nodes."""
    seen, todo = set(), [link.from_node for link in socket.links]
    while todo:
        node = todo.pop()
        if node not in seen:
            seen.add(node)
            todo += [link.from_node for s in node.inputs for link in s.links]
    return seen


def principled(material):
    """The Principled BSDF node of a material, or None if it has none."""
    return next((n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
