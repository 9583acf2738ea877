# SPDX-License-Identifier: MIT
"""Reads sound files as samples (WAV directly, other formats with ffmpeg), and resamples them."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..base import signatures
from ..base.errors import RisoriusError
from ..base.reading import ReadingError, read_file

Samples = npt.NDArray[np.float32]

RATE = 16000
"""Samples per second in all speech code, equal to that of the acoustic model's training data."""

_LOWEST_RATE, _HIGHEST_RATE = 4000, 768000
_MOST_CHANNELS = 64
_MOST_BYTES = 2**31  # limit of a file: 1.5 hours of stereo at 48 kHz and 32 bit
_PCM, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
# Values in the size fields of a WAV file whose program wrote to a pipe and did not know the size.
_LENGTH_UNKNOWN = (0, 0xFFFFFFFF)


class AudioError(RisoriusError):
    """An unusable sound file; the message names the file and the reason."""

    code = "audio"


class _Format(NamedTuple):
    code: int
    channels: int
    rate: int
    bits: int


def read_audio(path: str | os.PathLike[str]) -> tuple[Samples, int]:
    """Reads a sound file as one channel.

    Args:
        path: path of a WAV file (8, 16, 24 or 32 bit integer, 32 or 64 bit float), or of any file
            that an ffmpeg on PATH can read.

    Returns:
        float32[samples], where full scale is 1, and the samples per second. Several channels are
        averaged; if they cancel each other, the loudest one is used.

    Raises:
        AudioError: the file cannot be opened, is not sound, is damaged, or has no samples.
    """
    try:
        data = read_file(path, _MOST_BYTES)
    except ReadingError as error:
        raise AudioError(str(error)) from error
    except OSError as error:
        raise AudioError(f"{path}: cannot read it: {error.strerror}") from error
    kind = signatures.other_kind(data, (signatures.SOUND.code, signatures.FILM.code))
    if kind is not None:
        raise AudioError(f"{path}: a sound was expected, this is {kind}")
    if data[:4] != b"RIFF" or data[8:12] != b"WAVE":
        data = _converted(path, "not a WAV file")
    try:
        return parse_wav(data)
    except _OtherKindError as error:
        data = _converted(path, str(error))
    except AudioError as error:
        raise AudioError(f"{path}: {error}") from error
    try:
        return parse_wav(data)
    except AudioError as error:
        raise AudioError(f"{path}: {error}") from error


class _OtherKindError(AudioError):
    """A valid WAV file in a format that only ffmpeg reads."""


def parse_wav(data: bytes) -> tuple[Samples, int]:
    """Parses the bytes of a WAV file.

    Returns:
        float32[samples] of one channel, where full scale is 1, and the samples per second.

    Raises:
        AudioError: damaged, without samples, or of an unsupported format; the message does not name
            the file.
    """
    form: _Format | None = None
    offset = 12
    while offset + 8 <= len(data):
        name, size = data[offset : offset + 4], struct.unpack_from("<I", data, offset + 4)[0]
        begin = offset + 8
        if name == b"data":
            if form is None:
                raise AudioError(
                    f"byte {offset}: samples before the fmt chunk, which describes them, were found"
                )
            return _decode(_body(data, begin, size), form), form.rate
        if begin + size > len(data):
            raise AudioError(
                f"byte {offset}: a chunk of {size} bytes is announced, {len(data) - begin} are left"
            )
        if name == b"fmt ":
            form = _format(data[begin : begin + size], begin)
        offset = begin + size + (size & 1)
    raise AudioError("a WAV file without samples: no data chunk was found")


def _body(data: bytes, begin: int, size: int) -> bytes:
    if size in _LENGTH_UNKNOWN:
        return data[begin:]
    if begin + size > len(data):
        raise AudioError(
            f"cut short: {size} bytes of samples are announced, {len(data) - begin} are left"
        )
    return data[begin : begin + size]


def _format(chunk: bytes, offset: int) -> _Format:
    if len(chunk) < 16:
        raise AudioError(f"byte {offset}: a fmt chunk of 16 bytes was expected, found {len(chunk)}")
    code, channels, rate, _, block, bits = struct.unpack_from("<HHIIHH", chunk)
    if code == _EXTENSIBLE and len(chunk) >= 26:
        # The format code is at the beginning of the sub-format's GUID.
        code = struct.unpack_from("<H", chunk, 24)[0]
    if not 1 <= channels <= _MOST_CHANNELS:
        raise AudioError(
            f"byte {offset + 2}: 1 to {_MOST_CHANNELS} channels were expected, found {channels}"
        )
    if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
        raise AudioError(
            f"byte {offset + 4}: {_LOWEST_RATE} to {_HIGHEST_RATE} samples a second were expected, "
            f"found {rate}"
        )
    if (code, bits) not in {(_PCM, n) for n in (8, 16, 24, 32)} | {(_FLOAT, 32), (_FLOAT, 64)}:
        raise _OtherKindError(f"a WAV file of format {code} with {bits} bits")
    if block != channels * bits // 8:
        raise AudioError(
            f"byte {offset + 12}: {channels * bits // 8} bytes a sample of all channels were "
            f"expected, found {block}"
        )
    return _Format(code, channels, rate, bits)


