"""Losses and scores of a training run for TensorBoard, which is an optional package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import MissingDependencyError

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter


def scalar_log(folder: Path, epochs: int) -> SummaryWriter:
    """A log in the folder of a run; what it says of epochs that will be repeated is dropped.

    Args:
        folder: of the run.
        epochs: done so far.

    Raises:
        MissingDependencyError: TensorBoard is not installed.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError as error:
        raise MissingDependencyError(
            f"logs for TensorBoard need the package tensorboard ({error}); "
            "install it with: pip install 'cbagan-ompl[tensorboard]'"
        ) from error
    return SummaryWriter(str(folder), purge_step=epochs + 1)


def write_scalars(log: SummaryWriter, entry: dict[str, Any]) -> None:
    """Write an entry of ``log.jsonl``: its losses and validation scores."""
    for group in ("losses", "validation"):
        for name, value in entry[group].items():
            log.add_scalar(f"{group}/{name}", value, entry["epoch"])
    log.flush()
