"""Who they are: results, possession, tempo, shape, where the ball is won and lost."""

from __future__ import annotations

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.rcss.players import N_TEAM
from teamclone.scout import figures
from teamclone.scout.findings import Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Look, Measure
from teamclone.scout.places import counted, mean_of, summed, third
from teamclone.scout.seen import Bools, Floats, Seen
from teamclone.scout.shape import name_of_shape
from teamclone.scout.subject import Subject

KEY = "identity"
TITLE = "Who they are"

CYCLES = 100
"""In how many cycles of possession tempo and directness are counted."""

MEASURES = (
    Measure(key="goals", name="goals", unit="", about="goals in a match", good=1),
    Measure(key="goals_against", name="goals against", unit="", about="goals of the opponent in a match", good=-1),
    Measure(key="expected_goals", name="expected goals", unit="", about="of the shots of a match", good=1),
    Measure(
        key="expected_goals_against",
        name="expected goals against",
        unit="",
        about="of the opponent's shots of a match",
        good=-1,
    ),
    Measure(key="shots", name="shots", unit="", about="shots in a match", good=1),
    Measure(key="shots_against", name="shots against", unit="", about="of the opponent in a match", good=-1),
    Measure(key="possession", name="possession", unit="share", about="of the cycles in which either team has the ball"),
    Measure(key="passes", name="passes", unit="", about="in a match, of any outcome"),
    Measure(key="pass_completion", name="passes completed", unit="share", about="of its passes", good=1),
    Measure(key="pass_length", name="length of passes", unit="m", about="mean of the completed ones"),
    Measure(key="tempo", name="tempo", unit="", about=f"passes and dribbles in {CYCLES} cycles with the ball"),
    Measure(
        key="directness",
        name="directness",
        unit="m",
        about=f"how far the ball comes forward in {CYCLES} cycles with it",
    ),
    Measure(
        key="won_high", name="won high", unit="share", about="of the balls won, those in the attacking third", good=1
    ),
    Measure(key="lost_low", name="lost low", unit="share", about="of the balls lost, those in the own third", good=-1),
    Measure(key="fouls", name="fouls", unit="", about="in a match, without offsides", good=-1),
    Measure(key="cards", name="cards", unit="", about="yellow and red in a match", good=-1),
    Measure(key="offsides", name="offsides", unit="", about="in a match", good=-1),
    *(
        Measure(key=f"{what}_{when}", name=f"{what} {words}", unit="m", about=f"{about} {words}, field players")
        for what, about in (
            ("length", "from the hindmost to the foremost"),
            ("width", "from the leftmost to the rightmost"),
        )
        for when, words in (("with", "with the ball"), ("without", "without it"))
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    with_ball, without = seen.has == 1, seen.has == -1
    held = float(with_ball.sum())
    shots, against = seen.pick(EventKind.SHOT), seen.pick(EventKind.SHOT, own=False)
    passes = _passes(seen)
    completed = seen.pick(EventKind.PASS, Outcome.COMPLETED)
    moves = len(passes) + len(seen.pick(EventKind.DRIBBLE, Outcome.COMPLETED, Outcome.FAILED)["frame"])
    spells = seen.pick(EventKind.POSSESSION)
    won = seen.pick(EventKind.INTERCEPTION, Outcome.WON)
    lost = seen.pick(EventKind.INTERCEPTION, Outcome.WON, own=False)
    length = seen.length

    def count(kind: EventKind, *outcomes: str, own: bool = True) -> tuple[float, float]:
        return float(len(seen.pick(kind, *outcomes, own=own)["frame"])), length

    numbers = {
        "goals": count(EventKind.GOAL),
        "goals_against": count(EventKind.GOAL, own=False),
        "expected_goals": (float(np.nansum(shots["expected_goals"])), length),
        "expected_goals_against": (float(np.nansum(against["expected_goals"])), length),
        "shots": (float(len(shots["frame"])), length),
        "shots_against": (float(len(against["frame"])), length),
        "possession": (held, held + float(without.sum())),
        "passes": (float(len(passes)), length),
        "pass_completion": (float(len(completed["frame"])), float(len(passes))),
        "pass_length": (float(completed["length"].sum()), float(len(completed["frame"]))),
        "tempo": (CYCLES * float(moves), held),
        "directness": (CYCLES * float((spells["end_x"] - spells["x"]).sum()), held),
        "won_high": (float((third(won["end_x"]) == 2).sum()), float(len(won["frame"]))),
        "lost_low": (float((third(lost["end_x"]) == 0).sum()), float(len(lost["frame"]))),
        "fouls": count(EventKind.FOUL),
        "cards": count(EventKind.CARD),
        "offsides": count(EventKind.OFFSIDE),
    }
    for when, these in (("with", with_ball), ("without", without)):
        for axis, what in enumerate(("length", "width")):
            numbers[f"{what}_{when}"] = _extent(seen, these, axis)
    return Look(
        numbers=numbers,
        arrays={
            "won": counted(won["end_x"], won["end_y"]),
            "lost": counted(lost["end_x"], lost["end_y"]),
            "goalie": np.any(seen.goalies[:, :N_TEAM], axis=0, keepdims=True)[0],
            "without": summed(seen.places[without, :N_TEAM]),
            "with": summed(seen.places[with_ball, :N_TEAM]),
            "chances": np.concatenate([shots["expected_goals"], against["expected_goals"]]),
            "scored": np.concatenate([shots["outcome"], against["outcome"]]) == Outcome.GOAL,
        },
    )


def _passes(seen: Seen) -> Floats:
    """Return the frames of passes but those that a restart makes of the last touch before the stop."""
    passes = seen.pick(EventKind.PASS)
    found: Floats = passes["frame"][passes["outcome"] != Outcome.RESTART]
    return found


def _extent(seen: Seen, these: Bools, axis: int) -> tuple[float, float]:
    """Return the sum over frames of how long or wide the field players stand, and the number of frames."""
    place = seen.outfield[these, :N_TEAM, axis]
    known = np.isfinite(place)
    extent = np.max(place, axis=1, initial=-np.inf, where=known) - np.min(place, axis=1, initial=np.inf, where=known)
    extent = extent[np.isfinite(extent)]
    return float(extent.sum()), float(len(extent))


def tell(subject: Subject) -> Findings:
    """Return what its matches say of this."""
    looks = subject.own[KEY]
    won, drawn, lost = results(subject)
    shapes = {when: name_of_shape(mean_of(looks.total(when))[:, 0][~keepers(subject)]) for when in ("with", "without")}
    stands = " and ".join(
        f"{shapes[when]} {words}, {{length_{when}}} long and {{width_{when}}} wide"
        for when, words in (("without", "without the ball"), ("with", "with it"))
    )
    calibrated = figures.reliability_bins(looks.joined("chances"), looks.joined("scored") > 0)
    return Findings(
        claims=claims(
            claim(looks, f"{won} won, {drawn} drawn, {lost} lost: {{goals}} goals a match, {{goals_against}} against."),
            claim(
                looks,
                "Its chances are worth {expected_goals} goals a match, its opponents' {expected_goals_against}; it "
                "shoots {shots} times, and they {shots_against} times.",
            ),
            claim(looks, "It has the ball in {possession} of the play."),
            claim(
                looks,
                "It passes {passes} times a match over {pass_length}; {pass_completion} of the passes are completed.",
            ),
            claim(
                looks,
                f"With the ball it makes {{tempo}} passes and dribbles in {CYCLES} cycles and comes {{directness}} "
                "nearer to the other end.",
            ),
            claim(looks, f"It stands {stands}."),
            claim(
                looks,
                "Of the balls that it wins, {won_high} are won in the attacking third; of those that it loses, "
                "{lost_low} are lost in its own.",
            ),
            claim(looks, "It commits {fouls} fouls a match, is shown {cards} cards, and is offside {offsides} times."),
        ),
        pictures=[
            Picture(
                name="shapes",
                draw=lambda: figures.formations(
                    [
                        (f"{words}: {shapes[when]}" if shapes[when] else words, mean_of(looks.total(when))[:, :2])
                        for when, words in (("without", "without the ball"), ("with", "with the ball"))
                    ]
                ),
                alt="Mean places of the players without and with the ball",
                caption="Where each number stands on average while the opponent or the team itself has the ball.",
            ),
            Picture(
                name="changes-of-the-ball",
                draw=lambda: figures.shares_by_zone(
                    [("balls won", looks.total("won")), ("balls lost", looks.total("lost"))]
                ),
                alt="Where the ball is won and lost",
                caption="Where it takes the ball from the opponent, and where it loses it: share of each zone.",
            ),
            Picture(
                name="goals",
                draw=lambda: figures.goals(
                    calibrated,
                    expected=[looks.of(key)[0] for key in ("expected_goals", "expected_goals_against")],
                    scored=np.array([one.score for one in subject.played]).T,
                ),
                alt="Goals against expected goals, of shots and of matches",
                caption="Are the expected goals right here? Left, all shots of these matches, of both teams, in groups "
                "of equal size, with 95 % intervals; right, matches: blue its goals, orange the opponents'. What is "
                "right lies on the dashed lines.",
            ),
        ],
        tables=[_by_opponent(subject), _matches(subject)],
    )


def results(subject: Subject) -> tuple[int, int, int]:
    """Return the matches won, drawn and lost."""
    apart = np.sign([one.score[0] - one.score[1] for one in subject.played])
    won, drawn, lost = (int((apart == sign).sum()) for sign in (1, 0, -1))
    return won, drawn, lost


def keepers(subject: Subject) -> Bools:
    """Return (11,) which numbers are goalkeepers in most matches."""
    found: Bools = np.asarray(subject.own[KEY].total("goalie") * 2 > len(subject.own[KEY]))
    return found


def _by_opponent(subject: Subject) -> Table:
    looks = subject.own[KEY]
    expected, against = looks.of("expected_goals")[0], looks.of("expected_goals_against")[0]
    names = np.array([one.opponent for one in subject.played])
    score = np.array([one.score for one in subject.played])
    apart = np.sign(score[:, 0] - score[:, 1])
    return Table(
        name="results",
        caption="Results by opponent, goals a match",
        columns=("opponent", "matches", "won", "drawn", "lost", "goals", "against", "expected", "expected against"),
        rows=[
            (
                name,
                int((of := names == name).sum()),
                *(int((apart[of] == sign).sum()) for sign in (1, 0, -1)),
                *(float(values[of].mean()) for values in (score[:, 0], score[:, 1], expected, against)),
            )
            for name in sorted(set(names.tolist()), key=names.tolist().index)
        ],
    )


def _matches(subject: Subject) -> Table:
    looks = subject.own[KEY]
    expected, against = looks.of("expected_goals")[0], looks.of("expected_goals_against")[0]
    return Table(
        name="matches",
        caption=f"All {len(subject.played)} matches",
        columns=("when", "opponent", "score", "expected goals", "against", "possession (share)"),
        rows=[
            (
                one.started_at or "",
                one.opponent + ("" if one.complete else " (log not whole)"),
                f"{one.score[0]}:{one.score[1]}",
                float(expected[at]),
                float(against[at]),
                float(part / whole) if whole else None,
            )
            for at, (one, part, whole) in enumerate(zip(subject.played, *looks.of("possession"), strict=True))
        ],
        folded=True,
    )
