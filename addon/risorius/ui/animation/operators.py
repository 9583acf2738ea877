# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads the properties of a class from annotations, which a type checker takes for types:
# pyright: reportInvalidTypeForm=false
"""Operators that import animation from files and from other rigs."""

from collections.abc import Sequence
from pathlib import Path

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.names import printable
from ...logic.base.sentences import told
from ...scene.animation import range_properties, retarget_shape_keys
from ...scene.base import parts, session
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from ...scene.shape_keys import unknown_curves
from .. import words
from ..blender_types import Context, FileHandler, ImportHelper, Item, Menu, Operator, Result
from ..common import explain, face_controls, face_rig, shown_progress, system_path
from .place_clip import PlacesClip

RATES = (
    (
        "FRAMES",
        "Whole Frames",
        "Insert keys on whole frames of the scene",
    ),
    ("TIME", "Every Sample", "Insert a key for each sample at its own time, also between frames"),
    (
        "SCENE",
        "Set Scene Rate",
        ("Set the scene to the rate of the file and insert a key for each sample"),
    ),
)
CAPTURE_RANGES = (
    (
        "FACE",
        "Of the Face",
        "Use the range of this face from the panel Capture Range",
    ),
    ("TAKE", "Of This File", "Learn the person's range from the captured values in this file"),
    ("NONE", "None", "Keep the captured values unchanged"),
)
TIME_UNITS = (
    (
        "AUTO",
        "As the File Says",
        "Detect the unit of time from the header, or from the size of the numbers",
    ),
    ("S", "Seconds", ""),
    ("MS", "Milliseconds", ""),
    ("US", "Microseconds", ""),
    ("NS", "Nanoseconds", ""),
    ("MIN", "Minutes", ""),
    ("H", "Hours", ""),
    ("FRAMES", "Frame Numbers", "Times are frame numbers at the rate of the file"),
    ("ROWS", "Rows", "Ignore the times: each row is a frame at the rate of the file"),
)
ANGLES = (
    (
        "AUTO",
        "As the File Says",
        (
            "The import reads the angles as radians, and stops with a message if no head can "
            "turn as far"
        ),
    ),
    ("RADIANS", "Radians", ""),
    ("DEGREES", "Degrees", ""),
)
EXTENSIONS = (
    ".csv",
    ".tsv",
    ".txt",
    ".json",
    ".xml",
    ".dat",
    ".pgo",
    ".glb",
    ".gltf",
    ".fbx",
    ".rzc",
)
CLIP_EXTENSION = ".rzc"
SOUNDS = (".wav", ".mp3", ".flac", ".ogg", ".m4a", ".aac", ".opus", ".mp4", ".mov", ".mkv")


@session.cached(("unregister",))
def _kinds() -> list[Item]:
    kinds = native.part("importing").KINDS.items()
    return [
        ("AUTO", "Automatic", "Detect the kind from the contents of the file"),
        *((k, t, "") for k, t in kinds),
    ]


@session.cached(("unregister",))
def _mappings() -> list[Item]:
    importing = native.part("importing")
    return [
        ("AUTO", "Automatic", "Use the mapping that knows the most names in the file"),
        ("FILE", "File", "Use your own mapping, a TOML file"),
        *((name, importing.mapping_title(name), "") for name in importing.mapping_names()),
    ]


