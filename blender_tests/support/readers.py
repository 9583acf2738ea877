# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads exported files without Blender: trimesh, Assimp, OpenUSD and Alembic's own library.

readers.py KIND FILE prints one JSON object. The script runs in a separate
process, because Blender's and the package's copies of OpenUSD or Alembic may conflict in one
process.

    meshes       name -> points [V][3] at rest, material, colors [V][4] if it has a texture
    names        names of all other elements: armatures, bones, shape keys, takes
    opaque       material -> whether it is opaque; empty for Alembic
    begin, end   range of the animation in seconds; in FBX files it begins at 0
    up, metres   up axis, and metres per unit; only USD files state them, for other formats they
                 are the convention of the format
"""

import base64
import io
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np


def _colors(picture, uvs):
    """The RGBA colours of a picture at UV coordinates, [V][4], 0 to 1; v increases upwards."""
    from PIL import Image

    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("RGBA"), np.float64) / 255
    height, width = pixels.shape[:2]
    column = np.clip((uvs[:, 0] * width).astype(int), 0, width - 1)
    row = np.clip(((1 - uvs[:, 1]) * height).astype(int), 0, height - 1)
    return pixels[row, column].tolist()


def gltf(path):
    import trimesh

    scene = trimesh.load(path, process=False)
    meshes, opaque = {}, {}
    for node in scene.graph.nodes_geometry:
        place, name = scene.graph[node]
        item = scene.geometry[name]
        material = item.visual.material
        points = np.asarray(item.vertices) @ place[:3, :3].T + place[:3, 3]
        found = {"points": points.tolist(), "material": material.name}
        image = material.baseColorTexture
        if image is not None:
            stored = io.BytesIO()
            image.save(stored, "PNG")
            stored.seek(0)
            found["colors"] = _colors(stored, np.asarray(item.visual.uv))
        meshes[node] = found
        opaque[material.name] = material.alphaMode in (None, "OPAQUE")
    tree = _tree(Path(path).read_bytes())
    times = [
        tree["accessors"][s["input"]] for a in tree.get("animations", ()) for s in a["samplers"]
    ]
    names = [n["name"] for n in tree["nodes"] if n["name"] not in meshes]
    names += [s["name"] for s in tree["scenes"] if "name" in s]
    names += [a["name"] for a in tree["animations"]]
    names += [n for m in tree["meshes"] for n in m.get("extras", {}).get("targetNames", ())]
    begin, end = min(t["min"][0] for t in times), max(t["max"][0] for t in times)
    return meshes, names, opaque, (begin, end), ("Y", 1.0)


def _tree(content):
    """The JSON object in the bytes of a .glb file."""
    return json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])


def fbx(path):
    """Read an FBX file with Assimp's command, which exports its contents as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        told = Path(folder) / "told.json"
        command = ["assimp", "export", str(path), str(told), "-fassjson"]
        subprocess.run(command, check=True, capture_output=True)
        scene = json.loads(told.read_text(encoding="utf-8"))
    materials = [{p["key"]: p for p in m["properties"]} for m in scene["materials"]]
    pictures = [base64.b64decode(t["data"]) for t in scene.get("textures", ())]
    meshes, names = {}, [scene["animations"][0]["name"]]

    def visit(node, above):
        place = above @ np.reshape(node["transformation"], (4, 4))
        if not node.get("meshes"):
            names.append(node["name"])
        for number in node.get("meshes", ()):
            item = scene["meshes"][number]
            points = np.reshape(item["vertices"], (-1, 3)) @ place[:3, :3].T + place[:3, 3]
            look = materials[item["materialindex"]]
            found = {"points": points.tolist(), "material": look["?mat.name"]["value"]}
            picture = look.get("$raw.DiffuseColor|file")
            if picture:
                uvs = np.reshape(item["texturecoords"][0], (-1, item["numuvcomponents"][0]))
                content = io.BytesIO(pictures[int(picture["value"].removeprefix("*"))])
                found["colors"] = _colors(content, uvs)
            meshes[node["name"]] = found
        for child in node.get("children", ()):
            visit(child, place)

    visit(scene["rootnode"], np.eye(4))
    opaque = {
        m["?mat.name"]["value"]: m["$mat.opacity"]["value"] == 1
        and "$raw.TransparencyFactor|file" not in m
        for m in materials
    }
    take = scene["animations"][0]
    span = 0.0, take["duration"] / take["tickspersecond"]
    return meshes, names, opaque, span, ("Y", 0.01)


