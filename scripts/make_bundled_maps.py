"""Draw the bundled maps, cbagan_ompl/maps/bundled/*.png, and write their tasks.csv.

Run it from anywhere, ``python scripts/make_bundled_maps.py``; it always writes the same maps.
"""

from __future__ import annotations

import argparse
import csv
import io
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from cbagan_ompl.map_generators import MAP_GENERATORS

FOLDER = Path(__file__).resolve().parents[1] / "cbagan_ompl" / "maps" / "bundled"
SEED = 4
SIZES = {"warehouse": (320, 192)}

# Start and goal pixels, chosen by eye; the first of a map is the most instructive one.
TASKS = {
    # Out of the trap to what lies behind it; into it; past it; out of it, to the mouth's own side.
    "bug_trap": [
        (172, 125, 226, 122),
        (238, 185, 160, 165),
        (12, 125, 240, 55),
        (150, 90, 14, 236),
    ],
    "clutter": [(16, 12, 246, 246), (10, 138, 206, 22), (246, 152, 10, 216), (64, 246, 246, 60)],
    # Between cells in opposite corners, then between the middles of opposite borders.
    "maze": [(10, 10, 245, 245), (245, 10, 10, 245), (10, 118, 245, 136), (118, 10, 136, 245)],
    # The second is a few pixels through the wall, and a long way round.
    "narrow_passage": [
        (30, 62, 222, 112),
        (104, 20, 164, 24),
        (20, 240, 240, 30),
        (184, 240, 60, 130),
    ],
    "rooms": [(14, 14, 242, 242), (242, 14, 14, 242), (14, 118, 244, 160), (62, 216, 206, 62)],
    "walls_with_gaps": [
        (14, 20, 240, 240),
        (14, 240, 240, 14),
        (14, 150, 240, 60),
        (65, 20, 196, 246),
    ],
    # From the loading zone to the far corner; the rest begin or end between racks.
    "warehouse": [(14, 172, 306, 14), (14, 70, 270, 160), (100, 26, 280, 121), (204, 178, 70, 45)],
}


def draw(name: str) -> NDArray[np.bool_]:
    """Return a bundled map."""
    rng = np.random.default_rng([SEED, *name.encode("ascii")])
    return MAP_GENERATORS[name](rng, *SIZES.get(name, (256, 256)))


def tasks_csv() -> str:
    """Return the content of tasks.csv: the centres of the chosen pixels."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("map", "start_x", "start_y", "goal_x", "goal_y"))
    for name, tasks in sorted(TASKS.items()):
        writer.writerows((name, *(pixel + 0.5 for pixel in task)) for task in tasks)
    return text.getvalue()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.parse_args()
    FOLDER.mkdir(exist_ok=True)
    for name in TASKS:
        # One bit a pixel: the whole set is a few kilobytes.
        image = draw(name).astype(np.uint8) * 255
        cv2.imwrite(str(FOLDER / f"{name}.png"), image, [cv2.IMWRITE_PNG_BILEVEL, 1])
    (FOLDER / "tasks.csv").write_text(tasks_csv(), encoding="utf-8")
    print(f"{len(TASKS)} maps and their tasks written to {FOLDER}")


if __name__ == "__main__":
    main()