class RISORIUS_OT_import_animation(PlacesClip, Operator, ImportHelper):
    """Import a capture, a table of curves, a viseme track or a clip onto the active face"""

    bl_idname = "risorius.import_animation"
    bl_label = "Import Animation"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filter_glob: bpy.props.StringProperty(
        default=";".join(f"*{e}" for e in EXTENSIONS), options={"HIDDEN"}
    )
    kind: bpy.props.EnumProperty(
        name="Kind", description="Kind of the imported file", items=lambda _s, _c: _kinds()
    )
    mapping: bpy.props.EnumProperty(
        name="Mapping",
        description="Mapping from curves of the file to controls",
        items=lambda _s, _c: _mappings(),
    )
    mapping_file: bpy.props.StringProperty(
        name="Mapping File", description="TOML file with your own mapping", subtype="FILE_PATH"
    )
    rate_mode: bpy.props.EnumProperty(
        name="Keys", description="Frames at which samples of the file become keys", items=RATES
    )
    file_rate: bpy.props.FloatProperty(
        name="File Rate",
        description="Frames per second of a file that does not state its rate; 0: detect the rate",
        min=0.0,
        soft_max=240.0,
    )
    capture_range: bpy.props.EnumProperty(
        name="Range",
        description="Range of the capture that becomes 0 to 1, so that blinks close the eyes",
        items=CAPTURE_RANGES,
    )
    timecode_rate: bpy.props.FloatProperty(
        name="Timecode Rate",
        description=(
            "Frames per second of the timecode, if the file does not show "
            "this rate; 0: detect the rate"
        ),
        min=0.0,
        soft_max=240.0,
    )
    time_unit: bpy.props.EnumProperty(
        name="Time Unit",
        description="Unit of the times in a table or a JSON file",
        items=TIME_UNITS,
    )
    full_value: bpy.props.FloatProperty(
        name="Full Value",
        description=(
            "Value of a full movement in the file: 100 for per cent, 255 for bytes; "
            "1 keeps all values. 0: like 1, but values far above 1 stop the import "
            "with a message"
        ),
        min=0.0,
        soft_max=255.0,
    )
    angles: bpy.props.EnumProperty(
        name="Angles", description="Unit of the file's angles of head and eyes", items=ANGLES
    )
    gain: bpy.props.FloatProperty(
        name="Gain",
        description="Factor by which the values of all controls are multiplied",
        default=1.0,
        min=0.0,
        soft_max=2.0,
    )
    gains: bpy.props.StringProperty(
        name="Single Gains",
        description="Factors of single controls or patterns of their names, such as "
        "CTRL_expressions.jawOpen=1.3 *Blink*=1.1",
    )
    smoothing: bpy.props.FloatProperty(
        name="Smoothing",
        description="Length of the smoothing window in seconds; 0: no smoothing",
        min=0.0,
        soft_max=0.5,
    )
    use_neutral: bpy.props.BoolProperty(
        name="Calibrate",
        description=("Use the face of some samples of the file as the neutral face"),
    )
    neutral_first: bpy.props.IntProperty(
        name="Neutral From",
        description="Number of the first neutral sample, from 0",
        min=0,
    )
    neutral_last: bpy.props.IntProperty(
        name="Neutral To", description="Number of the last neutral sample, from 0", min=0
    )
    use_eyes: bpy.props.BoolProperty(
        name="Turn Eye Bones",
        description="Turn the eye bones too, if the file has angles of the eyes",
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.start_with(context.scene)
        if self.properties.is_property_set("filepath"):  # dropped onto the window
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        self.filepath = system_path(self.filepath)
        if _is_sound(self.filepath):
            name = printable(Path(self.filepath).name)
            self.report(
                {"ERROR"}, words.say("{name}: this is a sound: use Speak from Audio.", name=name)
            )
            return {"CANCELLED"}
        live, render = runtime.there(face_rig(context)), context.scene.render
        rate = render.fps, render.fps_base
        try:
            with shown_progress(context) as progress:
                clip, notes, mapping = self._read(context, live)
                clip = self._ranged(context, clip, notes, mapping)
                progress(0.4)
                clip = self._adjusted(clip)
                if self.rate_mode == "SCENE":
                    render.fps = max(1, round(clip.rate))
                    render.fps_base = render.fps / clip.rate
                progress(0.6)
                name, whole = Path(self.filepath).stem, self.rate_mode == "FRAMES"
                self.place(context, clip, name, notes, self.use_eyes, whole)
        except native.user_errors() as error:
            render.fps, render.fps_base = rate
            self._note_unknown(context, error)
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def _read(
        self, context: Context, live: runtime.Runtime
    ) -> tuple["native.Clip", list[str], str]:
        """Read the chosen file.

        Returns:
            The clip of raw controls, lines for the report, and the name of the mapping.
        """
        if Path(self.filepath).suffix.lower() == CLIP_EXTENSION:
            return native.module().Clip.load(self.filepath), [], ""
        mapping = None if self.mapping == "AUTO" else self.mapping
        if mapping == "FILE":
            mapping = system_path(self.mapping_file)
        clip, report = native.part("importing").import_file(
            self.filepath,
            live.dna.raw_control_names,
            kind=None if self.kind == "AUTO" else self.kind,
            mapping=mapping,
            rate=self.file_rate or None,
            timecode_rate=self.timecode_rate or None,
            time_unit=None if self.time_unit == "AUTO" else self.time_unit.lower(),
            rig=live.rig,
            rotations="all" if self.use_eyes else "head",
            full_value=self.full_value or None,
            angles=None if self.angles == "AUTO" else self.angles.lower(),
        )
        used = mapping if self.mapping == "FILE" else report.mapping
        self._keep_unknown(face_controls(context), str(used), report.unmapped)
        return clip, lines_of(report), report.mapping

    def _keep_unknown(self, controls: ArmatureObject, mapping: str, names: Sequence[str]) -> None:
        """Store the names of curves that the mapping lacks, so that the user can map them."""
        settings = {key: getattr(self, key) for key in self.properties.keys()}  # noqa: SIM118
        plain = {k: v for k, v in settings.items() if isinstance(v, (str, int, float))}
        found = unknown_curves.Unknown(mapping, {**plain, "filepath": self.filepath}, list(names))
        unknown_curves.keep(controls, found)

    def _note_unknown(self, context: Context, error: Exception) -> None:
        """Store the names of all curves of a file for which no mapping was found."""
        names = getattr(error, "unknown", ())
        if names:
            self._keep_unknown(face_controls(context), "", names)

    def _ranged(
        self, context: Context, clip: "native.Clip", notes: list[str], mapping: str
    ) -> "native.Clip":
        """Stretch the clip by the chosen capture range, and add a line about it to the notes.

        The face's stored range is never applied to a table of raw controls, because such a table
        may have been stretched before.
        """
        module, ranges = native.part("ranges"), None
        is_raw = mapping == "controls"
        if self.capture_range == "TAKE":
            ranges = module.learn(clip, performance=True)
        elif self.capture_range == "FACE" and module.is_captured(clip) and not is_raw:
            ranges = range_properties.of(face_controls(context))
        if ranges is None:
            return clip
        used = len(ranges.used().keys() & set(clip.names))
        notes.append(words.say("{used} controls are stretched by the range.", used=used))
        return ranges.apply(clip)

    def _adjusted(self, clip: "native.Clip") -> "native.Clip":
        """The clip after calibration to the neutral pose, smoothing and the gains."""
        process = native.part("importing.process")
        if self.use_neutral:
            last = max(self.neutral_first, self.neutral_last)
            clip = process.calibrate(clip, self.neutral_first, last)
        if self.smoothing > 0.0:
            clip = process.smooth(clip, self.smoothing)
        gains = {} if self.gain == 1.0 else dict.fromkeys(_sliders(clip), self.gain)
        if gains:
            clip = process.adjust(clip, gains)
        single = _gains(self.gains)
        return process.adjust(clip, single) if single else clip

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.draw_place(layout)
        for name in ("kind", "mapping"):
            layout.prop(self, name)
        if self.mapping == "FILE":
            layout.prop(self, "mapping_file")
        layout.prop(self, "rate_mode")
        layout.prop(self, "time_unit")
        for name in ("file_rate", "timecode_rate"):
            words.prop_or(layout, self, name, 0.0, "0: as the file says")
        words.prop_or(layout, self, "full_value", 0.0, "0: as the file says")
        layout.prop(self, "angles")
        layout.prop(self, "capture_range")
        layout.prop(self, "gain")
        words.prop_or(layout, self, "gains", "", "as *jawOpen=1.3 *Blink*=1.1")
        words.prop_or(layout, self, "smoothing", 0.0, "0: none")
        layout.prop(self, "use_eyes")
        layout.prop(self, "use_neutral")
        if self.use_neutral:
            layout.prop(self, "neutral_first")
            layout.prop(self, "neutral_last")


def _is_sound(path: str) -> bool:
    """Whether Speak from Audio accepts a file, by its extension or its first bytes."""
    if Path(path).suffix.lower() in SOUNDS:
        return True
    try:
        with Path(path).open("rb") as file:
            head = file.read(12)
    except OSError:
        return False  # the importer reports the error
    return head[:4] == b"RIFF" and head[8:] == b"WAVE"


def _sliders(clip: "native.Clip") -> list[str]:
    """The names of a clip's curves that are not angles of the head or the eyes."""
    return [n for n in clip.names if n.partition(".")[0] not in ("head", "eyeL", "eyeR")]


def _gains(text: str) -> dict[str, float]:
    """Parse `jawOpen=1.2 mouth*=0.8` as name -> factor. Raises: FaceError."""
    table = {}
    for word in text.replace(",", " ").split():
        name, _, value = word.rpartition("=")
        try:
            table[name] = float(value)
        except ValueError:
            name = ""
        if not name:
            raise FaceError(told("gains: name=factor was expected, found {word}", word=word))
    return table


def lines_of(report: "native.Report") -> list[str]:
    """The sentences of an import report, without its list of absent controls."""
    text = "{count} curves mapped by {mapping}."
    lines = [words.say(text, count=len(report.mapped), mapping=report.mapping)]
    told = [(head, names) for head, names in report.lists() if names != report.absent]
    lines += [_as_line(f"{words.local(head)}: {', '.join(names)}") for head, names in told]
    return [*lines, *(_as_line(words.local(note)) for note in report.notes)]


def _as_line(text: str) -> str:
    """The text with a capital letter at the beginning and a full stop at the end."""
    return f"{text[:1].upper()}{text[1:].rstrip('.')}."


class RISORIUS_FH_animation(FileHandler):
    """Drop a file of animation onto the 3D view"""

    bl_idname = "RISORIUS_FH_animation"
    bl_label = "Face Animation"
    bl_import_operator = "risorius.import_animation"
    bl_file_extensions = ".csv;.tsv;.json;.xml;.dat;.pgo;.rzc"

    @classmethod
    def poll_drop(cls, context: Context) -> bool:
        area = context.area
        return area is not None and area.type == "VIEW_3D" and parts.active_rig(context) is not None


class RISORIUS_OT_import_arkit_rig(PlacesClip, Operator):
    """Copy an object's shape-key animation (action, NLA strips, drivers) to the active face"""

    bl_idname = "risorius.import_arkit_rig"
    bl_label = "From ARKit Rig"

    start: bpy.props.FloatProperty(
        name="Start Frame",
        description="Frame of the scene for frame 0 of the other rig's animation",
    )
    source: bpy.props.StringProperty(
        name="Object",
        description=(
            "A mesh whose shape keys move; empty: the selected mesh, or the "
            "only mesh with animated shape keys"
        ),
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not retarget_shape_keys.sources(context):
            cls.poll_message_set(
                words.say("No other object of this scene has animated shape keys.")
            )
            return False
        return True

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        found = retarget_shape_keys.source_of(context)
        self.source = found.name if found is not None else ""
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: Context) -> Result:
        item = (
            bpy.data.objects.get(self.source)
            if self.source
            else retarget_shape_keys.source_of(context)
        )
        if item not in retarget_shape_keys.sources(context):
            self.report({"ERROR"}, words.say("Select the object whose shape keys are animated."))
            return {"CANCELLED"}
        live = runtime.there(face_rig(context))
        try:
            keys = retarget_shape_keys.clip_of(context, item)
            times = keys.frame_times()
            clip, report = native.part("importing").import_curves(
                {name: (times, curve) for name, curve in zip(keys.names, keys.curves, strict=True)},
                live.dna.raw_control_names,
                source=item.name,
            )
            self.place(context, clip, item.name, lines_of(report))
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(item.name, error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop_search(self, "source", context.scene, "objects")
        self.draw_place(layout)


def draw_import(self: Menu, _context: Context) -> None:
    """Draw the entry for animation in the menu File > Import."""
    self.layout.operator(RISORIUS_OT_import_animation.bl_idname, text="Face Animation")


CLASSES = (RISORIUS_OT_import_animation, RISORIUS_FH_animation, RISORIUS_OT_import_arkit_rig)
