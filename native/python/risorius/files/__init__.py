# SPDX-License-Identifier: MIT
"""Atomic writing of files, locks between processes, the cache folder, PNG and JPEG files."""
