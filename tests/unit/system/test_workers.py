"""Tasks over processes. ``eval`` is a function that any process can be sent."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from teamclone.system.workers import DIED, run_tasks

DIE = "__import__('os').kill(__import__('os').getpid(), 9)"
WAIT = "__import__('time').sleep(0.05)"


def test_every_task_is_answered() -> None:
    assert dict(run_tasks(eval, [f"{n} * {n}" for n in range(9)], jobs=2)) == {f"{n} * {n}": n * n for n in range(9)}


def test_one_job_stays_in_this_process() -> None:
    tasks = ["__import__('os').getpid()", "1"]
    assert list(run_tasks(eval, tasks, jobs=1)) == [(tasks[0], os.getpid()), ("1", 1)]
    assert list(run_tasks(eval, tasks[:1], jobs=8)) == [(tasks[0], os.getpid())]
    assert list(run_tasks(eval, [], jobs=2)) == []


def test_results_come_in_the_order_of_the_tasks_where_it_is_asked() -> None:
    tasks = [f"({WAIT} if {n} % 4 == 0 else 0, {n})[1]" for n in range(12)]
    assert [result for _, result in run_tasks(eval, tasks, jobs=3, in_order=True)] == list(range(12))


@pytest.mark.parametrize("in_order", [False, True])
def test_an_executor_is_not_given_more_than_is_taken(in_order: bool) -> None:
    started: list[int] = []
    with ThreadPoolExecutor(4) as executor:
        for number, _ in run_tasks(started.append, range(30), executor=executor, ahead=5, in_order=in_order):
            time.sleep(0.002)
            if in_order:
                assert max(started) <= number + 5
    assert sorted(started) == list(range(30))


def test_who_stops_early_leaves_nothing_running() -> None:
    started: list[int] = []
    with ThreadPoolExecutor(1) as executor:
        tasks = run_tasks(started.append, range(30), executor=executor, ahead=4)
        next(tasks)
        tasks.close()
        before = len(started)
    assert before == len(started) <= 5


def test_a_process_that_died_once_is_tried_again(tmp_path: Path) -> None:
    """The task kills its process unless it finds the mark that it left then."""
    mark = f"__import__('pathlib').Path({str(tmp_path / 'mark')!r})"
    task = f"5 if {mark}.exists() else ({mark}.touch(), {DIE})"
    assert dict(run_tasks(eval, [task, "1", "2"], jobs=2)) == {task: 5, "1": 1, "2": 2}


def test_a_death_costs_only_its_own_task() -> None:
    tasks = ["1", DIE, *(f"({WAIT}, {n})[1]" for n in range(4)), f"{DIE} or 2", "3"]
    results = dict(run_tasks(eval, tasks, jobs=2))
    assert {task for task, result in results.items() if result is DIED} == {
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
