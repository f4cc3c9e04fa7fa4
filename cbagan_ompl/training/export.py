"""From a training checkpoint to one file that runs without this package's network code."""

from __future__ import annotations

import datetime
import hashlib
import io
import json
import zipfile
from os import PathLike
from pathlib import Path
from typing import Any

import torch
from torch import nn

from ..common.files import as_path, make_folder, read_bytes, read_text, write_atomically
from ..common.outputs import check_output
from ..errors import ModelError, show
from ..inference.model_files import (
    MANIFEST,
    MAX_MODEL_BYTES,
    MAX_NAME_LENGTH,
    RECORD_MEMBER,
    RECORD_SCHEMA,
    ModelFormat,
    is_model,
    read_manifest,
    read_record,
)
from ..networks.export_model import AnyGenerator, make_region_model
from ..sampling.guarantee import RECORD_KEY, Guarantee
from .cards import MAX_CARD_BYTES, is_card, model_card, with_guarantee
from .checkpoints import best_generator, load_checkpoint
from .model_weights import recover_generator
from .onnx_export import save_onnx
from .torchscript import save_script

INPUTS = (
    "free: float (B, 1, H, W) in [0, 1], 1 where free, any H and W; "
    "start, goal: float (B, 2), pixel coordinates (u, v), u right and v down from the upper left "
    "corner, the centre of the upper left pixel is (0.5, 0.5)"
)
OUTPUTS = "float (B, 1, H, W) in [0, 1]: probability that a pixel belongs to the promising region"


def export(
    checkpoint: str | PathLike[str],
    path: str | PathLike[str],
    *,
    note: str = "",
    force: bool = False,
) -> dict[str, Any]:
    """Write the generator of a checkpoint with its record, as TorchScript or as ONNX.

    Beside the file go a model card (the same name with suffix ``.md``) and its line in
    ``manifest.json``, which names the default model and the SHA-256 of each.

    Args:
        checkpoint: a file that :func:`cbagan_ompl.training.loop.train` wrote; or an exported model,
            whose weights are recovered, to write it in the form of this version.
        path: the file to write; its suffix is ``.pt`` for TorchScript, which torch computes, or
            ``.onnx`` for ONNX graphs, which ONNX Runtime does.
        note: what the checkpoint cannot tell, for the record and the card: the origin of the data,
            and the licences of data and model.
        force: write over files of these names that no export wrote.

    Returns:
        The record, as the file carries it.

    Raises:
        ModelError: the checkpoint cannot be read, the file cannot be written, has another suffix,
            or a name that is too long or not printable; or a file would be lost.
    """
    target = as_path(path, ModelError)
    formats = {kind.suffix: kind for kind in ModelFormat}
    if target.suffix not in formats:
        raise ModelError(f"{target}: the name of an exported model ends in {' or '.join(formats)}")
    if not target.stem.isprintable() or len(target.stem) > MAX_NAME_LENGTH:
        raise ModelError(
            f"a model cannot be called {show(target.stem)}: its name is printable and has at most "
            f"{MAX_NAME_LENGTH} characters"
        )
    generator, record = _read_source(Path(checkpoint), target.stem, note)
    make_folder(target.parent, ModelError)
    _check_outputs(target, as_path(checkpoint), force)
    model = make_region_model(generator)
    _, card, _ = exported_files(target)
    is_onnx = formats[target.suffix] is ModelFormat.ONNX
    if is_onnx:
        save_onnx(model, target, record)
    else:
        # Convolutions in this layout take four fifths of the time on a CPU.
        model.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        save_script(model, target, record)
    # Both formats of a model have one card.
    if not (is_onnx and is_card(card)):
        write_atomically(card, model_card(record), ModelError)
    _update_manifest(target, force)
    return record


