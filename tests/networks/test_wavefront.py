"""Distance fields over learned costs, against Dijkstra's algorithm of SciPy."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

torch = pytest.importorskip("torch")

from cbagan_ompl.networks.wavefront import (
    Wavefront,
    differentiable_distances,
    distance_fields,
    step_costs,
)

H, W, BATCH, COST_MAPS = 9, 7, 2, 3
# To the right, below, below to the right, below to the left, as `step_costs` has them.
OFFSETS = [(0, 1), (1, 0), (1, 1), (1, -1)]
FAR = 1e4


@pytest.fixture
def edges() -> torch.Tensor:
    generator = torch.Generator().manual_seed(0)
    shape = (H, W, BATCH, 4 * COST_MAPS)
    return torch.empty(shape).uniform_(-2, 3, generator=generator).exp()


@pytest.fixture
def source() -> torch.Tensor:
    """One field begins in one cell, the next in two, that of its last cost map nowhere."""
    marked = torch.zeros(2, H, W, BATCH, COST_MAPS, dtype=torch.bool)
    marked[0, 2, 1, 0] = marked[0, 8, 6, 1] = marked[0, 0, 3, 1] = True
    marked[0, :, :, 1, 2] = False
    marked[1, 5, 5] = True
    return marked


def slow_distances(
    edges: torch.Tensor, source: torch.Tensor, field: int, batch: int, cost_map: int
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Distances (H, W) to the nearest source, and the predecessor of each cell, (H W,)."""
    rows, columns, costs = [], [], []
    for row, column in np.ndindex(H, W):
        for kind, (down, right) in enumerate(OFFSETS):
            if 0 <= row + down < H and 0 <= column + right < W:
                rows.append(row * W + column)
                columns.append((row + down) * W + column + right)
                cost = edges[row, column, batch, kind * COST_MAPS + cost_map].item()
                costs.append(cost * np.hypot(down, right))
    graph = coo_array((costs, (rows, columns)), shape=(H * W, H * W)).tocsr()
    starts = np.flatnonzero(source[field, :, :, batch, cost_map].numpy())
    if not len(starts):
        return np.full((H, W), FAR), np.full(H * W, -1)
    distance, predecessor, _ = dijkstra(
        graph, directed=False, indices=starts, return_predecessors=True, min_only=True
    )
    return distance.reshape(H, W), predecessor


