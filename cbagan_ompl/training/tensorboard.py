"""Losses and scores of a training run for TensorBoard, an optional package."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..common.files import reason
from ..common.validation import require
from ..errors import ConfigError

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter


def open_log(folder: Path, epochs: int) -> SummaryWriter:
    """Open a log in the folder of a run, without its entries of epochs that will be repeated.

    Args:
        folder: of the run.
        epochs: done so far.

    Raises:
        MissingDependencyError: TensorBoard is not installed.
        ConfigError: the log cannot be written.
    """
    require("torch.utils.tensorboard", "tensorboard")
    from torch.utils.tensorboard import SummaryWriter

    _silence_writers()
    with _translate_failure(folder):
        return SummaryWriter(str(folder), purge_step=epochs + 1)


def write_scalars(log: SummaryWriter, entry: dict[str, Any]) -> None:
    """Write an entry of ``log.jsonl``: its losses and validation scores.

    Raises:
        ConfigError: the log cannot be written.
    """
    with _translate_failure(Path(log.log_dir)):
        for group in ("losses", "validation"):
            for name, value in entry[group].items():
                log.add_scalar(f"{group}/{name}", value, entry["epoch"])
        log.flush()


def _silence_writers() -> None:
    """Let no thread that writes a log print its failure, which the next entry raises again."""
    before = threading.excepthook

    def hook(failure: threading.ExceptHookArgs) -> None:
        if not (
            isinstance(failure.exc_value, OSError)
            and type(failure.thread).__module__.startswith("tensorboard.")
        ):
            before(failure)

    threading.excepthook = hook


@contextmanager
def _translate_failure(folder: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(
            f"cannot write the logs for TensorBoard to {folder}: {reason(error)}"
        ) from error
