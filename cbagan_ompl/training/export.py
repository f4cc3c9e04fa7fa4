"""From a training checkpoint to one file that runs without this package's network code."""

from __future__ import annotations

import datetime
import hashlib
import json
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
    MAX_NAME_LENGTH,
    RECORD_SCHEMA,
    is_model,
    read_manifest,
    read_record,
)
from ..networks.export_model import AnyGenerator, make_region_model
from .checkpoints import best_generator, load_checkpoint
from .model_weights import recover_generator
from .torchscript import save_script

INPUTS = (
    "free: float (B, 1, H, W) in [0, 1], 1 where free, any H and W; "
    "start, goal: float (B, 2), pixel coordinates (u, v), u right and v down from the upper left "
    "corner, the centre of the upper left pixel is (0.5, 0.5)"
)
OUTPUTS = "float (B, 1, H, W) in [0, 1]: probability that a pixel belongs to the promising region"


# In every card, by which it is known as one.
_CARD_LINE = (
    "Predicts, for a 2-D occupancy map with a start and a goal, the region that good paths probably"
)
_MAX_CARD_BYTES = 2**20


def export(
    checkpoint: str | PathLike[str],
    path: str | PathLike[str],
    *,
    note: str = "",
    force: bool = False,
) -> dict[str, Any]:
    """Write the generator of a checkpoint as a TorchScript file with its record.

    Beside the file go a model card (the same name with suffix ``.md``) and its line in
    ``manifest.json``, which names the default model and the SHA-256 of each.

    Args:
        checkpoint: a file that :func:`cbagan_ompl.training.loop.train` wrote; or an exported model,
            whose weights are recovered, to write it in the form of this version.
        path: the file to write; its suffix is ``.pt``.
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
    if target.suffix != ".pt":
        raise ModelError(f"{target}: the name of an exported model ends in .pt")
    if not target.stem.isprintable() or len(target.stem) > MAX_NAME_LENGTH:
        raise ModelError(
            f"a model cannot be called {show(target.stem)}: its name is printable and has at most "
            f"{MAX_NAME_LENGTH} characters"
        )
    generator, record = _read_source(Path(checkpoint), target.stem, note)
    make_folder(target.parent, ModelError)
    _check_outputs(target, as_path(checkpoint), force)
    model = make_region_model(generator)
    # Convolutions in this layout take four fifths of the time on a CPU.
    model.to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    save_script(model, target, record)
    write_atomically(target.with_suffix(".md"), model_card(record), ModelError)
    _update_manifest(target, force)
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


def _check_outputs(model: Path, checkpoint: Path, force: bool) -> None:
    """Raise if a file would be overwritten that is an input, or that no export wrote."""
    for path, is_ours in (
        (model, is_model),
        (model.with_suffix(".md"), _is_card),
        (model.parent / MANIFEST, _is_manifest),
    ):
        check_output(str(path), [checkpoint], force=True)
        if path.exists() and not force and not is_ours(path):
            raise ModelError(
                f"{path} exists, and `cbagan-ompl export` did not write it; choose another "
                "--output, or overwrite it with --force"
            )


def _is_card(path: Path) -> bool:
    try:
        return _CARD_LINE in " ".join(read_text(path, ModelError, _MAX_CARD_BYTES).split())
    except ModelError:
        return False


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


def model_card(record: dict[str, Any]) -> str:
    """Return the record as Markdown, for people."""
    dataset, metrics = record["dataset"], record["metrics"]
    split = "test" if metrics["test"] else "validation"
    rows = {
        "this model": metrics[split],
        **((metrics["trivial"] if split == "test" else None) or {}),
    }
    columns = ("iou", "dice", "precision", "recall", "connectivity")
    table = "\n".join(
        f"| {name} | " + " | ".join(f"{scores[column]:.3f}" for column in columns) + " |"
        for name, scores in rows.items()
    )
    recipe = "\n".join(f"- `{name}`: {value}" for name, value in record["recipe"].items())
    return f"""# {record["name"]}

Predicts, for a 2-D occupancy map with a start and a goal, the region that good paths probably run
through: the generator of {_describe_network(record["recipe"])},
{_describe_training(record["recipe"])}, exported as
TorchScript on {record["date"]} with torch {record["torch"]}.

- Input: {record["inputs"]}
- Output: {record["outputs"]}
- Parameters: {record["parameters"]:,}
- Maps are scaled to {record["working_size"]} pixels on the longer side, the size of the training
  images; small ones are enlarged to twice their size at most.

## Data

{_describe_data(dataset)}

{record["note"] or "Licence and origin of the data: not stated."}

## Scores

Of the region class alone, over all pixels of the {split} tasks; connectivity is the fraction of
tasks whose start and goal one 8-connected part of the region in free space connects.

| predictor | {" | ".join(columns)} |
|---|{"---|" * len(columns)}
{table}

## Limits

The scores hold for maps like those of the training set. On other maps the region is a guess that
may miss the path, so samplers keep a fraction of uniform samples, and a planner's guarantees rest
on that fraction. The region says nothing of a robot's shape or dynamics.

## Recipe

Epoch {record["epoch"]} of:

{recipe}
"""


def _describe_data(dataset: dict[str, Any]) -> str:
    side = dataset["side"]
    if "synthetic" not in dataset:
        return (
            f"`{dataset['name']}`: {dataset['maps']} maps of {side} x {side} pixels,\n"
            f"{dataset['train_tasks']} tasks for training and validation, "
            f"{dataset['test_tasks']} for testing."
        )
    settings = dataset["synthetic"]
    return (
        f"Synthetic maps, generated during the training (`cbagan-ompl train --synthetic`, seed "
        f"{settings['seed']}):\n"
        f"{dataset['maps']} new maps of {side} x {side} pixels in each epoch with "
        f"{dataset['train_tasks']} tasks, {settings['hard_fraction']:.0%} of them\n"
        f"hard; {dataset['test_tasks']} tasks on other maps for testing. The label of a pixel "
        "falls with the detour\nthat a path through it takes, to 0.5 at "
        f"{settings['label']['epsilon']:.0%} and {settings['label']['slack']:g} pixel. "
        f"Generators: {', '.join(settings['generators'])}."
    )


def _describe_network(recipe: dict[str, Any]) -> str:
    kinds = [name for name in ("channel", "spatial", "self") if recipe.get(f"{name}_attention")]
    if kinds == ["self"]:
        return "a GAN with self-attention (SAGAN)"
    if kinds == ["channel", "spatial"]:
        return "a convolutional block attention GAN (CBAGAN-RRT)"
    return f"a GAN with {' and '.join(kinds) or 'no'} attention"


def _describe_training(recipe: dict[str, Any]) -> str:
    if not recipe.get("adversarial_weight"):
        return "trained for segmentation alone, without discriminators"
    return "trained against a map and a point discriminator"


def _update_manifest(model: Path, force: bool) -> None:
    path = model.parent / MANIFEST
    manifest: dict[str, Any] = {"default": model.name, "files": {}}
    if path.exists() and not (force and not _is_manifest(path)):
        manifest = read_manifest(path)
    digest = hashlib.sha256(read_bytes(model, ModelError)).hexdigest()
    manifest["files"][model.name] = {"sha256": digest}
    write_atomically(path, json.dumps(manifest, indent=2) + "\n", ModelError)
