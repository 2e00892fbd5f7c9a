from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import pytest

from teamclone.errors import UsageError
from teamclone.system.settings import (
    assignment,
    described,
    from_table,
    setting,
    table_of,
    to_toml,
    value_of,
    without_effect,
)


class Colour(StrEnum):
    RED = "red"
    BLUE = "blue"


def even(values: tuple[int, ...]) -> str | None:
    return None if sum(values) % 2 == 0 else f"an even sum, got {sum(values)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    name: str
    count: int = setting(3, at_least=1, at_most=9)
    share: float = setting(0.5, above=0, below=1)
    switch: bool = False
    colour: Colour = Colour.RED
    words: tuple[str, ...] = setting(("a",), choices=("a", "b", "c"))
    free: tuple[str, ...] = ()
    numbers: tuple[int, ...] = setting((1, 1), items=2, rule=even)
    colours: tuple[Colour, ...] = ()
    some: tuple[int, ...] = setting((1,), some=True)

    def problems(self, key: str) -> list[str]:
        return without_effect(self, key, ("share",), f"{key}.switch = true") if self.switch else []


def read(table: Any) -> tuple[Any, list[str]]:
    problems: list[str] = []
    return from_table(Settings, table, "it", problems), problems


def test_a_table_becomes_the_dataclass_and_a_table_again() -> None:
    text = """
    name = "x"
    count = 9
    share = 0.25
    colour = "blue"
    words = ["c", "a"]
    free = "one, with a comma"
    numbers = [3, 5]
    colours = ["blue", "red"]
    """
    made, problems = read(tomllib.loads(text))
    assert problems == []
    assert made == Settings(
        name="x",
        count=9,
        share=0.25,
        colour=Colour.BLUE,
        words=("c", "a"),
        free=("one, with a comma",),
        numbers=(3, 5),
        colours=(Colour.BLUE, Colour.RED),
    )
    again = tomllib.loads(to_toml({"it": table_of(made)}))["it"]
    assert read(again) == (made, [])


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        ({"count": 0}, "it.count: expected at least 1, got 0"),
        ({"count": 10}, "it.count: expected at most 9, got 10"),
        ({"count": True}, "it.count: expected a whole number, got True"),
        ({"count": 2.0}, "it.count: expected a whole number, got 2.0"),
        ({"share": 0}, "it.share: expected a number above 0, got 0.0"),
        ({"share": 1}, "it.share: expected a number below 1, got 1.0"),
        ({"share": math.nan}, "it.share: expected a number above 0, got nan"),
        ({"switch": 1}, "it.switch: expected true or false, got 1"),
        ({"colour": "rde"}, "it.colour: no 'rde'; did you mean red?"),
        ({"colour": [1]}, "it.colour: no [1]; choose from red, blue"),
        ({"colours": "gren"}, "it.colours: no 'gren'; choose from red, blue"),
        ({"words": "a,d"}, "it.words: no 'd'; choose from a, b, c"),
        ({"words": ["a", "a"]}, "it.words: names one more than once: a, a"),
        ({"words": {}}, "it.words: expected a word, got {}"),
        ({"numbers": [2]}, "it.numbers: expected 2 values, got [2]"),
        ({"numbers": [2, 3]}, "it.numbers: expected an even sum, got 5"),
        ({"numbers": "2,,4"}, "it.numbers: expected a value on both sides of each comma, got '2,,4'"),
        ({"numbers": "2, 4,"}, "it.numbers: expected a value on both sides of each comma, got '2, 4,'"),
        ({"numbers": ",2,4"}, "it.numbers: expected a value on both sides of each comma, got ',2,4'"),
        ({"numbers": "2, ,4"}, "it.numbers: expected a value on both sides of each comma, got '2, ,4'"),
        ({"words": "a,,b"}, "it.words: expected a value on both sides of each comma, got 'a,,b'"),
        ({"some": ","}, "it.some: expected a value on both sides of each comma, got ','"),
        ({"some": []}, "it.some: expected at least one value, got none"),
        ({"some": ""}, "it.some: expected at least one value, got none"),
        ({"nmae": 1}, "no setting it.nmae; did you mean name?"),
        (
            {"switch": True, "share": 0.1},
            "it.share has no effect with it.switch = true; leave it out, or set it to 0.5",
        ),
    ],
)
def test_what_does_not_fit_is_named_and_left_out(table: dict[str, Any], problem: str) -> None:
    made, problems = read({"name": "x", **table})
    assert problems == [problem]
    if "no effect" not in problem:
        assert made == Settings(name="x")


def test_a_former_name_is_answered_with_the_present_one() -> None:
    problems: list[str] = []
    former = {"it.number": "other.count", "other.nmae": "it.name"}
    made = from_table(Settings, {"name": "x", "number": 2, "nmae": 1}, "it", problems, renamed=former)
    assert problems == [
        "no setting it.number; it.number is now other.count",
        "no setting it.nmae; did you mean name?",
    ]
    assert made == Settings(name="x")


def test_all_mistakes_are_reported_together() -> None:
    made, problems = read({"count": 0, "share": 2, "other": 1})
    assert len(problems) == 4
    assert "it.name: expected a value, got none" in problems
    assert made == Settings(name="")
    assert read([1])[1] == ["it: expected a table, got [1]", "it.name: expected a value, got none"]


@pytest.mark.parametrize(
    ("text", "value"), [("1", 1), ("1e-3", 1e-3), ("true", True), ("[1, 2]", [1, 2]), ("word", "word"), ("", "")]
)
def test_values_of_texts(text: str, value: object) -> None:
    assert value_of(text) == value
    assert assignment(f" a.b = {text} ") == ("a.b", value)


def test_an_assignment_needs_an_equals_sign() -> None:
    with pytest.raises(UsageError, match="--option: expected KEY=VALUE, got 'a'"):
        assignment("a", option="--option")


def test_settings_are_described() -> None:
    rows = {one.name: (one.values, one.default) for one in described(Settings)}
    assert rows["name"] == ("word", "")
    assert rows["count"] == ("whole number, at least 1, at most 9", "3")
    assert rows["share"] == ("number, above 0, below 1", "0.5")
    assert rows["switch"] == ("switch", "false")
    assert rows["colour"] == ("`red`, `blue`", '"red"')
    assert rows["words"] == ("list: `a`, `b`, `c`", '["a"]')
