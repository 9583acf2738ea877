# SPDX-License-Identifier: GPL-3.0-or-later
"""What differs between Blender 4.2 and 5.2."""


def curves_of(action):
    """The F-curves of an action: since 4.4 it has layers and slots, since 5.0 nothing else."""
    if hasattr(action, "layers") and len(action.layers):
        for layer in action.layers:
            for strip in layer.strips:
                for bag in getattr(strip, "channelbags", ()):
                    yield from bag.fcurves
    elif hasattr(action, "fcurves"):
        yield from action.fcurves


def make_node_tree(material):
    """Give a material its nodes: since 5.0 each has them and the switch only warns."""
    if material.node_tree is None:
        material.use_nodes = True


def deselect_all(layer):
    """Select no object of a view layer.

    4.2 walks its list of objects while selecting makes it anew, and dies where objects have come
    or gone since the last update.
    """
    layer.update()
    for item in layer.objects[:]:
        item.select_set(False, view_layer=layer)
