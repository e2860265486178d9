"""Adam over one tensor of parameters: torch's, up to rounding."""

import pytest

pytest.importorskip("torch")

import torch

from agents.learning.flat_adam import FlatAdam


def parameters():
    torch.manual_seed(0)
    return [torch.nn.Parameter(torch.randn(shape)) for shape in ((3, 5), (17,), (1,), (4, 4))]


def test_steps_are_those_of_torch():
    own, theirs = parameters(), parameters()
    optimizer, reference = FlatAdam(own, lr=0.1, eps=1e-5), torch.optim.Adam(theirs, lr=0.1, eps=1e-5)
    for k in range(30):
        for adam, parts in ((optimizer, own), (reference, theirs)):
            adam.param_groups[0]["lr"] = 0.1 / (1 + k)
            adam.zero_grad()
            sum(((part - k % 3) ** 2).sum() for part in parts).backward()
            if adam is optimizer:
                adam.clip(1.0)
            else:
                torch.nn.utils.clip_grad_norm_(parts, 1.0)
            adam.step()
    for one, other in zip(own, theirs, strict=True):
        torch.testing.assert_close(one, other, rtol=1e-5, atol=1e-6)
        assert one.grad is not None
        torch.testing.assert_close(one.grad, other.grad, rtol=1e-5, atol=1e-6)


def test_short_gradients_are_not_scaled():
    parts = parameters()
    optimizer = FlatAdam(parts, lr=0.1)
    parts[2].grad.fill_(0.5)
    optimizer.clip(1.0)
    assert optimizer.gradient.norm() == 0.5
    optimizer.clip(0.25)
    assert optimizer.gradient.norm().item() == pytest.approx(0.25, rel=1e-5)


def test_gradients_come_back_to_their_places_after_another_optimizer():
    parts = parameters()
    optimizer = FlatAdam(parts, lr=0.1)
    torch.optim.Adam(parts).zero_grad(set_to_none=True)
    optimizer.zero_grad()
    sum(part.sum() for part in parts).backward()
    assert optimizer.gradient.sum() == sum(part.numel() for part in parts)


def test_state_goes_on_bit_for_bit_and_fits_its_own_size_alone():
    def step(optimizer, count):
        for k in range(count):
            optimizer.gradient.copy_(torch.sin(optimizer.values + k))
            optimizer.step()

    whole, before, after = (FlatAdam(parameters(), lr=0.1) for _ in range(3))
    step(whole, 3)
    step(whole, 2)
    step(before, 3)
    after.values.copy_(before.values)
    after.load_state_dict(before.state_dict())
    step(after, 2)
    assert torch.equal(after.values, whole.values)
    with pytest.raises(ValueError, match="state must be of 48 parameters, got 80"):
        FlatAdam(parameters()[:2], lr=0.1).load_state_dict(whole.state_dict())


def test_places_are_those_of_its_own_parameters():
    parts = parameters()
    optimizer = FlatAdam(parts, lr=0.1)
    for part in parts:
        first = optimizer.place(part)
        assert torch.equal(optimizer.values[first : first + part.numel()].view_as(part), part)
    with pytest.raises(ValueError, match=r"parameter must be one of the optimizer's, got one of shape \(17,\)"):
        optimizer.place(parameters()[1])
