# SPDX-License-Identifier: MIT
"""Measures errors and times of fitting joints to expressions, and of Dem Bones with --rival.

    python tests/bench/author_fit.py --joints 40 120 400 [--rival] [--bound] [--heads HEAD ...]

Dem Bones is EA's library: pip install py-dem-bones==0.13.1. Both fits get the same mesh, number of
joints and influences. HEAD is cc0 (the CC0 head with its expressions), a name of MACROS (the same
expressions on a body shape that no sample person has), or the path of ICT FaceKit's head as .npz.
"""

from __future__ import annotations

import argparse
import itertools
import os
import platform
import time
import zipfile
from pathlib import Path

import numpy as np
from risorius.author import FitOptions, fit_joints
from risorius.author.fitting import bounded
from risorius.author.geometry.skeleton import matrices_of_vectors
from risorius_people.source import FACE_UNITS, TARGETS, Source, fetch

HEAD_MM = 240
MACROS = {
    "baby": ("universal-male-baby-averagemuscle-maxweight", "african-male-baby"),
    "small": ("universal-female-baby-minmuscle-minweight", "asian-female-baby"),
    "strong": ("universal-male-child-maxmuscle-maxweight", "african-male-child"),
    "old": ("universal-female-old-minmuscle-minweight", "asian-female-old"),
}


def head(path, macros=()):
    """(positions [V, 3], displacements [E, V, 3], polygons) of the CC0 head, in decimetres.

    Args:
        path: zip with the CC0 data of the sample people.
        macros: names of body shapes that are added to the base mesh.
    """
    source = Source(path)
    base = source.base_mesh()
    names = zipfile.ZipFile(path).namelist()
    units = sorted(
        Path(n).stem for n in names if n.startswith(FACE_UNITS) and n.endswith(".target")
    )
    faces = [[corner[0] for corner in face] for face in base.faces["body"]]
    high = [f for f in faces if (np.abs(base.positions[f, 0]) < 1.3).all()]
    high = [f for f in high if (base.positions[f, 1] > 5.9).all()]
    kept = np.unique(np.concatenate(high))
    place = np.full(len(base.positions), -1)
    place[kept] = np.arange(len(kept))
    moved = np.stack([source.face_unit(n, len(base.positions))[kept] for n in units])
    form = base.positions.copy()
    for name in macros:
        form += source.target(f"{TARGETS}macrodetails/{name}.target.gz", len(form))
    return form[kept], moved, [place[face] for face in high]


def ict(path):
    """(positions [V, 3], displacements [E, V, 3], polygons) of ICT FaceKit's head.

    The head includes mouth, teeth and eyes. Lengths are in the unit of the file.
    """
    with np.load(path) as data:
        neutral, begin = data["neutral"].astype(float), data["expression_begin"]
        moved = np.zeros((len(begin) - 1, *neutral.shape))
        for e, (first, last) in enumerate(itertools.pairwise(begin)):
            moved[e, data["expression_vertex"][first:last]] = data["expression_delta"][first:last]
        return neutral, moved, [face[face >= 0] for face in data["faces"]]


def load(name):
    if Path(name).suffix == ".npz":
        return ict(name)
    return head(fetch(), MACROS.get(name, ()))


def edges_of(faces):
    pairs = np.concatenate([np.stack([f, np.roll(f, -1)], axis=1) for f in faces])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def roughness(weights, edges):
    """Mean over vertices of the L1 distance between a vertex's weights and its neighbours' mean."""
    mean = np.zeros_like(weights)
    np.add.at(mean, edges[:, 0], weights[edges[:, 1]])
    np.add.at(mean, edges[:, 1], weights[edges[:, 0]])
    count = np.bincount(edges.ravel(), minlength=len(weights))[:, None]
    return np.abs(weights - mean / count).sum(axis=1).mean()


def row(name, positions, moved, reached, weights, edges, wall, cpu):
    height = np.ptp(positions[:, 1])
    squares = ((reached - moved) ** 2).sum(axis=2)
    moving = np.linalg.norm(moved, axis=2) > 1e-3 * height
    share = 100 / height
    mm = HEAD_MM / height
    print(
        f"{name:22} {share * np.sqrt(squares.mean()):8.4f} "
        f"{share * np.sqrt(squares[moving].mean()):10.4f} {mm * np.sqrt(squares).mean():8.4f} "
        f"{mm * np.sqrt(squares.max()):10.3f} {roughness(weights, edges):9.4f} "
        f"{wall:7.1f} {cpu:7.1f}",
        flush=True,
    )


