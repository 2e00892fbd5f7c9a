"""How predictable they are: what each number does next with the ball, where, and whether pressed or not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from teamclone.events.definitions import PRESS_M
from teamclone.rcss.players import N_TEAM
from teamclone.scout import figures
from teamclone.scout.decisions import (
    CELLS,
    CLEARANCE,
    DRIBBLE,
    HOLD,
    LOST_PASS,
    N_ANSWERS,
    SHOT,
    Decisions,
    decisions,
)
from teamclone.scout.distribution import LONG_M, RESTART_KINDS, keeper, restarts
from teamclone.scout.findings import Claim, Findings, Picture, Table, capital, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment, ratio
from teamclone.scout.places import LANES, THIRDS, in_lane
from teamclone.scout.predictability import (
    LEAST,
    NEARLY_ALWAYS,
    SURE,
    Habit,
    foreseen,
    habits,
    hits,
    mean_entropy,
    share,
)
from teamclone.scout.sections import habits_figures as drawn
from teamclone.scout.seen import Floats, Ints, Seen
from teamclone.scout.subject import Subject

KEY = "habits"
TITLE = "How predictable they are"

RELEASES = (*range(N_TEAM), SHOT, CLEARANCE)
"""Decisions that let the ball go, as far as one knows to whom."""
MOST_HABITS = 4
"""So many are said; the others stand in the table."""
LEAST_MATCHES = 3
"""Of opponents seen less often nobody knows habits."""
NEAR = {None: "", 0: ", with no opponent near,", 1: ", with an opponent near,"}
ANSWERS = {
    **{at: f"passes to {at + 1}" for at in range(N_TEAM)},
    **{
        LOST_PASS: "loses the pass",
        DRIBBLE: "dribbles on",
        SHOT: "shoots",
        CLEARANCE: "clears",
        HOLD: "holds the ball",
    },
}

_SAME = "how often two decisions of a match by one number, in one zone, both pressed or both not, are the same"
_PARTS = (
    *((f"third_{at}", f"in the {words}") for at, words in enumerate(THIRDS)),
    *((f"lane_{at}", in_lane(words)) for at, words in enumerate(LANES)),
    ("free", "with no opponent near"),
    ("pressed", "pressed"),
)
_OF_KEEPER = "of the balls that the goalkeeper plays away"
MEASURES = (
    Measure(key="habits_same", name="repeats itself", unit="share", about=_SAME, good=-1),
    *(
        Measure(
            key=f"habits_same_{key}", name=f"repeats itself {words}", unit="share", about=f"{_SAME}, {words}", good=-1
        )
        for key, words in _PARTS
    ),
    Measure(key="habits_dribble", name="dribbles on", unit="share", about="of its decisions with the ball"),
    Measure(
        key="habits_keeper_long",
        name="long balls of the goalkeeper",
        unit="share",
        about=f"{_OF_KEEPER}, those of {LONG_M:g} m and more",
    ),
    *(
        Measure(
            key=f"habits_keeper_{words}",
            name=f"balls of the goalkeeper, {words}",
            unit="share",
            about=f"{_OF_KEEPER}, those that end to the {words} of the goal area",
        )
        for words in ("left", "right")
    ),
    Measure(
        key="habits_keeper_lost",
        name="balls of the goalkeeper lost",
        unit="share",
        about=f"{_OF_KEEPER}, those that the team does not get",
        good=-1,
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    made = decisions(seen)
    counts = np.zeros((*CELLS, N_ANSWERS), np.int64)
    np.add.at(counts, (*made.cell, made.answer), 1)
    restarted, restarted_when = restarts(seen)
    return Look(
        numbers={
            **_same(counts),
            "habits_dribble": (float((made.answer == DRIBBLE).sum()), float(len(made))),
            **{f"habits_keeper_{key}": pair for key, pair in keeper(seen).items()},
        },
        arrays={
            "counts": counts,
            "when": _when(seen, made),
            "places": _places(made),
            "restarts": restarted,
            "restarts_when": restarted_when,
        },
    )


def same(counts: Ints) -> tuple[float, float]:
    """Return among how many decisions two of a cell are the same, and of how many: sums over cells (..., answers)."""
    n = counts.sum(-1)
    twice = n > 1
    pairs = (counts * (counts - 1)).sum(-1)
    return float((pairs[twice] / (n[twice] - 1)).sum()), float(n[twice].sum())


def _same(counts: Ints) -> Mapping[str, tuple[float, float]]:
    parts = {
        "habits_same": counts,
        "habits_same_free": counts[..., 0, :],
        "habits_same_pressed": counts[..., 1, :],
        **{f"habits_same_third_{at}": counts[:, at] for at in range(len(THIRDS))},
        **{f"habits_same_lane_{at}": counts[:, :, at] for at in range(len(LANES))},
    }
    return {key: same(part) for key, part in parts.items()}


def _when(seen: Seen, made: Decisions) -> Ints:
    """Return (*CELLS, answers, 2) cycle and stoppage of one time that each decision was made, -1 of none."""
    found = np.full((*CELLS, N_ANSWERS, 2), -1, np.int64)
    world = seen.world
    found[(*made.cell, made.answer)] = np.stack([world.cycle[made.frame], world.stoppage[made.frame]], -1)
    return found


def _places(made: Decisions) -> Floats:
    """Return (*CELLS, answers, 4) sums of where the ball was and where it went, m."""
    found = np.zeros((*CELLS, N_ANSWERS, 4), np.float32)
    np.add.at(found, (*made.cell, made.answer), np.nan_to_num(np.concatenate([made.start, made.end], 1)))
    return found


def tell(subject: Subject) -> Findings:
    """Return what its matches say of this."""
    looks = subject.own[KEY]
    each = looks.each("counts")
    if not each.sum():
        return Findings(notes=["No log tells what the team does with the ball, so there is nothing to foresee."])
    released = _of_releases(each, SURE)
    dribbles = [one for one in habits(each) if one.answer == DRIBBLE]
    routes = [one for one in _of_releases(each, drawn.OFTEN) if one.answer < N_TEAM]
    return Findings(
        claims=claims(
            _foreseen(subject),
            *_released(subject, released, each),
            *(_habit(subject, one, f"of the {_times(one)} that it has the ball there") for one in dribbles[:1]),
            *_restart_claims(subject),
            _keeper(looks),
        ),
        pictures=_pictures(looks, routes),
        tables=[
            *([_habits_table([*released, *dribbles])] if released or dribbles else []),
            _restart_table(looks),
            _teams(subject),
        ],
    )


def _keeper(looks: Looks) -> Claim | None:
    """Say where the goalkeeper's balls go, if there are enough of them."""
    balls = int(looks.of("habits_keeper_long")[1].sum())
    if balls < LEAST:
        return None
    return claim(
        looks,
        f"Of the {balls} balls that its goalkeeper plays away, {{habits_keeper_long}} go {LONG_M:g} m or farther, "
        "{habits_keeper_left} to the left, {habits_keeper_right} to the right; {habits_keeper_lost} are lost.",
    )


