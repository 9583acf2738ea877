# SPDX-License-Identifier: MIT
"""Measures how many faults automatically found correctives repair, and their side effects.

    risorius sample build man.dna --joints 0
    python tests/bench/author_correctives.py man.dna [--counts 100 300 500 1000]
    python tests/bench/author_correctives.py full_man.dna --built man.dna

Measures the faults of all pairs of expressions that move common vertices and are no opposites,
repairs the pairs, and measures them again with their correctives, for several numbers of
correctives.

*Bound*: an upper bound of the fraction by which all three totals (volume, torn, folded) can fall if
this number of pairs is repaired completely.
*Undone*: vertices without a fault that the linear sum moves by more than 0.5 mm, and that keep
less than 0.9 of this motion with the corrective.
*Worse*: pairs whose greatest depth grows by more than 0.1 mm with the corrective, or whose most
stretched polygon grows by more than 1 % and beyond 2.5 times its area.
*Held out* (--held-out): removes the face's own correctives, repairs their pairs, and measures the
distance of the result from the removed correctives.
*Built* (--built): the totals of a finished face of joints and shapes, with all its correctives and
with only the correctives of its source.
"""

from __future__ import annotations

import argparse
import copy
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import risorius
from risorius.author.correctives import CorrectiveOptions
from risorius.author.correctives.poser import Poser
from risorius.author.correctives.search import Search, fairest_of, severity, values_of
from risorius.author.geometry import skeleton as sk
from risorius.author.work import MM
from risorius.cli.faces.author import opposites

COUNTS = (100, 300, 500, 1000, 1500, 2000)
MOVED_MM, KEPT, REACH_MM = 0.5, 0.9, 10.0
TORN = 2.5


def corners_of(mesh):
    """The vertex and the polygon of each polygon corner of a mesh, as two integer arrays."""
    layouts = np.asarray(mesh.layout_positions, np.int64)
    corners = layouts[np.asarray(mesh.face_layouts, np.int64)]
    faces = np.repeat(np.arange(len(mesh.face_offsets) - 1), np.diff(mesh.face_offsets))
    return corners, faces


def undone(search, on, mesh):
    """Four counts of vertices that a pair of controls moves, and that have no fault.

    They are: all such vertices; the vertices that keep less than 0.9 of their motion with the
    corrective of the pair; of these, the vertices more than 10 mm away from any fault; and the
    vertices that the corrective moves by more than 0.01 mm.

    Args:
        search: the search, after it has repaired the pair.
        on: indices of the pair's controls.
        mesh: the skin mesh.
    """
    neutral = search.poser.neutral[0]
    linear = search.poser.pose(on, corrected=False)[0]
    made = search.poser.pose(on)[0]
    faults, allowed = search.checker.look(linear, search.poser.pose(on)[1:]), search.allowed(on)
    bad = np.asarray(faults.depth) > np.maximum(np.asarray(allowed.depth), 0.1)
    corners, faces = corners_of(mesh)
    torn = np.asarray(faults.stretch) > np.maximum(np.asarray(allowed.stretch), TORN)
    bad[corners[torn[faces]]] = True
    way = linear - neutral
    length = np.linalg.norm(way, axis=1)
    free = ~bad & (length * search.mm > MOVED_MM)
    kept = np.einsum("vi,vi->v", made - neutral, way)[free] / length[free] ** 2
    held = kept < KEPT
    changed = np.linalg.norm(made - linear, axis=1)[free] * search.mm > 0.01
    far = 0
    if bad.any():
        places = linear[free][held]
        gaps = np.linalg.norm(places[:, None] - linear[bad][None], axis=2)
        far = int((gaps.min(axis=1, initial=np.inf) * search.mm > REACH_MM).sum())
    return free.sum(), held.sum(), far, changed.sum()


def worse(search, on):
    """Whether a pair's faults are worse with its corrective.

    Args:
        search: the search, after it has repaired the pair.
        on: indices of the pair's controls.
    """
    solids = search.poser.pose(on)[1:]
    a = search.checker.look(search.poser.pose(on, corrected=False)[0], solids)
    return grew(a, search.faults(on))


def grew(a, b):
    """Whether the greatest depth of `b` is more than 0.1 mm, or its largest stretch 1 %, above `a`.

    A stretch of at most TORN, 2.5 times the area of a polygon, does not count.

    Args:
        a: faults of a skin without a corrective.
        b: faults of the same skin with the corrective.
    """
    deeper = np.asarray(b.depth).max() > np.asarray(a.depth).max() + 0.1
    larger = np.asarray(b.stretch).max() > max(TORN, 1.01 * np.asarray(a.stretch).max())
    return deeper or larger


