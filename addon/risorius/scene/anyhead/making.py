# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs background tasks on a head without expressions: make a rig, or conform a face to it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Generic, NamedTuple, TypeVar

from ... import native
from ..base.task import Task, telling
from ..file import shape_key_head
from . import finding

Result = TypeVar("Result")
Progress = Callable[[float], None]
Cancelled = Callable[[], bool]

FIT, JOINTS = "FIT", "JOINTS"  # stages of a task
_FITTED = 0.6  # progress of the whole task when stage FIT ends: the head has its expressions
_CARRIED = 0.9  # progress of stage FIT when the transfer of expressions ends


class HeadTask(Task[Result], Generic[Result]):
    """A task on a head, in one or two stages. The attribute `stage` names the current stage.

    FIT: a template face is fitted to the head. JOINTS: the joints of the new face are made; a task
    that conforms a face to the head lacks this stage.
    """

    stage = FIT

    def part(self, stage: str, begin: float, end: float) -> Progress:
        """Begin a stage of the task.

        Args:
            stage: FIT or JOINTS.
            begin, end: progress of the whole task, 0 to 1, when the stage begins and ends.

        Returns:
            A function to call with the progress of the stage, 0 to 1; it sets the progress of the
            task.
        """
        self.stage = stage

        def tell(share: float) -> None:
            self.share = begin + (end - begin) * share

        return tell


class Template(NamedTuple):
    """The face whose expressions the head gets: a DNA file or a face of the scene.

    Attributes:
        dna: the face of the scene; None: the face is loaded from `path`.
        path: the DNA file; for a face of the scene the file it was imported from, or "".
    """

    dna: native.Dna | None = None
    path: str = ""

    def load(self) -> native.Dna:
        """The face as a Dna: the face of the scene, or else the face in the file, which is read.

        Raises:
            DnaError: the file is not a DNA file.
            OSError: the file cannot be read.
        """
        if self.dna is not None:
            return self.dna
        found: native.Dna = native.module().load(self.path)
        return found


class Transfer(NamedTuple):
    """Options for the transfer of expressions from a template face to a head.

    Attributes:
        strength: factor of all expressions, 0 to 1.5.
        repair: whether contacts of lids, lips and teeth are repaired.
    """

    strength: float = 1.0
    repair: bool = True


class Made(NamedTuple):
    """A face made from a head.

    Attributes:
        finding: the landmarks of the head.
        shapes: the head with its expressions.
        rigged: the joint rig that was made from the head.
    """

    finding: finding.Finding
    shapes: native.ShapeSet
    rigged: shape_key_head.Rigged


def rig_task(
    head: finding.Head, template: Template, transfer: Transfer, wishes: shape_key_head.RigWishes
) -> HeadTask[Made]:
    """A task that makes a DNA file of a head without expressions. A cancelled task writes no file.

    Args:
        head: the result of finding.read.
        template: the face with the expressions.
        transfer: options of the transfer.
        wishes: options of the rig.
    """

    def work(_progress: Progress, cancelled: Cancelled) -> Made:
        tell = telling(task.part(FIT, 0.0, _FITTED), cancelled)
        made, read = _carry_over(head, template, transfer, tell)
        tell = telling(task.part(JOINTS, _FITTED, 1.0), cancelled)
        few = native.part("anyhead.onto").FIT_VERTICES
        rig = shape_key_head.joint_rig(read.dna, wishes, read.kept, tell, few)
        if read.template is not None:
            native.part("anyhead.tables").copy_maps(read.template, rig.dna)
        if not cancelled():
            _write(rig.dna, read, wishes.path)
        found = finding.on_object(head, made.landmarks)
        made.shapes.notes = list(dict.fromkeys(made.notes))
        odd = [sentence for sentence in read.odd if sentence not in made.notes]
        return Made(found, made.shapes, shape_key_head.Rigged(rig, odd))

    task = HeadTask(work)
    return task


