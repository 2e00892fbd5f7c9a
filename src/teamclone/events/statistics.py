"""What the events of a match say of its teams, in numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.events.definitions import EventKind, Outcome
from teamclone.events.touches import Bools
from teamclone.logs.match import Columns


def _of(unit: str, about: str) -> Any:
    return field(metadata={"unit": unit, "about": about})


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamStatistics:
    """The numbers of one team in one match, NaN where there is none; `described` has unit and meaning of each."""

    goals: int = _of("", "goals of the team, the other team's own goals included")
    shots: int = _of("", "shots, those that scored included")
    shots_on_target: int = _of("", "of them scored, saved or blocked on the way between the posts")
    expected_goals: float = _of("goals", "sum over the shots of the chance of each to score, where it is known")
    possession: float = _of("share", "of the cycles of play_on in which either team has the ball")
    passes: int = _of("", "passes of any outcome but `restart`")
    passes_completed: int = _of("", "of them completed")
    pass_completion: float = _of("share", "of the passes that were completed")
    pass_length: float = _of("m", "mean length of the completed passes")
    through_passes: int = _of("", "through passes")
    through_passes_completed: int = _of("", "of them completed")
    interceptions: int = _of("", "interceptions, without restarts")
    dribbles: int = _of("", "dribbles from one touch to the next, completed or failed")
    dribbles_lost: int = _of("", "dribbles that ended with the other team's touch")
    self_passes: int = _of("", "self passes")
    clearances: int = _of("", "clearances")
    tackles_won: int = _of("", "tackles after which the team has the ball")
    tackles_lost: int = _of("", "tackles that moved the ball, but not to the team")
    tackles_missed: int = _of("", "tackles that did not get the ball")
    presses: int = _of("", "times that a player pressed")
    presses_won: int = _of("", "of them such that the team got the ball")
    catches: int = _of("", "balls that the goalkeeper caught")
    saves: int = _of("", "shots of the other team on target that the goalkeeper stopped")
    fouls: int = _of("", "fouls by the team, without offsides")
    offsides: int = _of("", "offsides of the team")
    yellow_cards: int = _of("", "yellow cards")
    red_cards: int = _of("", "red cards")
    kick_ins: int = _of("", "kick ins that the team was given")
    corner_kicks: int = _of("", "corner kicks")
    goal_kicks: int = _of("", "goal kicks")
    free_kicks: int = _of("", "free kicks, direct and indirect, also of a goalkeeper that caught the ball")
    kicks: int = _of("", "kicks that the server carried out")

    def to_json(self) -> dict[str, int | float | None]:
        """Return the numbers by name; None for NaN."""
        return {name: None if math.isnan(value) else value for name, value in asdict(self).items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchStatistics:
    """The statistics of both teams of a match."""

    left: TeamStatistics
    right: TeamStatistics


def described() -> Iterator[tuple[str, str, str]]:
    """Yield name, unit and meaning of each statistic."""
    for one in fields(TeamStatistics):
        yield one.name, one.metadata["unit"], one.metadata["about"]


def team_statistics(events: Columns) -> MatchStatistics:
    """Return the statistics of both teams.

    Args:
        events: ``definitions.COLUMNS`` of one match, all kinds, from ``find_events`` or from a store's table
            ``match_events``.
    """
    return MatchStatistics(left=_side(events, 1), right=_side(events, -1))


def _side(events: Columns, side: int) -> TeamStatistics:
    kind, outcome, whose = events["kind"], events["outcome"], events["side"]

    def these(of: EventKind, *outcomes: str, team: int = side) -> Bools:
        found: Bools = (kind == of.value) & (whose == team)
        return found & np.isin(outcome.astype("U"), [str(one) for one in outcomes]) if outcomes else found

    def count(of: EventKind, *outcomes: str, team: int = side) -> int:
        return int(np.count_nonzero(these(of, *outcomes, team=team)))

    def cycles(team: int) -> int:
        spells = these(EventKind.POSSESSION, team=team)
        return int((events["end_frame"][spells] - events["frame"][spells]).sum())

    passes = count(EventKind.PASS) - count(EventKind.PASS, Outcome.RESTART)
    completed = these(EventKind.PASS, Outcome.COMPLETED)
    return TeamStatistics(
        goals=count(EventKind.GOAL),
        shots=count(EventKind.SHOT),
        shots_on_target=count(EventKind.SHOT, Outcome.GOAL, Outcome.SAVED, Outcome.BLOCKED),
        expected_goals=_total(events["expected_goals"][these(EventKind.SHOT)]),
        possession=_share(cycles(side), cycles(side) + cycles(-side)),
        passes=passes,
        passes_completed=int(completed.sum()),
        pass_completion=_share(int(completed.sum()), passes),
        pass_length=float(events["length"][completed].mean()) if completed.any() else math.nan,
        through_passes=count(EventKind.THROUGH_PASS),
        through_passes_completed=count(EventKind.THROUGH_PASS, Outcome.COMPLETED),
        interceptions=count(EventKind.INTERCEPTION, Outcome.WON),
        dribbles=count(EventKind.DRIBBLE, Outcome.COMPLETED, Outcome.FAILED),
        dribbles_lost=count(EventKind.DRIBBLE, Outcome.LOST),
        self_passes=count(EventKind.SELF_PASS),
        clearances=count(EventKind.CLEARANCE),
        tackles_won=count(EventKind.TACKLE, Outcome.WON),
        tackles_lost=count(EventKind.TACKLE, Outcome.LOST),
        tackles_missed=count(EventKind.TACKLE, Outcome.MISSED),
        presses=count(EventKind.PRESS),
        presses_won=count(EventKind.PRESS, Outcome.WON),
        catches=count(EventKind.CATCH),
        saves=count(EventKind.SHOT, Outcome.SAVED, team=-side),
        fouls=count(EventKind.FOUL),
        offsides=count(EventKind.OFFSIDE),
        yellow_cards=count(EventKind.CARD, "yellow"),
        red_cards=count(EventKind.CARD, "red"),
        kick_ins=count(EventKind.SET_PLAY, "kick in"),
        corner_kicks=count(EventKind.SET_PLAY, "corner kick"),
        goal_kicks=count(EventKind.SET_PLAY, "goal kick"),
        free_kicks=count(EventKind.SET_PLAY, "free kick", "indirect free kick"),
        kicks=count(EventKind.KICK),
    )


def _total(chances: NDArray[np.floating[Any]]) -> float:
    known = chances[~np.isnan(chances)]
    return math.nan if len(chances) and not len(known) else float(known.sum(dtype=np.float64))


def _share(part: int, whole: int) -> float:
    return part / whole if whole else math.nan
