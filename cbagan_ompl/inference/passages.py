"""Models in the parts of :class:`cbagan_ompl.networks.export_model.PassageModel`."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from .graphs import Graphs
from .pipelines import KeptMaps, Painting

# Side of the patches, in pixels.
_PATCH = 4


class PassagesPipeline:
    """A model that learns costs of travel, and paints directions.

    Its nodes come from all pixels of a map, also where the network sees it scaled down, and its
    distances are computed between its parts.

    Args:
        graphs: of the model.
    """

    def __init__(self, graphs: Graphs) -> None:
        # Here, since numba takes long to import.
        from ..networks import fast_marching, full_nodes
        from ..networks.lowered_pixels import lowered_pixels

        self.graphs = graphs
        self._marching, self._nodes, self._lower = fast_marching, full_nodes, lowered_pixels

    def read_maps(self, free: NDArray[np.bool_], full: NDArray[np.bool_] | None = None) -> KeptMaps:
        """Return what depends on the maps alone.

        Args:
            free: (B, h, w), true where free; or (1, h, w) for several tasks on one map.
            full: (H, W), the one map before it was scaled down; if it was.
        """
        shape = free.shape[1], free.shape[2]
        features, costs = self.graphs.call("read_map", free.astype(np.float32)[:, None])
        patches = costs.shape[2], costs.shape[3]
        is_reduced = full is not None and full.shape[0] >= shape[0] and full.shape[1] >= shape[1]
        maps = [full] if full is not None and is_reduced else list(free)
        nodes = [self._nodes.full_nodes(one, shape, patches) for one in maps]
        codes, linked = (np.stack(parts) for parts in zip(*nodes, strict=True))
        padded = np.zeros((len(free), 1, _PATCH * patches[0], _PATCH * patches[1]), np.float32)
        padded[:, 0, : shape[0], : shape[1]] = free
        return KeptMaps(shape, [features, costs, codes, linked, padded, *maps])

    def paint(
        self, maps: KeptMaps, start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> Painting:
        """Return region and directions, see :meth:`.pipelines.WholePipeline.paint`."""
        features, costs, codes, linked, padded, *full = maps.arrays
        tasks = len(start)
        endpoints = [
            np.array(
                [
                    self._find_node(full[i % len(full)], maps.shape, codes[i % len(codes)], point)
                    for i, point in enumerate(points.tolist())
                ]
            )
            for points in (start, goal)
        ]
        # The distances come first: they need the costs of a task alone, not its features.
        batch = [
            array if len(array) == tasks else np.repeat(array, tasks // len(array), axis=0)
            for array in maps.arrays[:5]
        ]
        features, costs, codes, linked, padded = batch
        distances = self._marching.march_all(costs, linked, *endpoints)
        towards = self._marching.descent_directions(distances, linked)
        lowered = self._lower(costs, codes, distances)
        region, vectors = self.graphs.call(
            "paint", [features, costs], lowered, distances, towards, padded
        )
        height, width = maps.shape
        values = region[:, 0, :height, :width]
        if full[0].shape != maps.shape:
            values = np.stack([_cover_walls(one, padded[0, 0, :height, :width]) for one in values])
        return Painting(values, vectors)

    def _find_node(
        self,
        full: NDArray[np.bool_],
        shape: tuple[int, int],
        codes: NDArray[np.int32],
        point: list[float],
    ) -> int:
        """Return the node of a point of the scaled map."""
        scale = full.shape[1] / shape[1], full.shape[0] / shape[0]
        # A point on the edge of a pixel stays in it, whatever the rounding.
        column, row = (int(x * factor + 1e-6) for x, factor in zip(point, scale, strict=True))
        pixel = min(max(column, 0), full.shape[1] - 1), min(max(row, 0), full.shape[0] - 1)
        return self._nodes.full_node_of(full, shape, codes, pixel)


def _cover_walls(values: NDArray[np.float32], free: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return values that go on into blocked pixels, by one pixel.

    The interpolation to the size of the full map would lower those of narrow passages, whose walls
    the full map has itself.
    """
    spread = cv2.dilate(values, np.ones((3, 3), np.uint8))
    return np.where(free > 0, values, spread)
