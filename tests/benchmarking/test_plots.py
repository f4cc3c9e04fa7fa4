from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import pytest
from helpers.benchmarks import Finished
from helpers.logs import make_log, solved, unsolved

from cbagan_ompl.benchmarking import plots
from cbagan_ompl.benchmarking.logs import ExperimentLog
from cbagan_ompl.benchmarking.plot_styles import STYLES, Panels, styles_of
from cbagan_ompl.benchmarking.statistics import results_of
from cbagan_ompl.planning.ompl_benchmark import RunRecord

IMPROVING = [solved((0.1, 150.0), (0.3, 104.0), (0.4, 100.0))] * 3
FIRST_ONLY = [solved((0.1, 150.0))] * 3
# One run in three has a path.
MOSTLY_UNSOLVED = [solved((0.1, 150.0), (0.2, 140.0)), unsolved(), unsolved()]


def logs_of(**planners: list[RunRecord]) -> list[ExperimentLog]:
    records = {
        f"{planner}_{sampler}": runs
        for planner, runs in planners.items()
        for sampler in ("uniform", "learned")
    }
    return [make_log(name, records, optimal_cost=100.0) for name in ("a", "b")]


def titles(figure: plots.Figure) -> list[str]:
    return [axes.get_title() for axes in figure.axes if axes.axison]


def test_plots_are_drawn(finished: Finished) -> None:
    for name in ("success", "cost", "first_solution", "nodes", "ratio_first_solution"):
        image = cv2.imread(str(finished.folder / f"{name}.png"))
        assert image.std() > 10
        assert (finished.folder / f"{name}.pdf").stat().st_size > 5000


def test_planners_that_stop_at_their_first_path_have_no_curve_of_costs(tmp_path: Path) -> None:
    logs = logs_of(RRT=FIRST_ONLY, RRTstar=IMPROVING)
    runs = plots._collect_runs(logs)
    assert [name for name, some in runs.items() if plots._any_improves(some)] == ["RRTstar"]
    plots.save_plots(logs, results_of(logs), 5, tmp_path)
    assert (tmp_path / "cost.png").is_file()
    first_only = logs_of(RRT=FIRST_ONLY)
    plots.save_plots(first_only, results_of(first_only), 5, tmp_path)
    names = {path.name for path in tmp_path.glob("*.png")}
    # Without anything to show a plot goes, that of an earlier report too.
    assert names == {"success.png", "first_solution.png", "nodes.png", "ratio_first_solution.png"}


def test_costs_begin_where_half_of_the_runs_have_a_path() -> None:
    runs = plots._collect_runs(logs_of(RRTstar=MOSTLY_UNSOLVED))
    (axes,) = plots._cost_figure(runs, 5).axes
    assert len(axes.lines) == 1  # the threshold alone
    runs = plots._collect_runs(logs_of(RRTstar=[*MOSTLY_UNSOLVED, *IMPROVING]))
    (axes,) = plots._cost_figure(runs, 5).axes
    curves = axes.lines[:2]
    assert [line.get_xdata()[0] for line in curves] == pytest.approx([0.1, 0.1])
    assert len(axes.collections) == 2
    # The run within 0.1 % of the best known cost lies on the lower end of the axis.
    assert min(curves[0].get_ydata()) == pytest.approx(0.1)


def test_ratios_of_planners_that_never_get_there_are_left_out() -> None:
    results = results_of(logs_of(RRT=FIRST_ONLY, RRTstar=IMPROVING))
    figure = plots._ratio_figure(results, "within_5_percent_total_s", "x")
    assert figure is not None
    assert titles(figure) == ["RRTstar"]
    assert plots._ratio_figure(results, "within_2_percent_total_s", "x") is not None
    never = results_of(logs_of(RRT=FIRST_ONLY))
    assert plots._ratio_figure(never, "within_5_percent_total_s", "x") is None


def test_without_the_baseline_there_are_no_ratios() -> None:
    results = results_of([make_log("m", {"RRT_learned": FIRST_ONLY, "RRT_corridor": FIRST_ONLY})])
    assert plots._ratio_figure(results, "first_solution_total_s", "x") is None


@pytest.mark.parametrize(
    ("count", "shape"),
    [(1, (1, 1)), (2, (2, 1)), (3, (3, 1)), (4, (2, 2)), (5, (3, 2)), (7, (2, 4))],
)
def test_at_most_the_cell_of_the_legend_has_no_panel(count: int, shape: tuple[int, int]) -> None:
    panels = Panels([f"planner {i}" for i in range(count)], 2.0)
    columns, rows = shape
    assert len(panels.figure.axes) == columns * rows
    assert columns * rows - count <= 1
    assert len(titles(panels.figure)) == len(panels.axes) == count
    panels.add_note("note")
    texts = [text for axes in panels.figure.axes for text in axes.texts]
    assert len(texts) == columns * rows - count


def test_every_sampler_keeps_its_style() -> None:
    styles = styles_of(["learned", "uniform", "corridor"])
    assert styles["uniform"] == STYLES[0]
    assert [styles["learned"], styles["corridor"]] == list(STYLES[1:3])
    for parts in zip(*((s.color, s.dashes, s.marker, s.hatch) for s in STYLES), strict=True):
        assert len(set(parts)) == len(STYLES)


def test_many_kinds_of_maps_fit_on_the_figure_of_ratios(tmp_path: Path) -> None:
    records = {"RRT_uniform": FIRST_ONLY, "RRT_learned": FIRST_ONLY}
    logs = [make_log(f"map {i} $", records, optimal_cost=100.0) for i in range(1200)]
    logs = [
        replace(log, parameters={**log.parameters, "map family VARCHAR": log.name}) for log in logs
    ]
    results = results_of(logs[:3])
    assert len(results.families) == 3
    families = dict.fromkeys((log.name for log in logs), results.families["map 0 $"])
    figure = plots._ratio_figure(replace(results, families=families), "first_solution_total_s", "x")
    assert figure is not None
    assert "1140 kinds of map left out" in figure.get_suptitle()
    plots.write_figure(figure, tmp_path / "ratios.png", 200)
