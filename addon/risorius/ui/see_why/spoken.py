# SPDX-License-Identifier: GPL-3.0-or-later
"""How See Why calls controls and correctives: in the words of the sliders' panel."""

from functools import partial

from ...logic.character import slider_words
from ...scene.base.blender_types import ArmatureObject
from ...scene.see_why import heat
from ..blender_types import Context
from ..common import as_seen

_PRODUCT = " x "  # between the factors of a corrective


def spoken(context: Context, name: str) -> str:
    """A control's name in words, with left and right as in the panel of the sliders.

    Args:
        context: has the preferences.
        name: name of a control, or names of a corrective's factors.
    """
    swapped = as_seen(context)
    return _PRODUCT.join(
        slider_words.title_in_region(factor, "", swapped=swapped) for factor in name.split(_PRODUCT)
    )


def title(context: Context, rig: ArmatureObject, shown: heat.Heat) -> str:
    """The title of a heat map.

    Args:
        context: has the preferences.
        rig: deforming armature of the face.
        shown: its heat map.
    """
    return heat.title(rig, shown, partial(spoken, context))
