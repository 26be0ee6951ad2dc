"""Timing with a clock that is set."""

from __future__ import annotations

import numpy as np

from tolstat.benchmarks.timing import Times, in_turn


def test_tasks_take_turns_and_the_first_round_does_not_count():
    now, order = [0.0], []

    def task(name, seconds):
        order.append(name)
        now[0] += seconds * (100 if len(order) <= 2 else 1)  # the first round loads things
        return len(order)

    done = in_turn({"a": lambda: task("a", 1.0), "b": lambda: task("b", 3.0)}, 3, lambda: now[0])
    assert order == ["a", "b"] * 4
    assert (done.typical("a"), done.least("b"), done.ratio("b", "a")) == (1.0, 3.0, 3.0)
    assert len(done.seconds["a"]) == 3
    assert done.returned == {"a": 7, "b": 8}


def test_a_ratio_is_taken_round_by_round():
    slow = Times({"a": np.array([1.0, 10.0, 2.0]), "b": np.array([2.0, 20.0, 4.0])}, {})
    assert slow.ratio("b", "a") == 2.0