def ours(joints, positions, moved, edges, bound):
    rest = np.tile(np.eye(3, 4), (len(moved), 1, 1, 1))
    options = FitOptions(joints=joints - 1)  # the given joint, which never moves, counts too
    begin, cpu = time.perf_counter(), time.process_time()
    fit = fit_joints(
        positions,
        moved.astype(np.float32),
        edges.astype(np.uint32),
        given=positions.mean(axis=0)[None],
        motions=rest,
        options=bounded(options) if bound else options,
    )
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    weights = np.zeros((len(positions), joints))
    rows = np.arange(len(positions))[:, None]
    np.add.at(weights, (rows, fit.weight_joints.astype(int)), fit.weights)
    turns = matrices_of_vectors(fit.rotations) - np.eye(3)
    reached = np.zeros_like(moved)
    for j, centre in enumerate(fit.joints):
        held = np.flatnonzero(weights[:, j])
        arms = positions[held] - centre
        step = np.einsum("eik,vk->evi", turns[:, j], arms) + fit.translations[:, j, None]
        reached[:, held] += step * weights[held, j][None, :, None]
    row(f"Risorius, {joints}", positions, moved, reached, weights, edges, wall, cpu)


def rival(joints, positions, moved, faces, edges):
    from py_dem_bones import DemBones

    bones = DemBones()
    bones.nB, bones.nnz, bones.nS = joints, 8, 1
    bones.nV, bones.nF = len(positions), len(moved)
    bones.u = np.asfortranarray(positions.T)
    posed = (positions + moved).transpose(0, 2, 1).reshape(-1, len(positions))
    bones.v = np.asfortranarray(posed)
    bones.fStart = np.array([0, len(moved)], np.int32)
    bones.subjectID = np.zeros(len(moved), np.int32)
    bones.fv = [face.tolist() for face in faces]
    begin, cpu = time.perf_counter(), time.process_time()
    bones.init()
    bones.compute()
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    weights = np.asarray(bones.get_weights()).T
    all_of = np.asarray(bones.m).reshape(len(moved), 4, -1, 4)[:, :3].transpose(0, 2, 1, 3)
    points = np.column_stack([positions, np.ones(len(positions))])
    reached = np.zeros_like(moved)
    for j in range(weights.shape[1]):
        held = np.flatnonzero(weights[:, j])
        step = np.einsum("eik,vk->evi", all_of[:, j], points[held])
        reached[:, held] += step * weights[held, j][None, :, None]
    name = f"Dem Bones, {weights.shape[1]}"
    row(name, positions, moved, reached - positions, weights, edges, wall, cpu)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--joints", type=int, nargs="+", default=[40, 120])
    parser.add_argument("--rival", action="store_true")
    parser.add_argument("--bound", action="store_true", help="as risorius author --bound")
    parser.add_argument(
        "--heads", nargs="+", default=["cc0"], help=f"cc0, {', '.join(MACROS)}, .npz"
    )
    args = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores")
    for name in args.heads:
        measure(name, args)


def measure(name, args):
    positions, moved, faces = load(name)
    edges = edges_of(faces)
    motion = np.sqrt((moved**2).sum(axis=2).mean()) / np.ptp(positions[:, 1])
    print(f"{name}: {len(positions)} vertices, {len(moved)} expressions, motion {motion:.2%} RMS")
    titles = ["RMS %", "of moving", "mean mm", "largest mm", "roughness", "wall s", "CPU s"]
    widths = [8, 10, 8, 10, 9, 7, 7]
    line = " ".join(f"{t:>{w}}" for t, w in zip(titles, widths, strict=True))
    print(f"{'':22} {line}")
    for joints in args.joints:
        ours(joints, positions, moved, edges, args.bound)
        if args.rival:
            rival(joints, positions, moved, faces, edges)


if __name__ == "__main__":
    main()
