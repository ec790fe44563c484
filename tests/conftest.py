"""What every test may use: real data where it is at hand, and one fixed source of randomness."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

# How long an example takes says more about the machine than about the code.
settings.register_profile("mimique", deadline=None)
settings.load_profile("mimique")

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real rigs, performances and recordings; the test is skipped, visibly, where it is absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"real data is not at hand ({SHARED_DATA})")
    return SHARED_DATA


@pytest.fixture
def rng() -> np.random.Generator:
    """Give the same random numbers in every run."""
    return np.random.default_rng(20261122)
