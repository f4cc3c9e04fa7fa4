"""Modules as TorchScript files, with a record inside."""

from __future__ import annotations

import io
import json
import warnings
from pathlib import Path
from typing import Any

import torch
from torch import nn

from ..common.files import write_atomically
from ..errors import ModelError
from ..inference.model_files import RECORD_NAME, SPLIT_METHODS


def save_script(model: nn.Module, path: Path, record: dict[str, Any]) -> None:
    """Write what :func:`script_bytes` returns.

    Raises:
        ModelError: the file cannot be written.
    """
    write_atomically(path, script_bytes(model, record), ModelError)


def script_bytes(model: nn.Module, record: dict[str, Any]) -> bytes:
    """Compile and freeze a module in evaluation mode; return its file, with the record inside."""
    with warnings.catch_warnings():
        # TorchScript is deprecated in favour of torch.export, but it is the form that this
        # package's models have, and torch goes on reading and writing it.
        warnings.simplefilter("ignore", DeprecationWarning)
        # No optimize_for_inference: what it writes cannot be loaded again.
        methods = [name for name in SPLIT_METHODS if hasattr(model, name)]
        frozen = torch.jit.freeze(torch.jit.script(model), preserved_attrs=methods)
        extra = {RECORD_NAME: json.dumps(record, indent=1)}
        buffer = io.BytesIO()
        torch.jit.save(frozen, buffer, _extra_files=extra)
    return buffer.getvalue()
