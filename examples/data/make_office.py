"""Draw the map of the examples: an office of 12 m x 8 m at 5 cm a pixel.

    python examples/data/make_office.py

It writes office.pgm and office.yaml beside this file, as a ROS map saver would.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

HERE = Path(__file__).parent
RESOLUTION = 0.05  # metres per pixel
OCCUPIED, UNKNOWN, FREE = 0, 205, 254  # the gray levels of ROS map savers
WALL = 3  # pixels

# Walls and furniture as (column, row, width, height), doors as gaps cut out of them afterwards.
WALLS = [
    (0, 0, 240, WALL),
    (0, 157, 240, WALL),
    (0, 0, WALL, 160),
    (237, 0, WALL, 160),
    (0, 66, 240, WALL),
    (0, 96, 240, WALL),
    (75, 0, WALL, 66),
    (150, 0, WALL, 66),
    (110, 96, WALL, 64),
]
FURNITURE = [(20, 20, 30, 14), (95, 24, 34, 16), (175, 12, 14, 34), (40, 118, 36, 18)]
DOORS = [(30, 66, 20, WALL), (118, 66, 20, WALL), (196, 66, 20, WALL), (12, 96, 20, WALL)]
DOORS += [(208, 96, 20, WALL), (110, 132, WALL, 20)]
UNSEEN = (150, 115, 40, 30)


def main() -> None:
    image = np.full((160, 240), FREE, np.uint8)
    fill(image, UNSEEN, UNKNOWN)
    for box in WALLS + FURNITURE:
        fill(image, box, OCCUPIED)
    for box in DOORS:
        fill(image, box, FREE)
    cv2.imwrite(str(HERE / "office.pgm"), image)
    (HERE / "office.yaml").write_text(
        f"image: office.pgm\nmode: trinary\nresolution: {RESOLUTION}\norigin: [-2.0, -1.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )


def fill(image: np.ndarray, box: tuple[int, int, int, int], level: int) -> None:
    column, row, width, height = box
    image[row : row + height, column : column + width] = level


if __name__ == "__main__":
    main()
