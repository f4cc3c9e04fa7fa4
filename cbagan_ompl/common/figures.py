"""What all figures of the project share: colours, the marks of start and goal, saving."""

from __future__ import annotations

import warnings
from io import BytesIO
from os import PathLike
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from ..errors import ConfigError
from .files import write_atomically
from .outputs import MADE_BY

# Okabe and Ito's palette, which colour-blind readers can tell apart
# (https://jfly.uni-koeln.de/color/).
BLACK, ORANGE, SKY_BLUE, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"

#: Obstacles, and space of which nothing is known.
OBSTACLE, UNKNOWN = "#4d4d4d", "#c3cfdb"

#: Marker, colour and size of the two endpoints of a task, the same in every figure.
START_MARK, GOAL_MARK = ("o", GREEN, 10.0), ("*", VERMILLION, 15.0)


def mark_endpoints(axes: Axes, start: Any, goal: Any, scale: float = 1.0) -> list[Line2D]:
    """Draw start and goal.

    Args:
        axes: where to draw.
        start: (x, y) in the coordinates of the axes.
        goal: the same.
        scale: factor on the size of the marks.

    Returns:
        What a legend needs.
    """
    handles = []
    for point, (marker, color, size), label in (
        (start, START_MARK, "start"),
        (goal, GOAL_MARK, "goal"),
    ):
        handles += axes.plot(
            *point,
            marker=marker,
            color=color,
            markersize=scale * size,
            markeredgecolor="white",
            linestyle="none",
            label=label,
            zorder=5,
            clip_on=False,
        )
    return handles


def check_figure_path(path: str | PathLike[str]) -> None:
    """Raise if a figure cannot be saved for its suffix, before any work is done for it.

    Raises:
        ConfigError: the suffix stands for no format that can be written.
    """
    formats = set(FigureCanvasAgg.get_supported_filetypes()) - {"pgf"}  # which needs TeX
    if Path(path).suffix.lstrip(".").lower() not in formats:
        raise ConfigError(
            f"cannot save a figure as {Path(path).name!r}; its suffix must be one of "
            f"{', '.join('.' + name for name in sorted(formats))}"
        )


def write_figure(figure: Figure, path: str | PathLike[str], dots_per_inch: int = 150) -> None:
    """Save a figure, whole or not at all; the suffix chooses the format.

    Args:
        figure: the figure.
        path: of the file; its suffix is one that :func:`check_figure_path` lets pass.
        dots_per_inch: of images.

    Raises:
        ConfigError: the file cannot be written.
    """
    ignore_markup(figure)
    buffer = BytesIO()
    kind = Path(path).suffix.lstrip(".").lower()
    with warnings.catch_warnings():
        # Scripts that the font does not have are drawn as boxes; crowded panels stay crowded.
        warnings.filterwarnings("ignore", "Glyph .* missing", UserWarning)
        warnings.filterwarnings("ignore", "constrained_layout not applied", UserWarning)
        figure.savefig(buffer, format=kind, dpi=dots_per_inch, **_signature_of(path))
    write_atomically(path, buffer.getvalue())


def ignore_markup(figure: Figure) -> None:
    """Draw all texts of a figure as they are: ``$`` in a name is no formula."""
    for text in figure.findobj(Text):
        text.set_parse_math(False)


def _signature_of(path: str | PathLike[str]) -> dict[str, Any]:
    """Return the options of ``savefig`` that make a file say what wrote it."""
    suffix = Path(path).suffix.lower()
    if suffix == ".png":
        return {"metadata": {"Software": MADE_BY}}
    if suffix in (".pdf", ".svg", ".svgz", ".ps", ".eps"):
        return {"metadata": {"Creator": MADE_BY}}
    if suffix in (".jpg", ".jpeg"):
        return {"pil_kwargs": {"comment": MADE_BY.encode()}}
    return {}
