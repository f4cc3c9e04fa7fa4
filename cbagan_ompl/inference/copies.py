"""Model files sent to another machine, which has no file of this one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..common.files import read_bytes
from ..errors import ModelError
from .model_files import MANIFEST, MAX_MODEL_BYTES

#: Content of files by their names.
Files = Mapping[str, bytes]


def read_copy(path: Path) -> Files:
    """Return a model and the manifest beside it, which says whether it must be tried first.

    Args:
        path: of the model.

    Raises:
        ModelError: a file cannot be read.
    """
    files = {path.name: read_bytes(path, ModelError, MAX_MODEL_BYTES)}
    manifest = path.with_name(MANIFEST)
    if manifest.is_file():
        files[MANIFEST] = read_bytes(manifest, ModelError, MAX_MODEL_BYTES)
    return files


def write_files(folder: Path, files: Files) -> Path:
    """Write files into a new folder, and return the path of the first.

    Args:
        folder: made with its parents.
        files: such as those of :func:`read_copy`.
    """
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return folder / next(iter(files))
