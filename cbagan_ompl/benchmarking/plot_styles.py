"""How the plots of a benchmark look: colours, marks, axes, the arrangement of panels.

For colour-blind readers and for print in black and white every sampler has a colour of the palette
of :mod:`cbagan_ompl.common.figures`, a dash pattern, a marker and a hatch, the same in every plot.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from math import ceil, log10
from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from ..common.figures import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from .settings import BASELINE

_PANEL_WIDTH, _LEGEND_WIDTH, _LEGEND_HEIGHT = 3.2, 1.7, 0.45
_SMALL = 8  # font size of ticks and legends

# Numbers of columns, from the most wanted one; with one of them at most one cell is left over.
_COLUMNS = (3, 2)

# A logarithmic axis of more decades than this has no tick between two powers of ten.
_MOST_DECADES = 2.2


@dataclass(frozen=True)
class Style:
    """How a series is drawn.

    Attributes:
        color: of lines, marks and edges.
        dashes: lengths of dashes and gaps, in points; none for a solid line.
        marker: matplotlib's name of the mark.
        hatch: matplotlib's name of the pattern of a box.
    """

    color: str
    dashes: tuple[int, ...]
    marker: str
    hatch: str

    @property
    def line(self) -> dict[str, Any]:
        """What ``Axes.plot`` takes for a line with some marks on it."""
        dashes: Any = (0, self.dashes) if self.dashes else "-"
        # Marks at equal distances on the paper.
        marks = {"marker": self.marker, "markersize": 4.5, "markevery": (0.05, 0.25)}
        return {"color": self.color, "linestyle": dashes, "linewidth": 1.6, **marks}


#: The styles in the order in which they are given out; the first one is the baseline's.
STYLES = (
    Style(BLACK, (4, 2), "s", ""),
    Style(BLUE, (), "o", "////"),
    Style(GREEN, (5, 1, 1, 1), "^", "...."),
    Style(ORANGE, (1, 1), "D", "xxxx"),
    Style(PURPLE, (3, 1, 1, 1, 1, 1), "v", "||||"),
    Style(VERMILLION, (7, 2), "P", "----"),
    Style(SKY_BLUE, (2, 2), "X", "++++"),
)


def styles_of(samplers: Iterable[str]) -> dict[str, Style]:
    """Return a style for each sampler, the first one for the baseline.

    Example:
        >>> styles_of(["learned", "uniform"])["uniform"].marker
        's'
    """
    others = cycle(STYLES[1:])
    return {name: STYLES[0] if name == BASELINE else next(others) for name in samplers}


class Panels:
    """A figure of panels side by side, one for each title, with one legend.

    Attributes:
        figure: the figure.
        axes: the panels, in the order of the titles.

    Args:
        titles: of the panels.
        height: of a panel, inches.
    """

    def __init__(self, titles: Sequence[str], height: float) -> None:
        columns, rows = _arrange(len(titles))
        size = (_PANEL_WIDTH * columns + 0.6, height * rows + _LEGEND_HEIGHT)
        self.figure = Figure(figsize=size, layout="constrained")
        cells = self.figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        self.axes: list[Axes] = cells.ravel()[: len(titles)].tolist()
        self._left_over: list[Axes] = cells.ravel()[len(titles) :].tolist()
        self._first_column: list[Axes] = cells[:, 0].tolist()
        for axes, title in zip(self.axes, titles, strict=True):
            axes.set_title(title, fontsize=10)
            axes.set_axisbelow(True)
            axes.tick_params(labelsize=_SMALL, labelbottom=True)
        for cell in self._left_over:
            cell.set_axis_off()

    def label(self, *, x: str | None = None, y: str | None = None) -> None:
        """Label the x axis of each panel, and the y axis of the first one in each row."""
        for axes in self.axes if x else ():
            axes.set_xlabel(x or "", fontsize=9)
        for axes in self._first_column if y else ():
            axes.set_ylabel(y or "", fontsize=9)

    def use_logarithm(self, which: Literal["x", "y"]) -> None:
        """Make an axis of all panels logarithmic, with plain numbers; to be called after drawing.

        There a tick says 0.03, rather than a power of ten.
        """
        for axes in self.axes:
            axes.set(**{f"{which}scale": "log"})
        for axes in self.axes:
            axis = axes.xaxis if which == "x" else axes.yaxis
            low, high = axis.get_view_interval()
            few = log10(high / low) > _MOST_DECADES
            axis.set_major_locator(LogLocator(subs=(1,) if few else (1, 3)))
            axis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axis.set_minor_formatter(NullFormatter())
            axes.grid(axis=which, color="0.9", linewidth=0.6)

    def add_legend(self, handles: Sequence[Any]) -> None:
        """Put the legend into the cell that is left over, or below all panels."""
        shape: dict[str, Any] = {"handles": handles, "frameon": False, "fontsize": 9}
        if self._left_over:
            self._left_over[0].legend(loc="center", handlelength=3.5, **shape)
        else:
            columns = int(self.figure.get_figwidth() // _LEGEND_WIDTH)
            self.figure.legend(loc="outside lower center", ncols=columns, handlelength=3.5, **shape)

    def add_note(self, text: str) -> None:
        """Put a note where a legend would be."""
        if self._left_over:
            cell = self._left_over[0]
            center: dict[str, Any] = {"ha": "center", "va": "center", "in_layout": False}
            cell.text(0.5, 0.5, text, transform=cell.transAxes, fontsize=9, **center)
        else:
            self.figure.supxlabel(text, fontsize=9)


def _arrange(count: int) -> tuple[int, int]:
    """Return how many columns and rows of panels there are, with at most one cell left over."""
    if count <= _COLUMNS[0]:
        return count, 1
    columns = next(n for n in _COLUMNS if -count % n <= 1)
    return columns, ceil(count / columns)


def legend_handles(styles: Mapping[str, Style], dashed: bool = True) -> list[Line2D]:
    """Return the entries of a legend: a line with the mark of each sampler.

    Args:
        styles: style of each sampler.
        dashed: whether the lines have their dashes.
    """
    changes = {"markevery": None, **({} if dashed else {"linestyle": "-"})}
    return [Line2D([], [], label=name, **style.line | changes) for name, style in styles.items()]
