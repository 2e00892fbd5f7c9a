"""The kinds of events, their outcomes and thresholds, and the columns of their table, for store, docs and tests."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from teamclone.logs.columns import column
from teamclone.logs.match import Columns


class EventKind(StrEnum):
    """Kinds of events, in the order in which those of one frame are listed. KINDS says what each is."""

    GOAL = "goal"
    SHOT = "shot"
    PASS = "pass"
    THROUGH_PASS = "through pass"
    DRIBBLE = "dribble"
    SELF_PASS = "self pass"
    CLEARANCE = "clearance"
    INTERCEPTION = "interception"
    BALL_TOUCH = "ball touch"
    MULTI_TOUCH = "multi touch"
    OUT_OF_BOUNDS = "out of bounds"
    TACKLE = "tackle"
    CATCH = "catch"
    KICK = "kick"
    PRESS = "press"
    POSSESSION = "possession"
    SET_PLAY = "set play"
    FOUL = "foul"
    OFFSIDE = "offside"
    CARD = "card"
    PLAYER = "player"
    PERIOD = "period"


class Outcome(StrEnum):
    """What became of an event; OUTCOMES says which kinds have which.

    Fouls, set plays, cards, players and periods have the words of the play mode or the state bit in its place.
    """

    NONE = ""
    COMPLETED = "completed"
    FAILED = "failed"
    INTERCEPTED = "intercepted"
    CAUGHT = "caught"
    OUT = "out"
    OFFSIDE = "offside"
    RESTART = "restart"
    LOST = "lost"
    WON = "won"
    MISSED = "missed"
    SCORED = "scored"
    OWN_GOAL = "own goal"
    UNCLEAR = "unclear"
    GOAL = "goal"
    SAVED = "saved"
    BLOCKED = "blocked"
    WIDE = "wide"
    FOUL = "foul"
    STOPPED = "stopped"
    END = "end"


SHOT_SPEED = 0.6
"""A shot leaves the ball with at least this share of its highest speed: slower balls are led, not shot."""
SHOT_MARGIN_M = 1.0
"""How far beside a post a shot may pass."""
SHOT_RANGE_M = 35.0
"""From farther away it is a clearance that happens to point at the goal."""
CONTROL_M = 3.0
"""A player that is farther from the ball as it is lost had played it away."""
SELF_PASS_M = 5.0
"""A longer dribble is a self pass: in the next cycles nobody but the ball decides where it is."""
CLEARANCE_M = 10.0
"""Less far away a ball is not cleared."""
PRESS_M = 5.0
"""How near to the ball a player presses."""
PRESS_CYCLES = 5
"""For how long at least."""
PRESS_RUN_M = 2.0
"""How far it runs towards the ball at least: others stand where the ball comes by."""

KINDS: Mapping[EventKind, tuple[str, str]] = {
    EventKind.GOAL: (
        "rcg2data",
        "the play mode says so; by the player that touched the ball last, 0 if it cannot be told. `side` is the team "
        "that gets the goal, of an own goal `other` is the player",
    ),
    EventKind.SHOT: (
        "own",
        f"a kick or tackle within {SHOT_RANGE_M:g} m of the goal, the last of its player, that leaves the ball with at "
        f"least {SHOT_SPEED:.0%} of its greatest speed, on a way into the goal or at most {SHOT_MARGIN_M:g} m beside "
        "it, and fast enough to get there; and every touch that scores",
    ),
    EventKind.PASS: (
        "rcg2data; `intercepted`, `caught`, `out` and `offside` own",
        "a touch and the next one, which is a teammate's: `completed` if that is a kick, `failed` if it is a tackle or "
        f"several players touch the ball; and touches whose ball is lost more than {CONTROL_M:g} m from their player, "
        "unless they are shots or clearances",
    ),
    EventKind.THROUGH_PASS: (
        "own",
        "a pass in play from before the second last opponent, as it stood at the kick, to behind it; the pass has its "
        "own row, too",
    ),
    EventKind.DRIBBLE: (
        "rcg2data; `lost` own",
        "two touches of one player one after the other, with a dash between; and touches whose ball an opponent gets "
        f"within {CONTROL_M:g} m of their player, unless they are shots or clearances",
    ),
    EventKind.SELF_PASS: (
        "own",
        f"a dribble of at least {SELF_PASS_M:g} m between its touches; the dribble has its own row, too",
    ),
    EventKind.CLEARANCE: (
        "own",
        f"a touch in the own third that is no shot, leaves the ball with at least {SHOT_SPEED:.0%} of its greatest "
        f"speed and not towards the own goal line, and whose ball the team loses at least {CLEARANCE_M:g} m farther on",
    ),
    EventKind.INTERCEPTION: (
        "rcg2data",
        "a touch and the next one, which is the other team's. `side` is the team that gets the ball, by `unum`, 0 if "
        "several; `other` lost it",
    ),
    EventKind.BALL_TOUCH: ("rcg2data", "a touch and a tackle of the same player, without a dash between"),
    EventKind.MULTI_TOUCH: ("rcg2data", "a touch, and then both teams touch the ball in one cycle"),
    EventKind.OUT_OF_BOUNDS: (
        "rcg2data",
        "the play mode becomes kick in, corner kick or goal kick; of the team that does not get the ball",
    ),
    EventKind.TACKLE: (
        "own",
        "`won`: it moved the ball and the next touch, or the ball after a stop of play, is the team's; `lost`: it is "
        "not; `missed`: it did not get the ball",
    ),
    EventKind.CATCH: ("own", "a catch that the server carried out; `other` touched the ball before"),
    EventKind.KICK: ("own", "a kick that the server carried out"),
    EventKind.PRESS: (
        "own",
        f"a player stays within {PRESS_M:g} m of the ball for at least {PRESS_CYCLES} cycles while the other team has "
        f"it, and runs at least {PRESS_RUN_M:g} m towards it; `won`: as it ends its team has the ball. `other` touched "
        "the ball last as it began",
    ),
    EventKind.POSSESSION: (
        "own",
        "the time in play_on from a team's touch to the other team's next one or a stop of play; cycles in which both "
        "touch the ball change nothing. `unum` begins it, `other` has its last touch",
    ),
    EventKind.SET_PLAY: ("own", "a play mode other than play_on and those below; `unum` takes it, if the team's"),
    EventKind.FOUL: (
        "own",
        "a play mode by whose fault the other team gets the ball, but offside; `unum` as far as a tackle or a state "
        "bit tells it, `other` is the player that was charged",
    ),
    EventKind.OFFSIDE: ("own", "by the play mode; `unum` is not in the log"),
    EventKind.CARD: ("own", "by the state bits: `yellow` or `red`"),
    EventKind.PLAYER: ("own", "a player comes, goes, or changes its type"),
    EventKind.PERIOD: ("own", "by the play mode: the match begins, pauses or ends"),
}
"""Whose definition it is and what it is."""

OUTCOMES: Mapping[EventKind, tuple[Outcome, ...]] = {
    EventKind.GOAL: (Outcome.SCORED, Outcome.OWN_GOAL, Outcome.UNCLEAR),
    EventKind.SHOT: (Outcome.GOAL, Outcome.SAVED, Outcome.BLOCKED, Outcome.WIDE, Outcome.STOPPED),
    EventKind.PASS: (
        Outcome.COMPLETED,
        Outcome.FAILED,
        Outcome.INTERCEPTED,
        Outcome.CAUGHT,
        Outcome.OUT,
        Outcome.OFFSIDE,
        Outcome.RESTART,
    ),
    EventKind.THROUGH_PASS: (
        Outcome.COMPLETED,
        Outcome.FAILED,
        Outcome.INTERCEPTED,
        Outcome.CAUGHT,
        Outcome.OUT,
        Outcome.OFFSIDE,
    ),
    EventKind.DRIBBLE: (Outcome.COMPLETED, Outcome.FAILED, Outcome.LOST, Outcome.RESTART),
    EventKind.SELF_PASS: (Outcome.COMPLETED, Outcome.FAILED),
    EventKind.CLEARANCE: (Outcome.INTERCEPTED, Outcome.CAUGHT, Outcome.OUT),
    EventKind.INTERCEPTION: (Outcome.WON, Outcome.RESTART),
    EventKind.TACKLE: (Outcome.WON, Outcome.LOST, Outcome.MISSED),
    EventKind.PRESS: (Outcome.WON, Outcome.LOST),
    EventKind.POSSESSION: (
        Outcome.LOST,
        Outcome.CAUGHT,
        Outcome.OUT,
        Outcome.GOAL,
        Outcome.OFFSIDE,
        Outcome.FOUL,
        Outcome.STOPPED,
        Outcome.END,
    ),
}
"""The outcomes of kinds that have some."""


COLUMNS = (
    column("kind", "string", "", "what it is: `pass`"),
    column("outcome", "string", "", "what became of it: `completed`; empty where the kind has none"),
    column("frame", "int32", "", "index of the frame with which it begins; of a touch the one on which it was decided"),
    column("cycle", "int32", "cycle", "server time of `frame`"),
    column("stoppage", "int32", "cycle", "stoppage counter of `frame`"),
    column("playmode", "uint8", "", "play mode of `frame`, see the playmodes table"),
    column(
        "end_frame", "int32", "", "index of the frame with which it ends: that of the next touch, of the stop of play"
    ),
    column("end_cycle", "int32", "cycle", "server time of `end_frame`"),
    column("side", "int8", "", "side of the team whose event it is: 1 left, -1 right, 0 of none"),
    column("unum", "uint8", "", "number of its player; 0 of none, of several, or not known"),
    column("other_side", "int8", "", "side of the other player that it is about; 0 of none"),
    column("other_unum", "uint8", "", "number of the one who received, took or lost the ball; 0 of none or several"),
    column("x", "float32", "m", "ball position of `frame`"),
    column("y", "float32", "m", "ball position of `frame`"),
    column("end_x", "float32", "m", "ball position of `end_frame`"),
    column("end_y", "float32", "m", "ball position of `end_frame`"),
    column("length", "float32", "m", "distance of the two places"),
    column("speed", "float32", "m/cycle", "way of the ball in the cycle after `frame`; NaN where no touch begins it"),
    column(
        "expected_goals",
        "float32",
        "",
        "of a shot: the chance that it scores, by what could be seen before it; NaN of all else and where unknown",
    ),
)
"""One value an event: shape (n_events,). ``find.find_events`` makes them."""


def typed(columns: Columns) -> Columns:
    """Return COLUMNS, (n_events,) each, with their types; texts as NumPy text arrays."""
    return {
        one.name: columns[one.name].astype("U" if one.dtype == "string" else one.dtype, copy=False) for one in COLUMNS
    }
