"""The settings of torch that are one for the whole process, as an inference needs them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager


@contextmanager
def own_torch_state(threads: int) -> Iterator[None]:
    """Run a block with the settings that inference needs, whatever the caller of ours has set.

    Default type, default device, automatic mixed precision and number of threads are the caller's
    again afterwards.

    Args:
        threads: CPU threads of torch in the block.

    Example:
        >>> import torch
        >>> torch.set_default_dtype(torch.float64)
        >>> with own_torch_state(threads=1):
        ...     torch.get_default_dtype()
        torch.float32
        >>> torch.set_default_dtype(torch.float32)
    """
    import torch
    from torch.jit import optimized_execution  # type: ignore[attr-defined]

    own_threads, own_type = torch.get_num_threads(), torch.get_default_dtype()
    # Only what differs is changed: a prediction takes about a millisecond, all of this a tenth.
    with ExitStack() as stack:
        if own_threads != threads:
            stack.callback(torch.set_num_threads, own_threads)
            torch.set_num_threads(threads)
        if own_type is not torch.float32:
            stack.callback(torch.set_default_dtype, own_type)
            torch.set_default_dtype(torch.float32)
        if torch.get_default_device().type != "cpu":
            stack.enter_context(torch.device("cpu"))
        if torch.is_autocast_enabled("cpu"):
            stack.enter_context(torch.autocast("cpu", enabled=False))
        stack.enter_context(torch.inference_mode())
        # Without the optimiser, whose first two calls take ten times as long: a plan makes one.
        stack.enter_context(optimized_execution(False))
        yield
