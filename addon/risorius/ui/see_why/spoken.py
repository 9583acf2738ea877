# SPDX-License-Identifier: GPL-3.0-or-later
"""Titles of controls, correctives and heat maps, in the words of the panel Controls."""

from functools import partial

from ...logic.character import slider_words
from ...scene.base.blender_types import ArmatureObject
from ...scene.see_why import heat
from ..blender_types import Context
from ..common import as_seen

_PRODUCT = " x "  # separates the factors of a corrective


def spoken(context: Context, name: str) -> str:
    """The title of a control or corrective, with left and right as in the panel Controls.

    Args:
        context: context with the preferences.
        name: name of a control; for a corrective, the names of its controls joined with " x ".
    """
    swapped = as_seen(context)
    return _PRODUCT.join(
        slider_words.title_in_region(factor, "", swapped=swapped) for factor in name.split(_PRODUCT)
    )


def title(context: Context, rig: ArmatureObject, shown: heat.Heat) -> str:
    """The title of a heat map.

    Args:
        context: context with the preferences.
        rig: deforming armature of the face.
        shown: heat map of the face.
    """
    return heat.title(rig, shown, partial(spoken, context))
