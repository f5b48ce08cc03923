"""A few of the random scenes of :mod:`fuzz`: every recorded index is the one that dense linear algebra counts."""

from __future__ import annotations

import fuzz
import pytest

SEED, COUNT = 1, 12
SCENES = list(fuzz.scenes(SEED, COUNT))


@pytest.mark.alone
@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_every_row_has_the_index_of_dense_matrices(scene: fuzz.Scene) -> None:
    finding = fuzz.examine(scene)
    assert finding.rows > finding.unclear
    assert finding.wrong == []
    assert not any("symmetry" in sentence for sentence in finding.said)  # none is claimed that is none


@pytest.mark.alone
def test_scenes_with_cosh_energies_claim_no_symmetry() -> None:
    """A generic state of great curvature would hide all forces but its own: a thrust on a sliding end, say."""
    chosen = [s for s in fuzz.scenes(SEED, 60) if s.name in ("column 24", "column 34", "ring 47, radial")]
    assert len(chosen) == 3
    for scene in chosen:
        finding = fuzz.examine(scene)
        assert (finding.wrong, finding.said) == ([], [])