def held_out(dna):
    """Lines of text: the distances between the face's own correctives and found correctives.

    The correctives of pairs are compared; all own correctives are removed before the search.

    Args:
        dna: a face with correctives.
    """
    bare = copy.copy(dna)
    bare.psds = risorius.Psds(rows=[], columns=[], values=np.zeros(0, np.float32))
    search = Search(bare, CorrectiveOptions(apart=opposites()), None)
    truth = Poser(dna, search.skin, search.solids)
    given = {tuple(sorted(on)) for on in sk.psd_parts(dna).values() if len(on) == 2}
    out, means, moving_means = [], [], []
    for on in sorted(given):
        search.repair([on], (0.0, 1.0))
        sculpted, plain = truth.pose(on)[0], search.poser.pose(on, corrected=False)[0]
        moved = np.linalg.norm(sculpted - plain, axis=1) * search.mm
        off = np.linalg.norm(search.poser.pose(on)[0] - sculpted, axis=1) * search.mm
        touched = (moved > 0.1) | (off > 0.1)
        if not touched.any():
            continue
        means.append(off[touched].mean())
        moving = np.linalg.norm(sculpted - truth.neutral[0], axis=1) * search.mm > 0.1
        moving_means.append(off[moving].mean())
        out.append(
            f"  {' x '.join(search.names[c] for c in on):32} sculpted {moved.max():5.2f} mm, "
            f"mean {moved[touched].mean():5.2f}; found is {means[-1]:5.2f} off in the mean, "
            f"{off.max():5.2f} at most, {moving_means[-1]:5.2f} in the mean of what moves"
        )
    out.append(
        f"held out: {np.mean(means):.2f} mm in the mean of what {len(means)} pairs change, "
        f"{np.mean(moving_means):.2f} of what moves"
    )
    return out


def built(dna, source):
    """A line of text: the faults of all pairs of a face without and with its found correctives.

    Args:
        dna: a finished face of joints and shapes, loaded with the LODs of source.
        source: the face from which it was made; its correctives are active in both measurements.
    """
    kept = sorted(sk.psd_parts(source))
    parts, plain = dna.psds, copy.copy(dna)
    stays = np.isin(parts.rows, kept)
    plain.psds = risorius.Psds(
        rows=np.asarray(parts.rows)[stays],
        columns=np.asarray(parts.columns)[stays],
        values=np.asarray(parts.values)[stays],
    )
    options = CorrectiveOptions(apart=opposites())
    without, having = Search(plain, options, None), Search(dna, options, None)

    def look(on):
        allowed = without.allowed(on)
        faults = [search.faults(on) for search in (without, having)]
        sums = values_of([without.checker.sum(one, allowed) for one in faults])
        return sums, grew(*faults)

    pairs = without.pairs()
    with ThreadPoolExecutor(2) as pool:
        rows = list(pool.map(look, pairs))
    before, after = np.sum([sums for sums, _ in rows], axis=0)
    fall = " ".join(f"{share:.1%}" for share in 1 - after / before)
    return (
        f"{len(pairs):,} pairs, {len(kept):,} correctives given, "
        f"{len(sk.psd_parts(dna)) - len(kept):,} found: {before[0]:,.0f} mm3 inside, "
        f"{before[1]:,.0f} torn, {before[2]:,.0f} folded fall by {fall}; "
        f"worse in {sum(bool(w) for _, w in rows):,} pairs"
    )


def far_moved(dna):
    """float64[correctives]: the largest displacement in mm that each corrective adds to the head,
    with its controls at 1 and the correctives of subsets of these controls active.

    Args:
        dna: a face with joints, shapes or both.
    """
    columns = sk.column_count(dna)
    head = max(dna.meshes, key=lambda mesh: len(mesh.positions))
    deltas, shapes = sk.column_deltas(dna, columns), sk.column_shapes(dna, head, columns)
    rest = np.linalg.inv(sk.world_matrices(dna, np.zeros_like(deltas[0])))
    weights, neutral = sk.dense_weights(head, len(dna.joint_names)), np.float64(head.positions)
    parts = sk.psd_parts(dna)

    def posed(active):
        worlds = sk.world_matrices(dna, deltas[active].sum(axis=0))
        shaped = neutral + sum((shapes[c] for c in active if c in shapes), 0.0)
        return sk.skinned(shaped, weights, (worlds @ rest)[..., :3, :])

    out = []
    for column, on in parts.items():
        active = [*on, *(c for c, own in parts.items() if c != column and own <= on)]
        moved = posed([*active, column]) - posed(active)
        out.append(np.linalg.norm(moved, axis=1).max() * MM[dna.translation_unit])
    return np.array(out)


