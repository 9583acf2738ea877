# SPDX-License-Identifier: GPL-3.0-or-later
"""The family of the add-on's own errors: what a user can mend, in one sentence.

Operators catch these, the package's RisoriusError and OSError (native.user_errors), and nothing
wider: what else is raised is a fault of the program, which Blender shows as such.
"""


class FaceError(ValueError):
    """Something that a user can mend; the text is one sentence."""
