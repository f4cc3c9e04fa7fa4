"""Exported models computed by torch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .distance_fields import compiled_fields
from .model_files import SPLIT_METHODS
from .torch_state import own_torch_state

if TYPE_CHECKING:
    import torch


class KeptMaps(NamedTuple):
    """Maps as a module has read them, for any number of tasks on them.

    Attributes:
        shape: (H, W).
        tensors: from ``read_map`` of the module; the maps themselves where it has no such method.
    """

    shape: tuple[int, int]
    tensors: Sequence[torch.Tensor]


class TorchRuntime:
    """A TorchScript module, called with arrays.

    Attributes:
        module: the module.
        threads: CPU threads for one call.

    Args:
        module: see :class:`cbagan_ompl.networks.export_model.RegionModel`. The distance fields of
            those with the methods of a :class:`~cbagan_ompl.networks.export_model.SplitModel` are
            computed by a compiled function where numba is installed.
    """

    def __init__(self, module: torch.nn.Module) -> None:
        self.module = module
        self.threads = 1
        is_split = all(hasattr(module, name) for name in SPLIT_METHODS)
        self._fields = compiled_fields() if is_split else None

    def read_maps(self, free: NDArray[np.bool_]) -> KeptMaps:
        """Return what depends on the maps alone.

        Args:
            free: (B, H, W), true where free; or (1, H, W) for several tasks on one map.
        """
        import torch

        maps = torch.from_numpy(free.astype(np.float32))[:, None]
        tensors = [maps]
        if self._fields is not None:
            with own_torch_state(self.threads):
                tensors = self._call("read_map", maps)
        return KeptMaps((free.shape[1], free.shape[2]), tensors)

    def probabilities(
        self, maps: KeptMaps, start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return the output of the module, (B, 1, H, W).

        Args:
            maps: from :meth:`read_maps`.
            start: (B, 2), pixel coordinates (u, v), u right and v down.
            goal: (B, 2), the same.
        """
        import torch

        endpoints = [torch.from_numpy(points.astype(np.float32)) for points in (start, goal)]
        with own_torch_state(self.threads):
            if self._fields is None:
                free = maps.tensors[0].expand(len(start), -1, -1, -1)
                values = self.module(free, *endpoints)
            else:
                edges, cells, features = self._call("encode", maps.tensors, *endpoints)
                distances = torch.from_numpy(self._fields(edges.numpy(), cells.numpy()))
                values = self._call("paint", maps.tensors, features, distances)
            height, width = maps.shape
            result: NDArray[np.float32] = values[:, :, :height, :width].numpy()
        return result

    def _call(self, method: str, *inputs: Any) -> Any:
        return getattr(self.module, method)(*inputs)
