"""Checkpoint files of a training run: written whole or not at all, read without running code."""

from __future__ import annotations

import io
import zipfile
from os import PathLike
from pathlib import Path
from typing import Any

import torch

from ..common.files import write_atomically
from ..errors import ModelError
from ..networks.factory import make_generator
from ..networks.generator import Generator
from ..networks.patch_generator import PatchGenerator
from .config import TrainingConfig

#: Version of the form of a checkpoint; it goes up when the name of an option or a weight changes.
SCHEMA = 4
LAST, BEST = "last.pt", "best.pt"


def save_checkpoint(state: dict[str, Any], path: Path) -> None:
    """Write a checkpoint whole or not at all, whoever reads it or interrupts this.

    Raises:
        ModelError: the file cannot be written.
    """
    buffer = io.BytesIO()
    torch.save(state, buffer)
    write_atomically(path, buffer.getvalue(), ModelError)


def load_checkpoint(path: str | PathLike[str]) -> dict[str, Any]:
    """Read a file that :func:`cbagan_ompl.training.loop.train` wrote.

    Raises:
        ModelError: the file is missing, no training checkpoint, or of another version.
    """
    source = Path(path)
    if not source.is_file():
        raise ModelError(f"{source}: no such file; `cbagan-ompl train` writes {LAST} and {BEST}")
    if zipfile.is_zipfile(source):
        with zipfile.ZipFile(source) as archive:
            if any(name.endswith("/constants.pkl") for name in archive.namelist()):
                raise ModelError(f"{source}: an exported model, not a training checkpoint")
    try:
        state = torch.load(source, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises many types for damaged and for foreign files
        raise ModelError(
            f"{source}: not a training checkpoint, or a damaged one ({type(error).__name__})"
        ) from error
    schema = state.get("schema") if isinstance(state, dict) else None
    if type(schema) is not int:
        raise ModelError(f"{source}: not a training checkpoint of cbagan-ompl")
    if schema < SCHEMA:
        raise ModelError(
            f"{source}: written by an older version of cbagan-ompl; export it with that version, "
            "or train again"
        )
    if schema > SCHEMA:
        raise ModelError(
            f"{source}: written by a newer version of cbagan-ompl; install that version "
            "(pip install -U cbagan-ompl)"
        )
    return dict(state)


def best_generator(state: dict[str, Any]) -> Generator | PatchGenerator:
    """Return the generator that the epoch of a checkpoint was validated with, in evaluation mode.

    Args:
        state: from :func:`load_checkpoint`.
    """
    config = TrainingConfig().updated(state["config"])
    generator = make_generator(config.network)
    generator.load_state_dict(state["gan"]["average" if config.ema_decay else "generator"])
    return generator.eval()
