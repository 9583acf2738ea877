# SPDX-License-Identifier: GPL-3.0-or-later
"""The speech recognition package: hashes of accepted files, and reasons why pip failed."""

import re

PACKAGE = "pocketsphinx==5.1.1"
# SHA-256 hashes of the accepted wheels of the speech recognition package, for the Python versions
# of Blender; pip rejects other files.
HASHES = (
    "bb8fd0fc7fb08dd8f85da21f5121f34ebf4186a5bee91ce85e2d358e69a448bf",  # cp311, Linux x86_64
    "4742dc42c010caf5a2558cac910b0856d85c94e9bb0357ed4ff32f1f0d0837f9",  # cp311, Linux aarch64
    "8cd1ae6f236c2d1941643d87b9136317f628878892fbcb873ab2795f715144d3",  # cp311, macOS
    "08e4d5cc7377932dae2e55191b34f9939d73bf2401046ca2bd03be6daf21ac3b",  # cp311, Windows
    "38ff34e47b35f0caa1b58939806c4ab86c234a13536299c8c929a3cb45761941",  # cp313, Linux x86_64
    "c6741bebbec5a10d08971bd2fdc0a6c1f876ad20a27f73c598e81654612794d6",  # cp313, Linux aarch64
    "8de78671858278dbe97bf9578ea25a70ac2162d49a3218155c874058ba4554fc",  # cp313, macOS
    "2ba7e6789a67119f581b85d156e523cd1876af5d30ebacbf7ed3cd85f61ec382",  # cp313, Windows
)
_UNREACHED = re.compile(
    r"NewConnectionError|ConnectTimeoutError|ReadTimeoutError|ProxyError|NameResolutionError|"
    r"ConnectionResetError|RemoteDisconnected"
)
_DETAIL = re.compile(r"\[(?:Errno|WinError) -?\d+\] ([^'\")]+)")
_CERTIFICATE = re.compile(r"certificate verify failed: ([^(]+) \(_ssl")
_NO_FILE = re.compile(r"No matching distribution|Could not find a version")


def requirements() -> str:
    """The text of a requirements file for pip, with a hash for each wheel."""
    return " ".join([PACKAGE, *(f"--hash=sha256:{value}" for value in HASHES)]) + "\n"


def reason(said: str, running: str) -> str:
    """The reason why pip failed. The last line of its output is often only a consequence.

    Args:
        said: the whole output of pip.
        running: this Python and machine, such as "Python 3.14 on Linux aarch64".

    Returns:
        The reason as the end of a sentence, without a full stop.
    """
    if "DO NOT MATCH THE HASHES" in said:
        return "what was downloaded is not the file that this add-on knows; it was left out"
    if "CERTIFICATE_VERIFY_FAILED" in said or "SSLError" in said:
        found = _CERTIFICATE.search(said)
        why = f" ({found.group(1).strip()})" if found else ""
        return f"the certificate of the package index was not accepted{why}"
    if _UNREACHED.search(said):
        found = _DETAIL.search(said)
        why = f" ({found.group(1).strip()})" if found else ""
        return f"the package index could not be reached{why}"
    if _NO_FILE.search(said):
        return f"there is no file of it for {running}"
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    lines = [line for line in lines if not line.startswith(("[notice]", "WARNING:"))]
    errors = [line.removeprefix("ERROR: ") for line in lines if line.startswith("ERROR: ")]
    return (errors or lines or ["no reason was given"])[-1].rstrip(".")
