"""The functions of an exported model as ONNX graphs, computed by ONNX Runtime."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.validation import require

# Of the messages of ONNX Runtime: errors alone.
_ERRORS = 3


class OnnxGraphs:
    """Graphs by the names of the functions that they compute.

    Attributes:
        threads: CPU threads for one call; graphs are loaded again for another number.

    Args:
        graphs: ONNX models as bytes.

    Raises:
        MissingDependencyError: ONNX Runtime is not installed.
        Exception: of many types, for damaged graphs.
    """

    def __init__(self, graphs: Mapping[str, bytes]) -> None:
        require_onnx_runtime()
        self._graphs = dict(graphs)
        self.threads = 1
        self._loaded_for = 0
        self._sessions: dict[str, Any] = {}
        self._load()

    def has(self, name: str) -> bool:
        """Return whether there is a function of that name."""
        return name in self._graphs

    def ready(self) -> AbstractContextManager[None]:
        """Return the context in which functions are called."""
        if self.threads != self._loaded_for:
            self._load()
        return nullcontext()

    def call(self, name: str, *inputs: Any) -> list[NDArray[Any]]:
        """Return the results of a function, see :meth:`.graphs.Graphs.call`."""
        session, taken = self._sessions[name]
        values = flatten(inputs)
        # A graph has no input that it does not use.
        feeds = {key: np.ascontiguousarray(values[number]) for key, number in taken}
        results: list[NDArray[Any]] = session.run(None, feeds)
        return results

    def _load(self) -> None:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = self.threads
        options.inter_op_num_threads = 1
        options.log_severity_level = _ERRORS
        for name, graph in self._graphs.items():
            session = onnxruntime.InferenceSession(
                graph, options, providers=["CPUExecutionProvider"]
            )
            names = [node.name for node in session.get_inputs()]
            taken = [(key, int(key.rpartition("_")[2])) for key in names]
            self._sessions[name] = session, taken
        self._loaded_for = self.threads


def require_onnx_runtime() -> None:
    """Raise if ONNX Runtime cannot be imported, and have it keep to itself how it is used.

    From 1.32 on it writes a file and sends figures to its makers as soon as it is imported, unless
    the environment says otherwise. A variable that is set already stays.

    Raises:
        MissingDependencyError: it cannot be imported; the message says how to install it.
    """
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
    require("onnxruntime", "onnx")


def flatten(inputs: Sequence[Any]) -> list[NDArray[Any]]:
    """Return arrays, and lists of arrays, as one list of arrays.

    Example:
        >>> len(flatten([np.zeros(1), [np.zeros(2), np.zeros(3)]]))
        3
    """
    listed = [[value] if isinstance(value, np.ndarray) else value for value in inputs]
    return [array for arrays in listed for array in arrays]