def add_guarantee(path: str | PathLike[str], guarantee: Guarantee) -> dict[str, Any]:
    """Write a guarantee into the record of an exported model, its card and the manifest beside it.

    Args:
        path: of the model; nothing but its record changes.
        guarantee: from a calibration.

    Returns:
        The record.

    Raises:
        ModelError: the file is no exported model, or cannot be written.
    """
    target = as_path(path, ModelError)
    record = read_record(target) | {RECORD_KEY: guarantee.to_record()}
    source, buffer = read_bytes(target, ModelError, MAX_MODEL_BYTES), io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(source)) as old, zipfile.ZipFile(buffer, "w") as new:
        for member in old.infolist():
            is_record = member.filename.partition("/")[2] == RECORD_MEMBER
            content = json.dumps(record, indent=1).encode() if is_record else old.read(member)
            new.writestr(zipfile.ZipInfo(member.filename), content)
    write_atomically(target, buffer.getvalue(), ModelError)
    _, card, _ = exported_files(target)
    if is_card(card):
        text = with_guarantee(read_text(card, ModelError, MAX_CARD_BYTES), record)
        write_atomically(card, text, ModelError)
    _update_manifest(target, force=False)
    return record


def _read_source(path: Path, name: str, note: str) -> tuple[AnyGenerator, dict[str, Any]]:
    """Return the generator of a checkpoint or of an exported model, and the record of its export.

    Args:
        path: of the file.
        name: of the model to be written.
        note: see :func:`export`; an exported model keeps its own where there is none.
    """
    if not is_model(path):
        state = load_checkpoint(path)
        generator = best_generator(state, path)
        return generator, make_record(name, state, generator, note)
    record = read_record(path)
    record |= {"name": name, "note": note or record.get("note", ""), **_origin()}
    return recover_generator(path), record


def _origin() -> dict[str, str]:
    """Return what a record says of an export that is made now."""
    date = datetime.datetime.now(datetime.timezone.utc).date()
    return {"torch": str(torch.__version__), "date": date.isoformat()}


def exported_files(model: Path) -> tuple[Path, Path, Path]:
    """Return the files that an export writes: the model, its card and the list of models.

    Example:
        >>> [path.name for path in exported_files(Path("models/mine.pt"))]
        ['mine.pt', 'mine.md', 'manifest.json']
    """
    return model, model.parent / f"{model.stem}.md", model.parent / MANIFEST


def _check_outputs(model: Path, checkpoint: Path, force: bool) -> None:
    """Raise if a file would be overwritten that is an input, or that no export wrote."""
    kinds = is_model, is_card, _is_manifest
    for path, is_ours in zip(exported_files(model), kinds, strict=True):
        check_output(str(path), [checkpoint], force=True)
        if path.exists() and not force and not is_ours(path):
            raise ModelError(
                f"{path} exists, and `cbagan-ompl export` did not write it; choose another "
                "--output, or overwrite it with --force"
            )


def _is_manifest(path: Path) -> bool:
    try:
        return bool(read_manifest(path))
    except ModelError:
        return False


def make_record(
    name: str, state: dict[str, Any], generator: nn.Module, note: str = ""
) -> dict[str, Any]:
    """Return what a model file says about itself.

    Args:
        name: of the model.
        state: the training checkpoint.
        generator: to count its parameters.
        note: see :func:`export`.
    """
    last = state["history"][-1]
    return {
        "schema": RECORD_SCHEMA,
        "name": name,
        "inputs": INPUTS,
        "outputs": OUTPUTS,
        "working_size": state["dataset"]["side"],
        "parameters": sum(parameter.numel() for parameter in generator.parameters()),
        "recipe": state["config"],
        "epoch": last["epoch"],
        "dataset": state["dataset"],
        "note": note,
        # The test scores are there once the run has come to its end.
        "metrics": {
            "validation": last["validation"],
            "test": state.get("test"),
            "trivial": state.get("trivial"),
        },
        **_origin(),
    }


def _update_manifest(model: Path, force: bool) -> None:
    path = model.parent / MANIFEST
    manifest: dict[str, Any] = {"default": model.name, "files": {}}
    if path.exists() and not (force and not _is_manifest(path)):
        manifest = read_manifest(path)
    digest = hashlib.sha256(read_bytes(model, ModelError)).hexdigest()
    manifest["files"][model.name] = {"sha256": digest}
    write_atomically(path, json.dumps(manifest, indent=2) + "\n", ModelError)
