# SPDX-License-Identifier: MIT
"""Finds the joints that all sample people share and writes them where the package has them: to be
run again where the man, his controls or the fit change (tests/python/sample sees it). Two
minutes on two cores, in the environment of packaging/setup.sh; the wheel is built anew after it.

    python packaging/ship/find_joints.py
"""

from pathlib import Path

import numpy as np
from risorius.author import find_reference
from risorius.files import fileio
from risorius_people.blend_shape_face import assemble
from risorius_people.build import RIG, WEIGHTS
from risorius_people.references import SHIPPED
from risorius_people.source import Source, fetch


def main() -> None:
    """Write native/python/risorius_people/references/joints.npz."""
    man, _, _ = assemble(Source(fetch(offline=False)), print)
    reference = find_reference(man, RIG)
    for name, rows in reference.weights.items():
        # As fine as a sample face keeps them; the largest takes what is over.
        even = np.round(rows * WEIGHTS)
        even[np.arange(len(even)), even.argmax(axis=1)] += WEIGHTS - even.sum(axis=1)
        reference.weights[name] = even / WEIGHTS
    package = Path(__file__).parents[2] / "native" / "python" / "risorius_people"
    path = package / "references" / SHIPPED.name
    fileio.write_bytes(path, reference.to_bytes())
    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
