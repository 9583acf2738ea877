# SPDX-License-Identifier: GPL-3.0-or-later
"""Every test starts with an empty file and the add-on just enabled, and disables it after."""

import os
import shutil
import sys
from pathlib import Path

import bpy
import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

MODULE = "bl_ext.user_default.risorius"


@pytest.fixture(scope="session")
def installed():
    """The add-on as an extension in a repository of the throw-away user folder."""
    import addon_utils

    if "RISORIUS_TEST_EXTENSION" in os.environ:  # run.py installed it
        repos = bpy.context.preferences.extensions.repos
        repository = next(r for r in repos if r.module == "user_default")
        return Path(repository.directory) / "risorius"
    repository = next(
        (r for r in bpy.context.preferences.extensions.repos if r.module == "user_default"), None
    )
    if repository is None:
        repository = bpy.context.preferences.extensions.repos.new(
            name="User Default", module="user_default"
        )
    user = Path(os.environ["RISORIUS_TEST_USER"]) / "extensions" / "user_default"
    user.mkdir(parents=True, exist_ok=True)
    repository.use_custom_directory = True
    repository.custom_directory = str(user)
    target = user / "risorius"
    if not target.exists():
        shutil.copytree(
            HERE.parent / "addon" / "risorius",
            target,
            ignore=shutil.ignore_patterns("__pycache__", "wheels"),
        )
    addon_utils.extensions_refresh(ensure_wheels=False)
    return target


@pytest.fixture(autouse=True)
def addon(installed):
    """The enabled add-on in an empty file."""
    import addon_utils

    bpy.ops.wm.read_factory_settings(use_empty=True)
    _repository(installed)
    errors = []
    module = addon_utils.enable(MODULE, handle_error=errors.append)
    assert module is not None, errors
    yield module
    addon_utils.disable(MODULE, handle_error=errors.append)
    assert not errors, errors


def _repository(installed):
    """Factory settings forget the repository's folder."""
    repos = bpy.context.preferences.extensions.repos
    repository = next((r for r in repos if r.module == "user_default"), None)
    if repository is None:
        repository = repos.new(name="User Default", module="user_default")
    if repository.directory.rstrip("/\\") != str(installed.parent):
        repository.use_custom_directory = True
        repository.custom_directory = str(installed.parent)


@pytest.fixture(params=["LIVE", "KEYS"])
def mode(request):
    """Both ways of keeping shapes."""
    return request.param


@pytest.fixture
def dna_file(tmp_path):
    """A small face-like DNA file of our own making."""
    from support.faces import small_face

    path = tmp_path / "small.dna"
    small_face().save(str(path))
    return path
