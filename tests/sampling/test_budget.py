from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap
from cbagan_ompl.sampling.budget import ADVANCE, EARNED_BY_NODE, LearnedBudget
from cbagan_ompl.sampling.roadmap import RoadmapMixture
from cbagan_ompl.sampling.sampler import HeatmapSampler


def test_the_bound_holds_in_any_order() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        budget = LearnedBudget(0.25)
        learned = uniform = nodes = 0
        weights = rng.dirichlet(np.ones(3))
        for what in rng.choice(3, 3000, p=weights):
            if what == 0:
                learned += budget.spend()
            elif what == 1:
                budget.earn_by_uniform()
                uniform += 1
            else:
                budget.earn_by_node()
                nodes += 1
            assert learned <= ADVANCE + 0.25 * uniform + EARNED_BY_NODE * nodes


def test_samples_of_a_sampler_with_a_budget(two_walls: GridMap, corridor: Heatmap) -> None:
    """Asked in vain, a sampler ends with one learned sample in five, until it is restarted."""
    sampler = HeatmapSampler(corridor, seed=0, budget=LearnedBudget())
    for _ in range(5000):
        sampler.next()
    counts = sampler.sample_counts
    assert counts["learned"] <= ADVANCE + 0.25 * counts["uniform"]
    assert counts["learned"] > 900
    sampler.restart()
    for _ in range(100):
        sampler.next()
    assert sampler.sample_counts["learned"] - counts["learned"] > 80


@pytest.mark.parametrize("distance", [5.0, 30.0])
def test_local_samples_are_bounded_too(corridor: Heatmap, distance: float) -> None:
    sampler = HeatmapSampler(corridor, seed=0, budget=LearnedBudget())
    for _ in range(3000):
        sampler.near(20.0, 20.0, distance)
    counts = sampler.sample_counts
    assert counts["learned"] <= ADVANCE + 0.25 * counts["uniform"]
    assert sum(counts.values()) == 3000


def test_samples_of_a_roadmap_do_not_crowd() -> None:
    """A heat map of one pixel gets a sample, then few: no crowd that others connect with."""
    grid = GridMap(np.ones((64, 64), bool))
    values = np.zeros(grid.shape, np.float32)
    values[30, 30] = 1
    heatmap, budget = Heatmap(values, grid), LearnedBudget()
    mixture = RoadmapMixture(heatmap, 10.0, budget)
    sampler = HeatmapSampler(heatmap, seed=0, mixture=mixture, budget=budget)
    for _ in range(1000):
        sampler.on_new_node(*sampler.next(), False)
    assert 1 <= sampler.sample_counts["learned"] < 15
    sampler.restart()
    assert not any(mixture.covered or [])
