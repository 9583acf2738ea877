# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that assign shape keys to controls, save and load assignments, and draw pictures."""

from __future__ import annotations

from typing import Any, cast

import bpy

from ... import native
from ...scene.base import parts, session
from ...scene.base.blender_types import MeshObject, current_context
from ...scene.base.task import Task
from ...scene.file import shape_key_head
from ...scene.shape_keys import assigned, pictures
from .. import words
from ..background_work import RunsBeside
from ..blender_types import (
    Context,
    ExportHelper,
    ImportHelper,
    Operator,
    OperatorBase,
    Result,
)
from ..common import explain, proposed_file, system_path, usable
from ..expressions import previews
from ..expressions.library_operators import redraw
from . import shown

WAYS = (
    ("CHOSEN", "Control or Expression", "Assign the chosen control or expression"),
    ("NAME", "By Its Name", "Guess the control from the name of the shape key"),
    ("OWN", "Control of Its Own", "A new control with the name of the shape key"),
    ("NOTHING", "Leave Out", "Leave the shape key out of the rig"),
)
_AT_ONCE = 6  # number of new pictures after which the sidebar is redrawn

EnumItem = tuple[str, str, str, int, int]
# Items of the enum with all controls and expressions. They are kept here, because Blender keeps no
# references to the strings of enum items.
_items: list[EnumItem] = session.keep("shape_keys.items", list, ("unregister",))


class OfHead(OperatorBase):
    """Base of operators on the shape keys of a head."""

    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        """Whether the active object is a head whose keys can be assigned.

        If not, set the poll message.
        """
        if not usable(cls):
            return False
        if not shape_key_head.usable_head(context.active_object):
            cls.poll_message_set(words.say("Select a mesh with shape keys that is no face yet."))
            return False
        return True


def head_of(context: Context) -> MeshObject:
    """The active object, which poll requires to be a head. Args: context  context of Blender."""
    return cast(MeshObject, context.active_object)


