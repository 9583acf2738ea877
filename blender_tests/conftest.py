# SPDX-License-Identifier: GPL-3.0-or-later
"""Every test starts with an empty file and the add-on just enabled, and disables it afterwards."""

import os
import shutil
import sys
import traceback
from pathlib import Path

import bpy
import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
sys.path.append(str(HERE.parent / "packaging" / "check"))  # limits

MODULE = "bl_ext.user_default.risorius"


@pytest.fixture(scope="session")
def installed():
    """None if run.py installed a package; otherwise the folder with a copy of the add-on."""
    if os.environ.get("RISORIUS_TEST_INSTALLED"):
        return None
    target = Path(os.environ["RISORIUS_TEST_USER"]) / "extensions" / "user_default" / "risorius"
    if not target.exists():
        ignored = shutil.ignore_patterns("__pycache__", "wheels")
        shutil.copytree(HERE.parent / "addon" / "risorius", target, ignore=ignored)
    return target


@pytest.fixture(scope="session", autouse=True)
def kept_wheels():
    """Keep the files of wheels, which Blender deletes when an extension is disabled.

    Unpacking them again takes longer than most tests; test_extension.py tests the deletion in other
    processes.
    """
    import addon_utils

    sync = addon_utils._extension_sync_wheels

    def unless_empty(*, wheel_list, **given):
        if wheel_list:
            sync(wheel_list=wheel_list, **given)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(addon_utils, "_extension_sync_wheels", unless_empty)
        yield


@pytest.fixture(autouse=True)
def tracebacks():
    """Exceptions that Blender printed from our handlers, timers and operators.

    A test with such an exception fails, because Blender only prints it and goes on. A test that
    plants an exception removes it from this list.
    """
    printed = []

    def note(kind, error, trace):
        files = [frame.filename for frame in traceback.extract_tb(trace)]
        if any("user_default" in Path(file).parts for file in files):  # ignores Blender's exporters
            printed.append("".join(traceback.format_exception(kind, error, trace)))
        sys.__excepthook__(kind, error, trace)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "excepthook", note)
        yield printed
    assert not printed, "Blender printed a traceback:\n" + "\n".join(printed)


@pytest.fixture(autouse=True)
def addon(installed, tracebacks):
    """The enabled add-on in an empty file."""
    import addon_utils

    bpy.ops.wm.read_factory_settings(use_empty=True)
    if installed is not None:
        _repository(installed)
    errors = []
    module = addon_utils.enable(MODULE, handle_error=errors.append)
    assert module is not None, errors
    yield module
    addon_utils.disable(MODULE, handle_error=errors.append)
    assert not errors, errors


def _repository(installed):
    """Set the folder of the extension repository, which factory settings remove."""
    import addon_utils

    repos = bpy.context.preferences.extensions.repos
    repository = next((r for r in repos if r.module == "user_default"), None)
    if repository is None:
        repository = repos.new(name="User Default", module="user_default")
    # Set it even if it has this value, because Blender reads the folder when it is set.
    repository.use_custom_directory = True
    repository.custom_directory = str(installed.parent)
    addon_utils.extensions_refresh(ensure_wheels=False)


@pytest.fixture(params=["AUTO", "KEYS"])
def mode(request):
    """The mode of the face: Direct mode, or posed bones with a shape key for each channel.

    Some test files replace this fixture, most to add the mode with one live shape key.
    """
    return request.param


@pytest.fixture
def dna_file(tmp_path):
    """The path of a small DNA file that contains a simple face."""
    from support.faces import small_face

    path = tmp_path / "small.dna"
    small_face().save(str(path))
    return path


def pytest_terminal_summary(terminalreporter):
    """Print the reasons of skipped tests whose data or programs are missing, each reason once."""
    reasons = {report.longrepr[2] for report in terminalreporter.stats.get("skipped", [])}
    for reason in sorted(r.removeprefix("Skipped: ") for r in reasons):
        if reason.startswith("EXTRA NOT RUN"):
            terminalreporter.write_line(reason)
