"""A thing whose faces are lit as no light of the model is: residuals are wrong all over a face, not pixel by pixel."""

import numpy as np
import pytest

from airborne.tracking.model_based.pose_descent import PoseEquations
from airborne.tracking.model_based.twist_equations import merge_blocks


def equations(blocks):
    """Return the equations of one segment whose every degree of freedom is known, without noise."""
    return PoseEquations(
        pose=None, A=np.eye(6), g=np.zeros(6), J=np.eye(6)[None], blocks=[blocks], shifted=[], cost=0.0, noise=1e-12,
        misfit=0.0, shared=0.0, noise_of_views=(),
    )  # fmt: skip


def pulls(rng, shape, *, along):
    """Return blocks that pull along one degree of freedom, here one way and there another."""
    blocks = np.zeros((*shape, 1, 6))
    blocks[..., 0, along] = rng.normal(0, 1e-3, shape)
    return blocks


def test_a_pull_of_a_whole_face_counts_as_one_error_and_noise_counts_as_before():
    rng, n, noise, faces = np.random.default_rng(1), 200, [], []
    for _ in range(n):
        noise.append(equations(pulls(rng, (16, 16), along=0)).covariance()[0, 0])
        of_face = np.repeat(np.repeat(pulls(rng, (4, 4), along=0), 4, axis=0), 4, axis=1)
        faces.append(equations(of_face).covariance()[0, 0])
    assert np.mean(noise) == pytest.approx(256e-6, rel=0.05)  # the sum of 256 independent pulls
    assert np.mean(faces) == pytest.approx(16 * 256e-6, rel=0.05)  # of 16 of 16 times that size


def test_patches_hold_all_that_the_blocks_held_and_are_at_most_so_many():
    blocks = np.zeros((20, 30, 2, 6))
    blocks[3:14, 7:9] = np.random.default_rng(2).normal(size=(11, 2, 2, 6))
    merged = merge_blocks(blocks, 4)
    assert merged.shape[0] <= 4 and merged.shape[1] <= 4
    np.testing.assert_allclose(merged.sum(axis=(0, 1)), blocks.sum(axis=(0, 1)))
    assert not merge_blocks(np.zeros((3, 3, 1, 6)), 4).any()
