from __future__ import annotations

from cbagan_ompl.datasets.dataset import Dataset
from cbagan_ompl.evaluation.evaluator import Evaluator
from cbagan_ompl.evaluation.frechet import region_features
from cbagan_ompl.evaluation.report import markdown


def test_a_row_for_each_prediction(dataset: Dataset) -> None:
    tasks = dataset.test
    evaluator = Evaluator(tasks, region_features, seed=0)
    truth = evaluator.evaluate("truth", tasks.region.astype(bool))
    network = evaluator.evaluate(
        "network", tasks.free, {"parameters": 1234, "inference_ms": 5.67, "batched_ms": 1.0}
    )
    header, line, first, second = markdown([truth, network], "distance").splitlines()
    assert header.startswith("|  | IoU | Dice | precision | recall | connected (8) |")
    assert header.endswith("| distance | parameters | inference |")
    assert header.count("|") == line.count("|") == first.count("|") == second.count("|")
    assert first.startswith("| truth | 1.000 [1.000, 1.000] |")
    assert first.endswith("|  |  |")
    assert second.endswith("| 1,234 | 5.7 ms |")
