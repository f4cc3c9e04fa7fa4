"""How far samples follow the heat map, on their own and inside planners."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from helpers.monitors import FakeMonitor
from helpers.tasks import GOAL, START

from cbagan_ompl import ConfigError, GridMap, Heatmap, plan
from cbagan_ompl.sampling.adaptation import AdaptiveMixture
from cbagan_ompl.sampling.options import FULL_ADAPTATION, NO_ADAPTATION, Adaptation
from cbagan_ompl.sampling.sampler import HeatmapSampler
from cbagan_ompl.sampling.tree_coverage import TreeCoverage


def make_mixture(
    heatmap: Heatmap, adaptation: Adaptation = FULL_ADAPTATION, nodes: int = 10**9
) -> tuple[AdaptiveMixture, list[float]]:
    """A mixture, and the fractions that it sets, the latest one last."""
    monitor = FakeMonitor(nodes=nodes)
    return AdaptiveMixture(heatmap, adaptation, 16.0, monitor), monitor.fractions


def adapted(heatmap: Heatmap, mixture: AdaptiveMixture) -> HeatmapSampler:
    return HeatmapSampler(heatmap, seed=0, mixture=mixture)


def learned(sampler: HeatmapSampler) -> int:
    return sampler.sample_counts["learned"]


def test_a_node_covers_no_more_than_its_clearance(two_walls: GridMap) -> None:
    tree = TreeCoverage(two_walls, reach=16.0)

    def covers(x: float, y: float) -> bool:
        return tree.mask[int(y) * 256 + int(x)] == 1

    assert tree.add(100.0, 53.0) == 53 * 256 + 100
    assert covers(105.0, 50.0)
    assert not covers(100.0, 75.0), "the other side of the wall"
    assert not covers(100.0, 30.0)
    assert tree.add(101.0, 54.0) is None, "no new ground"
    assert tree.add(200.5, 110.5) is not None
    assert covers(184.5, 126.5)
    assert not covers(180.0, 110.0), "farther than the reach"
    assert tree.add(-3.0, 500.0) is None
    assert tree.add(30.0, 200.0, covers=False) is None
    assert not covers(30.0, 200.0)
    assert tree.node_count == 5
    tree.clear()
    assert not covers(100.0, 53.0)


def test_before_the_first_path_samples_go_where_the_tree_is_not(corridor: Heatmap) -> None:
    mixture, _ = make_mixture(corridor, Adaptation.of(["coverage"]))
    sampler = adapted(corridor, mixture)
    for x in range(5, 256, 5):
        for y in range(5, 60, 5):
            mixture.on_new_node(float(x), float(y), in_goal=False)
    before = learned(sampler)
    points = np.array([sampler.next() for _ in range(2000)])
    assert learned(sampler) - before > 1500
    assert (points[:, 1] < 52).mean() < 0.1, "uniform samples alone"


def test_a_region_full_of_tree_leaves_uniform_samples(corridor: Heatmap) -> None:
    mixture, _ = make_mixture(corridor, Adaptation.of(["coverage"]))
    sampler = adapted(corridor, mixture)
    for x in np.arange(2.0, 256, 2):
        for y in np.arange(2.0, 256, 2):
            mixture.on_new_node(x, y, in_goal=False)
    for _ in range(500):
        sampler.next()
    assert learned(sampler) < 20


def test_after_a_path_samples_follow_the_whole_region(corridor: Heatmap) -> None:
    mixture, _ = make_mixture(corridor)
    monitor = FakeMonitor(best_cost=lambda: 700.0)
    sampler = HeatmapSampler(corridor, monitor=monitor, mixture=mixture, seed=0)
    for x in np.arange(2.0, 256, 2):
        for y in np.arange(2.0, 256, 2):
            mixture.on_new_node(x, y, in_goal=False)
    for _ in range(1000):
        sampler.next()
    assert 0.87 < learned(sampler) / 1000 < 0.93


def test_samples_in_vain_cost_the_heat_map_its_fraction(corridor: Heatmap) -> None:
    mixture, fractions = make_mixture(corridor, Adaptation.of(["stagnation"]))
    for _ in range(127):
        mixture.on_sample()
    assert fractions == [1.0]
    mixture.on_sample()
    assert fractions[-1] == 0.5
    for _ in range(1000):
        mixture.on_sample()
    assert fractions[-1] == 0.25
    row, column = np.argwhere(corridor.region)[0]
    mixture.on_new_node(column + 0.5, row + 0.5, in_goal=False)
    assert fractions[-1] == 1.0, "new ground in the region restores it"
    for _ in range(1000):
        mixture.on_sample()
    row, column = np.argwhere(corridor.grid.free & (corridor.values == 0))[0]
    mixture.on_new_node(column + 0.5, row + 0.5, in_goal=False)
    assert fractions[-1] == 0.25, "new ground elsewhere does not"
    mixture.on_solution()
    assert fractions[-1] == 1.0, "there is a path"


def test_a_region_that_connects_nothing_is_sampled_less(corridor: Heatmap) -> None:
    for adaptation, connected, fraction in (
        (FULL_ADAPTATION, False, 0.15),
        (FULL_ADAPTATION, True, 1.0),
        (NO_ADAPTATION, False, 1.0),
    ):
        mixture, fractions = make_mixture(corridor, adaptation)
        mixture.on_start(connected)
        assert fractions[-1] == fraction
        if not connected:
            for _ in range(1000):
                mixture.on_sample()
            assert fractions[-1] == fraction, "nothing was watched that could change it"


def test_a_node_that_is_turned_elsewhere_does_not_count_as_new_ground(corridor: Heatmap) -> None:
    mixture, fractions = make_mixture(corridor)
    for _ in range(1000):
        mixture.on_sample()
    row, column = np.argwhere(corridor.region)[0]
    mixture.on_new_node(column + 0.5, row + 0.5, in_goal=False, covers=False)
    assert fractions[-1] == 0.25
    assert not any(mixture.covered)
    mixture.on_new_node(column + 0.5, row + 0.5, in_goal=False)
    assert fractions[-1] == 1.0
    assert any(mixture.covered)


def test_a_cleared_tree_is_noticed(corridor: Heatmap) -> None:
    mixture, _ = make_mixture(corridor, nodes=0)
    mixture.on_new_node(20.0, 20.0, in_goal=False)
    assert any(mixture.covered)
    mixture.on_exhausted()
    mixture.on_exhausted()
    assert not any(mixture.covered)
    again, _ = make_mixture(corridor)
    again.on_new_node(20.0, 20.0, in_goal=True)
    again.on_new_node(
        100.0, 100.0, in_goal=False
    )  # a planner that stops at its first path starts anew
    assert not again.covered[20 * 256 + 20]
    assert again.covered[100 * 256 + 100]


def test_unknown_rules_raise() -> None:
    with pytest.raises(ConfigError, match=r"'hope'.*connectivity, coverage, stagnation"):
        Adaptation.of(["connectivity", "hope"])


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


def tunnel() -> Heatmap:
    """A region that leads through a winding tunnel one pixel wide, beside a wide gap."""
    free = np.ones((256, 256), bool)
    free[:, 98:158] = False
    free[200:240, 98:158] = True
    region = np.zeros(free.shape, bool)
    region[60, 20:98] = region[60:81, 157] = region[60, 157:231] = True
    for turn, column in enumerate(range(98, 158, 4)):
        region[60:81, column] = True
        region[60 if turn % 2 else 80, column : min(column + 5, 158)] = True
    return Heatmap(region.astype(np.float32), GridMap(free | region))


def test_a_tunnel_that_leads_to_the_goal_costs_little() -> None:
    heatmap = tunnel()
    start, goal = (20.5, 60.5), (230.5, 60.5)
    assert heatmap.connects(start, goal)

    def iterations(**options: object) -> float:
        runs = [
            plan(heatmap.grid, start, goal, "RRT", range=20, time=20, seed=seed, **options)
            for seed in range(25)
        ]
        assert all(run.solved for run in runs)
        return float(np.median([run.iterations for run in runs]))

    assert iterations(heatmap=heatmap) < 1.5 * iterations(sampler="uniform")


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
def test_the_simplifier_gets_the_true_goal_where_few_samples_are_ours(planner: str) -> None:
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


def test_points_outside_are_not_connected(corridor: Heatmap) -> None:
    assert corridor.connects(START, GOAL)
    assert not corridor.connects(START, (256.0, 5.0))
    assert not corridor.connects(START, (-3.0, 5.0))
