"""The models that come with the package, by name."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from os import PathLike
from pathlib import Path

from ..common.files import as_path
from ..errors import ModelError, show
from .model_files import EXPORT_HINT, MANIFEST, ModelFormat, read_manifest

_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")


def bundled_model(name: str | None = None) -> Path:
    """Return the path of a model that comes with the package.

    Args:
        name: without suffix; None for the default model. Where ONNX Runtime is installed and torch
            is not, the path is that of the ONNX file, if there is one.

    Raises:
        ModelError: this installation has none of that name.
    """
    package = Path(__file__).resolve().parent.parent
    # An installed wheel has the folder inside the package, a checkout beside it.
    for folder in (package / "models", package.parent / "models"):
        if (folder / MANIFEST).is_file():
            manifest = read_manifest(folder / MANIFEST)
            path = folder / (f"{name}.pt" if name else str(manifest["default"]))
            onnx = path.with_suffix(ModelFormat.ONNX.suffix)
            if _needs_onnx() and onnx.name in manifest["files"] and onnx.is_file():
                return onnx
            if name and not (path.name in manifest["files"] and path.is_file()):
                present = (folder / file for file in manifest["files"])
                names = ", ".join(sorted({file.stem for file in present if file.is_file()}))
                raise ModelError(
                    f"there is no bundled model {show(name)}: give one of {names}, or the path of "
                    f"a model file (.pt); {EXPORT_HINT}"
                )
            return path
    raise ModelError(f"this installation has no bundled model; {EXPORT_HINT}, and give its path")


def _needs_onnx() -> bool:
    """Return whether ONNX Runtime is installed, but not torch, without loading them."""
    return find_spec("torch") is None and find_spec("onnxruntime") is not None


def find_model(model: str | PathLike[str] | None) -> Path:
    """Return the path of a model file.

    Args:
        model: a path; or the name of a bundled model, a text without suffix and folder where no
            file has that name; None for the default model.

    Raises:
        ModelError: there is no bundled model of that name, or the path is none.

    Example:
        >>> find_model("cbagan").name
        'cbagan.pt'
    """
    if model is None:
        return bundled_model()
    path = as_path(model, ModelError)
    is_name = isinstance(model, str) and bool(_NAME.fullmatch(model))
    return bundled_model(str(model)) if is_name and not os.path.lexists(path) else path
