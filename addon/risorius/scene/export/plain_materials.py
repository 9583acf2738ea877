# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts materials for exporters: one Principled shader with at most one image at each input.

Cycles bakes the node trees of inputs into images on the CPU. An image that reaches an input
unchanged is reused. Relief from nodes is left out, because it is finer than the images. Only the
temporary copies of an export are converted.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...logic.material import texture_search, uv_grid
from ..base import compat
from ..base.blender_types import MeshObject, Node, NodeTree, Override, Socket
from ..base.console import quiet
from ..material import image_loading
from . import shader_inputs
from .lent_names import Loans

_INPUTS = {"color": ("Base Color", "Color"), "alpha": ("Alpha",), "roughness": ("Roughness",)}
_MASKS = ("alpha", "roughness")  # baked into one image, as red and green
_SOCKETS = {"color": "Base Color", "roughness": "Roughness", "normal": "Normal"}
# Inputs of the Principled shader whose numbers are copied, because glTF and USD support these
# inputs. Textures of these inputs are left out.
_NUMBERS = ("Metallic", "Specular IOR Level", "IOR", "Coat Weight", "Coat Roughness", "Coat IOR")
_FILM = 0.05  # opacity of a wet film: low to show the iris, not 0 because its highlight fades too
_LAYER = "risorius_flat"  # name of the UV layer and of the image node of a bake
_WET = 0.08  # roughness of a wet film


@dataclass
class _Flat:
    """A material during its conversion.

    Attributes:
        material: the user's material.
        name: name of the user's material before the export.
        work: a copy for baking; None if the material has no nodes.
        users: (mesh object, slot number) with this material.
        shader: the shader node of the copy; None for a transparent film or without nodes.
        clear: True: the material is transparent in places.
        sources: input "color", "alpha" or "roughness" -> shader_inputs.Source.
        images: input -> reused or baked image, including "normal".
        baked: inputs to bake.
        mean: True: roughness becomes one number, because polygons overlap in the UV map; after the
            bake, this number.
    """

    material: bpy.types.Material
    name: str
    work: bpy.types.Material | None = None
    users: list[tuple[MeshObject, int]] = field(default_factory=list)
    shader: Node | None = None
    clear: bool = False
    sources: dict[str, shader_inputs.Source] = field(default_factory=dict)
    images: dict[str, bpy.types.Image] = field(default_factory=dict)
    baked: set[str] = field(default_factory=set)
    mean: bool | float = False


def flatten(override: Override, loans: Loans, size: int) -> Generator[float, None, None]:
    """Replace the materials of copied meshes by plain materials; a generator.

    Args:
        override: context override of the export, from export_animation.copies.
        loans: lent_names.Loans for the names of the materials.
        size: width and height of baked images in pixels; images of roughness alone are smaller.

    Yields:
        The progress, 0 to 1.

    Raises:
        FaceError: Cycles is missing, a mesh already has the maximum of eight UV maps, or the file
            of a reused image is missing.
    """
    items = [o for o in override["scene"].objects if o.type == "MESH"]
    for item in items:
        _join_slots(item)
    flats = _gather(items)
    for flat in flats:
        _read(flat)
        _lay_out(flat)
    if any(flat.baked for flat in flats):
        yield from _bake(override, items, flats, size)
    files: list[str] = []
    made = [_build(flat, loans, files) for flat in flats]
    for flat, material in zip(flats, made, strict=True):
        for item, slot in flat.users:
            item.material_slots[slot].material = material
    for item in items:
        _keep_one_layout(item.data)
    yield 1.0


def _join_slots(item: MeshObject) -> None:
    """Merge neighbouring material slots whose materials have equal node trees.

    An eye has two such slots, because their materials have different colours in solid view.
    """
    slots = item.data.materials
    for number in range(len(slots) - 1, 0, -1):
        one, other = slots[number - 1], slots[number]
        trees = [m.node_tree for m in (one, other) if m is not None and m.node_tree is not None]
        if len(trees) == 2 and shader_inputs.alike(*trees):
            slots.pop(index=number)  # Blender assigns its polygons to the slot before it


def _gather(items: Iterable[MeshObject]) -> list[_Flat]:
    found = {}
    for item in items:
        for number, slot in enumerate(item.material_slots):
            if slot.material is not None:
                flat = found.setdefault(slot.material, _Flat(slot.material, slot.material.name))
                flat.users.append((item, number))
    return list(found.values())


