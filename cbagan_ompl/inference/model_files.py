"""Exported model files: where the bundled one is, and clear errors for files that are no models.

All checks here come before torch opens a file, because TorchScript archives may carry code.
"""

from __future__ import annotations

import hashlib
import json
import warnings
import zipfile
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..common.files import read_bytes, read_text, reason
from ..errors import ModelError

if TYPE_CHECKING:
    import torch

MANIFEST = "manifest.json"

#: Name of the record inside an exported file, and the newest version of it that is understood.
RECORD_NAME = "cbagan_ompl.json"
RECORD_SCHEMA = 1

# What every record of this version has, with its type.
_REQUIRED = {"schema": int, "working_size": int, "name": str, "parameters": int}

_EXPORT_HINT = "export one with: cbagan-ompl export CHECKPOINT --output MODEL.pt"


def bundled_model() -> Path:
    """Return the path of the default model, which comes with the package.

    Raises:
        ModelError: this installation has none.
    """
    package = Path(__file__).resolve().parent.parent
    # An installed wheel has the folder inside the package, a checkout beside it.
    for folder in (package / "models", package.parent / "models"):
        if (folder / MANIFEST).is_file():
            return folder / str(read_manifest(folder / MANIFEST)["default"])
    raise ModelError(f"this installation has no bundled model; {_EXPORT_HINT}, and give its path")


def read_manifest(path: Path) -> dict[str, Any]:
    """Read the list of models in a folder.

    Args:
        path: of the list.

    Returns:
        ``{"default": NAME, "files": {NAME: {"sha256": ...}}}``.

    Raises:
        ModelError: it cannot be read, or has another form.
    """
    try:
        manifest = json.loads(read_text(path, ModelError))
    except ValueError as error:
        raise ModelError(f"{path}: cannot read the list of models ({error})") from error
    if not (
        isinstance(manifest, dict)
        and isinstance(manifest.get("default"), str)
        and isinstance(manifest.get("files"), dict)
        and all(isinstance(entry, dict) for entry in manifest["files"].values())
    ):
        raise ModelError(f"{path}: not a list of models, it needs the keys default and files")
    return manifest


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal.

    Raises:
        ModelError: the file cannot be read.
    """
    return hashlib.sha256(read_bytes(path, ModelError)).hexdigest()


def read_record(path: Path) -> dict[str, Any]:
    """Check that a file is an exported model, and return what it says about itself.

    Where a ``manifest.json`` beside the file lists it, the SHA-256 must agree as well.

    Raises:
        ModelError: the file is missing, no model of this package, damaged, or of a newer version;
            the message tells these apart and says what to do.
    """
    _check_readable(path)
    _check_listed(path)
    if not zipfile.is_zipfile(path):
        raise ModelError(_explain_no_zip(path))
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            record = next((name for name in names if name.endswith(f"/extra/{RECORD_NAME}")), None)
            text = archive.read(record) if record else None
    except (OSError, zipfile.BadZipFile) as error:
        raise ModelError(
            f"{path}: the file is damaged ({error}); copy or export it again"
        ) from error
    if text is None:
        raise ModelError(_explain_no_record(path, names))
    return _parse_record(path, text)


def load_script(path: str | PathLike[str]) -> torch.nn.Module:
    """Load a TorchScript file; torch must be installed.

    Raises:
        Exception: of many types, for damaged and for foreign files.
    """
    import torch

    with warnings.catch_warnings():
        # TorchScript is deprecated, see save_script in training/export.
        warnings.simplefilter("ignore", DeprecationWarning)
        module: torch.nn.Module = torch.jit.load(str(path), map_location="cpu")  # type: ignore[no-untyped-call]
    return module


def _check_readable(path: Path) -> None:
    try:
        if path.is_dir():
            raise ModelError(f"{path} is a folder; give the model file in it (.pt)")
        with path.open("rb") as file:
            empty = not file.read(1)
    except FileNotFoundError as error:
        raise ModelError(f"{path}: no such file; check the path, or {_EXPORT_HINT}") from error
    # A path with a NUL character is a ValueError.
    except (OSError, ValueError) as error:
        raise ModelError(f"{path}: cannot read the file ({reason(error)})") from error
    if empty:
        raise ModelError(f"{path}: the file is empty; copy it again, or {_EXPORT_HINT}")


def _check_listed(path: Path) -> None:
    manifest = path.parent / MANIFEST
    if not manifest.is_file():
        return
    expected = read_manifest(manifest)["files"].get(path.name, {}).get("sha256")
    if expected is not None and sha256(path) != expected:
        raise ModelError(
            f"{path}: SHA-256 differs from the one in {manifest.name} beside it, so the file is "
            "damaged or was replaced; install the package again, or export the model again"
        )


def _explain_no_zip(path: Path) -> str:
    with path.open("rb") as file:
        head = file.read(1024)
    if head.startswith(b"PK"):
        return f"{path}: the file is cut short; copy it again, or {_EXPORT_HINT}"
    try:
        head.decode("utf-8")
    except UnicodeDecodeError:
        return f"{path}: not an exported model; {_EXPORT_HINT}"
    if b"\0" in head:
        return f"{path}: not an exported model; {_EXPORT_HINT}"
    return f"{path}: a text file, not an exported model; {_EXPORT_HINT}"


def _explain_no_record(path: Path, names: list[str]) -> str:
    entries = {name.rpartition("/")[2] for name in names}
    if "constants.pkl" in entries:
        return (
            f"{path}: a TorchScript file, but not one that `cbagan-ompl export` wrote: "
            f"it has no {RECORD_NAME} inside"
        )
    if "data.pkl" in entries:
        return (
            f"{path}: a training checkpoint or bare weights, not an exported model; "
            f"run: cbagan-ompl export {path} --output MODEL.pt"
        )
    return f"{path}: a zip archive, but not an exported model; {_EXPORT_HINT}"


def _parse_record(path: Path, text: bytes) -> dict[str, Any]:
    try:
        record = json.loads(text)
    except ValueError as error:
        raise ModelError(f"{path}: the record {RECORD_NAME} is damaged ({error})") from error
    record = record if isinstance(record, dict) else {}
    schema = record.get("schema")
    if type(schema) is int and schema > RECORD_SCHEMA:
        raise ModelError(
            f"{path}: the model's record has version {schema}, this package understands up to "
            f"{RECORD_SCHEMA}; install a newer cbagan-ompl (pip install -U cbagan-ompl)"
        )
    wrong = [name for name, kind in _REQUIRED.items() if type(record.get(name)) is not kind]
    if not wrong and record["working_size"] < 1:
        wrong = ["working_size"]
    if wrong:
        raise ModelError(
            f"{path}: the record {RECORD_NAME} lacks {', '.join(wrong)}; export the model again"
        )
    return dict(record)
