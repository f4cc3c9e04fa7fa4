"""How far draws follow the heat map, on their own and inside planners."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import ConfigError, GridMap, Heatmap, plan
from cbagan_ompl.sampling.adaptation import FULL_ADAPTATION, NO_ADAPTATION, Adaptation, Tree, Trust
from cbagan_ompl.sampling.sampler import HeatmapSampler


def make_trust(
    heatmap: Heatmap, adaptation: Adaptation = FULL_ADAPTATION, nodes: int = 10**9
) -> tuple[Trust, list[float]]:
    """A trust, and the shares that it sets, the latest one last."""
    shares = [1.0]
    trust = Trust(heatmap, adaptation, 16.0, lambda: nodes, shares.append)
    return trust, shares


def adapted(heatmap: Heatmap, trust: Trust) -> HeatmapSampler:
    stream = HeatmapSampler(heatmap, 0.1, seed=0)
    stream.adapt(trust)
    return stream


def test_a_node_covers_no_more_than_its_clearance(two_walls: GridMap) -> None:
    tree = Tree(two_walls, reach=16.0)

    def covers(x: float, y: float) -> bool:
        return tree.cells[int(y) * 256 + int(x)] == 1

    assert tree.add(100.0, 53.0) == 53 * 256 + 100
    assert covers(105.0, 50.0)
    assert not covers(100.0, 75.0), "the other side of the wall"
    assert not covers(100.0, 30.0)
    assert tree.add(101.0, 54.0) is None, "no new ground"
    assert tree.add(200.5, 110.5) is not None
    assert covers(184.5, 126.5)
    assert not covers(180.0, 110.0), "farther than the reach"
    assert tree.add(-3.0, 500.0) is None
    assert tree.nodes == 4
    tree.clear()
    assert not covers(100.0, 53.0)


def test_before_the_first_path_draws_go_where_the_tree_is_not(corridor: Heatmap) -> None:
    trust, _ = make_trust(corridor, Adaptation.of(["coverage"]))
    stream = adapted(corridor, trust)
    for x in range(5, 256, 5):
        for y in range(5, 60, 5):
            trust.grown(float(x), float(y), arrived=False)
    before = stream.learned
    points = np.array([stream.next() for _ in range(2000)])
    learned = stream.learned - before
    assert learned > 1500
    assert (points[:, 1] < 52).mean() < 0.1, "uniform draws alone"


def test_a_region_full_of_tree_leaves_uniform_draws(corridor: Heatmap) -> None:
    trust, _ = make_trust(corridor, Adaptation.of(["coverage"]))
    stream = adapted(corridor, trust)
    for x in np.arange(2.0, 256, 2):
        for y in np.arange(2.0, 256, 2):
            trust.grown(x, y, arrived=False)
    for _ in range(500):
        stream.next()
    assert stream.learned < 20


def test_after_a_path_draws_follow_the_whole_region(corridor: Heatmap) -> None:
    trust, _ = make_trust(corridor)
    stream = adapted(corridor, trust)
    for x in np.arange(2.0, 256, 2):
        for y in np.arange(2.0, 256, 2):
            trust.grown(x, y, arrived=False)
    stream.follow(lambda: 700.0, lambda: None)
    for _ in range(1000):
        stream.next()
    assert 0.87 < stream.learned / 1000 < 0.93


def test_draws_in_vain_cost_the_heat_map_its_share(corridor: Heatmap) -> None:
    trust, shares = make_trust(corridor, Adaptation.of(["patience"]))
    for _ in range(127):
        trust.drawn()
    assert shares == [1.0]
    trust.drawn()
    assert shares[-1] == 0.5
    for _ in range(1000):
        trust.drawn()
    assert shares[-1] == 0.25
    row, column = np.argwhere(corridor.region)[0]
    trust.grown(column + 0.5, row + 0.5, arrived=False)
    assert shares[-1] == 1.0, "new ground in the region restores it"
    for _ in range(1000):
        trust.drawn()
    row, column = np.argwhere(corridor.grid.free & (corridor.values == 0))[0]
    trust.grown(column + 0.5, row + 0.5, arrived=False)
    assert shares[-1] == 0.25, "new ground elsewhere does not"
    trust.improved()
    assert shares[-1] == 1.0, "there is a path"


def test_a_region_that_joins_nothing_is_doubted(corridor: Heatmap) -> None:
    for adaptation, joined, share in (
        (FULL_ADAPTATION, False, 0.15),
        (FULL_ADAPTATION, True, 1.0),
        (NO_ADAPTATION, False, 1.0),
    ):
        trust, shares = make_trust(corridor, adaptation)
        trust.begin(joined)
        assert shares[-1] == share
        if not joined:
            for _ in range(1000):
                trust.drawn()
            assert shares[-1] == share, "nothing was followed that could change it"


def test_a_cleared_tree_is_noticed(corridor: Heatmap) -> None:
    trust, _ = make_trust(corridor, nodes=0)
    trust.grown(20.0, 20.0, arrived=False)
    assert any(trust.spent)
    trust.blocked()
    trust.blocked()
    assert not any(trust.spent)
    again, _ = make_trust(corridor)
    again.grown(20.0, 20.0, arrived=True)
    again.grown(100.0, 100.0, arrived=False)  # a planner that stops at its first path starts anew
    assert not again.spent[20 * 256 + 20]
    assert again.spent[100 * 256 + 100]


def test_unknown_parts_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"'hope'.*doubt, coverage, patience"):
        Adaptation.of(["doubt", "hope"])


def wrong_heatmaps(grid: GridMap, right: Heatmap) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    pixel = np.zeros(grid.shape, np.float32)
    pixel[200, 20] = 1
    return {
        "inverted": np.where(grid.free, 1 - right.values, 0),
        "shifted": np.roll(right.values, (64, 64), (0, 1)),
        "noise": rng.random(grid.shape, np.float32),
        "one pixel": pixel,
    }


@pytest.mark.parametrize("kind", ["inverted", "shifted", "noise", "one pixel"])
def test_wrong_heat_maps_cost_little(two_walls: GridMap, corridor: Heatmap, kind: str) -> None:
    """Iterations of RRT to its first path: at most half as many again as OMPL's own sampler."""

    def iterations(**options: object) -> float:
        runs = [
            plan(two_walls, START, GOAL, "RRT", range=20, time=20, seed=seed, **options)
            for seed in range(25)
        ]
        assert all(run.solved for run in runs)
        return float(np.median([run.iterations for run in runs]))

    wrong = Heatmap(wrong_heatmaps(two_walls, corridor)[kind], two_walls)
    plain = iterations(sampler="uniform")
    assert iterations(heatmap=wrong) < 1.5 * plain
    if kind == "one pixel":
        assert iterations(heatmap=wrong, adaptation=NO_ADAPTATION) > 2 * plain


