"""Exported model files, with clear errors for files that are no models.

All checks here come before torch opens a file: TorchScript archives may carry code, and torch
believes what they say of their tensors.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import warnings
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..common.files import read_bytes, read_text
from ..errors import ModelError, show
from ..networks.config import MAX_IMAGE_SIZE, MAX_WEIGHTS
from .archives import MAX_EXPANSION, Archive, pack
from .onnx_graphs import OnnxGraphs
from .tensor_pickles import check_group

if TYPE_CHECKING:
    import torch

MANIFEST = "manifest.json"

#: Name of the record inside an exported file, and the newest version of it that is understood.
RECORD_NAME = "cbagan_ompl.json"
RECORD_SCHEMA = 1

#: Largest model file: that of a network with :data:`.networks.config.MAX_WEIGHTS`, and its code.
MAX_MODEL_BYTES = 4 * MAX_WEIGHTS + MAX_EXPANSION

#: Largest TorchScript file of another origin, such as an Inception network.
MAX_SCRIPT_BYTES = 2**28

#: Methods of a module that is exported in parts, see
#: :class:`cbagan_ompl.networks.export_model.SplitModel`; ``forward`` is all of them together.
SPLIT_METHODS = ("read_map", "encode", "paint")
#: The same of :class:`cbagan_ompl.networks.export_model.PassageModel`.
PASSAGE_METHODS = ("read_map", "paint")

#: Most characters of a model's name.
MAX_NAME_LENGTH = 100

_MAX_RECORD_BYTES, _MAX_MANIFEST_BYTES = 2**18, 2**20

# What every record of this version has, with its type and its largest value or length.
_REQUIRED = {
    "schema": (int, RECORD_SCHEMA),
    "working_size": (int, MAX_IMAGE_SIZE),
    "name": (str, MAX_NAME_LENGTH),
    "parameters": (int, MAX_WEIGHTS),
}

# Members of an archive: the record, what torch reads, and what it only looks at after errors.
RECORD_MEMBER = f"extra/{RECORD_NAME}"
_SCRIPT = ("data.pkl", "data/", "constants.pkl", "constants/", "code/", "version", "byteorder")
_DEBUG = ".debug_pkl"
_TENSORS = ("data", "constants")

_DAMAGED = "the file is damaged", "copy or export it again"

_SHA256 = re.compile(r"[0-9a-f]{64}")

#: How a model file is made, for messages.
EXPORT_HINT = "export one with: cbagan-ompl export CHECKPOINT --output MODEL.pt"


def read_manifest(path: Path) -> dict[str, Any]:
    """Read the list of models in a folder.

    Args:
        path: of the list.

    Returns:
        ``{"default": NAME, "files": {NAME: {"sha256": ...}}}``.

    Raises:
        ModelError: it cannot be read, or has another form.
    """
    text = read_text(path, ModelError, _MAX_MANIFEST_BYTES)
    try:
        manifest = json.loads(text)
    except Exception as error:  # deep nesting is a RecursionError
        detail = str(error) or type(error).__name__
        raise ModelError(f"{path}: cannot read the list of models ({detail})") from error
    if not (
        isinstance(manifest, dict)
        and isinstance(manifest.get("default"), str)
        and isinstance(manifest.get("files"), dict)
        and all(map(_is_manifest_entry, manifest["files"].values()))
    ):
        raise ModelError(
            f"{path}: not a list of models, it needs the keys default and files, and the SHA-256 "
            "of each file"
        )
    return manifest


def _is_manifest_entry(entry: object) -> bool:
    return (
        isinstance(entry, dict)
        and isinstance(entry.get("sha256"), str)
        and _SHA256.fullmatch(entry["sha256"]) is not None
    )


class ModelFormat(str, Enum):
    """What a model is written as."""

    TORCHSCRIPT = "torchscript"
    ONNX = "onnx"

    @property
    def suffix(self) -> str:
        """Of the file."""
        return ".onnx" if self is ModelFormat.ONNX else ".pt"


class ModelFile(NamedTuple):
    """An exported model whose file has been checked.

    Attributes:
        record: what it says about itself.
        content: an archive of what computes it: TorchScript without what torch does not need, or
            ONNX graphs, ``NAME.onnx``.
        is_listed: whether a ``manifest.json`` beside it lists the file as it is.
        format: of the content.
    """

    record: dict[str, Any]
    content: bytes
    is_listed: bool
    format: ModelFormat


def read_model(path: Path) -> ModelFile:
    """Read an exported model, and check all of it that can be checked without running it.

    That is: size and form of the archive, the checksums of its members, the record, the length of
    each tensor, and the SHA-256 where a ``manifest.json`` beside the file lists it.

    Raises:
        ModelError: the file is missing, no model of this package, damaged, or of a newer version;
            the message tells these apart and says what to do.
    """
    data = _read_file(path)
    is_listed = _check_listed(path, data)
    if not zipfile.is_zipfile(io.BytesIO(data)):
        raise ModelError(_explain_no_zip(path, data[:1024]))
    with translate_damage(path, *_DAMAGED):
        archive = Archive(data)
    if RECORD_MEMBER not in archive.sizes:
        raise ModelError(_explain_no_record(path, archive.sizes))
    with translate_damage(path, *_DAMAGED):
        text = archive.read(RECORD_MEMBER, _MAX_RECORD_BYTES)
    record = _parse_record(path, text)
    with translate_damage(path, *_DAMAGED):
        graphs = [name for name in archive.sizes if name.endswith(ModelFormat.ONNX.suffix)]
        if graphs:
            content = pack({name: archive.read(name, archive.sizes[name]) for name in graphs})
            return ModelFile(record, content, is_listed, ModelFormat.ONNX)
        return ModelFile(record, _checked_script(archive), is_listed, ModelFormat.TORCHSCRIPT)


def is_model(path: Path) -> bool:
    """Return whether a file is an exported model, perhaps a damaged one."""
    try:
        return RECORD_MEMBER in Archive(read_bytes(path, ModelError, MAX_MODEL_BYTES)).sizes
    except Exception:  # zipfile lets many types through
        return False


def read_record(path: Path) -> dict[str, Any]:
    """Return what an exported model says about itself; errors as for :func:`read_model`."""
    return read_model(path).record


def read_script(path: Path) -> bytes:
    """Return the archive of any TorchScript file, after a check of the length of each tensor.

    Raises:
        ModelError: the file is missing, no TorchScript file, or damaged.
    """
    data = read_bytes(path, ModelError, MAX_SCRIPT_BYTES)
    with translate_damage(path, "it is no TorchScript file, or a damaged one"):
        return _checked_script(Archive(data))


def _checked_script(archive: Archive) -> bytes:
    """Return the TorchScript of an archive as an archive of its own."""
    script = {
        name: archive.read(name, max(archive.sizes[name], MAX_EXPANSION))
        for name in archive.sizes
        if name.startswith(_SCRIPT) and not name.endswith(_DEBUG)
    }
    for group in _TENSORS:
        check_group(archive, group)
    return pack(script)


@contextmanager
def translate_damage(path: Path, text: str, cure: str = "") -> Iterator[None]:
    """Raise a ModelError for any error of the block, which checks a file.

    Args:
        path: of the file.
        text: what the file is then.
        cure: what to do then.
    """
    try:
        yield
    except Exception as error:  # zipfile, pickletools and torch let many types through
        detail = str(error).partition("\n")[0] or type(error).__name__
        raise ModelError(f"{path}: {text} ({detail}){cure and '; '}{cure}") from error


def load_graphs(content: bytes) -> OnnxGraphs:
    """Load an archive of ONNX graphs that has been checked; ONNX Runtime must be installed.

    Raises:
        Exception: of many types, for damaged graphs.
    """
    archive, suffix = Archive(content), ModelFormat.ONNX.suffix
    sizes = archive.sizes.items()
    return OnnxGraphs({name.removesuffix(suffix): archive.read(name, n) for name, n in sizes})


def load_script(script: bytes) -> torch.nn.Module:
    """Load a TorchScript archive that has been checked; torch must be installed.

    Raises:
        Exception: of many types, for damaged and for foreign files.
    """
    import torch

    with warnings.catch_warnings():
        # TorchScript is deprecated, see training/torchscript.
        warnings.simplefilter("ignore", DeprecationWarning)
        module: torch.nn.Module = torch.jit.load(io.BytesIO(script), map_location="cpu")  # type: ignore[no-untyped-call]
    return module


def _read_file(path: Path) -> bytes:
    try:
        missing = not path.exists()
    except OSError:  # such as a name that is too long, which reading tells
        missing = False
    if missing:
        raise ModelError(f"{path}: no such file; check the path, or {EXPORT_HINT}")
    data = read_bytes(path, ModelError, MAX_MODEL_BYTES)
    if not data:
        raise ModelError(f"{path}: the file is empty; copy it again, or {EXPORT_HINT}")
    return data


def _check_listed(path: Path, data: bytes) -> bool:
    """Return whether a manifest lists a file; raise if it does with another SHA-256."""
    manifest = path.parent / MANIFEST
    if not manifest.is_file():
        return False
    try:
        entry = read_manifest(manifest)["files"].get(path.name)
    except ModelError:
        return False  # other programs have files of that name, too
    if entry is None:
        return False
    if entry["sha256"] != hashlib.sha256(data).hexdigest():
        raise ModelError(
            f"{path}: SHA-256 differs from the one in {manifest.name} beside it, so the file is "
            "damaged or was replaced; install the package again, or export the model again"
        )
    return True


def _explain_no_zip(path: Path, head: bytes) -> str:
    if head.startswith(b"PK"):
        return f"{path}: the file is cut short; copy it again, or {EXPORT_HINT}"
    try:
        text = head.decode("utf-8")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        return f"{path}: not an exported model; {EXPORT_HINT}"
    return f"{path}: a text file, not an exported model; {EXPORT_HINT}"


def _explain_no_record(path: Path, names: Iterable[str]) -> str:
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
    return f"{path}: a zip archive, but not an exported model; {EXPORT_HINT}"


def _parse_record(path: Path, text: bytes) -> dict[str, Any]:
    try:
        record = json.loads(text)
    except Exception as error:  # deep nesting is a RecursionError
        detail = str(error) or type(error).__name__
        raise ModelError(f"{path}: the record {RECORD_NAME} is damaged ({detail})") from error
    record = record if isinstance(record, dict) else {}
    schema = record.get("schema")
    if type(schema) is int and schema > RECORD_SCHEMA:
        raise ModelError(
            f"{path}: the model's record has version {show(schema)}, this package understands up "
            f"to {RECORD_SCHEMA}; install a newer cbagan-ompl (git pull in the clone)"
        )
    wrong = [
        name
        for name, (kind, _) in _REQUIRED.items()
        if type(record.get(name)) is not kind or (kind is int and record[name] < 1)
    ]
    if wrong:
        raise ModelError(
            f"{path}: the record {RECORD_NAME} lacks {', '.join(wrong)}; export the model again"
        )
    for name, (kind, most) in _REQUIRED.items():
        value = record[name]
        if (len(value) if kind is str else value) > most:
            raise ModelError(
                f"{path}: the record {RECORD_NAME} asks for {name} {show(value)}, the most is "
                f"{most}{' characters' if kind is str else ''}"
            )
    return dict(record)
