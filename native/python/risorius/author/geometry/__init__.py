# SPDX-License-Identifier: MIT
"""Meshes, and what joints do to them, apart from how a rig is made."""