# --- sources of inputs: reuse or bake -----------------------------------------------------------


def _read(flat: _Flat) -> None:
    """Find the source of each input of a material: a number, a reused image, or a bake."""
    if flat.material.node_tree is None:
        return
    flat.work = flat.material.copy()
    tree = flat.work.node_tree
    shader_inputs.rest_maps(tree)
    flat.shader, flat.clear = shader_inputs.shader_of(tree)
    if flat.shader is None:
        return
    flat.sources = {n: shader_inputs.source(flat.shader, *i) for n, i in _INPUTS.items()}
    color, alpha = flat.sources["color"], flat.sources["alpha"]
    mapped = all(item.data.uv_layers for item, _ in flat.users)
    whole = alpha.socket is None or alpha.is_alpha_of(color)
    if mapped and color.is_picture() and whole:
        flat.images["color"] = color.picture()
    if mapped and flat.sources["roughness"].is_picture():
        flat.images["roughness"] = flat.sources["roughness"].picture()
    normal = shader_inputs.normal_image(flat.shader) if mapped else None
    if normal is not None:
        flat.images["normal"] = normal.image
    flat.baked = {n for n, s in flat.sources.items() if s.socket and n not in flat.images}
    if "color" in flat.images:
        flat.baked.discard("alpha")  # the reused image contains the alpha
    elif "alpha" in flat.baked:
        flat.baked.add("color")  # even if it is a number, because its image stores the opacity


def _lay_out(flat: _Flat) -> None:
    """Choose the UV coordinates for baking a material.

    The meshes get a UV map for baking if their own UV map is missing or cannot be used.
    """
    if not flat.baked:
        return
    users = [(item, *_corners(item, slot)) for item, slot in flat.users]
    old = [_coordinates(item)[corners] for item, corners, _ in users]
    totals = np.concatenate([t for _, _, t in users])
    joined = np.concatenate(old)
    mapped = all(item.data.uv_layers for item, _ in flat.users)
    alone = not flat.images
    on_itself = mapped and uv_grid.overlaps(joined, totals)
    painted = [flat.sources[n].socket for n in flat.baked & {"color", "alpha"}]
    placed = any(s is not None and shader_inputs.by_place(s) for s in painted)
    new = None
    if alone and (not mapped or (on_itself and placed)):
        new, on_itself = uv_grid.cells(totals), False
    elif alone:
        new = uv_grid.spread(joined)
    flat.mean = on_itself and "roughness" in flat.baked
    if new is not None:
        for (item, corners, _), part in zip(users, np.split(new, _ends(old)), strict=True):
            _write(item.data, corners, part)


def _ends(parts: Iterable[NDArray[np.float32]]) -> NDArray[np.int64]:
    return np.cumsum([len(p) for p in parts])[:-1]


