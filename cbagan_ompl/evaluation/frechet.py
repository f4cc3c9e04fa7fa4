"""The Frechet distance between two sets of images, by the mean and covariance of their features.

The paper reports it with features of the Inception network ("FID"). Those need weights that this
package does not have; whoever has them gives them as a file. Without it the features are
:func:`region_features`, and the result is not an FID and cannot be compared with one.
"""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigError, ModelError

if TYPE_CHECKING:
    import torch

#: Regions are seen as shares of this many blocks along each side.
BLOCKS = 8
#: The name of the distance with our features, and with those of a file.
OWN_NAME, INCEPTION_NAME = "region-grid Frechet distance (not FID)", "FID"

_BATCH = 50


def frechet_distance(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """d^2 = |m1 - m2|^2 + Tr(S1 + S2 - 2 (S1 S2)^(1/2)) (eq. fid_score).

    The trace of the root of S1 S2 is the sum of the roots of its eigenvalues, which are those of
    the symmetric R S2 R with R the root of S1.

    Args:
        one: features, (N, F), N at least 2.
        other: features, (M, F), M at least 2.

    Raises:
        ConfigError: there are fewer than two images on a side.
    """
    if min(len(one), len(other)) < 2:
        raise ConfigError("a Frechet distance needs at least two images on each side")
    means = [features.mean(axis=0, dtype=np.float64) for features in (one, other)]
    first, second = (
        np.atleast_2d(np.cov(features.astype(np.float64), rowvar=False))
        for features in (one, other)
    )
    root = _root(first)
    shared = np.linalg.eigvalsh(root @ second @ root)
    trace = np.trace(first) + np.trace(second) - 2 * np.sqrt(np.maximum(shared, 0)).sum()
    return float(((means[0] - means[1]) ** 2).sum() + max(trace, 0.0))


def _root(covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """The symmetric square root of a covariance."""
    values, vectors = np.linalg.eigh(covariance)
    root: NDArray[np.float64] = (vectors * np.sqrt(np.maximum(values, 0))) @ vectors.T
    return root


def region_features(regions: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Features of regions: where they are, how ragged, and of how many parts and holes.

    Args:
        regions: (N, H, W).

    Returns:
        (N, 67): the share of the region in each of 8 x 8 blocks, its border pixels in sides of
        the image, its parts and its holes, these two through log(1 + n).
    """
    features = []
    for region in regions.astype(np.uint8):
        shares = cv2.resize(
            region.astype(np.float32), (BLOCKS, BLOCKS), interpolation=cv2.INTER_AREA
        )
        border = (region - cv2.erode(region, np.ones((3, 3), np.uint8))).sum() / region.shape[0]
        parts = cv2.connectedComponents(region, connectivity=8)[0] - 1
        holes = cv2.connectedComponents(np.pad(1 - region, 1, constant_values=1), connectivity=4)[0]
        features.append([*shares.ravel(), border, np.log1p(parts), np.log1p(holes - 2)])
    return np.array(features)


def inception_features(
    regions: NDArray[np.bool_], path: str | PathLike[str]
) -> NDArray[np.float64]:
    """Features of the region images (green on white) by a network of the user's.

    Args:
        regions: (N, H, W).
        path: a TorchScript file that maps uint8 images (B, 3, 299, 299), red, green, blue, 0 to
            255, to features (B, F). For an FID in the usual sense it is the Inception-v3 network
            of the TensorFlow FID code with its pool3 features (F = 2048).

    Raises:
        MissingDependencyError: torch is not installed.
        ModelError: the file cannot be used so.
    """
    from ..common.validation import require_torch
    from ..inference.model_files import load_script

    require_torch()
    import torch

    try:
        network = load_script(path)
        with torch.inference_mode():
            features = [
                network(_images(regions[i : i + _BATCH])) for i in range(0, len(regions), _BATCH)
            ]
        result: NDArray[np.float64] = torch.cat(features).double().numpy()
    except Exception as error:  # torch raises many types for files and inputs that do not fit
        raise ModelError(
            f"{path}: cannot compute features with it ({type(error).__name__}); it must be a "
            "TorchScript file that maps uint8 images (B, 3, 299, 299) to (B, F)"
        ) from error
    if result.ndim != 2:
        raise ModelError(f"{path}: gives features of shape {result.shape}, expected (B, F)")
    return result


def _images(regions: NDArray[np.bool_]) -> torch.Tensor:
    """Green on white, (B, 3, 299, 299)."""
    import torch

    pixels = np.where(regions[..., None], (0, 255, 0), (255, 255, 255)).astype(np.uint8)
    resized = [cv2.resize(image, (299, 299), interpolation=cv2.INTER_LINEAR) for image in pixels]
    return torch.from_numpy(np.stack(resized)).permute(0, 3, 1, 2)
