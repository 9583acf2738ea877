# SPDX-License-Identifier: MIT
"""Commands that make faces: author, mix, sample and solve."""
