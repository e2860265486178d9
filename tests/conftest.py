"""Configuration of all tests: hypothesis's profile, windows that nobody sees, one thread, markers, kernels, the arm."""

import gc
import os
import signal

# Small networks and matrices lose more by handing work between threads than they gain; processes started here agree.
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ["SDL_VIDEODRIVER"] = "dummy"

import pytest
from hypothesis import HealthCheck, settings

from elbow_gym import paper_arm, simulator
from elbow_gym.kernel.build import kernel
from tests.support.kernel_calls import shared

# What is imported while tests are collected is no garbage. Looking through it would take 3 % of the time of them all.
gc.disable()
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


def pytest_collection_finish():
    """Starts to look for garbage, but in what comes from now on."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Lets simulators with some switches on step in the kernel that has all of them, but for what is soak or timing.

    By the classical method they step in plain Python. Each kernel takes 7 to 14 s of CPU to compile. That a switch
    which has nothing to do changes no bit, that every kernel has the bits of its source, and which kernel a simulator
    asks for are laws of their own.
    """
    own = item.get_closest_marker("soak") or item.get_closest_marker("timing")
    simulator.kernel = kernel if own else shared


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
