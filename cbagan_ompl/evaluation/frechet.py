"""The Frechet distance between two sets of images, by the mean and covariance of their features.

With features of the Inception network it is the Frechet inception distance, FID: Heusel et al.,
"GANs trained by a two time-scale update rule converge to a local Nash equilibrium", 2017,
https://arxiv.org/abs/1706.08500. The CBAGAN-RRT paper reports the FID. It needs the weights of that
network, which this package does not have, but reads from a file. Without them the features are
:func:`region_features`, and the result is not an FID and cannot be compared with one.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigError, ModelError

if TYPE_CHECKING:
    import torch

#: Number of blocks along each side of the image, see :func:`region_features`.
BLOCKS = 8
#: Name of the distance with :func:`region_features`, and with those of a network.
REGION_GRID_NAME, INCEPTION_NAME = "region-grid Frechet distance (not FID)", "FID"

_BATCH = 50


def frechet_distance(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Return the squared Frechet distance between two Gaussians fitted to features.

    With means m1, m2 and covariances S1, S2 it is

        d^2 = |m1 - m2|^2 + trace(S1 + S2 - 2 (S1 S2)^(1/2)).

    The trace of (S1 S2)^(1/2) is computed as the sum of the square roots of the eigenvalues of
    R S2 R with R = S1^(1/2), which is symmetric and has the eigenvalues of S1 S2.

    Args:
        one: features, (N, F), N at least 2.
        other: features, (M, F), M at least 2.

    Raises:
        ConfigError: one of the sets has fewer than two images.

    Example:
        >>> features = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
        >>> round(frechet_distance(features, features + 3), 6)
        18.0
    """
    if min(len(one), len(other)) < 2:
        raise ConfigError("a Frechet distance needs at least two images in each set")
    means = [features.mean(axis=0, dtype=np.float64) for features in (one, other)]
    first, second = (
        np.atleast_2d(np.cov(features.astype(np.float64), rowvar=False))
        for features in (one, other)
    )
    root = _matrix_root(first)
    eigenvalues = np.linalg.eigvalsh(root @ second @ root)
    trace = np.trace(first) + np.trace(second) - 2 * np.sqrt(np.maximum(eigenvalues, 0)).sum()
    return float(((means[0] - means[1]) ** 2).sum() + max(trace, 0.0))


def _matrix_root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the symmetric square root of a covariance, (F, F)."""
    values, vectors = np.linalg.eigh(covariance)
    root: NDArray[np.float64] = (vectors * np.sqrt(np.maximum(values, 0))) @ vectors.T
    return root


def region_features(regions: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return features of regions: where they lie, their border, their parts and their holes.

    Args:
        regions: (N, H, W), true in the region.

    Returns:
        (N, 67): the fraction of each of 8 x 8 blocks that lies in the region, the number of border
        pixels divided by H, log(1 + number of parts), log(1 + number of holes). Parts are
        8-connected, holes 4-connected.
    """
    features = []
    for region in regions.astype(np.uint8):
        fractions = cv2.resize(
            region.astype(np.float32), (BLOCKS, BLOCKS), interpolation=cv2.INTER_AREA
        )
        border = (region - cv2.erode(region, np.ones((3, 3), np.uint8))).sum() / region.shape[0]
        parts = cv2.connectedComponents(region, connectivity=8)[0] - 1
        holes = cv2.connectedComponents(np.pad(1 - region, 1, constant_values=1), connectivity=4)[0]
        features.append([*fractions.ravel(), border, np.log1p(parts), np.log1p(holes - 2)])
    return np.array(features)


def inception_features(
    regions: NDArray[np.bool_], path: str | PathLike[str]
) -> NDArray[np.float64]:
    """Return features of region images (green on white) by a network from a file.

    Args:
        regions: (N, H, W), true in the region.
        path: a TorchScript file that maps uint8 images (B, 3, 299, 299), red, green, blue, 0 to
            255, to features (B, F). For an FID in the usual sense it is the Inception-v3 network
            of the TensorFlow FID code with its pool3 features (F = 2048).

    Returns:
        (N, F).

    Raises:
        MissingDependencyError: torch is not installed.
        ModelError: the file is no such network.
    """
    from ..common.validation import require_torch
    from ..inference.model_files import load_script, read_script
    from ..inference.probe import Kind, try_model

    require_torch()
    import torch

    expected = "it must be a TorchScript file that maps uint8 images (B, 3, 299, 299) to (B, F)"
    try:
        script = read_script(Path(path))
        try_model(str(path), script, Kind.INCEPTION, 299)
    except ModelError as error:
        raise ModelError(f"{error}; {expected}") from error
    try:
        network = load_script(script)
        with torch.inference_mode():
            features = [
                network(_region_images(regions[i : i + _BATCH]))
                for i in range(0, len(regions), _BATCH)
            ]
        result: NDArray[np.float64] = torch.cat(features).double().numpy()
    except Exception as error:  # torch raises many types for inputs that do not fit
        raise ModelError(
            f"{path}: cannot compute features with it ({type(error).__name__}); {expected}"
        ) from error
    if result.ndim != 2 or len(result) != len(regions) or not np.isfinite(result).all():
        raise ModelError(
            f"{path}: gives features of shape {result.shape}, or some that are not finite; "
            f"{expected}"
        )
    return result


def _region_images(regions: NDArray[np.bool_]) -> torch.Tensor:
    """Return images of regions, green on white, (B, 3, 299, 299)."""
    import torch

    pixels = np.where(regions[..., None], (0, 255, 0), (255, 255, 255)).astype(np.uint8)
    resized = [cv2.resize(image, (299, 299), interpolation=cv2.INTER_LINEAR) for image in pixels]
    return torch.from_numpy(np.stack(resized)).permute(0, 3, 1, 2)
