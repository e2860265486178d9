"""Configuration of all tests: hypothesis's profile, windows that nobody sees, one thread, markers, kernels, the arm."""

import os
import signal

# Small networks and matrices lose more by handing work between threads than they gain; processes started here agree.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ["SDL_VIDEODRIVER"] = "dummy"

import pytest
from hypothesis import HealthCheck, settings

from elbow_gym import paper_arm
from elbow_gym.kernel.build import kernel
from tests.support.kernel_calls import shared

settings.register_profile(
    "elbow_gym",
    derandomize=True,
    deadline=None,
    max_examples=50,
    print_blob=False,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("elbow_gym")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Marks what is soak or timing as slow, too, before `-m` chooses."""
    for item in items:
        if item.get_closest_marker("soak") or item.get_closest_marker("timing"):
            item.add_marker("slow")


@pytest.fixture(scope="session", autouse=True)
def _shared_kernels():
    """Simulators with some switches on step in the kernel that has all of them.

    Each kernel takes 8 to 17 s of CPU to compile. That a switch which has nothing to do changes no bit, and that every
    kernel has the bits of its source, are laws of their own (laws/test_switches.py).
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("elbow_gym.simulator.kernel", shared)
        yield


@pytest.fixture(autouse=True)
def _own_kernels_in_soak(request, monkeypatch):
    """What is soak steps in the kernels that users have."""
    if request.node.get_closest_marker("soak") or request.node.get_closest_marker("timing"):
        monkeypatch.setattr("elbow_gym.simulator.kernel", kernel)


@pytest.fixture(scope="session")
def arm():
    """The paper's arm; frozen, so one for all tests."""
    return paper_arm()


@pytest.fixture
def interruptible():
    """Ctrl-C interrupts and a lost terminal ends, also where a shell's background or nohup has them ignored."""
    usual = {"SIGINT": signal.default_int_handler, "SIGHUP": signal.SIG_DFL}
    before = {
        getattr(signal, name): signal.signal(getattr(signal, name), handler)
        for name, handler in usual.items()
        if hasattr(signal, name)
    }
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