def _carry_over(
    head: finding.Head, template: Template, transfer: Transfer, progress: Callable[[float], bool]
) -> tuple[native.Onto, native.Read]:
    """The head with the expressions of the template, and a face whose rig has only blend shapes.

    The face is made from the head with its expressions; it has no joints.

    Args:
        head: the result of finding.read.
        template: the face with the expressions.
        transfer: options of the transfer.
        progress: function that is called with the progress, 0 to 1; it returns False to cancel.
    """
    dna, own = template.load(), {part.source for part in head.parts}
    onto, parts = native.part("anyhead.onto"), native.part("author.heads.parts")
    options = onto.OntoOptions(
        strength=transfer.strength,
        repaired=transfer.repair,
        marks=finding.marks_of(head),
        # The head keeps its size, because a face of another size would not fit its body.
        wishes=parts.Wishes(mesh=head.named, scale=1.0),
    )
    name = head.parts[0].name
    made: native.Onto = onto.onto(
        name, head.parts, "cm", dna, options, lambda share: progress(_CARRIED * share)
    )
    made.shapes.name = name
    if template.path:
        lend = native.part("anyhead.borrowing").lend_materials
        lend(made.shapes.parts, dna, Path(template.path), own)
    return made, onto.shape_face(
        made, dna, name, lambda share: progress(_CARRIED + (1 - _CARRIED) * share)
    )


def _write(dna: native.Dna, read: native.Read, path: str) -> None:
    """Write a face and the textures of its materials.

    Args:
        dna: the face; names of textures are added to its metadata.
        read: the face before its joints were made, with the materials of the head.
        path: path of the new DNA file.
    """
    textures = native.part("author.heads.textures")
    found = textures.textures_of(read.materials, textures.texture_folder(Path(path)))
    named = textures.metadata_of(dna.mesh_names, read.materials, found)
    dna.metadata = dict(dna.metadata) | named
    native.part("files.fileio").write_all({Path(path): dna.to_bytes(), **found.files})


def conform_task(head: finding.Head, template: Template, path: str) -> HeadTask[list[str]]:
    """A task that gives a face the shape of a head. A cancelled task writes no file.

    Args:
        head: the result of finding.read; it may be a sculpt with the topology of the face.
        template: the face that is conformed.
        path: the new DNA file.

    Returns:
        A task whose result is a list of sentences about the work.
    """

    def work(_progress: Progress, cancelled: Cancelled) -> list[str]:
        dna = template.load()
        made = _conform(head, dna, telling(task.part(FIT, 0.0, 1.0), cancelled))
        files = {Path(path): made.dna.to_bytes(), **_textures(dna, template.path, path)}
        if not cancelled():
            native.part("files.fileio").write_all(files)
        return list(made.notes)

    task = HeadTask(work)
    return task


def _textures(dna: native.Dna, source: str, path: str) -> dict[Path, bytes]:
    """The texture files of a face: path in the texture folder of the new DNA file -> bytes.

    Args:
        dna: the face.
        source: the DNA file of the face, or "". Without the file there are no textures.
        path: the new DNA file.
    """
    if not source or not Path(source).is_file():
        return {}
    mixing, textures = native.part("mixing"), native.part("mixing.textures")
    found, _ = textures.mix_textures([dna], [Path(source)], mixing.Mix([1.0]), mixing.Masks(dna))
    folder = textures.texture_folder(Path(path))
    return {folder / name: picture for name, picture in found.items()}


def _conform(
    head: finding.Head, dna: native.Dna, progress: Callable[[float], bool]
) -> native.Conformed:
    module, parts = native.part("anyhead.conform.head"), native.part("author.heads.parts")
    made: native.Conformed = module.conform_face(
        dna,
        head.parts,
        finding.marks_of(head),
        progress,
        where=head.parts[0].name,
        wishes=parts.Wishes(mesh=head.named),
    )
    return made
