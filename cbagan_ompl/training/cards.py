"""Model cards: what the record of an exported model says, for people."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..common.files import read_text
from ..errors import ModelError
from ..sampling.guarantee import Guarantee

# In every card, by which it is known as one.
_CARD_LINE = (
    "Predicts, for a 2-D occupancy map with a start and a goal, the region that good paths probably"
)

#: Largest card.
MAX_CARD_BYTES = 2**20

_GUARANTEE, _LIMITS = "## Guarantee", "## Limits"


def is_card(path: Path) -> bool:
    """Return whether a file is the card of an exported model."""
    try:
        return _CARD_LINE in " ".join(read_text(path, ModelError, MAX_CARD_BYTES).split())
    except ModelError:
        return False


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

{guarantee_section(record)}## Limits

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


def guarantee_section(record: dict[str, Any]) -> str:
    """Return the section of a card on the guarantee in a record; empty where it has none."""
    guarantee = Guarantee.from_record(record)
    if guarantee is None:
        return ""
    families = ", ".join(f"{name} {value:.3f}" for name, value in guarantee.families.items())
    return f"""{_GUARANTEE}

The free pixels with a value of at least {guarantee.threshold:.3f}, and those of start and goal,
hold a path at most {guarantee.within:.0%} longer than the shortest one, with a probability of at
least {guarantee.probability:.0%}: for predictions with repair, on tasks like the {guarantee.maps}
that this was calibrated on (generated maps, one task on each; `scripts/calibrate.py`). It is no
statement on maps of other kinds. Calibrated for each kind by itself: {families}.

"""


def with_guarantee(card: str, record: dict[str, Any]) -> str:
    """Return a card with the section on the guarantee in a record, in place of the one it had."""
    before, _, rest = card.partition(_GUARANTEE)
    after = rest[rest.index(_LIMITS) :] if rest else _LIMITS + before.partition(_LIMITS)[2]
    return before.partition(_LIMITS)[0] + guarantee_section(record) + after