def _decode(body: bytes, form: _Format) -> Samples:
    count = len(body) // (form.channels * form.bits // 8)
    if count == 0:
        raise AudioError("a WAV file without samples: its data chunk is empty")
    body = body[: count * form.channels * form.bits // 8]
    if form.code == _FLOAT:
        values = np.frombuffer(body, f"<f{form.bits // 8}").astype(np.float32)
        if not np.isfinite(values).all():
            place = int(np.argmin(np.isfinite(values))) // form.channels
            raise AudioError(f"sample {place} is no finite number")
    elif form.bits == 8:
        values = (np.frombuffer(body, np.uint8).astype(np.float32) - 128.0) / 128.0
    elif form.bits == 24:
        wide = np.zeros((count * form.channels, 4), np.uint8)
        wide[:, 1:] = np.frombuffer(body, np.uint8).reshape(-1, 3)
        values = wide.view("<i4")[:, 0].astype(np.float32) / 2.0**31
    else:
        values = np.frombuffer(body, f"<i{form.bits // 8}").astype(np.float32)
        values /= 2.0 ** (form.bits - 1)
    return _one_channel(values.reshape(count, form.channels))


def _one_channel(channels: Samples) -> Samples:
    """float32[samples]: the mean of float32[samples, channels], or the loudest channel if the mean
    loses the voice."""
    mean = channels.mean(axis=1, dtype=np.float32)
    power = np.square(channels, dtype=np.float64).mean(axis=0)
    # Channels of microphones with opposite polarity cancel out in the mean.
    if np.square(mean, dtype=np.float64).mean() < 0.05 * power.max():
        return np.ascontiguousarray(channels[:, int(np.argmax(power))])
    return mean


def _converted(path: str | os.PathLike[str], found: str) -> bytes:
    """Converts a sound file with ffmpeg to the bytes of a WAV file: one channel at RATE.

    Args:
        path: path of the file.
        found: the reason why ffmpeg is needed, for errors.

    Raises:
        AudioError: not a regular file, no ffmpeg on PATH, or no sound in the file.
    """
    # ffmpeg gets only files: a pipe has been read already, and ffmpeg would wait for ever.
    if not os.path.isfile(path):
        raise AudioError(f"{path}: {found}; other formats are read from files, and not from pipes")
    program = shutil.which("ffmpeg")
    if program is None:
        raise AudioError(
            f"{path}: {found}; other formats are read through ffmpeg, which is not on PATH"
        )
    # Because of the prefix "file:", ffmpeg never takes a name as an address or an option.
    source = f"file:{os.path.abspath(path)}"
    # fmt: off
    done = subprocess.run(
        [program, "-v", "error", "-nostdin", "-protocol_whitelist", "file", "-i", source, "-vn",
         "-ac", "1", "-ar", str(RATE), "-c:a", "pcm_s16le", "-f", "wav", "-bitexact", "-"],
        capture_output=True, check=False,
    )
    # fmt: on
    if done.returncode != 0 or not done.stdout:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise AudioError(f"{path}: {found}, and ffmpeg finds no sound in it: {(said or ['?'])[-1]}")
    return done.stdout


def resample(samples: Samples, source: int, target: int = RATE) -> Samples:
    """Converts samples to another rate with a polyphase filter: a sinc in a Kaiser window (80 dB,
    flat to 91 % of the lower band).

    Args:
        samples: float32[n] at `source` samples per second.
        source, target: samples per second before and after the conversion.

    Returns:
        float32[n * target / source], rounded up; sample i is at i / target seconds.
    """
    if source == target:
        return samples
    divisor = int(np.gcd(source, target))
    up, down = target // divisor, source // divisor
    count = -(-len(samples) * up // down)
    band = 0.955 * min(1.0, target / source)  # highest frequency / (source / 2)
    reach = int(np.ceil(56.0 / band))  # samples of the source on each side of the filter
    padded = np.concatenate([np.zeros(reach, np.float32), samples, np.zeros(reach + 1, np.float32)])
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    result = np.empty(count, np.float32)
    block = max(1, 2**21 // (2 * reach + 1))
    for first in range(0, count, block):
        place = np.arange(first, min(first + block, count), dtype=np.int64) * down
        phases, which = np.unique(place % up, return_inverse=True)
        bank = _kernel(phases / up, reach, band)
        rows = windows[place // up]
        result[first : first + len(place)] = np.einsum("nk,nk->n", rows, bank[which])
    return result


def _kernel(fractions: npt.NDArray[np.float64], reach: int, band: float) -> Samples:
    """float32[fractions, 2 * reach + 1]: filter weights of the samples around each position.

    Args:
        fractions: float64[n], distance of each position from the sample before it, 0 to 1.
        reach: number of samples on each side.
        band: highest frequency that passes, as a fraction of half the samples per second.
    """
    distance = np.arange(-reach, reach + 1) - fractions[:, None]
    inside = np.clip(1.0 - np.square(distance / (reach + 1.0)), 0.0, None)
    window = np.i0(8.0 * np.sqrt(inside)) / np.i0(8.0)
    weights = band * np.sinc(band * distance) * window
    return (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
