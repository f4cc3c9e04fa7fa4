"""The functions of an exported model, called with arrays, whatever computes them."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .torch_state import own_torch_state

if TYPE_CHECKING:
    import torch


class Graphs(Protocol):
    """The functions of a model by their names.

    Attributes:
        threads: CPU threads for one call.
    """

    threads: int

    def has(self, name: str) -> bool:
        """Return whether there is a function of that name."""

    def ready(self) -> AbstractContextManager[None]:
        """Return the context in which functions are called."""

    def call(self, name: str, *inputs: Any) -> list[NDArray[Any]]:
        """Return the results of a function.

        Args:
            name: of the function.
            *inputs: arrays, and lists of arrays.
        """


class TorchGraphs:
    """The methods of a TorchScript module.

    Attributes:
        module: the module.
        threads: CPU threads for one call.

    Example:
        >>> import torch
        >>> TorchGraphs(torch.nn.Identity()).call("forward", np.zeros(2))
        [array([0., 0.])]
    """

    def __init__(self, module: torch.nn.Module) -> None:
        self.module = module
        self.threads = 1

    def has(self, name: str) -> bool:
        """Return whether the module has a method; every one can be called by itself."""
        return name == "forward" or hasattr(self.module, name)

    def ready(self) -> AbstractContextManager[None]:
        """Return the context in which methods are called: with settings of torch of its own."""
        return own_torch_state(self.threads)

    def call(self, name: str, *inputs: Any) -> list[NDArray[Any]]:
        """Return the results of a method, see :meth:`Graphs.call`."""
        function: Any = self.module if name == "forward" else getattr(self.module, name)
        results = function(*map(_as_tensors, inputs))
        listed = [results] if hasattr(results, "numpy") else results
        return [result.numpy() for result in listed]


def _as_tensors(value: Any) -> Any:
    import torch

    if isinstance(value, np.ndarray):
        return torch.from_numpy(value)
    return [torch.from_numpy(array) for array in value]
