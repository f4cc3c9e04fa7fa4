"""Checkpoint files of a training run: written whole or not at all, read without running code."""

from __future__ import annotations

import os
import zipfile
from os import PathLike
from pathlib import Path
from typing import Any

import torch

from ..errors import ModelError
from ..networks.generator import Generator
from ..networks.patch_generator import PatchGenerator
from .config import TrainingConfig
from .gan import make_generator

SCHEMA = 3
LAST, BEST = "last.pt", "best.pt"


def save_atomically(state: dict[str, Any], path: Path) -> None:
    """Write a checkpoint so that a reader, or an interruption, never meets half a file."""
    temporary = path.with_suffix(".tmp")
    torch.save(state, temporary)
    os.replace(temporary, path)


def load_checkpoint(path: str | PathLike[str]) -> dict[str, Any]:
    """Read a file that :func:`train` wrote.

    Raises:
        ModelError: the file is missing, or no training checkpoint of this version.
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
    if not isinstance(state, dict) or state.get("schema") != SCHEMA:
        raise ModelError(f"{source}: not a training checkpoint of this version of cbagan-ompl")
    return state


def best_generator(state: dict[str, Any]) -> Generator | PatchGenerator:
    """The generator of a checkpoint that its epoch was validated with."""
    config = TrainingConfig().updated(state["config"])
    generator = make_generator(config)
    generator.load_state_dict(state["networks"]["average" if config.ema_decay else "generator"])
    return generator.eval()
