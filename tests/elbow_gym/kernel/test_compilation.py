"""Compilations: told where they take long, and the compiler and the collector left as they were."""

import gc
import time

import pytest

from elbow_gym import ElbowArmEnv
from elbow_gym.kernel import compilation


class Context:
    """A typing context that counts its searches."""

    searches = 0

    def resolve_function_type(self, function, args, kws):
        self.searches += 1
        return None if function == "unknown" else (function, *args, *kws)


def test_an_answer_is_searched_for_once_and_none_is_no_answer(monkeypatch):
    monkeypatch.setattr(compilation, "_answers", {})
    context = Context()
    with compilation.remembered(context):
        for _ in range(3):
            assert context.resolve_function_type("+", (1, 2), {}) == ("+", 1, 2)
        assert context.searches == 1
        for _ in range(2):
            assert context.resolve_function_type("unknown", (1,), {}) is None
        assert context.searches == 3
        assert context.resolve_function_type("+", (1,), {"x": 2}) == ("+", 1, "x")
        assert context.resolve_function_type("+", (1,), {}) == ("+", 1)
        for _ in range(2):
            assert context.resolve_function_type("index", (1, [2]), {}) == ("index", 1, [2])
        assert context.searches == 7
    for _ in range(2):
        context.resolve_function_type("+", (1, 2), {})
    assert context.searches == 9


@compilation.compiling(Context())
def fail():
    raise ArithmeticError(str(gc.isenabled()))


@pytest.mark.parametrize("enabled", [True, False])
def test_the_collector_is_as_it_was_after_a_failed_compilation_too(enabled):
    was = gc.isenabled()
    try:
        (gc.enable if enabled else gc.disable)()
        with pytest.raises(ArithmeticError, match="False"):
            fail()
        assert gc.isenabled() == enabled
    finally:
        (gc.enable if was else gc.disable)()


def test_a_long_compilation_is_told_and_a_short_one_is_not(monkeypatch, capsys):
    with compilation.announced():
        pass
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(compilation, "PATIENCE", 0.0)
    with compilation.announced():
        time.sleep(0.2)
    assert capsys.readouterr().err.startswith("elbow_gym: compiling for this machine, once")


def test_resets_and_steps_of_a_compiled_kernel_announce_nothing(monkeypatch):
    env = ElbowArmEnv()
    env.reset(seed=0)
    env.step(env.action_space.sample())

    def refuse(*_, **__):
        raise AssertionError("an announcement")

    monkeypatch.setattr(compilation, "Timer", refuse)
    env.reset()
    env.step(env.action_space.sample())