def _corners(item: MeshObject, slot: int) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """The corners of the polygons that use a material slot, int64[n], and the number of corners of
    each of these polygons, int32[polygons]."""
    mesh = item.data
    index, total = np.empty(len(mesh.polygons), np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("material_index", index)
    mesh.polygons.foreach_get("loop_total", total)
    shown = np.minimum(index, len(item.material_slots) - 1) == slot
    return np.flatnonzero(np.repeat(shown, total)), total[shown]


def _coordinates(item: MeshObject) -> NDArray[np.float32]:
    """float32[corners, 2]: the UV map that is active for rendering; 0 without a UV map."""
    mesh = item.data
    flat = np.zeros(len(mesh.loops) * 2, np.float32)
    layer = _shown_layer(mesh)
    if layer is not None:
        layer.uv.foreach_get("vector", flat)
    return flat.reshape(-1, 2)


def _shown_layer(mesh: bpy.types.Mesh) -> bpy.types.MeshUVLoopLayer | None:
    return next((y for y in mesh.uv_layers if y.active_render), None)


def _write(mesh: bpy.types.Mesh, corners: NDArray[np.int64], part: NDArray[np.float32]) -> None:
    """Write UV coordinates of some corners into the UV map for baking.

    A missing UV map for baking is created as a copy of the UV map that is active for rendering.

    Args:
        mesh: the copied mesh.
        corners: int64[n], indices of the corners.
        part: float32[n, 2], their UV coordinates.
    """
    shown, layer = _shown_layer(mesh), mesh.uv_layers.get(_LAYER)
    values = np.zeros(len(mesh.loops) * 2, np.float32)
    begins = layer or shown
    if begins is not None:
        begins.uv.foreach_get("vector", values)
    layer = layer or mesh.uv_layers.new(name=_LAYER, do_init=False)
    if layer is None:
        raise FaceError(
            told("{mesh} has eight UV maps: remove one to bake its materials.", mesh=mesh.name)
        )
    values.reshape(-1, 2)[corners] = part
    layer.uv.foreach_set("vector", values)


def _keep_one_layout(mesh: bpy.types.Mesh) -> None:
    """Copy the coordinates of the UV map for baking into the UV map that is active for rendering.

    The UV map for baking is then removed. If it is the only UV map, it stays as "UVMap" instead.
    """
    layer, shown = mesh.uv_layers.get(_LAYER), _shown_layer(mesh)
    if layer is None:
        return
    if shown is None or shown.name == _LAYER:
        layer.name = "UVMap"
        return
    values = np.empty(len(mesh.loops) * 2, np.float32)
    layer.uv.foreach_get("vector", values)
    shown.uv.foreach_set("vector", values)
    mesh.uv_layers.remove(layer)


# --- baking ------------------------------------------------------------------------------------


def _bake(
    override: Override, items: Sequence[MeshObject], flats: Sequence[_Flat], size: int
) -> Iterator[float]:
    """Bake all materials: first colours, then opacity and roughness together. Yields progress.

    Args:
        override: context override of the export.
        items: the copied meshes.
        flats: their materials.
        size: width and height of baked images in pixels; images of roughness alone are smaller.
    """
    _prepare(override["scene"], size)
    spare = bpy.data.images.new("Spare", 4, 4)
    jobs = [
        (item, inputs)
        for inputs in (("color",), _MASKS)
        for item in items
        if any(flat.baked & set(inputs) for flat in _shown_on(item, flats))
    ]
    targets = {}
    for number, (item, inputs) in enumerate(jobs):
        yield number / len(jobs)
        for flat in _shown_on(item, flats):
            wanted = [n for n in inputs if n in flat.baked]
            key = (flat.material, inputs)
            if wanted and key not in targets:
                targets[key] = _new_image(flat, inputs[0], size)
            _aim(flat, wanted, targets.get(key, spare))
        _bake_one(override, items, item)
    bpy.data.images.remove(spare)
    for item in items:
        item.hide_render = False
    for flat in flats:
        _read_back(flat, *(targets.get((flat.material, i)) for i in (("color",), _MASKS)))


def _prepare(stage: bpy.types.Scene, size: int) -> None:
    """Set up Cycles on the CPU with one sample, because baked inputs contain no light."""
    try:
        stage.render.engine = "CYCLES"  # pyright: ignore[reportAttributeAccessIssue]
    except TypeError:
        raise FaceError(
            told("Cycles bakes the materials: enable its add-on, or switch Bake Materials off")
        ) from None
    cycles: Any = stage.cycles
    cycles.device, cycles.samples = "CPU", 1
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    settings = stage.render.bake
    settings.margin, settings.margin_type = max(size // 64, 4), "EXTEND"
    settings.use_clear = settings.use_selected_to_active = False
    settings.target = "IMAGE_TEXTURES"


def _shown_on(item: MeshObject, flats: Iterable[_Flat]) -> list[_Flat]:
    return [flat for flat in flats if any(user == item for user, _ in flat.users)]


def _new_image(flat: _Flat, name: str, size: int) -> bpy.types.Image:
    """An empty image for a bake. It is smaller if it stores roughness without opacity.

    Args:
        flat: the material.
        name: "color", or "alpha" for the image with opacity and roughness.
        size: width and height in pixels.
    """
    if name != "color" and "alpha" not in flat.baked:
        size = 64 if flat.mean else max(size // 4, 64)
    image = bpy.data.images.new(f"{flat.name}_{name}", size, size, alpha=True)
    image.generated_color = (0.0, 0.0, 0.0, 0.0)
    image_loading.set_color_space(image, name != "color")
    return image


def _aim(flat: _Flat, wanted: Sequence[str], image: bpy.types.Image) -> None:
    """Set up the copy of a material for a bake: the copy emits the values of inputs as colour.

    Args:
        flat: the material.
        wanted: names of the inputs: ["color"], or "alpha" and "roughness", which are emitted as red
            and green; empty: only the image is set.
        image: the image into which the bake writes.
    """
    if flat.work is None:
        flat.work = flat.material.copy()
        compat.make_node_tree(flat.work)
    tree: NodeTree = flat.work.node_tree
    for item, slot in flat.users:
        item.material_slots[slot].material = flat.work
    target = tree.nodes.get(_LAYER) or tree.nodes.new("ShaderNodeTexImage")
    target.name, target.image = _LAYER, image
    for node in tree.nodes:
        node.select = node == target
    tree.nodes.active = target
    if not wanted:
        return
    glow = tree.nodes.new("ShaderNodeEmission")
    if wanted == ["color"]:
        _feed(tree, flat.sources["color"], glow.inputs["Color"])
    else:
        both = tree.nodes.new("ShaderNodeCombineColor")
        for name, socket in zip(_MASKS, both.inputs, strict=False):
            _feed(tree, flat.sources[name], socket)
        tree.links.new(both.outputs[0], glow.inputs["Color"])
    output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
    tree.links.new(glow.outputs[0], output.inputs["Surface"])


def _feed(tree: NodeTree, source: shader_inputs.Source, socket: Socket) -> None:
    if source.socket is not None:
        tree.links.new(source.socket, socket)
    elif source.value is not None:
        socket.default_value = source.value


def _bake_one(override: Override, items: Iterable[MeshObject], item: MeshObject) -> None:
    """Bake one mesh; the others are hidden, because Cycles would load them for each bake."""
    for other in items:
        other.hide_render = other != item
    layer = item.data.uv_layers.get(_LAYER) or _shown_layer(item.data)
    assert layer is not None
    layer.active = True
    alone = {**override, "selected_objects": [item], "active_object": item, "object": item}
    with bpy.context.temp_override(**alone), quiet():
        bpy.ops.object.bake(type="EMIT")


def _read_back(flat: _Flat, color: bpy.types.Image | None, masks: bpy.types.Image | None) -> None:
    """Store baked images in a material: colour with opacity, and roughness as image or number.

    Args:
        flat: the material.
        color: baked image of the colour, or None.
        masks: baked image with opacity in red and roughness in green, or None.
    """
    values = _pixels(masks) if masks is not None else np.zeros((0, 0, 4), np.float32)
    if color is not None:
        _finish_color(color, values[..., 0] if "alpha" in flat.baked else None)
        flat.images["color"] = color
    if "roughness" not in flat.baked or masks is None:
        return
    if flat.mean:
        seen = values[..., 3] > 0
        flat.mean = float(values[seen, 1].mean()) if seen.any() else 0.5
        return
    values[..., :3], values[..., 3] = values[..., 1:2], 1.0
    masks.name = f"{flat.name}_roughness"
    _store(masks, values, "NONE")
    flat.images["roughness"] = masks


def _finish_color(image: bpy.types.Image, alpha: NDArray[np.float32] | None) -> None:
    """Store the opacity of a material in the alpha channel of its baked colour image.

    Args:
        image: the colour image.
        alpha: float32[height, width], the opacity; None: the alpha channel is set to 1, and
            Blender ignores it.
    """
    values = _pixels(image)
    seen = values[..., 3] > 0
    if seen.any():  # mipmaps blend unused pixels into used ones, so fill them with the mean colour
        values[~seen, :3] = values[seen, :3].mean(axis=0)
    values[..., 3] = 1.0 if alpha is None else alpha
    _store(image, values, "NONE" if alpha is None else "STRAIGHT")


def _store(image: bpy.types.Image, values: NDArray[np.float32], alpha_mode: str) -> None:
    image.alpha_mode = alpha_mode  # pyright: ignore[reportAttributeAccessIssue]
    pixels: Any = image.pixels
    pixels.foreach_set(values.ravel())
    image.update()


def _pixels(image: bpy.types.Image) -> NDArray[np.float32]:
    """float32[height, width, 4]: the pixels of an image, bottom row first."""
    values = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    pixels: Any = image.pixels
    pixels.foreach_get(values)
    return values.reshape(image.size[1], image.size[0], 4)


# --- the plain material ------------------------------------------------------------------------


def _build(flat: _Flat, loans: Loans, files: list[str]) -> bpy.types.Material:
    """Make the plain material that replaces a user's material in the exported file.

    Args:
        flat: the user's material, with the images of its inputs.
        loans: gives the plain material the name of the user's material.
        files: names of image files; the names of the material's image files are appended.
    """
    user = flat.material
    material = bpy.data.materials.new(flat.name)
    loans.take("materials", material, flat.name)
    material.diffuse_color = user.diffuse_color
    material.use_backface_culling = user.use_backface_culling
    compat.make_node_tree(material)
    nodes = compat.tree_of(material).nodes
    shader: Node = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
    if flat.shader is None:
        _plain_look(flat, shader)
    else:
        _take_numbers(flat, shader)
        _take_images(flat, material, shader, files)
    if flat.clear or shader.inputs["Alpha"].is_linked or shader.inputs["Alpha"].default_value < 1:
        material.surface_render_method = "BLENDED"
    return material


def _plain_look(flat: _Flat, shader: Node) -> None:
    """Set up a material without a shader: a transparent film, or the colours of solid view."""
    color = tuple(flat.material.diffuse_color)
    if flat.clear:
        shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
        shader.inputs["Alpha"].default_value = _FILM
        shader.inputs["Roughness"].default_value = _WET
        return
    shader.inputs["Base Color"].default_value = (*color[:3], 1.0)
    shader.inputs["Roughness"].default_value = flat.material.roughness


def _take_numbers(flat: _Flat, shader: Node) -> None:
    assert flat.shader is not None
    for name in _NUMBERS:
        if name in flat.shader.inputs and name in shader.inputs:
            shader.inputs[name].default_value = flat.shader.inputs[name].default_value
    for name, (socket, *_) in _INPUTS.items():
        value = flat.sources[name].value
        if name == "roughness" and flat.mean:
            value = flat.mean
        if value is not None:
            shader.inputs[socket].default_value = value


def _take_images(flat: _Flat, material: bpy.types.Material, shader: Node, files: list[str]) -> None:
    tree = compat.tree_of(material)
    for name, image in flat.images.items():
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = _packed(flat, name, image, files)
        socket, feeding = shader.inputs[_SOCKETS[name]], node.outputs["Color"]
        if name == "normal":
            between = tree.nodes.new("ShaderNodeNormalMap")
            tree.links.new(feeding, between.inputs["Color"])
            feeding = between.outputs["Normal"]
        tree.links.new(feeding, socket)
        if name == "color" and flat.sources["alpha"].socket is not None:
            tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])


def write_images(scene: bpy.types.Scene, folder: Path) -> int:
    """Write the images of the export scene as files, for formats without materials.

    Args:
        scene: scene of the export, after `flatten`.
        folder: folder for the files; created if there are images.

    Returns:
        The number of written files.
    """
    slots = [s for o in scene.objects if o.type == "MESH" for s in o.material_slots if s.material]
    trees: set[NodeTree] = {s.material.node_tree for s in slots if s.material} - {None}
    images = {n.image for t in trees for n in t.nodes if n.type == "TEX_IMAGE" and n.image}
    write_bytes = native.part("files.fileio").write_bytes
    for image in images:
        folder.mkdir(exist_ok=True)
        write_bytes(folder / PurePath(image.filepath_raw).name, image.packed_file.data)
    return len(images)


def _pack(image: bpy.types.Image) -> None:
    """Pack the file of an image. Raises FaceError if the file is missing."""
    try:
        image.pack()
    except RuntimeError as error:
        name = PurePath(image.filepath_raw).name
        raise FaceError(
            told(
                "the image file {name} is missing: restore the file, or remove the image "
                "from its material",
                name=name,
            )
        ) from error


def _packed(flat: _Flat, name: str, image: bpy.types.Image, files: list[str]) -> bpy.types.Image:
    """Pack a baked image, or a copy of a reused image, under a new file name.

    The file name is appended to `files`.

    Returns:
        The packed image.
    """
    taken = name not in flat.baked
    if taken:
        image = image.copy()
        image.name = f"{flat.name}_{name}"
        if image.packed_file is None:
            _pack(image)
    ending = PurePath(image.filepath_raw).suffix.lower() if taken else ""
    # The path is invented: exporters identify images by their paths, and the exported file must not
    # contain paths of this machine.
    known = ending if ending in texture_search.EXTENSIONS else ".png"
    files.append(native.part("files.names").file_name(image.name, known, files))
    image.filepath_raw = f"//{files[-1]}"
    if taken:
        assert image.packed_file is not None
        data = image.packed_file.data  # pack again, because USD uses the path at packing time
        image.pack(data=data, data_len=len(data))
    else:
        image.pack()
    return image
