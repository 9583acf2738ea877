# SPDX-License-Identifier: MIT
"""Tests that all errors derive from one class, and that the command line prints each once."""

import importlib
import inspect
import pkgutil

import pytest
import risorius
import risorius_people
from risorius import RisoriusError, cli
from risorius.cli import info
from risorius.cli.files import CommandLineError, InputError
from risorius.importing import AnimationFileError

OLD_BASES = {
    "DnaError": ValueError,
    "ClipError": ValueError,
    "AnimationFileError": ValueError,
    "MappingError": AnimationFileError,
    "LiveError": ValueError,
    "AudioError": ValueError,
    "MissingError": ValueError,
    "CancelledError": Exception,
    "JobsError": ValueError,
    "PoolError": RuntimeError,
    "SourceError": RuntimeError,
    "UnknownControlError": ValueError,
    "CommandLineError": Exception,
    "InputError": Exception,
}


def error_classes():
    """Name -> class of each error that a module of the packages defines."""
    found = {}
    modules = [
        module
        for package in (risorius, risorius_people)
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    ]
    for module in modules:
        if module.name == "risorius.__main__":
            continue
        for name, value in vars(importlib.import_module(module.name)).items():
            ours = inspect.isclass(value) and value.__module__.startswith("risorius")
            if ours and issubclass(value, BaseException):
                found[name] = value
    return found


def test_every_error_of_the_package_is_of_one_family():
    classes = error_classes()
    assert OLD_BASES.keys() <= classes.keys()
    outside = [name for name, value in classes.items() if not issubclass(value, RisoriusError)]
    assert outside == []


@pytest.mark.parametrize("name", OLD_BASES)
def test_who_caught_an_error_by_its_old_base_still_does(name):
    assert issubclass(error_classes()[name], OLD_BASES[name])


def test_errors_say_code_and_place():
    with pytest.raises(RisoriusError) as caught:
        risorius.load(b"DNA and nothing behind it")
    assert (caught.value.code, caught.value.offset) == ("unsupported_generation", 3)
    with pytest.raises(RisoriusError) as caught:
        risorius.ClipReader(b"RZC")
    assert (caught.value.code, caught.value.offset) == ("not_clip", 0)
    error = AnimationFileError("take.csv", "a number was expected", line=3, column="jawOpen")
    assert str(error) == "take.csv, line 3, column jawOpen: a number was expected"
    assert (error.code, error.where) == ("animation_file", "take.csv, line 3, column jawOpen")
    with pytest.raises(RisoriusError) as caught:
        risorius.load(b"", layers="nonsense")
    assert caught.value.code == "invalid_argument"


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (InputError("a.dna: it is bad"), 1, "a.dna: it is bad"),
        (CommandLineError("--x: 1 was expected"), 2, "--x: 1 was expected"),
        (RisoriusError("it is bad"), 1, "it is bad"),
        (FileNotFoundError(2, "No such file or directory", "a.dna"), 1,
         "a.dna: No such file or directory"),
        (OSError(28, "No space left on device", "a"), 1, "a: No space left on device"),
        (MemoryError(), 1, "not enough memory"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (KeyboardInterrupt("interrupted; it goes on"), 130, "interrupted; it goes on"),
    ],
)  # fmt: skip
def test_the_command_line_says_an_error_once(error, code, text, monkeypatch, capsys):
    def fail(_args):
        raise error

    monkeypatch.setattr(info, "run", fail)
    assert cli.main(["info", "a.dna"]) == code
    assert capsys.readouterr() == ("", f"risorius: {text}\n")


def test_a_fault_of_the_program_is_not_said_as_one_of_the_user(monkeypatch):
    def fail(_args):
        raise ValueError("operands could not be broadcast together")

    monkeypatch.setattr(info, "run", fail)
    with pytest.raises(ValueError, match="broadcast"):
        cli.main(["info", "a.dna"])