def _of_releases(each: Floats, sure: float) -> list[Habit]:
    """Return the habits among decisions that let the ball go."""
    return habits(each[..., RELEASES], sure=sure, names=RELEASES)


def _foreseen(subject: Subject) -> Claim | None:
    """Say how much of what it does is foreseen by who knows its other matches, and of its opponents by the same."""
    each = subject.own[KEY].each("counts")
    if len(each) < 2:
        return None
    pairs = {"let_go": foreseen(each[..., RELEASES])}
    template = (
        f"By number, zone, and whether an opponent is within {PRESS_M:g} m, one foresees {{let_go}} of what it does "
        "when it lets the ball go: to whom it passes, or that it shoots or clears"
    )
    opponents = [foreseen(one[..., RELEASES]) for one in _by_opponent(subject).values() if len(one) >= LEAST_MATCHES]
    if opponents:
        pairs["others"] = (np.concatenate([one for one, _ in opponents]), np.concatenate([one for _, one in opponents]))
        template += "; of its opponents {others}"
    return _claim(f"{template}.", pairs)


def _by_opponent(subject: Subject) -> dict[str, Floats]:
    """Return the counts (n_matches, ...) of each opponent by its name."""
    counts = subject.other[KEY].each("counts")
    names = [one.opponent for one in subject.played]
    return {name: counts[[one == name for one in names]] for name in sorted(set(names))}


