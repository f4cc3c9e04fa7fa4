from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import sqrtm

from cbagan_ompl import ConfigError
from cbagan_ompl.evaluation.frechet import frechet_distance, region_features


def test_frechet_distance_against_the_matrix_root() -> None:
    rng = np.random.default_rng(0)
    one = rng.normal(size=(300, 6)) @ rng.normal(size=(6, 6)) + 1
    other = rng.normal(size=(200, 6)) @ rng.normal(size=(6, 6))
    first, second = np.cov(one, rowvar=False), np.cov(other, rowvar=False)
    shift = one.mean(axis=0) - other.mean(axis=0)
    expected = shift @ shift + np.trace(first + second - 2 * sqrtm(first @ second).real)
    assert frechet_distance(one, other) == pytest.approx(expected, rel=1e-9)
    assert frechet_distance(other, one) == pytest.approx(expected, rel=1e-9)


def test_frechet_distance_of_known_gaussians() -> None:
    base = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
    assert frechet_distance(base, base) == pytest.approx(0, abs=1e-12)
    assert frechet_distance(base, base + np.array([3, 4])) == pytest.approx(25)
    # Covariance c I against 4 c I in two dimensions: 2 (sqrt(4 c) - sqrt(c))^2 = 2 c.
    assert frechet_distance(base, 2 * base) == pytest.approx(2 * 2 / 3)


def test_frechet_distance_with_fewer_images_than_features() -> None:
    rng = np.random.default_rng(0)
    assert frechet_distance(rng.normal(size=(5, 40)), rng.normal(size=(6, 40))) > 0
    with pytest.raises(ConfigError, match="at least two"):
        frechet_distance(rng.normal(size=(1, 4)), rng.normal(size=(6, 4)))


def test_region_features_tell_parts_and_holes() -> None:
    ring = np.zeros((32, 32), dtype=np.bool_)
    ring[4:12, 4:12] = True
    ring[6:10, 6:10] = False
    two = np.zeros_like(ring)
    two[2:6, 2:6] = two[20:24, 20:24] = True
    features = region_features(np.stack((ring, two, np.zeros_like(ring))))
    assert features.shape == (3, 67)
    assert np.expm1(features[:, 65]).round().tolist() == [1, 2, 0]
    assert np.expm1(features[:, 66]).round().tolist() == [1, 0, 0]
    assert features[:, :64].sum(axis=1) * 16 == pytest.approx([48, 32, 0])
