# SPDX-License-Identifier: MIT
"""Atomic writing of files, locks between processes, the folder of caches."""
