# SPDX-License-Identifier: MIT
"""Measures the fraction of speech frames with the right viseme, with and without a transcript.

espeak-ng speaks the sentences, so the true phoneme times are known. The parameters of
risorius.speech were tuned on the first half of the sentences. The result that counts is the second
half, because its sentences, voices, speeds and pitches were not used for tuning.

    python tests/bench/speech_accuracy.py [--half tuned|held-out] [--table]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

import espeak_truth
from risorius.speech import phonemes
from risorius.speech.phones import VISEMES, viseme_of

STEP = 0.01  # seconds per frame

# (espeak-ng voice, words per minute, pitch from 0 to 100) of each voice
TUNED_VOICES = (("en-us", 175, 50), ("en-us+f2", 150, 60), ("en-us+m3", 195, 40))
HELD_OUT_VOICES = (("en-us+m7", 165, 45), ("en-us+f4", 180, 55), ("en-us+m1", 145, 35))
TUNED = (
    "The quick brown fox jumps over the lazy dog near the river bank.",
    "Bob packed my map before breakfast, but Pam left both bags at home.",
    "Five very fine violins filled the vast hall with soft and lovely music.",
    "She sells sea shells, and he chose cheese and cherry juice for lunch.",
    "Think about the other path, although this thick weather bothers them.",
    "Would you go down to the old stone house, or wait for the slow boat?",
    "Take ten tidy tickets to the top deck, and don't drop a single dime.",
    "Good cooks keep great cakes cool; ginger and garlic go in quickly.",
    "Her nurse heard thirty birds early on the first Thursday of March.",
    "Roy enjoys noisy toys, while Joyce avoids the boiling oil.",
    "A cow ran around the brown house, and now our town is loud.",
    "We need to meet three people each week, please be neat and keen.",
    "Ruby used two blue shoes to move through the cool smooth room.",
    "Can Ann's black cat catch that fat rat? Perhaps it can.",
    "I like my white kite, and I might fly it high tonight.",
)
HELD_OUT = (
    "My mother bought a small wooden table from the market by the bridge.",
    "Please put the paper cups back on top of the cupboard, Bobby.",
    "Have you ever found a leaf of clover with four or five leaves?",
    "The judge changed her vision of justice, and usually measured each choice.",
    "Neither the author nor his brother thought the earth was smooth.",
    "Long strong songs bring young singers along in the spring evening.",
    "Red roses rarely grow around rough rocks, the gardener remarked.",
    "Don't go home alone, Joan; the road is cold and the coach is slow.",
    "Yes, yellow yachts yielded yesterday beyond the yard.",
    "The wizard was always aware that winter winds would wake the wolf.",
    "Six sick seals zigzag across the icy seas in silence.",
    "Hello, how are you today? I hope that everything is going well.",
    "Put the pudding on the good wooden shelf, it should look full.",
    "Late in May the gray whale came to play in the great bay.",
    "Many men said that ten red pens were better than any pencil.",
)


def corpus(half: str) -> list[tuple[str, str, int, int]]:
    """(text, voice, words per minute, pitch) of each sentence of a half; the voices take turns.

    Args:
        half: "tuned" or "held-out".
    """
    texts, voices = (TUNED, TUNED_VOICES) if half == "tuned" else (HELD_OUT, HELD_OUT_VOICES)
    return [(text, *voices[i % len(voices)]) for i, text in enumerate(texts)]


def frames(found, at: np.ndarray) -> np.ndarray:
    """The viseme class of a list of phonemes at each time in seconds; "sil" between phonemes."""
    classes = np.full(len(at), "sil", dtype="<U3")
    for phone in found:
        classes[(at >= phone.begin) & (at < phone.end)] = viseme_of(phone.name)
    return classes


def measure(
    sentences: list[tuple[str, str, int, int]], folder: Path, with_text: bool
) -> np.ndarray:
    """int[true class, found class]: numbers of frames, for sentences from corpus()."""
    table = np.zeros((len(VISEMES), len(VISEMES)), int)
    for i, (text, voice, speed, pitch) in enumerate(sentences):
        spoken = espeak_truth.say(text, voice, speed, pitch)
        path = folder / f"{i}.wav"
        spoken.save(path)
        at = np.arange(STEP / 2, spoken.times[-1], STEP)
        found = frames(phonemes(path, text if with_text else None), at)
        pairs = Counter(zip(spoken.classes(at), found, strict=True))
        for (true, heard), count in pairs.items():
            table[VISEMES.index(true), VISEMES.index(heard)] += count
    return table


def accuracy(table: np.ndarray) -> float:
    return float(np.trace(table) / table.sum())


def commonest(table: np.ndarray) -> tuple[str, float]:
    """The most common true class, and its fraction: the result of always guessing this class."""
    counts = table.sum(axis=1)
    return VISEMES[int(counts.argmax())], float(counts.max() / counts.sum())


def markdown(table: np.ndarray) -> str:
    """A Markdown table with a row for each true class and a column for each found class.

    A cell is the percentage of the row's frames; the last column is their number.
    """
    lines = [f"| true | {' | '.join(VISEMES)} | frames |", "|---" * (len(VISEMES) + 2) + "|"]
    for name, row in zip(VISEMES, table, strict=True):
        share = [f"{100 * n / max(row.sum(), 1):.0f}" if n else "" for n in row]
        lines.append(f"| {name} | {' | '.join(share)} | {row.sum()} |")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--half", choices=("tuned", "held-out"), action="append")
    parser.add_argument("--table", action="store_true", help="print the confusion tables")
    args = parser.parse_args()
    if not espeak_truth.is_installed():
        print("EXTRA NOT RUN: espeak-ng is not installed")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        for half in args.half or ("tuned", "held-out"):
            for with_text in (True, False):
                begin = time.perf_counter()
                table = measure(corpus(half), Path(folder), with_text)
                guess, share = commonest(table)
                print(
                    f"{half}, {'with' if with_text else 'without'} transcript: "
                    f"{accuracy(table):.1%} of {table.sum()} frames right; always {guess}: "
                    f"{share:.1%}; {time.perf_counter() - begin:.1f} s"
                )
                if args.table:
                    print("\n" + markdown(table) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