class Says(OfHead):
    """Base of operators that assign a control or an expression to a shape key."""

    key: bpy.props.StringProperty(
        name="Shape Key",
        description="Name of the shape key; empty: the active shape key",
        options={"SKIP_SAVE"},
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not assigned.is_editable(head_of(context)):
            cls.poll_message_set(
                words.say("This mesh is linked from another file: make it local first.")
            )
            return False
        return True

    def keep(self, context: Context, value: assigned.Said | None) -> Result:
        """Store the user's assignment of the shape key `key`; if `key` is "", of the active one.

        Args:
            context: context of Blender.
            value: `value` of an assigned.Choice, a control or expression; []: the key is left out
                of the rig; None: the user's assignment is removed.
        """
        item = head_of(context)
        name = self.key or shown.active_key(item)
        if name not in assigned.of(item).rows:
            self.report({"ERROR"}, words.say("{mesh} has no shape key {name}.", mesh=item.name,
                                             name=name))  # fmt: skip
            return {"CANCELLED"}
        try:
            assigned.put(item, {name: value})
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class RISORIUS_OT_assign_shape_key(Says, Operator):
    """Assign a control or expression to a shape key of this head"""

    bl_idname = "risorius.assign_shape_key"
    bl_label = "Assign Shape Key"

    way: bpy.props.EnumProperty(name="Becomes", items=WAYS)
    becomes: bpy.props.StringProperty(
        name="Control or Expression",
        description="A control, such as jawOpen; =mouthFunnel: an ARKit unit; @joy: an expression",
    )

    def execute(self, context: Context) -> Result:
        if self.way == "NAME":
            return self.keep(context, None)
        if self.way == "NOTHING":
            return self.keep(context, [])
        if self.way == "OWN":
            name = self.key or shown.active_key(head_of(context))
            return self.keep(context, assigned.own_control(name))
        if not self.becomes:
            self.report({"ERROR"}, words.say("A control or an expression was expected."))
            return {"CANCELLED"}
        return self.keep(context, self.becomes)


def _listed(_self: object, _context: object) -> Any:  # noqa: ANN401  stubs know no icon by number
    if not _items:
        fill_choices()
    return _items


# An enum item may contain the number of an icon, which the type stubs of Blender's API do not know.
# So `_listed` returns Any.
choice_items = _listed


def fill_choices() -> None:
    """Fill the enum with all controls and expressions, and their pictures if these exist."""
    _items[:] = [
        (
            choice.value,
            shown.label_of_choice(choice),
            shown.tooltip_of_choice(choice),
            previews.load(pictures.sample_path(choice.value)),
            number,
        )
        for number, choice in enumerate(assigned.choices())
    ]


class RISORIUS_OT_choose_shape_key(Says, Operator):
    """Find a control or expression by name, and assign it to this shape key"""

    bl_idname = "risorius.choose_shape_key"
    bl_label = "Choose a Control or Expression"
    bl_property = "choice"

    choice: bpy.props.EnumProperty(name="Becomes", items=choice_items, options={"SKIP_SAVE"})

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        fill_choices()
        context.window_manager.invoke_search_popup(cast(Any, self))
        return {"FINISHED"}

    def execute(self, context: Context) -> Result:
        return self.keep(context, self.choice)


class RISORIUS_OT_select_shape_key(OfHead, Operator):
    """Make this shape key the active shape key"""

    bl_idname = "risorius.select_shape_key"
    bl_label = "Select Shape Key"

    key: bpy.props.StringProperty(name="Shape Key", options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        item = head_of(context)
        place = parts.keys_there(item).key_blocks.find(self.key)
        if place >= 0:
            item.active_shape_key_index = place
        return {"FINISHED"}


class RISORIUS_OT_save_shape_key_names(OfHead, Operator, ExportHelper):
    """Save the assignments of shape keys to a file, for other heads and for risorius author"""

    bl_idname = "risorius.save_shape_key_names"
    bl_label = "Save Names"
    bl_options = set()

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})
    use_all: bpy.props.BoolProperty(
        name="All Keys",
        description=(
            "Also save the controls that Risorius guessed from names of shape "
            "keys, so that you can edit these guesses as text"
        ),
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not self.filepath:
            self.filepath = proposed_file(f"{head_of(context).name}_names", ".toml")
        return ExportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        item = head_of(context)
        self.filepath = system_path(self.filepath)
        table = assigned.said_of(item)
        if self.use_all:
            table = {row.key: shown.value_of(row) for row in assigned.of(item).rows.values()}
        try:
            text = native.part("author.input.said").text_of(table)
            native.part("files.fileio").write_text(self.filepath, text)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        self.report({"INFO"}, words.say("{count} shape keys", count=len(table)))
        return {"FINISHED"}


class RISORIUS_OT_load_shape_key_names(Says, Operator, ImportHelper):
    """Load the assignments from a file that Save Names or the command risorius author wrote"""

    bl_idname = "risorius.load_shape_key_names"
    bl_label = "Load Names"

    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def execute(self, context: Context) -> Result:
        item = head_of(context)
        self.filepath = system_path(self.filepath)
        try:
            table = native.part("author.input.said").read(self.filepath)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        rows = assigned.of(item).rows
        fits = {name: value for name, value in table.items() if name in rows}
        if not fits:
            text = "No name of the file is that of a shape key here."
            self.report({"ERROR"}, words.say(text))
            return {"CANCELLED"}
        assigned.put(item, fits)
        self.report({"INFO"}, words.say("{count} shape keys", count=len(fits)))
        if len(fits) < len(table):
            text = "{count} names in the file match no shape key of this head."
            self.report({"INFO"}, words.say(text, count=len(table) - len(fits)))
        return {"FINISHED"}


class RISORIUS_OT_shape_key_pictures(RunsBeside, OfHead, Operator):
    """Draw pictures of the shape keys of this head and of their controls; Esc cancels"""

    bl_idname = "risorius.shape_key_pictures"
    bl_label = "Draw Pictures"
    bl_options = set()

    again: bpy.props.BoolProperty(
        name="All Anew",
        description="Also draw the pictures that already exist",
        options={"SKIP_SAVE"},
    )
    use_choices: bpy.props.BoolProperty(
        name="Pictures of Controls",
        description=(
            "Also draw pictures of the controls that the button Choose "
            "lists, including controls without a shape key"
        ),
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.wait_beside()
        self.use_choices = True  # sample pictures are drawn last, once for all heads
        return self.execute(context)

    def execute(self, context: Context) -> Result:
        item = head_of(context)
        model, rows = pictures.model_of(item), assigned.of(item).rows
        first = sorted(rows.values(), key=lambda row: row.is_known)
        keys = [r.key for r in first if self.again or not model.paths[r.key].is_file()]
        meant = [value for value in map(shown.sample_of, first) if value]
        if self.use_choices:
            meant += [c.value for c in assigned.choices() if c.kind != assigned.CONTROL]
        samples = pictures.without_picture(meant)
        self._count, self._redrawn = len(keys) + len(samples), 0
        job = pictures.Job(model, keys, samples)
        return self.begin(
            context, Task(lambda progress, ended: pictures.make(job, progress, ended))
        )

    def finish(self, context: Context) -> Result:
        error = self._running.error
        if error is not None and not isinstance(error, native.user_errors()):
            raise error
        redraw(context)
        if error is not None:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def shown(self, share: int) -> str:
        done = round(share * self._count / 100)
        if done >= self._redrawn + _AT_ONCE:
            self._redrawn = done
            redraw(current_context())
        return words.say(
            "Pictures of shape keys: {done} of {count} are drawn. Esc stops the drawing.",
            done=done,
            count=self._count,
        )

    def cancelled_text(self) -> str:
        return words.say("Pictures that are already drawn are kept.")


CLASSES = (
    RISORIUS_OT_assign_shape_key,
    RISORIUS_OT_choose_shape_key,
    RISORIUS_OT_select_shape_key,
    RISORIUS_OT_save_shape_key_names,
    RISORIUS_OT_load_shape_key_names,
    RISORIUS_OT_shape_key_pictures,
)
