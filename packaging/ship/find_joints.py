# SPDX-License-Identifier: MIT
"""Finds the joints that all sample people share, and writes them into the package.

    python packaging/ship/find_joints.py

Run it again if the man, his controls or the fit change (a test of tests/python/sample fails then),
and build the wheel after it. It takes two minutes on two cores and needs the venv of
packaging/setup.sh.
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
        # Round to the step in which a sample face stores weights. The largest weight of a vertex
        # takes the remainder, so that the sum is 1.
        even = np.round(rows * WEIGHTS)
        even[np.arange(len(even)), even.argmax(axis=1)] += WEIGHTS - even.sum(axis=1)
        reference.weights[name] = even / WEIGHTS
    package = Path(__file__).parents[2] / "native" / "python" / "risorius_people"
    path = package / "references" / SHIPPED.name
    fileio.write_bytes(path, reference.to_bytes())
    print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
