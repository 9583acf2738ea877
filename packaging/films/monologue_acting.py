# SPDX-License-Identifier: MIT
"""Lists the times of speech, moods, gaze and head turns of the monologue. Does not need Blender.

python monologue_acting.py      prints a line of milliseconds, words per minute and text, separated
                                by tabs, for each line of speech
"""

from __future__ import annotations

FRAME_RATE = 24
LAST_FRAME = 480  # twenty seconds

# Spoken lines: (start in seconds, words per minute, text).
LINES = [
    (2.3, 140, "There it is. I almost do not dare to look."),
    (8.0, 165, "They said yes. They really said yes!"),
    (13.6, 125, "I only wish he could have heard it."),
]

INTENSITY = 0.75  # of the speech; below 1, because a mood has already moved the mouth

# Moods: (first second, last second, expression, strength, whether the expression is mirrored). The
# expression has this strength from the first to the last second, and blends into the next mood.
MOODS = [
    (0.0, 0.6, "relief", 0.15, False),
    (1.4, 4.6, "doubt", 0.7, False),
    (5.2, 6.6, "concentration", 0.75, False),
    (7.1, 7.9, "surprise", 0.75, False),
    (8.5, 12.2, "joy", 0.8, False),
    (13.4, 16.6, "sadness", 0.8, False),
    (18.2, 20.0, "smile_closed", 0.45, False),
]
SMIRK = 0.45  # fraction of the displacement of the mouth's corner in a full smile
NEARER = 0.62  # the camera's distance as a fraction of the studio's
BLINKS = [0.9, 4.9, 6.8, 12.8, 15.2, 17.2]

# Targets of the gaze: (second, place). A place has the distances to the left of, in front of and
# above the midpoint of the eyes, in heights of the head.
LOOKS = [
    (0.0, (1.6, 2.6, 0.1)),
    (1.1, (1.6, 2.6, 0.1)),
    (1.3, (0.3, 2.0, -0.8)),  # the letter
    (3.6, (0.3, 2.0, -0.8)),
    (3.8, (-0.3, 3.0, 0.15)),  # the listener
    (4.8, (-0.3, 3.0, 0.15)),
    (5.0, (0.2, 2.0, -0.8)),
    (5.6, (0.5, 2.0, -0.82)),
    (5.7, (0.15, 2.0, -0.9)),
    (6.3, (0.5, 2.0, -0.95)),
    (7.7, (0.3, 2.0, -0.9)),
    (7.9, (-0.2, 3.0, 0.1)),
    (12.6, (-0.2, 3.0, 0.1)),
    (12.9, (0.9, 2.2, -0.7)),
    (16.8, (0.9, 2.2, -0.7)),
    (17.3, (-0.1, 3.0, 0.05)),
    (20.0, (-0.1, 3.0, 0.05)),
]
# (second, (nod, tilt, turn) of the head in degrees); positive: down, to the left shoulder, to the
# left.
TURNS = [
    (0.0, (-2, 0, 10)),
    (1.2, (-1, 0, 9)),
    (1.9, (12, 2, 4)),
    (3.5, (11, 2, 4)),
    (4.1, (1, -3, -4)),
    (4.8, (2, -3, -3)),
    (5.4, (13, 1, 3)),
    (6.9, (14, 1, 3)),
    (7.8, (-3, 0, 0)),
    (8.6, (2, 2, -3)),
    (9.6, (-4, -2, -2)),
    (10.8, (1, 3, -4)),
    (12.3, (0, 1, -3)),
    (13.3, (9, -5, 7)),
    (16.6, (11, -6, 7)),
    (18.0, (0, -2, -2)),
    (20.0, (-1, -1, -2)),
]
SHEET = [10, 40, 72, 95, 140, 178, 210, 250, 330, 375, 420, 470]


if __name__ == "__main__":
    for seconds, speed, text in LINES:
        print(round(seconds * 1000), speed, text, sep="\t")
