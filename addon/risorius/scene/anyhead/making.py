# SPDX-License-Identifier: GPL-3.0-or-later
"""A head takes expressions from a face, or a face takes a head's form: the work beside Blender."""

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

FIT, JOINTS = "FIT", "JOINTS"  # what is done now
_FITTED = 0.6  # the share of the whole time at which a head has its expressions


class HeadTask(Task[Result], Generic[Result]):
    """Something that takes seconds in two stages. Attributes: stage  FIT or JOINTS."""

    stage = FIT

    def part(self, stage: str, begin: float, end: float) -> Progress:
        """A progress for a stage, from its own 0 to 1.

        Args:
            stage: FIT or JOINTS.
            begin, end: shares of the whole.
        """
        self.stage = stage

        def tell(share: float) -> None:
            self.share = begin + (end - begin) * share

        return tell


class Template(NamedTuple):
    """The face that lends its expressions: a DNA file, or a face of the scene.

    Attributes:
        dna: of a face of the scene; None: the file's.
        path: of the file; of a face of the scene the file that it came from; "": none.
    """

    dna: native.Dna | None = None
    path: str = ""

    def load(self) -> native.Dna:
        """The face.

        Raises:
            DnaError, OSError: the file is none, or cannot be read.
        """
        if self.dna is not None:
            return self.dna
        found: native.Dna = native.module().load(self.path)
        return found


class Transfer(NamedTuple):
    """What is to be carried over. Attributes: strength  1: as on the template; repair  of contacts
    that the transfer breaks: lids, lips, teeth."""

    strength: float = 1.0
    repair: bool = True


class Made(NamedTuple):
    """What became of a head.

    Attributes:
        finding: its landmarks.
        shapes: what the face was made from.
        rigged: the face.
    """

    finding: finding.Finding
    shapes: native.ShapeSet
    rigged: shape_key_head.Rigged


def rig_task(
    head: finding.Head, template: Template, transfer: Transfer, wishes: shape_key_head.RigWishes
) -> HeadTask[Made]:
    """The way from a head without expressions to a DNA file; a cancelled one leaves none.

    Args:
        head: of finding.read.
        template: lends its expressions.
        transfer: how they are carried over.
        wishes: what the rig is to be.
    """

    def work(_progress: Progress, cancelled: Cancelled) -> Made:
        tell = telling(task.part(FIT, 0.0, _FITTED), cancelled)
        made, read = _carry_over(head, template, transfer, tell)
        tell = telling(task.part(JOINTS, _FITTED, 1.0), cancelled)
        rig = shape_key_head.joint_rig(read.dna, wishes, read.kept, tell)
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
    """The head with the expressions of a face, and the face of blend shapes of it."""
    dna, own = template.load(), {part.source for part in head.parts}
    onto, parts = native.part("anyhead.onto"), native.part("author.heads.parts")
    options = onto.OntoOptions(
        strength=transfer.strength,
        repaired=transfer.repair,
        marks=finding.marks_of(head),
        # An object has the size that it has: a face that is made smaller would not fit its body.
        wishes=parts.Wishes(mesh=head.named, scale=1.0),
    )
    name = head.parts[0].name
    made: native.Onto = onto.onto(name, head.parts, "cm", dna, options, progress)
    made.shapes.name = name
    if template.path:
        lend = native.part("anyhead.borrowing").lend_materials
        lend(made.shapes.parts, dna, Path(template.path), own)
    return made, onto.shape_face(made, dna, name)


def _write(dna: native.Dna, read: native.Read, path: str) -> None:
    """A face, and the textures of what it has from the other face."""
    textures = native.part("author.heads.textures")
    found = textures.textures_of(read.materials, textures.texture_folder(Path(path)))
    named = textures.metadata_of(dna.mesh_names, read.materials, found)
    dna.metadata = dict(dna.metadata) | named
    native.part("files.fileio").write_all({Path(path): dna.to_bytes(), **found.files})


def conform_task(head: finding.Head, template: Template, path: str) -> HeadTask[list[str]]:
    """A face takes a head's form and is written; a cancelled one leaves no file.

    Args:
        head: of finding.read, or a sculpt of the face with its own vertices.
        template: keeps its topology, names and counts.
        path: of the new file.

    Returns:
        A task whose result is what was guessed and done, a sentence each.
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
    """The textures beside a face's file, for beside the new one.

    Args:
        dna: the face.
        source: its file, which may be gone; "": none.
        path: of the new file.
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
