from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from helpers.tiny_model import export_tiny_model
from helpers.training_set import write_training_set

from cbagan_ompl import GridMap, ModelError, load_model
from cbagan_ompl.inference.model_files import read_record
from cbagan_ompl.sampling.guarantee import Guarantee
from cbagan_ompl.training.cards import guarantee_section
from cbagan_ompl.training.export import add_guarantee, export

GUARANTEE = Guarantee(0.375, 0.95, 0.05, 80, {"maze": 0.25, "city": 0.5})
TASK = (1.5, 1.5), (28.5, 30.5)


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    dataset = write_training_set(tmp_path_factory.mktemp("data") / "tiny")
    return export_tiny_model(dataset, tmp_path_factory.mktemp("models"))


@pytest.fixture
def model(exported: Path, tmp_path: Path) -> Path:
    shutil.copytree(exported.parent, tmp_path / "models")
    return tmp_path / "models" / exported.name


def test_predictions_carry_the_guarantee_of_their_model(model: Path) -> None:
    grid = GridMap(np.ones((32, 32)))
    before = load_model(model)
    assert before.guarantee is None
    expected = before.predict(grid, *TASK)
    assert expected.guarantee is None
    record = add_guarantee(model, GUARANTEE)
    after = load_model(model)  # its line in the manifest is that of the new file
    assert after.guarantee == GUARANTEE
    assert after.record == record == before.record | {"guarantee": GUARANTEE.to_record()}
    heatmap = after.predict(grid, *TASK)
    assert heatmap.guarantee == GUARANTEE
    assert np.array_equal(heatmap.values, expected.values)
    assert all(h.guarantee == GUARANTEE for h in after.predict_many(grid, TASK, TASK[::-1]))
    assert after.predict(grid, *TASK, repair=False).guarantee is None


def test_the_card_says_it_once(model: Path) -> None:
    card = model.with_suffix(".md")
    before = card.read_text()
    add_guarantee(model, GUARANTEE)
    once = card.read_text()
    assert once.count("## Guarantee") == 1
    assert "maze 0.250, city 0.500" in once
    add_guarantee(model, Guarantee(0.5, 0.9, 0.1, 40))
    assert "at least 0.500" in card.read_text()
    assert card.read_text().replace(guarantee_section(read_record(model)), "") == before


def test_another_export_keeps_it(model: Path, tmp_path: Path) -> None:
    add_guarantee(model, GUARANTEE)
    export(model, tmp_path / "again.pt")
    assert load_model(tmp_path / "again.pt").guarantee == GUARANTEE
    assert "maze 0.250" in (tmp_path / "again.md").read_text()


@pytest.mark.parametrize(
    "change",
    [
        {"threshold": 1.5},
        {"threshold": "0.5"},
        {"probability": None},
        {"within": -1},
        {"maps": 0},
        {"maps": 2.5},
        {"families": [0.5]},
        {"families": {"maze": 3}},
        {"more": 1},
    ],
)
def test_records_with_a_guarantee_without_sense(change: dict[str, Any]) -> None:
    record = {"guarantee": GUARANTEE.to_record() | change}
    with pytest.raises(ModelError, match="a guarantee that makes no sense"):
        Guarantee.from_record(record)


@pytest.mark.parametrize("value", [3, "text", [], {}, {"threshold": 0.5}])
def test_what_is_no_guarantee(value: object) -> None:
    with pytest.raises(ModelError, match="a guarantee that makes no sense"):
        Guarantee.from_record({"guarantee": value})
    assert Guarantee.from_record({}) is None
