"""Checkpoint files, checked before torch opens them, or is loaded at all: that takes seconds."""

from __future__ import annotations

import os
from pathlib import Path

from ..common.files import read_bytes
from ..errors import ModelError
from ..inference.archives import Archive
from ..inference.model_files import translate_damage
from ..inference.tensor_pickles import check_group
from ..networks.config import MAX_WEIGHTS
from .config import BEST, LAST

#: Largest checkpoint: six numbers for each weight (the weight, its average in the generator, two
#: moments of the optimiser), and as much again for the log.
MAX_CHECKPOINT_BYTES = 8 * 4 * MAX_WEIGHTS


def read_checkpoint(path: Path) -> bytes:
    """Return the content of a file that has the form of a checkpoint.

    Raises:
        ModelError: the file is missing, too large, no archive of torch, damaged, or an exported
            model.
    """
    if not os.path.exists(path):  # False also where the name is too long to be one
        raise ModelError(f"{path}: no such file; `cbagan-ompl train` writes {LAST} and {BEST}")
    data = read_bytes(path, ModelError, MAX_CHECKPOINT_BYTES)
    with translate_damage(path, "not a training checkpoint, or a damaged one"):
        archive = Archive(data)
        is_model = "constants.pkl" in archive.sizes
        if not is_model:
            check_group(archive, "data")
    if is_model:
        raise ModelError(f"{path}: an exported model, not a training checkpoint")
    return data
