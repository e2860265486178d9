"""What all tests share: a deterministic hypothesis profile, windows that nobody sees, and the paper's arm."""

import os

import pytest
from hypothesis import HealthCheck, settings

from elbow_gym import paper_arm

settings.register_profile(
    "elbow_gym",
    derandomize=True,
    deadline=None,
    max_examples=50,
    print_blob=False,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("elbow_gym")
os.environ["SDL_VIDEODRIVER"] = "dummy"


@pytest.fixture(scope="session")
def arm():
    """The paper's arm; frozen, so one for all tests."""
    return paper_arm()
