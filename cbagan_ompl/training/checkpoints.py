"""Checkpoint files of a training run: written whole or not at all, read without running code."""

from __future__ import annotations

import io
import json
from os import PathLike
from pathlib import Path
from typing import Any

import torch

from ..common.files import as_path, write_atomically
from ..errors import ModelError, show
from ..inference.model_files import translate_damage
from ..networks.config import MAX_IMAGE_SIZE
from ..networks.export_model import AnyGenerator
from ..networks.factory import check_weights, make_generator
from .checkpoint_files import read_checkpoint
from .config import TrainingConfig

#: Version of the form of a checkpoint; it goes up when the name of an option or a weight changes.
SCHEMA = 4

_SCORES = dict.fromkeys(("iou", "dice", "precision", "recall", "connectivity"), float)
_GENERATORS = ("generator", "average")
_DISCRIMINATORS = ("map_discriminator", "point_discriminator")
_SYNTHETIC = {
    "seed": int,
    "hard_fraction": float,
    "label": {"epsilon": float, "slack": float},
    "generators": [str],
}

# What a checkpoint has at least: a mapping with these keys, a list of some items, a number in a
# range, a value of a type.
_FORM: dict[str, Any] = {
    "config": {},
    "dataset": {
        "name": str,
        "maps": int,
        "side": range(1, MAX_IMAGE_SIZE + 1),
        "train_tasks": int,
        "test_tasks": int,
    },
    "gan": {name: {} for name in (*_GENERATORS, "optimizers")},
    "rng": str,
    "noise_rng": torch.Tensor,
    "history": [{"epoch": int, "losses": {}, "validation": _SCORES}],
}

# What goes into the log, the record of a model and its card.
_DESCRIPTIONS = ("config", "dataset", "history", "test", "trivial")


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
        ModelError: the file is missing, no training checkpoint, damaged, or of another version.
    """
    source = as_path(path, ModelError)
    data = read_checkpoint(source)
    with translate_damage(source, "not a training checkpoint, or a damaged one"):
        state: Any = torch.load(io.BytesIO(data), map_location="cpu", weights_only=True)
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
            "(git pull in the clone)"
        )
    _check_form(state, source)
    with translate_damage(source, "damaged, its configuration is none"):
        config = TrainingConfig().updated(state["config"])
    return {**state, "config": config.to_dict()}


def best_generator(state: dict[str, Any], path: str | PathLike[str] = "checkpoint") -> AnyGenerator:
    """Return the generator that the epoch of a checkpoint was validated with, in evaluation mode.

    Args:
        state: from :func:`load_checkpoint`.
        path: of the checkpoint, for messages.

    Raises:
        ModelError: the weights do not fit the configuration.
    """
    with translate_damage(Path(path), "damaged, its weights do not fit its configuration"):
        config = TrainingConfig().updated(state["config"])
        check_weights(config.network)
        generator = make_generator(config.network)
        generator.load_state_dict(state["gan"]["average" if config.ema_decay else "generator"])
    return generator.eval()


def _check_form(state: dict[str, Any], path: Path) -> None:
    form, networks = dict(_FORM), [*_GENERATORS]
    if isinstance(state.get("config"), dict) and state["config"].get("adversarial_weight", 1):
        networks += _DISCRIMINATORS
        form["gan"] = form["gan"] | {name: {} for name in _DISCRIMINATORS}
    if state.get("test") is not None:
        form |= {"test": _SCORES, "trivial": {}}
    wrong = _find_mismatch(state, form)
    if wrong is None and "synthetic" in state["dataset"]:
        wrong = _find_mismatch(state["dataset"]["synthetic"], _SYNTHETIC)
    if wrong is None and state.get("trivial") is not None:
        wrong = _find_mismatch(state["trivial"], dict.fromkeys(state["trivial"], _SCORES))
    if wrong is not None:
        raise ModelError(f"{path}: damaged, its entry {wrong} is missing or of another kind")
    for name in networks:
        for key, weights in state["gan"][name].items():
            if not isinstance(weights, torch.Tensor) or not torch.isfinite(weights).all():
                raise ModelError(f"{path}: damaged, the weights {show(key)} are not finite numbers")
    with translate_damage(path, "damaged, it has values where texts and numbers should be"):
        json.dumps([state.get(name) for name in _DESCRIPTIONS])


def _find_mismatch(value: Any, form: Any, name: str = "") -> str | None:
    """Return the name of the first part of a value that has not the form of ``_FORM``, if any."""
    if isinstance(form, dict):
        if not isinstance(value, dict):
            return name
        parts = [(f"{name}.{key}".lstrip("."), value.get(key), form[key]) for key in form]
    elif isinstance(form, list):
        if not isinstance(value, list) or not value:
            return name
        parts = [(f"{name}[{i}]", item, form[0]) for i, item in enumerate(value)]
    elif isinstance(form, range):
        return None if type(value) is int and value in form else name
    else:
        is_right = type(value) is form or (form is torch.Tensor and isinstance(value, form))
        return None if is_right else name
    found = (_find_mismatch(item, part, label) for label, item, part in parts)
    return next((label for label in found if label is not None), None)
