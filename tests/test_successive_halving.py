"""A few steps with all, on with what is near."""

from concurrent.futures import ThreadPoolExecutor

from ers_mj.solvers.successive_halving import Stage, carried_on, halved


def each(function, items):
    return [function(item) for item in items]


def test_what_is_near_goes_on_and_in_the_order_that_was_kept():
    steps = []

    def toward(goal):
        return lambda x: steps.append(x) or (x + goal) / 2.0

    stages = [Stage(toward(0.0), lambda ended: sorted(ended)[:2]), Stage(toward(8.0))]
    assert halved([9.0, 1.0, 5.0], stages, each) == [4.25, 5.25]
    assert steps == [9.0, 1.0, 5.0, 0.5, 2.5]
    assert halved([], stages, each) == [] and halved([3.0, 1.0], [], each) == [3.0, 1.0]


def test_nothing_left_is_nothing_to_go_on_with():
    assert halved([1.0, 2.0], [Stage(lambda x: x, lambda ended: []), Stage(lambda x: 1 / 0)], each) == []


def test_everything_that_was_begun_ends_though_only_what_is_near_goes_on():
    ends = carried_on([1, 2, 3], lambda x: 10 * x, lambda x: x < 25, lambda x: x + 1, each)
    assert ends == [11, 21, 30]


def test_threads_change_nothing():
    stages = [Stage(lambda x: x * x, lambda ended: [x for x in ended if x % 2]), Stage(lambda x: x + 1)]
    with ThreadPoolExecutor(4) as pool:
        side_by_side = halved(range(50), stages, lambda f, items: list(pool.map(f, items)))
    assert side_by_side == halved(range(50), stages, each) == [k * k + 1 for k in range(1, 50, 2)]
