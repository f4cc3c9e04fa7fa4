"""What computes a model, loaded from a file that has been checked."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from ..common.validation import require_torch
from .convolutions import convolve_maps_once, use_onednn
from .model_files import ModelFile, ModelFormat, load_graphs, load_script
from .onnx_graphs import OnnxGraphs, require_onnx_runtime
from .probe import Kind, try_model

if TYPE_CHECKING:
    import torch

#: What computes models of each format, for messages.
RUNTIMES = {ModelFormat.TORCHSCRIPT: "torch", ModelFormat.ONNX: "ONNX Runtime"}


def can_predict() -> bool:
    """Return whether torch or ONNX Runtime is installed, without loading them."""
    return any(find_spec(package) is not None for package in ("torch", "onnxruntime"))


def prepare_runtime(source: Path, model: ModelFile) -> None:
    """Make sure that a model can be loaded, in another process where no manifest lists it.

    Args:
        source: its file, for messages.
        model: its content.

    Raises:
        MissingDependencyError: what computes it is not installed.
        ModelError: it could not be loaded there.
    """
    is_onnx = model.format is ModelFormat.ONNX
    if is_onnx:
        require_onnx_runtime()
    else:
        require_torch()
    if not model.is_listed:
        kind = Kind.ONNX if is_onnx else Kind.REGION
        try_model(str(source), model.content, kind, model.record["working_size"])


def load_functions(model: ModelFile) -> torch.nn.Module | OnnxGraphs:
    """Return what computes a model.

    Raises:
        Exception: of many types, for damaged files.
    """
    if model.format is ModelFormat.ONNX:
        return load_graphs(model.content)
    module = load_script(model.content)
    use_onednn(module)
    convolve_maps_once(module)
    return module