def usd(path):
    from pxr import Usd, UsdGeom, UsdShade

    stage = Usd.Stage.Open(str(path))
    meshes, opaque = {}, {}
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh):
            continue
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get())
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
        found = {"points": points.tolist(), "material": material.GetPrim().GetName()}
        shader = material.ComputeSurfaceSource()[0]
        color = shader.GetInput("diffuseColor").GetConnectedSources()[0]
        if color:
            file = color[0].source.GetPrim().GetAttribute("inputs:file").Get()
            primvar = next(
                v
                for v in UsdGeom.PrimvarsAPI(prim).GetPrimvars()
                if "texCoord" in str(v.GetTypeName())
            )
            uvs = np.zeros((len(points), 2))
            uvs[np.array(mesh.GetFaceVertexIndicesAttr().Get())] = primvar.ComputeFlattened()
            found["colors"] = _colors(file.resolvedPath, uvs)
        opacity = shader.GetInput("opacity")
        plain = opacity is None or not opacity.Get() or opacity.Get() == 1.0
        opaque[found["material"]] = plain and not (opacity and opacity.HasConnectedSource())
        meshes[prim.GetName()] = found
    names = [p.GetName() for p in stage.Traverse() if p.GetName() not in meshes]
    for prim in stage.Traverse():
        if prim.GetTypeName() == "Skeleton":
            names += [j.rpartition("/")[2] for j in prim.GetAttribute("joints").Get()]
    rate = stage.GetTimeCodesPerSecond()
    span = stage.GetStartTimeCode() / rate, stage.GetEndTimeCode() / rate
    up = UsdGeom.GetStageUpAxis(stage)
    return meshes, names, opaque, span, (up, UsdGeom.GetStageMetersPerUnit(stage))


def alembic(path):
    from alembic3d import Abc, AbcGeom

    archive = Abc.IArchive(str(path))
    meshes, names = {}, []
    folder = Path(path).with_name(Path(path).stem + "_textures")

    def visit(parent):
        for number in range(parent.getNumChildren()):
            child = parent.getChild(number)
            if AbcGeom.IPolyMesh.matches(child.getHeader()):
                schema = AbcGeom.IPolyMesh(parent, child.getName()).getSchema()
                meshes[child.getName()] = _abc_mesh(schema, folder)
            else:
                names.append(child.getName())
                visit(child)

    def _abc_mesh(schema, folder):
        now = Abc.ISampleSelector(0)
        value = schema.getValue(now)
        points = np.array([(p.x, p.y, p.z) for p in value.getPositions()])
        found = {"points": points.tolist(), "material": str(schema.getFaceSetNames()[0])}
        picture = folder / f"{found['material']}_color.png"
        if picture.exists():
            values = schema.getUVsParam().getExpandedValue(now).getVals()
            uvs = np.zeros((len(points), 2))
            uvs[np.array(list(value.getFaceIndices()))] = [(v.x, v.y) for v in values]
            found["colors"] = _colors(picture, uvs)
        return found

    visit(archive.getTop())
    begin, end = Abc.GetArchiveStartAndEndTime(archive)
    names = [n for n in names if n not in meshes]
    return meshes, names, {}, (begin, end), ("Y", 1.0)


if __name__ == "__main__":
    reader = {"GLTF": gltf, "FBX": fbx, "USD": usd, "ALEMBIC": alembic}[sys.argv[1]]
    meshes, names, opaque, (begin, end), (up, metres) = reader(sys.argv[2])
    found = {"meshes": meshes, "names": names, "opaque": opaque, "begin": begin, "end": end}
    print(json.dumps({**found, "up": up, "metres": metres}))