def _released(subject: Subject, found: Sequence[Habit], each: Floats) -> list[Claim | None]:
    """Say what is nearly always done when the ball is let go, once for each number and what it does."""
    lead = "" if found else "No number nearly always lets the ball go in the same way. The nearest: "
    once: dict[tuple[int | None, int], Habit] = {}
    for one in found or _of_releases(each, SURE / 2)[:1]:
        once.setdefault((one.cell[0], one.answer), one)
    made = []
    for one in list(once.values())[:MOST_HABITS]:
        lost = int(each[(slice(None), *_index(one), LOST_PASS)].sum())
        of = f"of the {_times(one)} that it lets the ball go there" + (
            f"; {lost} more were lost on the way" if lost else ""
        )
        made.append(_habit(subject, one, of, lead))
    return made


def _times(one: Habit) -> str:
    n, matches = int(one.wholes.sum()), int((one.wholes > 0).sum())
    return f"{n} times in {matches} {'match' if matches == 1 else 'matches'}"


def _habit(subject: Subject, one: Habit, of: str, lead: str = "") -> Claim | None:
    words = f"{_where(one)}{NEAR[one.cell[-1]] or ','} {_number(one)} {ANSWERS[one.answer]}: {{share}} {of}."
    text = lead + words if lead else capital(words)
    return _claim(text, {"share": (one.parts, one.wholes)}, _moments(subject, one))


def _index(one: Habit) -> tuple[int | slice, ...]:
    """Return the index of the cells of a habit."""
    return tuple(slice(None) if index is None else index for index in one.cell)


def _number(one: Habit) -> int:
    return (one.cell[0] or 0) + 1


def _where(one: Habit) -> str:
    return f"{in_lane(LANES[one.cell[2] or 0])} of the {THIRDS[one.cell[1] or 0]}"


def _moments(subject: Subject, one: Habit) -> tuple[Moment, ...]:
    """Return a time in each of the matches in which it was done most often."""
    made: list[Moment] = []
    for at in _shown(subject, one.parts):
        times = subject.own[KEY].looks[at].arrays["when"][(*_index(one), one.answer)].reshape(-1, 2)
        made += [
            _moment(subject, at, time, f"{_number(one)} {ANSWERS[one.answer]}", _number(one))
            for time in times[times[:, 0] >= 0][:1]
        ]
    return tuple(made[:3])


def _shown(subject: Subject, parts: Floats) -> list[int]:
    """Return which matches (n_matches,) have something to show, those with most of it first."""
    shown = subject.own[KEY].shown
    order = [int(at) for at in np.argsort(-parts, kind="stable") if parts[at]]
    return [at for at in order if shown is None or subject.played[at].match_id in shown]


def _moment(subject: Subject, at: int, time: Ints, words: str, unum: int) -> Moment:
    cycle, stoppage = (int(one) for one in time)
    match_id = subject.played[at].match_id
    return Moment(match_id=match_id, cycle=cycle, stoppage=stoppage, unum=unum, text=words)


def _claim(template: str, pairs: Mapping[str, tuple[Floats, Floats]], moments: tuple[Moment, ...] = ()) -> Claim | None:
    """Return a sentence about shares, each of parts and wholes (n_matches,); None if one is of nothing."""
    shares = {key: share(*(np.asarray(values, float) for values in pair)) for key, pair in pairs.items()}
    if any(one.value is None for one in shares.values()):
        return None
    return Claim(template=template, figures=shares, units=dict.fromkeys(shares, "share"), moments=moments)


def _restart_claims(subject: Subject) -> list[Claim | None]:
    """Say of which restarts one knows the taker and the receiver, the most frequent two."""
    each, when = (subject.own[KEY].each(name) for name in ("restarts", "restarts_when"))
    made: list[tuple[float, Claim | None]] = []
    for kind, (_, name, parts) in enumerate(RESTART_KINDS):
        for part, words in parts.items():
            here = each[:, kind, part]
            taker, receiver = divmod(int(here.sum(0)[:, :N_TEAM].argmax()), N_TEAM)
            done, wholes = here[:, taker, receiver], here.sum((1, 2))
            if wholes.sum() < LEAST or done.sum() < SURE * wholes.sum():
                continue
            text = (
                f"Of {int(wholes.sum())} passes from a {name}{words}, {{share}} go from {taker + 1} to {receiver + 1}."
            )
            moments = [
                _moment(subject, at, when[at, kind, part, taker, receiver], f"{name} to {receiver + 1}", taker + 1)
                for at in _shown(subject, done)[:3]
            ]
            made.append((float(done.sum()), _claim(text, {"share": (done, wholes)}, tuple(moments))))
    return [one for _, one in sorted(made, key=lambda one: -one[0])[:2]]