def test_coverage_saves_nodes(two_walls: GridMap, corridor: Heatmap) -> None:
    def nodes(adaptation: Adaptation) -> float:
        runs = [
            plan(
                two_walls, START, GOAL, "RRT", heatmap=corridor, range=20, time=20, seed=seed,
                adaptation=adaptation,
            )
            for seed in range(25)
        ]  # fmt: skip
        assert all(run.solved and run.cost < inf for run in runs)
        return float(np.median([run.nodes for run in runs]))

    assert nodes(FULL_ADAPTATION) < 0.75 * nodes(NO_ADAPTATION)


@pytest.mark.parametrize("planner", ["RRTstar", "InformedRRTstar"])
def test_the_simplifier_gets_the_true_goal_where_few_draws_are_ours(planner: str) -> None:
    free = np.ones((64, 64), bool)
    free[20:44, 32] = False
    grid = GridMap(free)
    values = np.where(np.arange(64) < 45, 0.3, 0.4) * free
    for seed in range(12):
        result = plan(
            grid, (4, 32), (60, 32), planner, heatmap=Heatmap(values, grid), iterations=300,
            time=20, range=8, simplify=True, seed=seed,
        )  # fmt: skip
        assert result.solved, seed


def test_points_outside_are_not_joined(corridor: Heatmap) -> None:
    assert corridor.connects(START, GOAL)
    assert not corridor.connects(START, (256.0, 5.0))
    assert not corridor.connects(START, (-3.0, 5.0))
