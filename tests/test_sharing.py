import pytest

from elbow_gym.sharing import Sharing


@pytest.mark.parametrize(("arms", "lanes", "threads"), [(1, 1, 1), (5, 1, 3), (16, 16, 4), (40, 16, 2), (100, 16, 3)])
def test_every_arm_is_in_one_share_and_no_block_is_cut(arms, lanes, threads):
    shares = []

    def work(first, end):
        shares.append((first, end))
        return end - first

    assert Sharing(arms, lanes, threads).total(work) == arms
    assert len(shares) == min(threads, -(-arms // lanes))
    assert sorted(i for first, end in shares for i in range(first, end)) == list(range(arms))
    assert all(first % lanes == 0 for first, _ in shares)


def test_an_error_in_another_thread_is_raised_here():
    def work(first, end):
        if first > 0:
            raise ArithmeticError("the second share")
        return 0

    with pytest.raises(ArithmeticError, match="the second share"):
        Sharing(2, 1, 2).total(work)
