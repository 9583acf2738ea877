# SPDX-License-Identifier: GPL-3.0-or-later
"""Random actions of a user on faces, and the checks of the faces in between."""

import hashlib
import random
import string

import addon_utils
import bpy
import numpy as np
import risorius

from . import faces, oracle, scene

LIMIT = 6  # largest number of characters
CONTROLS = [c for c in faces.CONTROLS if c.startswith("CTRL") and len(c) < 60]


class WrongFaceError(AssertionError):
    """A face does not follow its controls, or a driver is invalid."""


class World:
    """Random actions on the open file.

    A World stores no Blender objects, because undo replaces them.

    Args:
        folder: folder for the files of the run.
        seed: seed of the random choices.
        characters: number of characters at the beginning.
    """

    def __init__(self, folder, seed, characters):
        self.folder, self.seed, self.characters = folder, seed, characters
        self.blend = folder / "soak.blend"
        self.library = folder / "library.blend"
        self.random = random.Random(seed)
        self.sources, self._oracles = [], {}
        self.repaired = 0  # number of locked overrides that the panel's button unlocked
        for number, axes in enumerate((("right", "up", "front"), ("left", "up", "back"))):
            path = folder / f"Face{number}.dna"
            faces.small_face(name=f"Face{number}", axes=axes).save(str(path))
            self.sources.append(path)
            dna = risorius.load(str(path))
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            self._oracles[digest] = (dna, risorius.Rig(dna), {})

    # -- the file ---------------------------------------------------------------------------

    def begin(self):
        """Save a library file with one character, then make and save the file of the run.

        The file of the run has `characters` characters, and one undo step.
        """
        self._enable()
        bpy.ops.wm.read_homefile(use_empty=True)
        self._import("LIVE" if self.random.random() < 0.5 else "KEYS")
        bpy.ops.wm.save_as_mainfile(filepath=str(self.library))
        bpy.ops.wm.read_homefile(use_empty=True)
        while len(self.rigs()) < self.characters:
            self._import("AUTO")
        self._settings()
        self.render()  # memory that the engine keeps after its first render is no leak
        bpy.ops.ed.undo_push(message="begin")
        bpy.ops.wm.save_as_mainfile(filepath=str(self.blend))

    @staticmethod
    def _settings():
        edit = bpy.context.preferences.edit
        edit.use_global_undo, edit.undo_steps = True, 24
        setup = bpy.context.scene
        setup.render.engine = "CYCLES"
        setup.cycles.samples, setup.cycles.device = 1, "CPU"
        setup.cycles.use_denoising = False
        setup.render.resolution_x = setup.render.resolution_y = 16

    @staticmethod
    def rigs():
        """The deforming armatures of the scene's faces, sorted by name, without linked faces."""
        inside = bpy.context.scene.objects
        found = [o for o in inside if o.library is None and o.get("risorius_controls")]
        return sorted(found, key=lambda o: o.name)

    def _rig(self):
        return self.random.choice(self.rigs())

    @staticmethod
    def _meshes(rig):
        """Index of a mesh in the DNA file -> mesh object of this rig.

        A partial copy of a face also refers to meshes of the original; these are left out.
        """
        held = [rig[k] for k in rig.keys() if k.startswith("risorius_mesh_")]  # noqa: SIM118
        own = [m for m in held if m is not None and m.get("risorius_rig") == rig]
        return {m["dna_mesh"]: m for m in own}

    def _objects(self, rig):
        held = [rig, rig["risorius_controls"], *self._meshes(rig).values()]
        return [o for o in held if o is not None]

    def _activate(self, rig):
        bpy.context.view_layer.objects.active = rig["risorius_controls"]

    def _push(self, message):
        bpy.ops.ed.undo_push(message=message)

    # -- actions of a user ------------------------------------------------------------------

    def slider(self):
        rig = self._rig()
        for name in self.random.sample(CONTROLS, self.random.randint(1, 3)):
            scene.face(rig)[name] = self.random.choice((0.0, 1.0, self.random.random()))
        scene.update(rig["risorius_controls"])

    def key(self):
        self._activate(self._rig())
        bpy.ops.risorius.key(region=self.random.choice(("", "mouth", "jaw")))

    def unkey(self):
        self._rig()["risorius_controls"].animation_data_clear()

    def frame(self):
        bpy.context.scene.frame_set(
            self.random.randint(1, 30), subframe=self.random.choice((0.0, 0.0, 0.5))
        )

    def select(self):
        items = list(bpy.context.view_layer.objects)
        for item in self.random.sample(items, min(3, len(items))):
            item.select_set(self.random.random() < 0.7)
        bpy.context.view_layer.objects.active = self.random.choice(items)
        bpy.context.view_layer.update()

    def reset(self):
        self._activate(self._rig())
        bpy.ops.risorius.reset(region=self.random.choice(("", "mouth")))

    def overdrive(self):
        self._activate(self._rig())
        bpy.ops.risorius.set_overdrive(enable=self.random.random() < 0.5)

    def lod(self):
        rig = self._rig()
        self._activate(rig)
        levels = scene.submodule("scene.lod.lods").built(rig)
        bpy.ops.risorius.set_lod(lod=self.random.choice(levels))

    def lod_by_distance(self):
        camera = bpy.context.scene.camera
        if camera is None:
            camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
            bpy.context.scene.collection.objects.link(camera)
            bpy.context.scene.camera = camera
        camera.location = (0.0, -self.random.choice((0.5, 1.0, 2.0, 4.0)), 1.6)
        self._activate(self._rig())
        bpy.ops.risorius.set_lod_by_distance(enable=self.random.random() < 0.5)

    def place(self):
        """Move, rotate and scale the control armature at random."""
        controls = self._rig()["risorius_controls"]
        controls.location = [self.random.uniform(-1, 1) for _ in range(3)]
        controls.rotation_euler = [self.random.uniform(-1, 1) for _ in range(3)]
        controls.scale = [self.random.choice((1.0, 0.5, 2.0))] * 3
        scene.update(controls)

    def attach(self):
        """Attach a face to a body, or detach it, and then move the body."""
        rig = self._rig()
        self._activate(rig)
        body = bpy.context.scene.objects.get("body") or self._body()
        if bpy.ops.risorius.detach_body.poll() and self.random.random() < 0.5:
            bpy.ops.risorius.detach_body()
        else:
            bpy.ops.risorius.attach_body(body=body.name, base="base", fit="NONE")
        body.pose.bones["base"].location = [self.random.uniform(-0.2, 0.2) for _ in range(3)]
        scene.update(body)

    def _body(self):
        body = bpy.data.objects.new("body", bpy.data.armatures.new("body"))
        bpy.context.scene.collection.objects.link(body)
        active = bpy.context.view_layer.objects.active
        bpy.context.view_layer.objects.active = body
        bpy.ops.object.mode_set(mode="EDIT")
        bone = body.data.edit_bones.new("base")
        bone.tail = (0.0, 0.0, 1.0)
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.context.view_layer.objects.active = active
        return body

    def test_channel(self):
        """Test blend shape channel 1, and end the test by the operator or by another frame."""
        self._activate(self._rig())
        bpy.ops.risorius.test_channel(channel="1", value=self.random.random())
        if self.random.random() < 0.5:
            bpy.ops.risorius.test_channel(end=True)
        else:
            bpy.context.scene.frame_set(bpy.context.scene.frame_current + 1)

    def shape_mode(self):
        self._activate(self._rig())
        bpy.ops.risorius.set_shape_mode(mode=self.random.choice(("LIVE", "KEYS", "AUTO")))

    def own_key(self):
        item = self.random.choice(list(self._meshes(self._rig()).values()))
        if not (item.data.library or item.data.override_library):
            block = item.shape_key_add(name="mine", from_mix=False)
            block.value = 0.0
            bpy.context.view_layer.update()

    def drop_own_key(self):
        for item in self._meshes(self._rig()).values():
            key = item.data.shape_keys
            locked = item.data.library or item.data.override_library
            for block in list(key.key_blocks) if key and not locked else ():
                if block.name.startswith("mine"):
                    item.shape_key_remove(block)

    def rename(self):
        rig = self._rig()
        controls = rig["risorius_controls"]
        mesh = self.random.choice(list(self._meshes(rig).values()))
        homes = [c for c in bpy.data.collections if rig in c.objects[:]]
        held = [rig, controls, mesh, *homes, rig["risorius_dna"]]
        held += [m for m in mesh.data.materials if m]
        for bones in (rig.data.bones, controls.data.bones):
            if rig.data.library is None:
                held.append(self.random.choice(list(bones)))
        key = mesh.data.shape_keys
        if key and not (mesh.data.library or mesh.data.override_library):
            held.append(self.random.choice(list(key.key_blocks)[1:]))
        letters = string.ascii_letters + "äß漢. \"'\\]"
        words = "".join(self.random.choices(letters, k=self.random.randint(1, 70)))
        item = self.random.choice([h for h in held if not getattr(h, "library", None)])
        item.name = words
        bpy.context.view_layer.update()

    def hide(self):
        controls = self._rig()["risorius_controls"]
        controls.hide_viewport = self.random.random() < 0.5
        controls.hide_render = self.random.random() < 0.5
        bpy.context.view_layer.update()

    def exclude(self):
        layers = list(bpy.context.view_layer.layer_collection.children)
        if layers:
            number = self.random.randrange(len(layers))
            layers[number].exclude = True
            bpy.context.scene.frame_set(self.random.randint(1, 30))
            bpy.context.view_layer.layer_collection.children[number].exclude = False
            bpy.context.view_layer.update()

    def duplicate(self):
        if len(self.rigs()) >= LIMIT:
            return
        layer = bpy.context.view_layer
        for item in layer.objects:
            item.select_set(False)
        objects = self._objects(self._rig())
        for item in objects:
            item.hide_viewport = False
        layer.update()  # objects hidden until now cannot be selected before this
        for item in objects:
            item.hide_set(False)
            item.select_set(True)
        bpy.ops.object.duplicate(linked=self.random.random() < 0.3)
        layer.update()
        for rig in self.rigs():  # hides the meshes of other LODs again
            scene.submodule("scene.lod.lods").show(rig)
        layer.update()

    def delete(self):
        if len(self.rigs()) > 1:
            self._delete(self._rig())

    def _delete(self, rig):
        """Delete a rig with its meshes, in a random way: by the operator Delete, or from the file.

        Objects of a library override are removed from the file, with the override's collection.
        """
        objects = self._objects(rig)
        controls = rig["risorius_controls"]
        if any(r != rig and r["risorius_controls"] == controls for r in self.rigs()):
            objects.remove(controls)
        if rig.override_library:
            # Blender would create the objects of an override again if the override's collection
            # remained.
            root = rig.override_library.hierarchy_root
            # A copy of an override has the same root collection as the override, but is not in it.
            whole = isinstance(root, bpy.types.Collection) and rig in root.all_objects[:]
            bpy.data.batch_remove([*objects, root] if whole else objects)
        elif self.random.random() < 0.5:
            with bpy.context.temp_override(selected_objects=objects, active_object=rig):
                bpy.ops.object.delete()
        else:
            bpy.data.batch_remove(objects)
        bpy.context.view_layer.update()

    def delete_part(self):
        """Delete one object of a rig, change the frame, and undo the deletion."""
        self._push("whole")
        item = self.random.choice(self._objects(self._rig()))
        bpy.data.objects.remove(item)
        bpy.context.view_layer.update()
        self.frame()
        self._push("ruin")
        bpy.ops.ed.undo()
        bpy.context.view_layer.update()  # the next undo step makes the broken state unreachable

    def _import(self, mode=None):
        path = self.random.choice(self.sources)
        bpy.ops.risorius.import_dna(
            filepath=str(path),
            shape_mode=mode or self.random.choice(("LIVE", "KEYS", "AUTO")),
            lods=(True, True, *(False,) * 6),
        )

    def import_dna(self):
        if len(self.rigs()) < LIMIT:
            self._import()

    def reload(self):
        rig = self._rig()
        if not rig.override_library:
            self._activate(rig)
            bpy.ops.risorius.reload()

    def replace(self):
        """Replace the DNA file of a rig by the same file, or by a file with other axes."""
        rig = self._rig()
        if not rig.override_library:
            self._activate(rig)
            bpy.ops.risorius.replace_dna(filepath=str(self.random.choice(self.sources)))

    def export(self):
        self._activate(self._rig())
        bpy.ops.risorius.export_dna(filepath=str(self.folder / "out.dna"))

    def append(self):
        if len(self.rigs()) >= LIMIT:
            return
        with bpy.data.libraries.load(str(self.library)) as (source, target):
            target.collections = [c for c in source.collections if c.startswith("Face")]
        bpy.context.scene.collection.children.link(target.collections[0])
        bpy.context.view_layer.update()

    def override(self):
        if len(self.rigs()) >= LIMIT:
            return
        with bpy.data.libraries.load(str(self.library), link=True) as (source, target):
            target.collections = [c for c in source.collections if c.startswith("Face")]
        item = bpy.data.objects.new("instance", None)
        item.instance_type, item.instance_collection = "COLLECTION", target.collections[0]
        bpy.context.scene.collection.objects.link(item)
        bpy.context.view_layer.objects.active = item
        bpy.context.view_layer.update()
        bpy.ops.risorius.make_override(shapes=self.random.choice(("DRIVEN", "LOCAL")))

    def separate(self):
        self._activate(self._rig())
        bpy.ops.risorius.separate()

    def undo(self):
        for _ in range(self.random.randint(1, 6)):
            if not bpy.ops.ed.undo.poll() or bpy.ops.ed.undo() != {"FINISHED"}:
                break
        bpy.context.view_layer.update()

    def redo(self):
        for _ in range(self.random.randint(1, 6)):
            if not bpy.ops.ed.redo.poll() or bpy.ops.ed.redo() != {"FINISHED"}:
                break
        bpy.context.view_layer.update()

    def save(self):
        bpy.ops.wm.save_as_mainfile(filepath=str(self.blend))

    def save_and_load(self):
        self.save()
        bpy.ops.wm.open_mainfile(filepath=str(self.blend))
        self._settings()
        self._push("loaded")

    def revert(self):
        """Open the file of the run as it was last saved."""
        bpy.ops.wm.open_mainfile(filepath=str(self.blend))
        self._settings()
        self._push("reverted")

    def purge(self):
        bpy.ops.outliner.orphans_purge(do_recursive=True)

    def other_scene(self):
        """Visit another scene, which is empty or has the same characters."""
        here = bpy.context.window.scene
        there = bpy.data.scenes.new("there")
        if self.random.random() < 0.5:
            for child in here.collection.children:
                there.collection.children.link(child)
        bpy.context.window.scene = there
        there.frame_set(self.random.randint(1, 30))
        bpy.context.view_layer.update()
        bpy.context.window.scene = here
        bpy.data.scenes.remove(there)
        here.frame_set(here.frame_current)
        bpy.context.view_layer.update()

    def render(self):
        setup = bpy.context.scene
        if setup.camera is None:
            camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
            camera.location, camera.rotation_euler = (0, -0.6, 1.58), (np.pi / 2, 0, 0)
            setup.collection.objects.link(camera)
            setup.camera = camera
        setup.frame_start = self.random.randint(1, 20)
        setup.frame_end = setup.frame_start + 1
        setup.render.filepath = str(self.folder / "frame_")
        bpy.ops.render.render(animation=self.random.random() < 0.5)

    @staticmethod
    def _enable():
        assert addon_utils.enable(scene.MODULE) is not None

    def disable_and_enable(self):
        addon_utils.disable(scene.MODULE)
        try:
            self.slider()
            self.frame()
        finally:
            self._enable()
        bpy.context.scene.frame_set(bpy.context.scene.frame_current)

    # -- conditions that must hold ----------------------------------------------------------

    def check(self):
        """Compare all faces of the scene with the oracle, and check all drivers.

        An override that Blender has locked is first repaired by the panel's operator.

        Returns:
            The largest coordinate difference from the oracle, as a share of the mesh's size.

        Raises:
            WrongFaceError: a driver is invalid, no face is left, or a face differs by TOLERANCE or
                more.
        """
        bad, _ = scene.invalid_drivers()
        if bad:
            raise WrongFaceError(f"invalid drivers: {bad[:5]}")
        rigs = self.rigs()
        if not rigs:
            raise WrongFaceError("no character is left")
        worst = 0.0
        for rig in rigs:
            error, where = self._error(rig)
            if not error < scene.TOLERANCE and scene.submodule("scene.frame.evaluate").refused(rig):
                # Blender has made parts of an override read-only. The panel Face says so and has a
                # button for the repair; this call does what the button does.
                self._activate(rig)
                bpy.ops.risorius.make_override()
                self.repaired += 1
                error, where = self._error(rig)
            worst = max(worst, error)
            if not error < scene.TOLERANCE:
                raise WrongFaceError(f"{rig.name}: {where} is off by {error:.3g} of its size")
        return worst

    def _error(self, rig):
        """The largest error of a rig, and the name of the mesh that has it.

        The error of a mesh is its largest coordinate difference from the oracle, as a share of its
        size. If the world matrices of rig and controls differ by more, the error is this
        difference, in Blender units, and the name is "its place".
        """
        dna, evaluator, _ = self._oracles[rig["risorius_dna"]["risorius_hash"]]
        depsgraph = bpy.context.evaluated_depsgraph_get()
        bone = rig["risorius_controls"].evaluated_get(depsgraph).pose.bones["face"]
        labels = scene.submodule("logic.base.names").unique_labels(dna.raw_control_names)
        raw = np.array([float(bone[n]) for n in labels], np.float32)
        lod = int(rig["risorius_lod"])
        pose = evaluator.evaluate(raw, lod)
        place = np.array(rig.matrix_world)
        apart = np.abs(place - np.array(rig["risorius_controls"].matrix_world)).max()
        worst = (float(apart), "its place")
        for index, item in self._meshes(rig).items():
            if lod not in list(item["dna_lods"]) or item.hide_viewport:
                continue
            wanted = oracle.vertices(dna, index, pose) @ place[:3, :3].T + place[:3, 3]
            size = np.ptp(wanted, axis=0).max()
            error = float(np.abs(scene.evaluated(item) - wanted).max() / size)
            worst = max(worst, (error, item.name))
        return worst

    def calm(self):
        """Prepare for a sample of memory.

        Restore the initial number of characters, remove their animation, save and reload.
        """
        while len(self.rigs()) > self.characters:
            self._delete(self.rigs()[-1])
        while len(self.rigs()) < self.characters:
            self._import("LIVE")
        for rig in self.rigs():
            rig["risorius_controls"].animation_data_clear()
        self.purge_all()
        self.save_and_load()
        self.save_and_load()

    def leftovers(self):
        """Delete all characters, and count the data-blocks that are left: type -> number.

        The numbers must not grow during a run. Afterwards the file of the run is opened again.
        """
        for rig in self.rigs():
            self._delete(rig)
        self.purge_all()
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "empty.blend"))  # drops unused data
        self.purge_all()
        # Linked data-blocks are not counted: if they refer to each other, Blender keeps them until
        # another file is opened.
        kinds = [p for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]
        local = {
            p.identifier: [i for i in getattr(bpy.data, p.identifier) if not i.library]
            for p in kinds
            if p.identifier != "libraries"
        }
        # Reports of the add-on are texts that stay for the user, so only texts with DNA data are
        # counted.
        local["texts"] = [t for t in local["texts"] if "risorius_bytes" in t]
        counts = {name: len(found) for name, found in local.items()}
        bpy.ops.wm.open_mainfile(filepath=str(self.blend))
        self._settings()
        self._push("sampled")
        return counts

    def purge_all(self):
        """Remove empty collections, and data-blocks without users."""
        bpy.data.batch_remove([c for c in bpy.data.collections if not c.all_objects])
        self.purge()


# Name of an action -> how often it is chosen, relative to the other actions.
WEIGHTS = {
    "slider": 300, "frame": 130, "key": 60, "undo": 80, "redo": 50, "select": 60, "lod": 50,
    "shape_mode": 40, "reset": 20, "overdrive": 20, "own_key": 20, "drop_own_key": 20,
    "rename": 40, "hide": 20, "exclude": 10, "duplicate": 25, "delete": 40, "delete_part": 10,
    "import_dna": 12, "reload": 12, "replace": 8, "export": 8, "append": 12, "override": 12,
    "separate": 5, "save": 10, "save_and_load": 12, "revert": 5, "purge": 5, "other_scene": 10,
    "render": 6, "unkey": 15,
    "disable_and_enable": 10, "lod_by_distance": 12, "place": 15, "attach": 12, "test_channel": 15,
}  # fmt: skip
# Actions after which soak.py pushes no undo step.
NOT_PUSHED = {"undo", "redo", "save", "save_and_load", "revert"}
