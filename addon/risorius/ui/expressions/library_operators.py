# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that save, change, export and import the user's expressions and draw their pictures."""

from dataclasses import replace
from pathlib import Path

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.names import printable
from ...logic.base.sentences import told
from ...scene.base.blender_types import ArmatureObject, current_context
from ...scene.base.task import Task
from ...scene.character import runtime
from ...scene.expressions import assets, library, poses, thumbnails
from ...scene.frame import inputs
from ..background_work import RunsBeside
from ..blender_types import Context, Operator, OperatorBase, Result
from ..common import FaceOperator, face_rig, system_path
from ..words import of_error, say
from . import previews
from .properties import choices, region_items

_AT_ONCE = 3  # number of new pictures after which the sidebar is redrawn


def redraw(context: Context) -> None:
    """Redraw the sidebars of all windows, so that they show new pictures."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            for region in area.regions if area.type == "VIEW_3D" else ():
                if region.type == "UI":
                    region.tag_redraw()


class RISORIUS_OT_render_thumbnails(RunsBeside, FaceOperator, Operator):
    """Draw the pictures of all expressions on this face; Esc stops the drawing"""

    bl_idname = "risorius.render_thumbnails"
    bl_label = "Draw Pictures"
    bl_options = set()
    baked_too = True

    again: bpy.props.BoolProperty(
        name="All Anew",
        description="Also draw the pictures that already exist",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        self.wait_beside()
        return self.execute(context)

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        items, _ = library.all_items(library.folder(context))
        jobs = previews.jobs_of(rig, list(items.values()))
        missing = [job for job in jobs if self.again or not job.path.is_file()]
        sitter = thumbnails.sitter_of(rig) if missing else None
        if sitter is None:
            text = (
                "This face has no mesh that can be drawn."
                if missing
                else "All expressions already have pictures."
            )
            self.report({"INFO"}, say(text))
            return {"FINISHED"}
        self._count, self._redrawn = len(missing), 0
        return self.begin(
            context,
            Task(lambda progress, ended: thumbnails.make(sitter, missing, progress, ended)),
        )

    def finish(self, context: Context) -> Result:
        error = self._running.error
        if error is not None and not isinstance(error, native.user_errors()):
            raise error
        previews.forget()
        redraw(context)
        if error is not None:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        thumbnails.tidy()
        self._give_pictures(context)
        self.report({"INFO"}, say("{count} pictures", count=self._running.result))
        return {"FINISHED"}

    @staticmethod
    def _give_pictures(context: Context) -> None:
        """Set pictures of the active face as previews of the .blend file's expression assets."""
        rig = face_rig(context)
        for action in bpy.data.actions:
            expression = library.of_action(action)
            if expression is not None and action.library is None:
                assets.give_picture(action, assets.picture_of(rig, expression))

    def shown(self, share: int) -> str:
        done = round(share * self._count / 100)
        if done >= self._redrawn + _AT_ONCE:  # redrawing takes time from the drawing of pictures
            self._redrawn = done
            redraw(current_context())
        return say(
            "Pictures of expressions: {done} of {count} are drawn. Esc stops the drawing.",
            done=done,
            count=self._count,
        )

    def cancelled_text(self) -> str:
        redraw(current_context())
        return say("Drawing was cancelled; some pictures are missing.")


class _LibraryOperator(FaceOperator):
    """Base of operators on the user's expressions; they report an error as one sentence."""

    def execute(self, context: Context) -> Result:
        try:
            self.work(context)
        except library.TakenError:
            raise  # operators with a Replace option ask the user
        except native.user_errors() as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        redraw(context)
        return {"FINISHED"}

    def work(self, context: Context) -> None:
        """Do the work of the operator.

        Raises:
            native.user_errors(): any of these errors is reported to the user as one sentence.
        """
        raise NotImplementedError


def _put(
    context: Context,
    rig: ArmatureObject,
    expression: "native.Expression",
    shared: bool,
    over: Path | None = None,
) -> None:
    """Make a pose asset of the expression in the open .blend file, with a picture.

    If `shared` is True, the expression is also written to the user's library: into the existing
    file `over`, or into a new file if `over` is None.
    """
    picture = assets.picture_of(rig, expression)
    sitter = None if picture.is_file() else thumbnails.sitter_of(rig)
    if sitter is not None:
        weights = poses.weights_for(sitter.live, expression)
        thumbnails.make(sitter, [thumbnails.Job(picture, weights)])
    if shared:
        held = picture.read_bytes() if picture.is_file() else b""
        library.write(library.folder(context), [library.Entry(expression, held, over)])
    assets.make_asset(rig, expression)


