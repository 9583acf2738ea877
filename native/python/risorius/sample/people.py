# SPDX-License-Identifier: MIT
"""Who can be built: shares of the data's body shapes, and colours."""

from __future__ import annotations

from dataclasses import dataclass

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Person:
    """A sample person. Colours are sRGB in [0, 1]."""

    name: str
    gender: str
    age: int
    shape: dict[str, float]
    """Target of the data -> weight."""
    skin: Colour
    flush: Colour
    lids: Colour
    lips: Colour
    hair: Colour
    brows: Colour
    beard: float
    """Opacity of its shadow."""
    iris: tuple[Colour, Colour]
    """At the pupil, at the rim."""


MAN = Person(
    name="Sample",
    gender="male",
    age=28,
    shape={
        "macrodetails/universal-male-young-averagemuscle-averageweight": 1.0,
        "macrodetails/caucasian-male-young": 0.6,
        "macrodetails/african-male-young": 0.2,
        "macrodetails/asian-male-young": 0.2,
    },
    skin=(0.79, 0.60, 0.50),
    flush=(0.78, 0.46, 0.40),
    lids=(0.62, 0.42, 0.36),
    lips=(0.66, 0.38, 0.36),
    hair=(0.20, 0.15, 0.13),
    brows=(0.13, 0.085, 0.06),
    beard=0.16,
    iris=((0.42, 0.30, 0.16), (0.25, 0.29, 0.26)),
)
WOMAN = Person(
    name="SampleWoman",
    gender="female",
    age=31,
    shape={
        "macrodetails/universal-female-young-averagemuscle-averageweight": 1.0,
        "macrodetails/african-female-young": 0.65,
        "macrodetails/caucasian-female-young": 0.2,
        "macrodetails/asian-female-young": 0.15,
    },
    skin=(0.50, 0.335, 0.255),
    flush=(0.50, 0.26, 0.20),
    lids=(0.35, 0.215, 0.165),
    lips=(0.47, 0.235, 0.215),
    hair=(0.085, 0.065, 0.055),
    brows=(0.06, 0.042, 0.034),
    beard=0.0,
    iris=((0.26, 0.15, 0.075), (0.15, 0.085, 0.05)),
)
PEOPLE = {"man": MAN, "woman": WOMAN}
