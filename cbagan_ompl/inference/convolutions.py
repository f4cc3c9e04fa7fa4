"""Convolutions of a loaded TorchScript module, made quick for single tasks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .model_files import SPLIT_METHODS

if TYPE_CHECKING:
    import torch

# Smaller kernels are quicker in torch's own code on one thread.
_LEAST_KERNEL = 2


def use_onednn(module: torch.nn.Module) -> None:
    """Let the convolutions of a module be computed by oneDNN, whatever the size of their input.

    torch takes its own code for single inputs of up to 20480 numbers. For the features of a network
    at a coarse size that takes up to three times as long.

    Args:
        module: frozen, as loaded; changed in place.
    """
    import torch

    if not torch.backends.mkldnn.is_available():  # type: ignore[no-untyped-call]
        return
    for name in ("forward", *SPLIT_METHODS):
        if not hasattr(module, name):
            continue
        graph: Any = getattr(module, name).graph
        for node in graph.findAllNodes("aten::conv2d", recurse=True):
            image, weight, bias, stride, padding, dilation, groups = node.inputs()
            kernel = weight.toIValue()
            if kernel is None or min(kernel.shape[2:]) < _LEAST_KERNEL or padding.toIValue() == []:
                continue
            inputs = [image, weight, bias, padding, stride, dilation, groups]
            direct = graph.create("aten::mkldnn_convolution", inputs, 1)
            direct.insertBefore(node)
            direct.output().setType(node.output().type())
            node.output().replaceAllUsesWith(direct.output())
            node.destroy()