class RISORIUS_OT_save_expression(_LibraryOperator, Operator):
    """Save the current pose as an asset of this file and, if chosen, also in the library"""

    bl_idname = "risorius.save_expression"
    bl_label = "Save Expression"

    label: bpy.props.StringProperty(
        name="Name",
        description="Name of the expression; empty: the field Name of the panel Expressions; if "
        "that is empty too, the word Expression, with a number if needed",
        options={"SKIP_SAVE"},
    )
    group: bpy.props.StringProperty(
        name="Category",
        description="Category of the expression; empty: the category in the panel",
        options={"SKIP_SAVE"},
    )
    regions: bpy.props.EnumProperty(
        name="Regions",
        description="Regions to save; no region: all regions that are not at rest",
        items=region_items,
        options={"ENUM_FLAG", "SKIP_SAVE"},
    )
    shared: bpy.props.EnumProperty(
        name="Shared Library",
        description="Also save the expression in the library for all files",
        items=(
            ("PANEL", "As in the Panel", ""),
            ("YES", "In the Library", ""),
            ("NO", "In This File Only", ""),
        ),
        options={"SKIP_SAVE"},
    )

    def work(self, context: Context) -> None:
        chosen, rig = choices(context), face_rig(context)
        items, _ = library.all_items(library.folder(context))
        label = (self.label or chosen.new_label).strip()
        group = (self.group or chosen.new_group).strip() or "own"
        if not label:
            label = library.free_label(items, say("Expression"))
        name = library.name_for(label)
        if not name:
            raise library.LibraryError(told("Enter a name with at least one letter."))
        if name in items:
            raise library.LibraryError(
                told("There is an expression {label} already.", label=items[name].expression.label)
            )
        expression = poses.captured(
            rig, name, label, group, inputs.seen_sliders(context, rig), self.regions
        )
        shared = chosen.to_library if self.shared == "PANEL" else self.shared == "YES"
        _put(context, rig, expression, shared)
        for note in assets.write_catalogs([group]) if bpy.data.filepath else ():
            self.report({"WARNING"}, note)
        chosen.active, chosen.new_label = name, ""
        self.report({"INFO"}, say("{label} was saved.", label=label))


class _OfOne(_LibraryOperator):
    """Base of operators on the expression that the property `expression` names.

    If this property is empty, the operator uses the expression that was clicked last.
    """

    expression: bpy.props.StringProperty(name="Expression", options={"SKIP_SAVE"})

    def item(self, context: Context) -> library.Item:
        """The expression. Raises: LibraryError: no expression has this name."""
        items, _ = library.all_items(library.folder(context))
        return library.find(items, self.expression or choices(context).active)


class RISORIUS_OT_update_expression(_OfOne, Operator):
    """Replace the pose of your own expression by the current pose"""

    bl_idname = "risorius.update_expression"
    bl_label = "Update Expression"

    def work(self, context: Context) -> None:
        rig, item = face_rig(context), self.item(context)
        library.check_own(item)
        old = item.expression
        expression = poses.captured(
            rig, old.name, old.label, old.group, inputs.seen_sliders(context, rig)
        )
        new = replace(expression, description=old.description)
        _put(context, rig, new, item.path is not None, item.path)


class RISORIUS_OT_rename_expression(_OfOne, Operator):
    """Change the name or category of your own expression"""

    bl_idname = "risorius.rename_expression"
    bl_label = "Rename Expression"

    label: bpy.props.StringProperty(name="Name", options={"SKIP_SAVE"})
    group: bpy.props.StringProperty(name="Category", options={"SKIP_SAVE"})

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        try:
            item = self.item(context)
            library.check_own(item)
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        self.label, self.group = item.expression.label, item.expression.group
        return context.window_manager.invoke_props_dialog(self)

    def work(self, context: Context) -> None:
        rig, item = face_rig(context), self.item(context)
        library.check_own(item)
        items, _ = library.all_items(library.folder(context))
        label = self.label.strip() or item.expression.label
        name = library.name_for(label)
        if name in items and name != item.expression.name:
            raise library.LibraryError(
                told("There is an expression {label} already.", label=items[name].expression.label)
            )
        group = self.group.strip() or item.expression.group
        new = replace(item.expression, name=name, label=label, group=group)
        poses.check(runtime.there(rig), item)
        same = name == item.expression.name
        _put(context, rig, new, item.path is not None, item.path if same else None)
        if not same:
            library.remove(item)
        if item.expression.name in library.favourites():
            library.set_favourite([item.expression.name], False)
            library.set_favourite([name], True)
        choices(context).active = name


