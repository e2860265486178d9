"""Compiled networks: what torch computes and records, up to rounding."""

import copy
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("torch")

import torch
from torch import nn

from agents.learning.fit import Fit, _gradient, compile_fit
from agents.learning.flat_adam import FlatAdam
from agents.learning.layers import KINDS, kind_of, outputs, places_of
from agents.learning.passes import ROWS, room_for

ACTIVATIONS = pytest.mark.parametrize("activation", list(KINDS), ids=lambda kind: kind.__name__)


def network(activation, *widths):
    torch.manual_seed(0)
    layers = [part for pair in pairwise(widths) for part in (nn.Linear(*pair), activation())]
    return nn.Sequential(*layers[:-1])


@ACTIVATIONS
@pytest.mark.parametrize("rows", [1, ROWS - 1, ROWS + 1, 2 * ROWS])
@pytest.mark.parametrize("widths", [(7, 20, 5, 3), (7, 33, 1), (7, 3)], ids=str)
def test_outputs_are_those_of_torch(activation, rows, widths):
    layers = network(activation, *widths)
    optimizer = FlatAdam(layers.parameters(), lr=0.0)
    places = places_of(layers, optimizer.place)
    x = 3.0 * np.random.default_rng(0).normal(size=(rows, widths[0])).astype(np.float32)
    own = outputs(x, optimizer.values.numpy(), places, kind_of(layers), room_for(places))
    with torch.no_grad():
        np.testing.assert_allclose(own, layers(torch.from_numpy(x)), rtol=1e-5, atol=3e-6)


@ACTIVATIONS
def test_functions_are_those_of_torch_at_all_sizes(activation):
    """One input, weights of one and no bias: the hidden layer's values come out as they are."""
    parameters, places = np.zeros(64, np.float32), np.array([(0, 16, 1, 1), (32, 48, 1, 1)])
    parameters[[0, 32]] = 1.0
    sizes = np.geomspace(1e-6, 1e4, 4000)
    x = np.concatenate([-sizes, sizes]).astype(np.float32)[:, None]
    own = outputs(x, parameters, places, KINDS[activation], room_for(places)).astype(float)
    exact = activation()(torch.from_numpy(x.astype(float))).numpy()
    # SiLU multiplies x by a share that is rounded where 1 is.
    assert np.max(np.abs(own - exact) / (2e-7 * np.minimum(np.abs(x), 16.0) + 2e-7 * np.abs(exact))) < 1.0


@ACTIVATIONS
@pytest.mark.parametrize("squashed", [True, False])
def test_steps_of_a_fit_are_those_of_torch(activation, squashed):
    own, rng = network(activation, 7, 20, 5, 3), np.random.default_rng(0)
    reference = copy.deepcopy(own)
    adam, fit = torch.optim.Adam(reference.parameters()), Fit(own, squashed)
    x, y = (rng.normal(size=(400, size)).astype(np.float32) for size in (7, 3))
    for rate in (0.01, 0.02, 0.005):
        batch = rng.integers(400, size=2 * ROWS + 40)
        fit.step(batch, x, y, rate)
        found = reference(torch.from_numpy(x[batch]))
        adam.param_groups[0]["lr"] = rate
        adam.zero_grad()
        ((torch.tanh(found) if squashed else found) - torch.from_numpy(y[batch])).square().mean().backward()
        adam.step()
    for one, other in zip(own.parameters(), reference.parameters(), strict=True):
        torch.testing.assert_close(one, other, rtol=1e-4, atol=1e-5)


def test_a_fit_compiles_nothing_after_its_loops():
    """Whatever is called has the same types: there is one compiled form."""
    compile_fit()
    Fit(network(nn.Tanh, 3, 2)).step(np.arange(4), np.ones((4, 3), np.float32), np.ones((4, 2), np.float32), 0.1)
    assert len(_gradient.signatures) == 1


def test_what_compiles_the_loops_needs_no_torch():
    code = "import agents.learning.fit, agents.learning.ppo.gradient, sys; print('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout == "False\n"
