# SPDX-License-Identifier: MIT
"""The joints of a game face, alone or on the bones of a body, and their nodes."""
