"""The graph of patches: its nodes, its links, and distances on it, in torch and compiled."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

torch = pytest.importorskip("torch")

from cbagan_ompl.maps.connectivity import label_components
from cbagan_ompl.networks.fast_marching import (
    REACH,
    REACH_SLACK,
    UNREACHED,
    descent_directions,
    link_bits,
    march_all,
)
from cbagan_ompl.networks.full_nodes import full_node_of, full_nodes
from cbagan_ompl.networks.marching_gradients import FastMarching
from cbagan_ompl.networks.passages import (
    NODES,
    component_table,
    directions,
    distance_fields,
    endpoint_nodes,
    links,
    patch_codes,
)

H, W = 12, 9  # patches


def random_map(seed: int, fraction: float = 0.6) -> NDArray[np.bool_]:
    return np.random.default_rng(seed).random((4 * H, 4 * W)) < fraction


def codes_of(free: NDArray[np.bool_]) -> torch.Tensor:
    cells = torch.from_numpy(free.astype(np.float32))[None, None]
    return patch_codes(cells, component_table())


def random_costs(seed: int) -> torch.Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.empty(1, NODES, H, W).uniform_(-1, 1, generator=generator).exp()


def pixels_of(codes: NDArray[np.int32]) -> NDArray[np.bool_]:
    """The pixels of each node, (nodes, 4 h, 4 w)."""
    bits = (codes[..., None] >> np.arange(16)) & 1
    nodes, height, width = codes.shape
    tiles = bits.reshape(nodes, height, width, 4, 4).transpose(0, 1, 3, 2, 4)
    return tiles.reshape(nodes, 4 * height, 4 * width) > 0


@pytest.mark.parametrize("fraction", [0.3, 0.5, 0.7])
def test_nodes_hold_what_can_be_passed_through(fraction: float) -> None:
    free = random_map(0, fraction)
    members = pixels_of(codes_of(free)[0].numpy())
    assert members.sum(0).max() == 1  # a pixel has one node at most
    assert not (members.any(0) & ~free).any()
    for row, column in np.ndindex(H, W):
        patch = np.s_[4 * row : 4 * row + 4, 4 * column : 4 * column + 4]
        labels = label_components(free[patch], connectivity=4)
        for label in range(1, labels.max() + 1):
            rows, columns = np.nonzero(labels == label)
            contacts = sum(((axis == 0) | (axis == 3)).sum() for axis in (rows, columns))
            if contacts > 1:
                assert members[(slice(None), *patch)].any(0)[labels == label].all()


@pytest.mark.parametrize("seed", range(4))
def test_the_graph_is_connected_as_the_map_is(seed: int) -> None:
    free = random_map(seed)
    # Walls that cross: four rooms that meet in one patch.
    free[21], free[:, 13] = False, False
    codes = codes_of(free)
    linked = links(codes)[:, 0].numpy()
    members = pixels_of(codes[0].numpy())
    labels = label_components(members.any(0), connectivity=4)
    numbers = np.arange(NODES * H * W).reshape(NODES, H, W)
    pairs = []
    for direction, (down, right) in enumerate([(0, -1), (0, 1), (-1, 0), (1, 0)]):
        for here, there, row, column in np.argwhere(linked[direction]):
            other = numbers[there, row + down, column + right]
            pairs.append((numbers[here, row, column], other))
    ones = np.ones(len(pairs))
    graph = coo_array((ones, np.array(pairs).T), (numbers.size, numbers.size))
    groups = connected_components(graph, directed=False)[1]
    node_of = np.full(labels.shape, -1)
    for node in range(NODES):
        tiles = numbers[node].repeat(4, axis=0).repeat(4, axis=1)
        node_of[members[node]] = tiles[members[node]]
    inside = labels > 0
    # Each component is in one group, and each group in one component.
    found = np.unique(np.stack((labels[inside], groups[node_of[inside]])), axis=1)
    assert found.shape[1] == labels.max() == len(np.unique(found[1]))


def test_walls_that_cross_keep_four_sides_apart() -> None:
    free = np.ones((12, 12), np.bool_)
    free[5], free[:, 6] = False, False
    codes = codes_of(free)[0, :, 1, 1]
    assert (codes > 0).all()
    assert sum(int(code).bit_count() for code in codes) == 9


def test_links_as_bits_are_the_links() -> None:
    codes = codes_of(random_map(1))
    bits = link_bits(codes.numpy()).astype(np.int64)
    expected = links(codes).numpy()  # (4, B, here, there, h, w)
    for direction, there in np.ndindex(4, NODES):
        one = (bits >> (4 * direction + there)) & 1
        assert (one > 0).tolist() == expected[direction, :, :, there].tolist()


def test_nodes_of_all_pixels_are_those_of_the_network_where_no_map_is_scaled() -> None:
    free = random_map(2, 0.5)
    codes, linked = full_nodes(free, free.shape, (H, W))
    expected = codes_of(free)
    assert codes.tolist() == expected[0].tolist()
    assert linked.tolist() == link_bits(expected.numpy())[0].tolist()


def test_a_wall_that_is_lost_when_a_map_is_scaled_down_still_parts_nodes() -> None:
    free = np.ones((64, 64), np.bool_)
    free[:, 21] = False  # one pixel of two: its block is free on the scaled map
    codes, linked = full_nodes(free, (32, 32), (8, 8))
    assert (codes[:2, :, 2] > 0).all()
    costs = np.ones((1, NODES, 8, 8), np.float32)
    ends = [full_node_of(free, (32, 32), codes, pixel) for pixel in ((3, 30), (60, 30))]
    distances = march_all(costs, linked[None], *(np.array([end]) for end in ends))
    assert distances[0, 0].ravel()[ends[1]] == UNREACHED
    free[40, 21] = True
    codes, linked = full_nodes(free, (32, 32), (8, 8))
    ends = [full_node_of(free, (32, 32), codes, pixel) for pixel in ((3, 30), (60, 30))]
    distances = march_all(costs, linked[None], *(np.array([end]) for end in ends))
    assert 7 < distances[0, 0].ravel()[ends[1]] < 12


@pytest.mark.parametrize("shape", [(8, 12), (6, 9)])
def test_nodes_of_blocks_are_their_largest_components(shape: tuple[int, int]) -> None:
    free = np.random.default_rng(4).random((24, 260)) < 0.6
    codes, linked = full_nodes(free, shape, (2, 3))
    rows, columns = (
        np.arange(n + 1) * size // n for n, size in zip(shape, free.shape, strict=True)
    )
    nodes = np.zeros(free.shape, np.uint8)
    for i, j in np.ndindex(2, 3):
        edges = rows[4 * i : 4 * i + 5], columns[4 * j : 4 * j + 5]
        block = np.s_[edges[0][0] : edges[0][-1], edges[1][0] : edges[1][-1]]
        labels = label_components(free[block], connectivity=4)
        contacts = sum(
            (axis == 0) + (axis == size - 1).astype(int)
            for axis, size in zip(np.indices(labels.shape), labels.shape, strict=True)
        )
        sizes = np.bincount(labels.ravel())
        touching = np.bincount(labels.ravel(), contacts.ravel())
        keys = {k: sizes[k] + labels.size * (touching[k] > 1) for k in range(1, len(sizes))}
        ranked = sorted(keys, key=lambda k: (-keys[k], np.flatnonzero(labels.ravel() == k)[0]))
        for rank, label in enumerate(ranked):
            if rank < 4 or touching[label] > 1:
                nodes[block][labels == label] = min(rank + 1, 4)
        for node, (v, u) in ((n, p) for n in range(4) for p in np.ndindex(4, 4)):
            is_inside = v + 1 < len(edges[0]) and u + 1 < len(edges[1])
            own = (
                is_inside
                and (
                    nodes[edges[0][v] : edges[0][v + 1], edges[1][u] : edges[1][u + 1]] == node + 1
                ).any()
            )
            assert (codes[node, i, j] >> (4 * v + u)) & 1 == own
    for row, column in np.argwhere(free)[::7].tolist():
        found = full_node_of(free, shape, codes, (column, row))
        node, i, j = np.unravel_index(found, codes.shape)
        assert node == max(0, int(nodes[row, column]) - 1)
        assert rows[4 * i] <= row < rows[min(4 * i + 4, shape[0])]
        assert columns[4 * j] <= column < columns[min(4 * j + 4, shape[1])]
    for j in (1, 2):  # the links across the sides of blocks
        beside = nodes[: rows[4], columns[4 * j] - 1], nodes[: rows[4], columns[4 * j]]
        pairs = {
            (a - 1, b - 1) for a, b in zip(*map(np.ndarray.tolist, beside), strict=True) if a and b
        }
        bits = linked[:, 0, j - 1].astype(int) >> 4
        assert pairs == {(a, b) for a, b in np.ndindex(4, 4) if (bits[a] >> b) & 1}


def test_endpoints_are_in_the_node_of_their_pixel() -> None:
    free = random_map(3, 0.5)
    codes = codes_of(free)
    members = pixels_of(codes[0].numpy())
    for row, column in np.argwhere(members.any(0)):
        point = torch.tensor([[column + 0.5, row + 0.5]])
        node, cell = divmod(int(endpoint_nodes(point, codes)[0]), H * W)
        assert members[node, row, column]
        assert divmod(cell, W) == (row // 4, column // 4)
        assert full_node_of(free, free.shape, codes[0].numpy(), (column, row)) == int(
            endpoint_nodes(point, codes)[0]
        )


@pytest.mark.parametrize("seed", range(3))
def test_compiled_distances_and_directions_are_those_of_torch(seed: int) -> None:
    free = random_map(seed, 0.75)
    codes, costs = codes_of(free), random_costs(seed)
    largest = label_components(free, connectivity=4)
    rows, columns = np.nonzero(largest == np.bincount(largest[largest > 0]).argmax())
    points = [torch.tensor([[columns[i] + 0.5, rows[i] + 0.5]]) for i in (0, -1)]
    start, goal = (endpoint_nodes(point, codes) for point in points)
    expected = distance_fields(costs, codes, start, goal, 5000)
    linked = link_bits(codes.numpy())
    found = march_all(costs.numpy(), linked, start.numpy(), goal.numpy())
    assert found == pytest.approx(expected.numpy(), abs=1e-3)
    shortest = float(expected[0, 0].flatten()[goal])
    reached = found[found < UNREACHED]
    assert shortest < reached.max() <= REACH * shortest + REACH_SLACK + 1e-3
    exact = directions(torch.from_numpy(found), codes).numpy()
    assert descent_directions(found, linked) == pytest.approx(exact, abs=1e-4)


def test_distances_in_the_open_are_nearly_those_of_the_plane() -> None:
    codes = codes_of(np.ones((4 * H, 4 * W), np.bool_))
    ends = torch.tensor([0]), torch.tensor([H * W - 1])
    found = distance_fields(torch.ones(1, NODES, H, W), codes, *ends, 5000)[0, 0, 0].numpy()
    exact = np.hypot(*np.ogrid[:H, :W])
    assert (found >= exact - 1e-3).all()
    assert (found <= 1.06 * exact + 0.45).all()


def test_gradients_by_the_costs_are_those_of_finite_differences() -> None:
    codes = codes_of(random_map(5, 0.8))
    costs = random_costs(5).requires_grad_()
    ends = endpoint_nodes(torch.tensor([[1.5, 1.5]]), codes), torch.tensor([H * W - 1])
    weights = torch.rand(1, 2, NODES, H, W, generator=torch.Generator().manual_seed(0))
    # Distances that are hardly within reach may come and go.
    weights[FastMarching.apply(costs, codes, *ends)[0] > 10] = 0
    total = (weights * FastMarching.apply(costs, codes, *ends)[0]).sum()
    total.backward()
    assert costs.grad is not None
    step = 1e-3 * costs.detach()

    def value(values: torch.Tensor) -> float:
        return float((weights * FastMarching.apply(values, codes, *ends)[0]).double().sum())

    difference = (value(costs.detach() + step) - value(costs.detach() - step)) / 2
    assert difference == pytest.approx(float((costs.grad * step).sum()), rel=0.02)
    assert difference > 0
