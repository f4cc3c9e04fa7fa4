"""Convolutions of a loaded TorchScript module, made quick for single tasks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .model_files import PASSAGE_METHODS, SPLIT_METHODS

if TYPE_CHECKING:
    import torch

# Smaller kernels are quicker in torch's own code on one thread.
_LEAST_KERNEL = 2

_ONEDNN = "aten::mkldnn_convolution"


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
            node.output().replaceAllUsesWith(_insert(graph, node, _ONEDNN, inputs))
            node.destroy()


def convolve_maps_once(module: torch.nn.Module) -> None:
    """Let the features of a map be convolved when it is read, not again for each task on it.

    A convolution is linear: that of the features of a map beside those of a task, as ``paint`` of a
    :class:`cbagan_ompl.networks.passage_model.PassageModel` has it, is the sum of one of each. The
    first becomes part of ``read_map``, which returns its result instead of the features.

    Args:
        module: as :func:`use_onednn` leaves it, before its first call; changed in place. Modules
            without such a convolution stay as they are.
    """
    if hasattr(module, "encode") or not all(hasattr(module, name) for name in PASSAGE_METHODS):
        return
    read_map, paint = (getattr(module, name).graph for name in PASSAGE_METHODS)
    kept = next(read_map.outputs()).node()
    for joint in paint.findAllNodes(_ONEDNN, recurse=False):
        image, weight, bias, *options = joint.inputs()
        if image.node().kind() != "aten::cat":
            continue
        parts = image.node().inputsAt(0).node()
        features = parts.inputsAt(0)
        if features.node().kind() != "aten::__getitem__" or len(features.uses()) > 1:
            continue
        index = features.node().inputsAt(1).toIValue()
        # A convolution with the same options has made the features, and tells how many they are.
        maker = kept.inputsAt(index).node().inputsAt(0).node()
        if maker.kind() != _ONEDNN:
            continue
        _, own_weight, _, *own_options = maker.inputs()
        kernel, count = weight.toIValue(), len(own_weight.toIValue())
        of_map, of_task = kernel[:, :count].contiguous(), kernel[:, count:].contiguous()
        inputs = [kept.inputsAt(index), of_map, bias.toIValue(), *own_options]
        kept.replaceInput(index, _insert(read_map, kept, _ONEDNN, inputs))
        parts.removeInput(0)
        convolved = _insert(paint, joint, _ONEDNN, [image, of_task, None, *options])
        total = _insert(paint, joint, "aten::add", [convolved, features, 1])
        joint.output().replaceAllUsesWith(total)
        joint.destroy()


def _insert(graph: Any, before: Any, kind: str, inputs: list[Any]) -> Any:
    """Insert an operation on tensors before a node of a graph.

    Args:
        graph: of the function.
        before: the node.
        kind: of the operation.
        inputs: values of the graph, or constants.

    Returns:
        The output, a tensor.
    """
    import torch

    graph.setInsertPoint(before)
    values = [
        value if isinstance(value, torch.Value) else graph.insertConstant(value) for value in inputs
    ]
    node = graph.create(kind, values, 1)
    node.insertBefore(before)
    node.output().setType(torch._C.TensorType.get())
    return node.output()
