"""Models as ONNX graphs (https://onnx.ai), for ONNX Runtime: without torch.

TorchScript computes all of a model, with the distance fields. They spread until nothing changes,
which no fixed graph does; so each part of a model that is called by itself becomes a graph.
"""

from __future__ import annotations

import io
import json
import math
import warnings
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from ..common.files import write_atomically
from ..common.validation import require
from ..errors import ModelError
from ..inference.choice import make_pipeline
from ..inference.graphs import Graphs, TorchGraphs
from ..inference.model_files import RECORD_MEMBER, ModelFormat
from ..inference.onnx_graphs import flatten
from ..networks.export_model import RegionModel
from ..networks.passage_model import PassageModel

_OPSET = 17

# Maps, tasks, height and width of two examples: sizes that differ between them are left open.
_EXAMPLES = ((1, 2, 1, 2), (3, 3, 2, 3))


def save_onnx(model: RegionModel | PassageModel, path: Path, record: dict[str, Any]) -> None:
    """Write a model as an archive of its graphs and its record.

    Args:
        model: in evaluation mode.
        path: of the file.
        record: what it says about itself.

    Raises:
        MissingDependencyError: onnx is not installed.
        ModelError: the file cannot be written.
    """
    require("onnx", "dev")
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, graph in onnx_graphs(model).items():
            file.writestr(zipfile.ZipInfo(f"model/{name}{ModelFormat.ONNX.suffix}"), graph)
        text = json.dumps(record, indent=1)
        file.writestr(zipfile.ZipInfo(f"model/{RECORD_MEMBER}"), text)
    write_atomically(path, buffer.getvalue(), ModelError)


def onnx_graphs(model: RegionModel | PassageModel) -> dict[str, bytes]:
    """Return the graphs of all functions that a prediction calls, by name.

    Args:
        model: in evaluation mode.
    """
    recorders = [_Recorder(TorchGraphs(model)) for _ in _EXAMPLES]
    for recorder, (maps, tasks, rows, columns) in zip(recorders, _EXAMPLES, strict=True):
        free = np.ones((maps, rows * model.stride, columns * model.stride), np.bool_)
        free[:, ::7, ::5] = False
        points = np.linspace(3, 0.9 * model.stride, 2 * tasks, dtype=np.float32).reshape(-1, 2)
        pipeline = make_pipeline(recorder)
        with recorder.ready():
            pipeline.paint(pipeline.read_maps(free), points, points[::-1].copy())
    one, other = recorders
    return {name: _export(model, name, one.calls[name], other.calls[name]) for name in one.calls}


class _Recorder:
    """Graphs that keep the inputs of their calls.

    Attributes:
        calls: arguments and number of results of each function that was called.
    """

    def __init__(self, graphs: Graphs) -> None:
        self._graphs, self.threads = graphs, graphs.threads
        self.calls: dict[str, tuple[Sequence[Any], list[NDArray[Any]]]] = {}
        self.has, self.ready = graphs.has, graphs.ready

    def call(self, name: str, *inputs: Any) -> list[NDArray[Any]]:
        results = self._graphs.call(name, *inputs)
        self.calls[name] = inputs, results
        return results


class _Function(nn.Module):
    """A method of a model, as a module whose inputs and outputs are tensors alone."""

    def __init__(self, model: RegionModel | PassageModel, name: str, inputs: Sequence[Any]) -> None:
        super().__init__()
        self.model, self.name = model, name
        # Of each input: the number of tensors in a list, or 0 for a tensor.
        self.lengths = [0 if isinstance(value, np.ndarray) else len(value) for value in inputs]

    def forward(self, *tensors: Tensor) -> Any:
        remaining = iter(tensors)
        inputs = [
            [next(remaining) for _ in range(length)] if length else next(remaining)
            for length in self.lengths
        ]
        results = getattr(self.model, self.name)(*inputs)
        return tuple(results) if isinstance(results, list) else results


def _export(
    model: RegionModel | PassageModel,
    name: str,
    one: tuple[Sequence[Any], list[NDArray[Any]]],
    other: tuple[Sequence[Any], list[NDArray[Any]]],
) -> bytes:
    """Return the graph of a method of a model.

    Args:
        model: the model.
        name: of the method.
        one: inputs and results of a call.
        other: of a call with other sizes.
    """
    names, axes = [], {}
    pairs = zip((*flatten(one[0]), *one[1]), (*flatten(other[0]), *other[1]), strict=True)
    for i, (first, second) in enumerate(pairs):
        names.append(f"value_{i}")
        sizes = enumerate(zip(first.shape, second.shape, strict=True))
        axes[names[-1]] = [axis for axis, (size, next_size) in sizes if size != next_size]
    count = len(flatten(one[0]))
    torch.onnx.register_custom_op_symbolic("aten::exp2", _exp2, _OPSET)  # type: ignore[attr-defined]
    buffer = io.BytesIO()
    with warnings.catch_warnings(), torch.no_grad():
        # The exporter warns of itself, and of sizes that become constants: none that differ.
        warnings.simplefilter("ignore")
        torch.onnx.export(
            _Function(model, name, one[0]).eval(),
            tuple(map(torch.from_numpy, flatten(one[0]))),
            buffer,  # type: ignore[arg-type]
            input_names=names[:count],
            output_names=names[count:],
            dynamic_axes=axes,
            opset_version=_OPSET,
            dynamo=False,
        )
    return buffer.getvalue()


def _exp2(graph: Any, exponent: Any) -> Any:
    """Return 2 to the power of a value of a graph: ONNX has the exponential function of base e."""
    factor = graph.op("Constant", value_t=torch.tensor(math.log(2)))
    return graph.op("Exp", graph.op("Mul", exponent, factor))