class RISORIUS_OT_delete_expression(_OfOne, Operator):
    """Delete your own expression, in this file and in the library"""

    bl_idname = "risorius.delete_expression"
    bl_label = "Delete Expression"

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        return context.window_manager.invoke_confirm(self, event)

    def work(self, context: Context) -> None:
        item = self.item(context)
        library.remove(item)
        library.set_favourite([item.expression.name], False)
        choices(context).active = ""


class RISORIUS_OT_star_expression(_OfOne, Operator):
    """Add this expression to the favourites, or remove it. Favourites have a star"""

    bl_idname = "risorius.star_expression"
    bl_label = "Favourite"
    bl_options = set()

    on: bpy.props.BoolProperty(name="Favourite", default=True, options={"SKIP_SAVE"})

    def work(self, context: Context) -> None:
        library.set_favourite([self.item(context).expression.name], self.on)


class _OfFolder(_LibraryOperator, OperatorBase):
    """Base of operators on a folder; they ask before they replace the user's own expressions."""

    directory: bpy.props.StringProperty(name="Folder", subtype="DIR_PATH")
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    replace: bpy.props.BoolProperty(
        name="Replace",
        description="Replace your own expressions that have the same names",
        options={"SKIP_SAVE"},
    )
    asked: bpy.props.StringProperty(options={"HIDDEN", "SKIP_SAVE"})
    _in_dialog = False

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if self.asked:  # set by execute(), which has already read the folder
            self.replace = True
            return context.window_manager.invoke_confirm(
                self,
                event,
                title=say("Replace your own expressions?"),
                message=self.asked,
                confirm_text=say("Replace"),
                icon="WARNING",
                translate=False,
            )
        self._in_dialog = True
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Context) -> Result:
        try:
            return super().execute(context)
        except library.TakenError as error:
            if not self._in_dialog:
                self.report({"ERROR"}, of_error(error))
                return {"CANCELLED"}
            ours = bpy.ops.risorius  # pyright: ignore  made by registration
            again = getattr(ours, self.bl_idname.partition(".")[2])
            again("INVOKE_DEFAULT", directory=self.directory, asked=of_error(error))
            return {"CANCELLED"}  # the confirmed dialog runs the operator again

    def chosen(self) -> Path:
        return Path(system_path(self.directory))


class RISORIUS_OT_export_expressions(_OfFolder, Operator):
    """Write your own expressions into a folder, each as a TOML file and a picture"""

    bl_idname = "risorius.export_expressions"
    bl_label = "Export Expressions"
    bl_options = set()

    def work(self, context: Context) -> None:
        rig = face_rig(context)
        items, _ = library.all_items(library.folder(context))
        own = [item.expression for item in items.values() if item.source != library.RISORIUS]
        if not own:
            raise library.LibraryError(told("You have no expressions of your own yet."))
        pictures = [assets.picture_of(rig, expression) for expression in own]
        held = [p.read_bytes() if p.is_file() else b"" for p in pictures]
        entries = [library.Entry(*pair) for pair in zip(own, held, strict=True)]
        entries = library.in_the_way(self.chosen(), entries)
        taken = [entry.over for entry in entries if entry.over is not None]
        if taken and not self.replace:
            raise library.TakenError(
                told(
                    "{folder} holds a file {file} already: choose Replace to "
                    "overwrite files with these names, or choose another folder.",
                    folder=self.chosen().name,
                    file=taken[0].name,
                )
            )
        library.write(self.chosen(), entries)
        self.report({"INFO"}, say("{count} expressions", count=len(own)))


class RISORIUS_OT_import_expressions(_OfFolder, Operator):
    """Import all expressions of a folder into the library"""

    bl_idname = "risorius.import_expressions"
    bl_label = "Import Expressions"
    bl_options = set()

    def work(self, context: Context) -> None:
        found = library.read_all(self.chosen())
        items, _ = library.all_items(library.folder(context))
        entries = []
        for expression in found:
            item = items.get(expression.name)
            if item is not None:
                library.check_own(item)
                if not self.replace:
                    raise library.TakenError(
                        told(
                            "There is an expression {label} already: choose Replace to "
                            "overwrite your own expressions.",
                            label=printable(expression.label),
                        )
                    )
            over = item.path if item is not None else None
            entries.append(library.Entry(expression, over=over))
        library.write(library.folder(context), entries)
        self.report({"INFO"}, say("{count} expressions", count=len(found)))


CLASSES = (
    RISORIUS_OT_render_thumbnails,
    RISORIUS_OT_save_expression,
    RISORIUS_OT_update_expression,
    RISORIUS_OT_rename_expression,
    RISORIUS_OT_delete_expression,
    RISORIUS_OT_star_expression,
    RISORIUS_OT_export_expressions,
    RISORIUS_OT_import_expressions,
)
