"""Predictions stored in the layout of the published ones."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from cbagan_ompl.datasets.dataset import label_files


def store(folder: Path, dataset: Path, regions: np.ndarray, listed: bool) -> Path:
    lines = ["true_roi,pred_roi,iou"]
    for k, (label, region) in enumerate(zip(label_files(dataset, "test"), regions, strict=True)):
        name = f"roi_{k}.png" if listed else f"{label.parent.name}/{label.name}"
        image = np.full((*region.shape, 3), 250, np.uint8)
        image[region > 0] = (10, 240, 20)
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(folder / name), image)
        lines.append(f"dataset/tasks/{label.parent.name}/{label.name},results/{name},0.5")
    if listed:
        (folder / "results.csv").write_text("\n".join(lines) + "\n")
    return folder
