from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import ConfigError, GridMap, plan
from cbagan_ompl.plotting import make_figure, save_figure


def legend(result_figure: object) -> set[str]:
    return {text.get_text() for text in result_figure.legends[0].get_texts()}  # type: ignore[attr-defined]


def test_everything_is_drawn(two_walls: GridMap) -> None:
    result = plan(
        two_walls,
        START,
        GOAL,
        "RRT",
        "corridor",
        time=5,
        range=20,
        radius=3,
        seed=0,
        keep_tree=True,
    )
    figure = make_figure(result, two_walls)
    assert legend(figure) == {
        "heat map (corridor)", "obstacle", "too near for the robot", "tree", "path", "start", "goal"
    }  # fmt: skip
    titles = " ".join(text.get_text() for text in figure.texts)
    assert f"{result.cost:.4g}" in titles
    assert "RRT" in titles


def test_no_path_no_line(two_walls: GridMap) -> None:
    result = plan(two_walls, START, GOAL, "RRT", "uniform", time=5, iterations=5, seed=0)
    figure = make_figure(result, two_walls)
    assert legend(figure) == {"obstacle", "start", "goal"}
    assert "no exact solution" in figure.texts[0].get_text()


@pytest.mark.parametrize("shape", [(40, 200), (200, 40)])
def test_any_aspect_and_frame(tmp_path: Path, shape: tuple[int, int]) -> None:
    grid = GridMap(np.ones(shape, bool), 0.1, (5.0, -3.0, 0.4))
    start, goal = grid.to_world([(5, 5), (shape[1] - 5, shape[0] - 5)])
    result = plan(grid, start, goal, "RRT", "straight-line", time=2, seed=0, keep_tree=True)
    save_figure(result, grid, tmp_path / "plan.png")
    image = cv2.imread(str(tmp_path / "plan.png"))
    ratio = image.shape[0] / image.shape[1]
    assert (ratio > 1) == (shape[0] > shape[1])


def test_bad_suffix(tmp_path: Path, two_walls: GridMap) -> None:
    result = plan(two_walls, START, GOAL, "RRT", "corridor", time=5, range=20, seed=0)
    with pytest.raises(ConfigError, match=r"'plan\.txt'.*\.png"):
        save_figure(result, two_walls, tmp_path / "plan.txt")


def ticks(figure: object, axis: str) -> list[str]:
    (axes,) = figure.axes  # type: ignore[attr-defined]
    return [label.get_text() for label in getattr(axes, f"get_{axis}ticklabels")()]


def test_axes_are_in_world_units(two_walls: GridMap) -> None:
    result = plan(two_walls, START, GOAL, "RRT", "uniform", time=5, iterations=5, seed=0)
    figure = make_figure(result, two_walls)
    assert ticks(figure, "x") == ticks(figure, "y") == ["0", "40", "80", "120", "160", "200", "240"]
    metres = GridMap(two_walls.free, 0.1, (-10.0, 2.0, 0.0))
    start, goal = metres.to_world([START, GOAL])
    figure = make_figure(plan(metres, start, goal, "RRT", "uniform", time=0.1, seed=0), metres)
    assert ticks(figure, "x")[0] == "-8" or ticks(figure, "x")[0] == "-10"
    assert figure.axes[0].get_xlabel() == "x, m"


def test_maps_askew_have_a_scale_bar(two_walls: GridMap) -> None:
    askew = GridMap(two_walls.free, 0.1, (5.0, -3.0, 0.4))
    start, goal = askew.to_world([START, GOAL])
    figure = make_figure(plan(askew, start, goal, "RRT", "uniform", time=0.1, seed=0), askew)
    assert ticks(figure, "x") == []
    assert [text.get_text() for text in figure.axes[0].texts] == ["5 m"]


def test_unknown_space_is_no_obstacle_and_the_margin_is_cut_off() -> None:
    unknown = np.ones((200, 300), bool)
    unknown[80:120, 100:180] = False
    free = ~unknown
    free[95:100, 120:160] = False
    grid = GridMap(free, unknown=unknown)
    result = plan(grid, (105, 85), (175, 115), "RRT", "corridor", time=5, range=9, seed=0)
    figure = make_figure(result, grid)
    assert {"unknown", "obstacle"} < legend(figure)
    (left, right), (bottom, top) = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
    assert (left, right, bottom, top) == (97, 183, 123, 77)
    hidden = make_figure(result, grid, show_tree=False)
    assert "tree" not in legend(hidden)


@pytest.mark.parametrize(
    "name", ["a$b", "$x^$", r"\frac{1}", "two\nlines", "x" * 300, "b\udcff", "地图"]
)
@pytest.mark.parametrize("suffix", [".png", ".pdf", ".svg"])
@pytest.mark.filterwarnings("ignore:Glyph")
def test_names_are_drawn_as_they_are(name: str, suffix: str, tmp_path: Path) -> None:
    grid = GridMap(np.ones((20, 20), bool), name=name)
    result = plan(grid, (2, 2), (15, 15), "RRT", "uniform", time=1, seed=0)
    path = tmp_path / f"plan{suffix}"
    save_figure(result, grid, path)
    assert path.stat().st_size > 5000
    # As callers save figures of their own.
    make_figure(result, grid).draw_without_rendering()
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_figure_that_cannot_be_written_leaves_nothing(two_walls: GridMap, tmp_path: Path) -> None:
    result = plan(two_walls, START, GOAL, "RRT", "uniform", time=1, range=20, seed=0)
    (tmp_path / "plan.png").mkdir()
    with pytest.raises(ConfigError, match="cannot write"):
        save_figure(result, two_walls, tmp_path / "plan.png")
    assert [file.name for file in tmp_path.iterdir()] == ["plan.png"]
