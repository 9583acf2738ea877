# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the add-on's errors that a user can mend.

Operators catch these, the package's RisoriusError and OSError (native.user_errors), and nothing
else: any other exception is a fault of the program, which Blender shows with a traceback.
"""


class FaceError(ValueError):
    """An error that the user can correct; its message is one sentence."""