def flat(edges: torch.Tensor, source: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """The form that :func:`distance_fields` takes: tasks and cost maps in one dimension."""
    apart = edges.view(H, W, BATCH, 4, COST_MAPS).permute(3, 0, 1, 2, 4)
    return step_costs(apart.flatten(3)), source.flatten(3)


def test_distance_fields_are_dijkstras(edges: torch.Tensor, source: torch.Tensor) -> None:
    distance = distance_fields(*flat(edges, source), steps=100).view(2, H, W, BATCH, COST_MAPS)
    for field, batch, cost_map in np.ndindex(2, BATCH, COST_MAPS):
        expected, _ = slow_distances(edges, source, field, batch, cost_map)
        np.testing.assert_allclose(distance[field, :, :, batch, cost_map], expected, rtol=1e-5)
    assert (distance[0, :, :, 1, 2] == FAR).all(), "a field without source reaches no cell"


def test_too_few_steps_leave_far_cells_unreached() -> None:
    source = torch.zeros(1, 1, 50, 1, dtype=torch.bool)
    source[0, 0, 49] = True
    # Against the order in which a step visits neighbours, one cell a step.
    distance = distance_fields(step_costs(torch.ones(4, 1, 50, 1)), source, steps=8)[0, 0, :, 0]
    assert distance[41:].tolist() == [8, 7, 6, 5, 4, 3, 2, 1, 0]
    assert (distance[:41] == FAR).all()


def test_sums_of_costs_are_the_same_distances(edges: torch.Tensor, source: torch.Tensor) -> None:
    costs, begins = flat(edges, source)
    distance = distance_fields(costs, begins, steps=100)
    torch.testing.assert_close(differentiable_distances(distance, costs, begins), distance)


@pytest.mark.parametrize("cell", [(8, 6), (0, 0), (2, 1)])
def test_the_gradient_of_a_distance_is_its_cheapest_path(
    edges: torch.Tensor, source: torch.Tensor, cell: tuple[int, int]
) -> None:
    edges.requires_grad_()
    costs, begins = flat(edges, source)
    distance = differentiable_distances(distance_fields(costs, begins, steps=100), costs, begins)
    distance.view(2, H, W, BATCH, COST_MAPS)[(0, *cell, 0, 1)].backward()
    _, predecessor = slow_distances(edges.detach(), source, 0, 0, 1)
    expected = torch.zeros_like(edges)
    here = cell[0] * W + cell[1]
    while predecessor[here] >= 0:
        # The edge belongs to the cell that is above, or on the left.
        first, second = sorted(divmod(n, W) for n in (here, int(predecessor[here])))
        step = second[0] - first[0], second[1] - first[1]
        kind = OFFSETS.index(step)
        expected[(*first, 0, kind * COST_MAPS + 1)] = np.hypot(*step)
        here = int(predecessor[here])
    torch.testing.assert_close(edges.grad, expected)


def inputs() -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(0)
    endpoints = torch.zeros(BATCH, 2, H, W)
    endpoints[0, 0, 2, 1] = endpoints[1, 0, 0, 0] = 1
    endpoints[0, 1, 8, 6] = endpoints[1, 1, 5, 5] = 1
    blocked = torch.rand(BATCH, 1, H, W, generator=generator)
    return torch.randn(BATCH, 8, H, W, generator=generator), blocked, endpoints


def test_features_are_one_on_the_cheapest_path_and_less_elsewhere() -> None:
    torch.manual_seed(0)
    module, (features, blocked, endpoints) = Wavefront(8, COST_MAPS).eval(), inputs()
    closeness = module(features, blocked, endpoints)
    assert closeness.shape == (BATCH, 2 * COST_MAPS, H, W)
    assert closeness.min() >= 0
    torch.testing.assert_close(closeness.amax((2, 3)), torch.ones(BATCH, 2 * COST_MAPS))
    sharp, wide = closeness.chunk(2, 1)
    assert (sharp <= wide).all()
    for cell in endpoints.split(1, 1):
        at = closeness.masked_select(cell.bool().expand_as(closeness))
        torch.testing.assert_close(at, torch.ones_like(at), rtol=0, atol=1e-4)


def test_training_has_the_same_features_with_gradients() -> None:
    torch.manual_seed(0)
    module, given = Wavefront(8, COST_MAPS), inputs()
    trained, used = module.train()(*given), module.eval()(*given)
    torch.testing.assert_close(trained, used, rtol=0, atol=1e-4)
    assert not used.requires_grad
    (trained * torch.rand_like(trained)).sum().backward()
    for learned in (module.costs.weight, module.wall_costs):
        assert learned.grad is not None
        assert learned.grad.isfinite().all()
        assert learned.grad.any()


@pytest.mark.parametrize("size", [(9, 7), (16, 12)])
def test_scripted_features_are_the_same(size: tuple[int, int]) -> None:
    torch.manual_seed(0)
    module = Wavefront(8, COST_MAPS).eval()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        scripted = torch.jit.script(module)
    features, blocked = torch.randn(BATCH, 8, *size), torch.rand(BATCH, 1, *size)
    endpoints = torch.zeros(BATCH, 2, *size)
    endpoints[:, 0, 1, 2] = endpoints[:, 1, 7, 5] = 1
    for model in (module, scripted):
        model.eval()
    with torch.inference_mode():
        torch.testing.assert_close(
            scripted(features, blocked, endpoints), module(features, blocked, endpoints)
        )
    for model in (module, scripted):
        model.train()
    torch.testing.assert_close(
        scripted(features, blocked, endpoints), module(features, blocked, endpoints)
    )