def bound(values, count):
    """An upper bound, 0 to 1, of the smallest of the three fractions that `count` pairs remove.

    By duality: the smallest of three fractions is at most any weighted mean of them, and the pairs
    with the largest values maximise that mean. The smallest result of 861 weightings is returned.

    Args:
        values: float64[pairs, 3], volume, torn and folded of each pair.
        count: number of repaired pairs.
    """
    shares, steps = values / values.sum(axis=0), 40
    grid = [(a, b, steps - a - b) for a in range(steps + 1) for b in range(steps + 1 - a)]
    means = (shares @ np.array(w) / steps for w in grid)
    return min(np.sort(mean)[::-1][:count].sum() for mean in means)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("face", type=Path)
    parser.add_argument("--counts", type=int, nargs="*", default=COUNTS)
    parser.add_argument("--most", type=int, default=100_000, help="pairs that are repaired")
    parser.add_argument("--looked-at", type=int, default=400, help="for what is undone")
    parser.add_argument("--held-out", action="store_true", help="that alone")
    parser.add_argument("--moves", action="store_true", help="how far each moves, that alone")
    parser.add_argument("--built", type=Path, help="what the face was made from; that alone")
    args = parser.parse_args()
    begin, cpu = time.monotonic(), time.process_time()
    dna = risorius.load(args.face)
    if args.held_out:
        print("\n".join(held_out(dna)))
        return
    if args.built:
        source = risorius.load(args.built)
        print(built(risorius.load(args.face, lods=range(source.lod_count)), source))
        return
    if args.moves:
        moved = far_moved(dna)
        row = ", ".join(f"{(moved >= mm).sum():,} {mm} mm" for mm in (0.05, 0.1, 0.5, 1, 2, 5))
        print(f"{len(moved):,} correctives; so many move a vertex by at least: {row}")
        return
    search = Search(dna, CorrectiveOptions(apart=opposites()), None)
    pairs = search.pairs()
    sums = dict(zip(pairs, search.sums(pairs, (0.0, 1.0)), strict=True))
    wrong = sorted((p for p in pairs if severity(sums[p]) > 0), key=lambda p: -severity(sums[p]))
    bad = [p for p in wrong if severity(sums[p]) > 0.1]
    print(
        f"{len(pairs):,} pairs, {len(wrong):,} wrong, {len(bad):,} of them by more than is left "
        f"alone; {time.process_time() - cpu:.0f} s of CPU",
        flush=True,
    )
    search.repair(bad[: args.most], (0.0, 1.0))
    made = [p for p in bad if p in search.found]
    values = values_of(list(sums.values()))
    whole = values.sum(axis=0)
    print(f"{'correctives':>11} {'mm3 inside':>11} {'torn':>7} {'folded':>7}  fall by; bound")
    for count in sorted({0, len(made), *(n for n in args.counts if n < len(made))}):
        mended = set(fairest_of({p: sums[p] for p in made}, count))
        left = [search.found[p].after if p in mended else s for p, s in sums.items()]
        row = values_of(left).sum(axis=0)
        fall = " ".join(f"{share:.1%}" for share in 1 - row / whole)
        print(
            f"{count:11,} {row[0]:11,.0f} {row[1]:7,.0f} {row[2]:7,.0f}  {fall}; "
            f"{bound(values, count):.1%}",
            flush=True,
        )
    some = made[:: max(1, len(made) // args.looked_at)]
    mesh = dna.meshes[search.skin]
    counted = np.sum([undone(search, on, mesh) for on in some], axis=0)
    print(
        f"{len(some)} of them: {counted[0]:,} vertices that move and have no fault; {counted[3]:,} "
        f"are changed, {counted[1]:,} keep less than {KEPT:.0%}, {counted[2]:,} of these more than "
        f"{REACH_MM:.0f} mm from a fault"
    )
    print(f"worse in {sum(worse(search, on) for on in some)} of them")
    print(f"{time.process_time() - cpu:.0f} s of CPU, {time.monotonic() - begin:.0f} s")


if __name__ == "__main__":
    main()