def _pictures(looks: Looks, routes: Sequence[Habit]) -> list[Picture]:
    each = looks.each("counts")
    zones = [
        (words, hits(counts).sum((0, 1, 4)), counts.sum((0, 1, 4, 5)))
        for words, counts in (("what it does next", each), ("when it lets the ball go", each[..., RELEASES]))
    ]
    pictures = []
    if len(each) >= 2:
        pictures.append(
            Picture(
                name="foreseen",
                draw=lambda: figures.ratios_by_zone(zones),
                alt="How much of its decisions is foreseen, by zone of the ball",
                caption="Where it is easy to foresee: the share of decisions that are what the same number did most "
                "often there in the other matches, and how many decisions there were. On the left, dribbling on "
                "counts, too.",
            )
        )
    places = looks.total("places")
    drawn_routes = [drawn.route(one, places) for one in routes[: drawn.MOST_ROUTES]]
    if drawn_routes:
        pictures.append(
            Picture(
                name="habits",
                draw=lambda: drawn.routes(drawn_routes),
                alt="The passes that it plays again and again",
                caption=f"Wherever a number plays to the same one in {drawn.OFTEN:.0%} of the cases or more: from the "
                "mean place of these passes to the mean place where they arrive.",
            )
        )
    return pictures


def _habits_table(found: Sequence[Habit]) -> Table:
    return Table(
        name="habits",
        caption=f"All habits: {LEAST} times or more, of which the same in {NEARLY_ALWAYS:.0%}, or in {SURE:.0%} by the "
        "lower end of the interval",
        columns=("number", "where", "opponent near", "does", "share (share)", "times", "matches"),
        rows=[
            (
                _number(one),
                _where(one),
                {None: "or not", 0: "no", 1: "yes"}[one.cell[-1]],
                ANSWERS[one.answer],
                one.share,
                int(one.wholes.sum()),
                int((one.wholes > 0).sum()),
            )
            for one in found
        ],
        folded=True,
    )


def _restart_table(looks: Looks) -> Table:
    counts = looks.total("restarts")
    rows: list[tuple[str | float | int | None, ...]] = []
    for kind, (_, name, parts) in enumerate(RESTART_KINDS):
        for part, words in parts.items():
            here = counts[kind, part]
            if not here.sum():
                continue
            taker = int(here.sum(1).argmax())
            pair = divmod(int(here[:, :N_TEAM].argmax()), N_TEAM)
            share = float(here[pair] / here.sum())
            rows.append(
                (
                    name + words,
                    int(here.sum()),
                    taker + 1,
                    float(here[taker].sum() / here.sum()),
                    f"{pair[0] + 1} to {pair[1] + 1}" if share else "",
                    share if share else None,
                    float(here[:, N_TEAM].sum() / here.sum()),
                )
            )
    return Table(
        name="restarts",
        caption="Restarts: who takes them and to whom the first pass goes",
        columns=("restart", "passes", "mostly by", "of all (share)", "mostly", "of all (share)", "lost (share)"),
        rows=rows,
        folded=True,
    )


def _teams(subject: Subject) -> Table:
    """Return how predictable the team and its opponents are."""
    rows = []
    for name, counts in {subject.team: subject.own[KEY].each("counts"), **_by_opponent(subject)}.items():
        known = len(counts) >= 2
        shares = [ratio(*foreseen(part)).value if known else None for part in (counts, counts[..., RELEASES])]
        rows.append(
            (name, len(counts), *shares, mean_entropy(counts.sum(0)), mean_entropy(counts[..., RELEASES].sum(0)))
        )
    return Table(
        name="predictability",
        caption="It and its opponents: what is foreseen, and the entropy of what they do, in bits (0: always the same)",
        columns=("team", "matches", "next (share)", "when let go (share)", "entropy, next", "entropy, when let go"),
        rows=rows,
        folded=True,
    )
