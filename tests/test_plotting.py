from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import ConfigError, GridMap, plan
from cbagan_ompl.plotting import draw_plan, save_figure


def legend(result_figure: object) -> set[str]:
    return {text.get_text() for text in result_figure.legends[0].get_texts()}  # type: ignore[attr-defined]


def test_everything_is_drawn(two_walls: GridMap) -> None:
    result = plan(
        two_walls, START, GOAL, "RRT", "corridor", 5, range=20, radius=3, seed=0, keep_tree=True
    )
    figure = draw_plan(result, two_walls)
    assert legend(figure) == {
        "heat map (corridor)", "obstacle", "inflated by the radius", "tree", "path", "start", "goal"
    }  # fmt: skip
    titles = " ".join(text.get_text() for text in figure.texts)
    assert f"{result.cost:.4g}" in titles
    assert "RRT" in titles


def test_no_path_no_line(two_walls: GridMap) -> None:
    result = plan(two_walls, START, GOAL, "RRT", "uniform", 5, iterations=5, seed=0)
    figure = draw_plan(result, two_walls)
    assert legend(figure) == {"obstacle", "start", "goal"}
    assert "no exact solution" in figure.texts[0].get_text()


@pytest.mark.parametrize("shape", [(40, 200), (200, 40)])
def test_any_aspect_and_frame(tmp_path: Path, shape: tuple[int, int]) -> None:
    grid = GridMap(np.ones(shape, bool), 0.1, (5.0, -3.0, 0.4))
    start, goal = grid.to_world([(5, 5), (shape[1] - 5, shape[0] - 5)])
    result = plan(grid, start, goal, "RRT", "straight-line", 2, seed=0, keep_tree=True)
    save_figure(result, grid, tmp_path / "plan.png")
    image = cv2.imread(str(tmp_path / "plan.png"))
    ratio = image.shape[0] / image.shape[1]
    assert (ratio > 1) == (shape[0] > shape[1])


def test_bad_suffix(tmp_path: Path, two_walls: GridMap) -> None:
    result = plan(two_walls, START, GOAL, "RRT", "corridor", 5, range=20, seed=0)
    with pytest.raises(ConfigError, match=r"'plan\.txt'.*\.png"):
        save_figure(result, two_walls, tmp_path / "plan.txt")
