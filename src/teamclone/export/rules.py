"""What a kernel may use to be translated, and the errors of one that uses something else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from teamclone.errors import TeamcloneError

RULES = {
    "statement": "assignments, if, while, break, continue, return; for over range, arrays, enumerate, zip, tuples",
    "expression": "arithmetic, comparisons, and, or, not, if else, indices, calls, tuples; lists in np.array alone",
    "call": "kernels, NamedTuples, and the functions and methods that `calls` has, with the arguments that it takes",
    "index": "numbers, slices and np.newaxis; or one array of whole numbers or truths alone",
    "type": "numbers, arrays of a fixed rank, NamedTuples and tuples of these; operations on elements of one type",
    "variable": "a variable keeps its type; a value of another one gets another name",
    "constant": "what is outside of a kernel is read only: numbers, and tuples, NamedTuples and arrays of them",
    "order": "a call that changes an array has nothing beside it in its expression that reads or changes arrays",
    "sort": "sorts are stable, kind='mergesort': others leave open how equal keys are ordered",
    "recursion": "no kernel calls itself, not through others either",
}
"""What is allowed, by the name of the rule."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """What a kernel must not use.

    Attributes:
        file, line: where it stands. kernel: its name. rule: the key in RULES. text: what is wrong.
    """

    file: Path
    line: int
    kernel: str
    rule: str
    text: str

    def __str__(self) -> str:
        """Return where the problem is, what it is, and what is allowed."""
        return f"{self.file}, line {self.line}: {self.kernel}: {self.text}. Allowed are {RULES[self.rule]}"


class KernelError(TeamcloneError):
    """Kernels that cannot be translated.

    Attributes:
        problems: all that were found.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("\n".join(map(str, problems)))
        self.problems = tuple(problems)


class RejectedError(Exception):
    """Ends the translation of a statement; its problem is noted, or follows from one that is."""
