"""Wavefronts over learned costs, against Dijkstra's algorithm of SciPy."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

torch = pytest.importorskip("torch")

from cbagan_ompl.networks.wavefront import Wavefront, spread, step_costs, with_gradients

H, W, BATCH, METRICS = 9, 7, 2, 3
# To the right, below, below to the right, below to the left, as `step_costs` has them.
OFFSETS = [(0, 1), (1, 0), (1, 1), (1, -1)]
FAR = 1e4


@pytest.fixture
def edges() -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    shape = (H, W, BATCH, 4 * METRICS)
    return torch.empty(shape).uniform_(-2, 3, generator=generator).exp()


@pytest.fixture
def source() -> torch.Tensor:
    """The first fronts: one begins at one place, the next at two, its last metric's nowhere."""
    marked = torch.zeros(2, H, W, BATCH, METRICS, dtype=torch.bool)
    marked[0, 2, 1, 0] = marked[0, 8, 6, 1] = marked[0, 0, 3, 1] = True
    marked[0, :, :, 1, 2] = False
    marked[1, 5, 5] = True
    return marked


def slow_distances(
    edges: torch.Tensor, source: torch.Tensor, front: int, batch: int, metric: int
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Distances (H, W) to the nearest source, and the place before each, (H W,)."""
    rows, columns, costs = [], [], []
    for row, column in np.ndindex(H, W):
        for kind, (down, right) in enumerate(OFFSETS):
            if 0 <= row + down < H and 0 <= column + right < W:
                rows.append(row * W + column)
                columns.append((row + down) * W + column + right)
                cost = edges[row, column, batch, kind * METRICS + metric].item()
                costs.append(cost * np.hypot(down, right))
    graph = coo_array((costs, (rows, columns)), shape=(H * W, H * W)).tocsr()
    starts = np.flatnonzero(source[front, :, :, batch, metric].numpy())
    if not len(starts):
        return np.full((H, W), FAR), np.full(H * W, -1)
    distance, before, _ = dijkstra(
        graph, directed=False, indices=starts, return_predecessors=True, min_only=True
    )
    return distance.reshape(H, W), before


def flat(edges: torch.Tensor, source: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """The form that :func:`spread` takes: tasks and metrics in one dimension."""
    apart = edges.view(H, W, BATCH, 4, METRICS).permute(3, 0, 1, 2, 4)
    return step_costs(apart.flatten(3)), source.flatten(3)


def test_fronts_arrive_as_dijkstra_says(edges: torch.Tensor, source: torch.Tensor) -> None:
    distance = spread(*flat(edges, source), steps=100).view(2, H, W, BATCH, METRICS)
    for front, batch, metric in np.ndindex(2, BATCH, METRICS):
        expected, _ = slow_distances(edges, source, front, batch, metric)
        np.testing.assert_allclose(distance[front, :, :, batch, metric], expected, rtol=1e-5)
    assert (distance[0, :, :, 1, 2] == FAR).all(), "a front that begins nowhere arrives nowhere"


def test_too_few_steps_leave_far_places_unreached() -> None:
    source = torch.zeros(1, 1, 50, 1, dtype=torch.bool)
    source[0, 0, 49] = True
    # Against the order in which a step of the front looks at neighbours, one place a step.
    distance = spread(step_costs(torch.ones(4, 1, 50, 1)), source, steps=8)[0, 0, :, 0]
    assert distance[41:].tolist() == [8, 7, 6, 5, 4, 3, 2, 1, 0]
    assert (distance[:41] == FAR).all()


def test_sums_of_costs_are_the_same_distances(edges: torch.Tensor, source: torch.Tensor) -> None:
    costs, begins = flat(edges, source)
    distance = spread(costs, begins, steps=100)
    torch.testing.assert_close(with_gradients(distance, costs, begins), distance)


@pytest.mark.parametrize("place", [(8, 6), (0, 0), (2, 1)])
def test_the_gradient_of_a_distance_is_its_cheapest_way(
    edges: torch.Tensor, source: torch.Tensor, place: tuple[int, int]
) -> None:
    edges.requires_grad_()
    costs, begins = flat(edges, source)
    distance = with_gradients(spread(costs, begins, steps=100), costs, begins)
    distance.view(2, H, W, BATCH, METRICS)[(0, *place, 0, 1)].backward()
    _, before = slow_distances(edges.detach(), source, 0, 0, 1)
    expected = torch.zeros_like(edges)
    here = place[0] * W + place[1]
    while before[here] >= 0:
        # The edge belongs to the end that is above, or on the left.
        first, second = sorted(divmod(n, W) for n in (here, int(before[here])))
        step = second[0] - first[0], second[1] - first[1]
        kind = OFFSETS.index(step)
        expected[(*first, 0, kind * METRICS + 1)] = np.hypot(*step)
        here = int(before[here])
    torch.testing.assert_close(edges.grad, expected)


def inputs() -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(0)
    ends = torch.zeros(BATCH, 2, H, W)
    ends[0, 0, 2, 1] = ends[1, 0, 0, 0] = ends[0, 1, 8, 6] = ends[1, 1, 5, 5] = 1
    blocked = torch.rand(BATCH, 1, H, W, generator=generator)
    return torch.randn(BATCH, 8, H, W, generator=generator), blocked, ends


def test_features_are_one_on_the_cheapest_way_and_less_elsewhere() -> None:
    torch.manual_seed(0)
    module, (features, blocked, ends) = Wavefront(8, METRICS).eval(), inputs()
    fronts = module(features, blocked, ends)
    assert fronts.shape == (BATCH, 2 * METRICS, H, W)
    assert fronts.min() >= 0
    torch.testing.assert_close(fronts.amax((2, 3)), torch.ones(BATCH, 2 * METRICS))
    sharp, wide = fronts.chunk(2, 1)
    assert (sharp <= wide).all()
    for place in ends.split(1, 1):
        at = fronts.masked_select(place.bool().expand_as(fronts))
        torch.testing.assert_close(at, torch.ones_like(at), rtol=0, atol=1e-4)


def test_training_has_the_same_features_with_gradients() -> None:
    torch.manual_seed(0)
    module, given = Wavefront(8, METRICS), inputs()
    trained, used = module.train()(*given), module.eval()(*given)
    torch.testing.assert_close(trained, used, rtol=0, atol=1e-4)
    assert not used.requires_grad
    (trained * torch.rand_like(trained)).sum().backward()
    for learned in (module.costs.weight, module.walls):
        assert learned.grad is not None
        assert learned.grad.isfinite().all()
        assert learned.grad.any()


@pytest.mark.parametrize("size", [(9, 7), (16, 12)])
def test_scripted_fronts_are_the_same(size: tuple[int, int]) -> None:
    torch.manual_seed(0)
    module = Wavefront(8, METRICS).eval()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        scripted = torch.jit.script(module)
    features, blocked = torch.randn(BATCH, 8, *size), torch.rand(BATCH, 1, *size)
    ends = torch.zeros(BATCH, 2, *size)
    ends[:, 0, 1, 2] = ends[:, 1, 7, 5] = 1
    for model in (module, scripted):
        model.eval()
    with torch.inference_mode():
        torch.testing.assert_close(
            scripted(features, blocked, ends), module(features, blocked, ends)
        )
    for model in (module, scripted):
        model.train()
    torch.testing.assert_close(scripted(features, blocked, ends), module(features, blocked, ends))
