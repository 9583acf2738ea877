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
    """The folder with a copy of the add-on, or None if run.py has installed a packaged add-on."""
    if os.environ.get("RISORIUS_TEST_INSTALLED"):
        return None
    target = Path(os.environ["RISORIUS_TEST_USER"]) / "extensions" / "user_default" / "risorius"
    if not target.exists():
        ignored = shutil.ignore_patterns("__pycache__", "wheels")
        shutil.copytree(HERE.parent / "addon" / "risorius", target, ignore=ignored)
    return target


@pytest.fixture(scope="session", autouse=True)
def kept_wheels():
    """Keep the unpacked wheels, which Blender would delete when a test disables the extension.

    Unpacking the wheels for each test would take longer than most tests. test_extension.py tests
    the deletion in processes of its own.
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
    """Texts of the exceptions from handlers, timers and operators of the add-on.

    Blender only prints such an exception and goes on, so this fixture lets the test fail. A test
    that causes an exception on purpose removes its text from this list.
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
    """Set the folder of the extension repository, because loading factory settings removes it."""
    import addon_utils

    repos = bpy.context.preferences.extensions.repos
    repository = next((r for r in repos if r.module == "user_default"), None)
    if repository is None:
        repository = repos.new(name="User Default", module="user_default")
    # Set the folder even if the repository has it already, because Blender reads the folder only
    # when this property is set.
    repository.use_custom_directory = True
    repository.custom_directory = str(installed.parent)
    addon_utils.extensions_refresh(ensure_wheels=False)


@pytest.fixture(params=["AUTO", "KEYS"])
def mode(request):
    """The mode of the face: Direct mode, or posed bones with a shape key for each channel.

    Some test files have a fixture of the same name instead; most of them add the mode LIVE, with
    one live shape key per mesh.
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
