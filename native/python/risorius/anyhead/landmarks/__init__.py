# SPDX-License-Identifier: MIT
"""Finds the landmarks of a face automatically, checks them, and stores them as JSON."""
