"""Tasks over processes. ``eval`` is a function that any process can be sent."""

from __future__ import annotations

import os

import pytest

from teamclone.store.workers import DIED, run_tasks

DIE = "__import__('os').kill(__import__('os').getpid(), 9)"
WAIT = "__import__('time').sleep(0.05)"


def test_every_task_is_answered() -> None:
    assert dict(run_tasks(eval, [f"{n} * {n}" for n in range(9)], jobs=2)) == {f"{n} * {n}": n * n for n in range(9)}


def test_one_job_stays_in_this_process() -> None:
    tasks = ["__import__('os').getpid()", "1"]
    assert list(run_tasks(eval, tasks, jobs=1)) == [(tasks[0], os.getpid()), ("1", 1)]
    assert list(run_tasks(eval, tasks[:1], jobs=8)) == [(tasks[0], os.getpid())]
    assert list(run_tasks(eval, [], jobs=2)) == []


def test_a_death_costs_only_its_own_task() -> None:
    tasks = ["1", DIE, *(f"({WAIT}, {n})[1]" for n in range(4)), f"{DIE} or 2", "3"]
    results = dict(run_tasks(eval, tasks, jobs=2))
    assert {task for task, result in results.items() if result is DIED or type(result).__name__ == "Died"} == {
        DIE,
        f"{DIE} or 2",
    }
    assert results["1"] == 1
    assert results["3"] == 3
    assert results[tasks[5]] == 3
    assert len(results) == len(tasks)


def test_an_error_is_raised_here() -> None:
    with pytest.raises(ZeroDivisionError):
        list(run_tasks(eval, ["1 / 0", "1", "2"], jobs=2))
