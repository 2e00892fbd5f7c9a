"""Stamina, pace, player types, substitutions: who gets tired when, and what it costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from teamclone.events.definitions import EventKind
from teamclone.logs.match import Columns
from teamclone.rcss import server_params
from teamclone.rcss.players import N_TEAM
from teamclone.scout.findings import Claim, Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Look, Looks, Measure, Moment, ratio
from teamclone.scout.sections import stamina_figures as drawn
from teamclone.scout.seen import Bools, Floats, Ints, Seen
from teamclone.scout.subject import Subject
from teamclone.scout.windows import moment
from teamclone.world.traits import ranks

KEY = "stamina"
TITLE = "Stamina, player types, substitutions"

BINS = 16
"""Of a match, eight each half; the last two of each are its last quarter."""
HALF = BINS // 2
LATE = np.arange(BINS) % HALF >= HALF * 3 // 4
EMPTY = 100.0
"""Stamina of a dash with full power; a player with less is empty."""
SPAN = 1000
"""In how many cycles of play expected goals are counted."""
MANY = 3
"""So many empty players are a moment to see."""
GROUPS = (
    ("last", "the hindmost four", slice(0, 4)),
    ("middle", "the three in the middle", slice(4, 7)),
    ("front", "the foremost three", slice(7, 10)),
)
"""Field players by their mean place along the pitch."""

TRAITS: Mapping[str, tuple[str, str, str, int]] = {
    "top_speed": ("speed", "fastest", "slowest", 1),
    "acceleration": ("acceleration", "quickest off the mark", "slowest off the mark", 1),
    "kickable_margin": ("reach", "longest reaching", "shortest reaching", 1),
    "stamina_inc_max": ("recovery", "best recovering", "worst recovering", 1),
    "kick_rand": ("precision", "most precise", "least precise", -1),
}
"""Traits of types: key, words for the best and the worst type, and whether more is better."""
LEAST_MATCHES = 3
"""In fewer, any number may have good types by chance."""
MOST_TYPES = 3
CHOSEN = 0.7
"""A number is given a kind of type if its rank among the types of a match, 0 to 1, is surely beyond this."""

_TYPES = "mean rank of the types of its field players among those of the match, from 0 to 1"
MEASURES = (
    Measure(
        key="stamina_before",
        name="stamina before the last quarter",
        unit="share",
        about="of the greatest, field players, in the first three quarters of the halves",
    ),
    Measure(
        key="stamina_late",
        name="stamina in the last quarter",
        unit="share",
        about="of the greatest, field players, in the last quarter of the halves",
        good=1,
    ),
    Measure(
        key="stamina_empty",
        name="empty in the last quarter",
        unit="share",
        about=f"of the cycles of field players in the last quarter of the halves, those with a stamina below {EMPTY:g}",
        good=-1,
    ),
    *(
        Measure(
            key=f"stamina_empty_{key}",
            name=f"empty in the last quarter of the {key} half",
            unit="share",
            about=f"of the cycles of field players in the last quarter of it, those with a stamina below {EMPTY:g}",
            good=-1,
        )
        for key in ("first", "second")
    ),
    *(
        Measure(
            key=f"stamina_empty_{key}",
            name=f"empty in the last quarter, {words}",
            unit="share",
            about=f"of the cycles of {words} in the last quarter of the halves, those with a stamina below {EMPTY:g}",
            good=-1,
        )
        for key, words, _ in GROUPS
    ),
    Measure(
        key="stamina_many_empty",
        name=f"{MANY} players empty",
        unit="cycles",
        about=f"of a half, until {MANY} of its players are empty, where they ever are",
        good=1,
    ),
    Measure(
        key="stamina_halves",
        name=f"halves with {MANY} players empty",
        unit="share",
        about="of the halves",
        good=-1,
    ),
    *(
        Measure(
            key=f"stamina_pace_{when}",
            name=f"pace {words}",
            unit="m",
            about=f"way of a field player in a cycle, {words} of the halves",
        )
        for when, words in (("before", "in the first three quarters"), ("late", "in the last quarter"))
    ),
    *(
        Measure(
            key=f"stamina_goals{whose}_{when}",
            name=f"expected goals{' against' if whose else ''} {words}",
            unit="",
            about=f"in {SPAN} cycles of play {words} of the halves",
        )
        for whose in ("", "_against")
        for when, words in (("before", "in the first three quarters"), ("late", "in the last quarter"))
    ),
    Measure(key="stamina_substitutions", name="substitutions", unit="", about="in a match"),
    Measure(
        key="stamina_substituted_at",
        name="time of substitutions",
        unit="share",
        about="of the match that is over as it substitutes",
    ),
    *(
        Measure(key=f"stamina_types_{key}", name=f"types by {key}", unit="", about=f"{_TYPES}, by {key}", good=1)
        for key, *_ in TRAITS.values()
    ),
)


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    bins = _bins(seen)
    field = seen.on_field[:, :N_TEAM] & ~seen.goalies[:, :N_TEAM]
    world = seen.world
    stamina = world.channel("stamina")[:, :N_TEAM]
    greatest, capacity = (world.server[server_params.FIELDS.index(f"stamina_{name}")] for name in ("max", "capacity"))
    arrays = {
        "stamina": _binned(stamina / greatest, bins, field),
        "empty": _binned(np.where(np.isnan(stamina), np.nan, stamina < EMPTY), bins, field),
        "way": _binned(_way(seen), bins, field),
        "capacity": _at_half_ends(world.channel("capacity")[:, :N_TEAM] / capacity, bins, field),
        "goals": _goals(seen, bins),
        "depth": _binned(seen.places[:, :N_TEAM, 0], bins, field).sum(0),
        "types": _ranks(seen, bins),
        "substituted": _substituted(seen),
    }
    tired = _tired(seen, bins, field)
    return Look(
        numbers=_numbers(seen, arrays) | _first_empty(seen, arrays, tired),
        arrays=arrays,
        moments={"stamina_many_empty": tired, "stamina_substitutions": _changes(seen)},
    )


def _bins(seen: Seen) -> Ints:
    """Return (n_frames,) the bin of each frame of play, -1 of others and of extra time."""
    whole = float(seen.cycles)
    if not (np.isfinite(whole) and whole > 0):
        return np.full(len(seen.world), -1)
    at = np.floor(seen.world.cycle * (BINS / whole)).astype(np.int64)
    return np.where(seen.play_on & (at >= 0) & (at < BINS), at, -1)


def _binned(values: Floats, bins: Ints, there: Bools) -> Floats:
    """Return (BINS, 11, 2) sums of values (n_frames, 11) in each bin and how many they are."""
    known = there & np.isfinite(values) & (bins >= 0)[:, None]
    frame, player = np.nonzero(known)
    index = bins[frame] * N_TEAM + player
    size = BINS * N_TEAM
    sums = np.bincount(index, weights=values[frame, player], minlength=size)
    found: Floats = np.stack([sums, np.bincount(index, minlength=size)], -1)
    return found.reshape(BINS, N_TEAM, 2)


def _way(seen: Seen) -> Floats:
    """Return (n_frames, 11) how far each player comes to the next frame, m; NaN where play stops or frames are lost."""
    world = seen.world
    way = np.full((len(world), N_TEAM), np.nan)
    if len(world) > 1:
        way[:-1] = np.linalg.norm(np.diff(seen.places[:, :N_TEAM], axis=0), axis=-1)
        follows = (np.diff(world.cycle) == 1) & seen.play_on[1:]
        way[:-1][~follows] = np.nan
    return way


def _at_half_ends(values: Floats, bins: Ints, there: Bools) -> Floats:
    """Return (11, 2) sums of values at the last frame of play of the last bin of each half, and counts."""
    made: Floats = np.zeros((N_TEAM, 2))
    for last in (HALF - 1, BINS - 1):
        frames = np.flatnonzero(bins == last)[-1:]
        known = there[frames] & np.isfinite(values[frames])
        made += np.stack([np.where(known, values[frames], 0).sum(0), known.sum(0)], -1)
    return made


def _goals(seen: Seen, bins: Ints) -> Floats:
    """Return (BINS, 3) expected goals of the team and of the opponent, and cycles of play."""
    made = np.zeros((BINS, 3))
    for column, own in enumerate((True, False)):
        shots = seen.pick(EventKind.SHOT, own=own)
        at, worth = bins[shots["frame"]], np.nan_to_num(shots["expected_goals"].astype(np.float64))
        np.add.at(made[:, column], at[at >= 0], worth[at >= 0])
    made[:, 2] = np.bincount(bins[bins >= 0], minlength=BINS)
    return made


def _ranks(seen: Seen, bins: Ints) -> Floats:
    """Return (11, len(TRAITS)) the rank of the type with which each number began, 1 the best; NaN if nobody knows."""
    made = np.full((N_TEAM, len(TRAITS)), np.nan)
    first, types = np.flatnonzero(bins >= 0)[:1], seen.world.types
    if not len(first) or len(types) < N_TEAM:
        return made
    of = ranks(types, tuple(TRAITS))
    better = np.array([sign for *_, sign in TRAITS.values()])
    of = np.where(better > 0, of, 1 - of)
    index = seen.world.channel("type")[first[0], :N_TEAM]
    there = seen.on_field[first[0], :N_TEAM] & (index < len(types))
    made[there] = of[index[there].astype(np.int64)]
    return made


def _substituted(seen: Seen) -> Floats:
    """Return (n, 2) the number and the share of the match that is over of each change of a type during it."""
    changes = seen.pick(EventKind.PLAYER)
    these = _during(changes)
    over = changes["cycle"][these] / max(float(seen.cycles), 1.0)
    found: Floats = np.stack([changes["unum"][these].astype(np.float64), over.astype(np.float64)], -1)
    return found


def _groups(depth: Floats) -> dict[str, Ints]:
    """Return the indices of the players of each group by sums of their x (11, 2); none where too few are known."""
    known = np.argsort(-depth[:, 1], kind="stable")[: N_TEAM - 1]
    known = known[depth[known, 1] > 0]
    order = known[np.argsort(depth[known, 0] / depth[known, 1], kind="stable")]
    return {key: order[part] if len(order) == N_TEAM - 1 else order[:0] for key, _, part in GROUPS}


def _numbers(seen: Seen, arrays: Mapping[str, Floats]) -> dict[str, tuple[float, float]]:
    def pair(sums: Floats) -> tuple[float, float]:
        part, whole = sums.reshape(-1, 2).sum(0)
        return float(part), float(whole)

    empty, substituted, types = arrays["empty"], arrays["substituted"], arrays["types"]
    goals = {"before": arrays["goals"][~LATE].sum(0), "late": arrays["goals"][LATE].sum(0)}
    first = np.arange(BINS) < HALF
    field = arrays["depth"][:, 1] > 0
    known = np.isfinite(types) & field[:, None]
    return {
        "stamina_before": pair(arrays["stamina"][~LATE]),
        "stamina_late": pair(arrays["stamina"][LATE]),
        "stamina_empty": pair(empty[LATE]),
        "stamina_empty_first": pair(empty[LATE & first]),
        "stamina_empty_second": pair(empty[LATE & ~first]),
        **{f"stamina_empty_{key}": pair(empty[LATE][:, who]) for key, who in _groups(arrays["depth"]).items()},
        "stamina_pace_before": pair(arrays["way"][~LATE]),
        "stamina_pace_late": pair(arrays["way"][LATE]),
        **{
            f"stamina_goals{whose}_{when}": (float(of[column]), float(of[2]) / SPAN)
            for when, of in goals.items()
            for column, whose in enumerate(("", "_against"))
        },
        "stamina_substitutions": (float(len(substituted)), seen.length),
        "stamina_substituted_at": (float(substituted[:, 1].sum()), float(len(substituted))),
        **{
            f"stamina_types_{key}": (float(types[known[:, at], at].sum()), float(known[:, at].sum()))
            for at, (key, *_) in enumerate(TRAITS.values())
        },
    }


def _tired(seen: Seen, bins: Ints, field: Bools) -> list[Moment]:
    """Return the first moment of each half at which many are empty."""
    with np.errstate(invalid="ignore"):
        empty = field & (seen.world.channel("stamina")[:, :N_TEAM] < EMPTY)
    many = empty.sum(1) >= MANY
    found = []
    for half in ((bins >= 0) & (bins < HALF), bins >= HALF):
        for at in np.flatnonzero(many & half)[:1]:
            text = f"{MANY} of its players are empty"
            unum = int(np.flatnonzero(empty[at])[0]) + 1
            found.append(moment(seen, int(at), text, unum=unum, weight=float((many & half).sum())))
    return found


def _first_empty(seen: Seen, arrays: Mapping[str, Floats], tired: Sequence[Moment]) -> dict[str, tuple[float, float]]:
    """Return after how many cycles of a half many are empty, and in how many halves of those that the log holds."""
    known = arrays["stamina"][[HALF - 1, BINS - 1], :, 1].any(1)
    half = seen.cycles / 2
    return {
        "stamina_many_empty": (float(sum(one.cycle % half for one in tired)), float(len(tired))),
        "stamina_halves": (float(len(tired)), float(max(known.sum(), len(tired)))),
    }


def _changes(seen: Seen) -> list[Moment]:
    """Return the substitutions."""
    changes = seen.pick(EventKind.PLAYER)
    these = np.flatnonzero(_during(changes))
    return [
        moment(seen, int(changes["frame"][at]), f"{unum} is substituted", unum=unum)
        for at, unum in zip(these.tolist(), changes["unum"][these].tolist(), strict=True)
    ]


def _during(changes: Columns) -> Bools:
    """Return which events of players are changes of a type during the match."""
    found: Bools = np.char.startswith(changes["outcome"], "changes") & (changes["cycle"] > 0)
    return found


def tell(subject: Subject) -> Findings:
    """Return what its matches say of this."""
    looks, other = subject.own[KEY], subject.other[KEY]
    stamina = looks.total("stamina")
    notes = []
    if not stamina[..., 1].any():
        notes.append("No log holds the stamina of the players, so nobody knows who gets tired.")
    elif not stamina[LATE, :, 1].any():
        notes.append("No log reaches the last quarter of a half, where players get tired.")
    if not np.isfinite(looks.each("types")).any():
        notes.append("No log describes the types of the players.")
    types = _types(looks)
    if not types and len(looks) >= LEAST_MATCHES and not notes:
        *others, last = (key for key, *_ in TRAITS.values())
        notes.append(
            f"No number regularly gets better or worse types than the others, by {', '.join(others)} or {last}: nobody "
            "chooses them by that."
        )
    groups = [(words, _groups(looks.total("depth"))[key]) for key, words, _ in GROUPS]
    return Findings(
        claims=claims(
            claim(
                looks,
                f"It has {MANY} empty players, who have less than a full dash takes ({EMPTY:g}), after "
                "{stamina_many_empty} of a half, in {stamina_halves} of the halves.",
                moments=("stamina_many_empty",),
            ),
            claim(
                looks,
                "Of the last quarter of a half the hindmost four are empty in {stamina_empty_last}, the three in the "
                "middle in {stamina_empty_middle}, the foremost three in {stamina_empty_front}.",
            ),
            _emptiest(looks),
            claim(
                looks,
                "Its field players run {stamina_pace_before} a cycle before the last quarter of a half, "
                "{stamina_pace_late} in it.",
            ),
            claim(
                looks,
                f"Expected goals in {SPAN} cycles of play: {{stamina_goals_before}} before the last quarter of a half, "
                "{stamina_goals_late} in it; of its opponents {stamina_goals_against_before} before, "
                "{stamina_goals_against_late} in it.",
            ),
            _substitutions(looks),
            *types,
        ),
        pictures=_pictures(looks, other, groups),
        tables=[_by_number(looks, groups)],
        notes=notes,
    )


def _late(looks: Looks, unum: int) -> tuple[Floats, Floats]:
    """Return (n_matches,) cycles of the last quarters in which a number is empty, and all of them."""
    counts = looks.each("empty")[:, LATE, unum - 1].sum(1)
    return counts[:, 0], counts[:, 1]


def _emptiest(looks: Looks) -> Claim | None:
    """Say which numbers are empty for the longest."""
    shares = {unum: ratio(*_late(looks, unum)) for unum in range(1, N_TEAM + 1)}
    most = [unum for unum in shares if (shares[unum].value or 0) > 0]
    most = sorted(most, key=lambda unum: -(shares[unum].value or 0))[:3]
    if not most:
        return None
    words = ", ".join(f"{unum} in {{of_{unum}}}" for unum in most)
    figures = {f"of_{unum}": shares[unum] for unum in most}
    return Claim(
        template=f"The emptiest numbers: {words} of that time.",
        figures=figures,
        units=dict.fromkeys(figures, "share"),
    )


def _substitutions(looks: Looks) -> Claim | None:
    made = looks.joined("substituted")
    if not len(made):
        return claim(looks, "It substitutes {stamina_substitutions} players a match.")
    unums, counts = np.unique(made[:, 0].astype(np.int64), return_counts=True)
    most = unums[np.argsort(-counts, kind="stable")][:4]
    return claim(
        looks,
        "It substitutes {stamina_substitutions} players a match, on average after {stamina_substituted_at} of it, "
        f"most often {_listed(sorted(most.tolist()))}; each comes with full stamina.",
        moments=("stamina_substitutions",),
    )


def _listed(unums: list[int]) -> str:
    *others, last = map(str, unums)
    return f"{', '.join(others)} and {last}" if others else last


def _types(looks: Looks) -> list[Claim | None]:
    """Say which field players regularly get the best or the worst types by what, the clearest first."""
    if len(looks) < LEAST_MATCHES:
        return []
    field = np.concatenate(list(_groups(looks.total("depth")).values()))
    each = looks.each("types")
    known = np.isfinite(each)
    ranks_of = np.where(known, each, 0)
    made: list[tuple[float, Claim]] = []
    for at, (_, best, worst, _) in enumerate(TRAITS.values()):
        figures = {
            int(player): ratio(ranks_of[:, player, at], known[:, player, at].astype(float)) for player in np.sort(field)
        }
        for words, chosen in (
            (best, [player for player, one in figures.items() if one.low is not None and one.low >= CHOSEN]),
            (worst, [player for player, one in figures.items() if one.high is not None and one.high <= 1 - CHOSEN]),
        ):
            if not chosen:
                continue
            had, counts = (values[:, chosen, at].sum(1).astype(float) for values in (ranks_of, known))
            mean = ratio(had if words == best else counts - had, counts)
            verb = "gets" if len(chosen) == 1 else "get"
            others = "worse" if words == best else "better"
            numbers = _listed([player + 1 for player in chosen])
            text = f"{numbers} {verb} the {words} types: {{rank}} of the others are {others}."
            one = Claim(template=text, figures={"rank": mean}, units={"rank": "share"})
            made.append((abs((mean.value or 0.5) - 0.5), one))
    return [one for _, one in sorted(made, key=lambda one: -one[0])[:MOST_TYPES]]


def _pictures(looks: Looks, other: Looks, groups: list[tuple[str, Ints]]) -> list[Picture]:
    made = []
    stamina = _mean(looks.total("stamina"))
    if np.isfinite(stamina).any() and all(len(who) for _, who in groups):
        made.append(
            Picture(
                name="stamina",
                draw=lambda: drawn.stamina(stamina, groups),
                alt="Stamina of each number over the match",
                caption="Stamina left while the ball is in play, by number; it is filled up at half time.",
            )
        )
    paces = [_mean(one.total("way").sum(1)) for one in (looks, other)]
    goals = looks.total("goals")
    if np.isfinite(paces[0]).any():
        with np.errstate(invalid="ignore", divide="ignore"):
            worth = [SPAN * goals[:, column] / goals[:, 2] for column in (0, 1)]
        made.append(
            Picture(
                name="pace",
                draw=lambda: drawn.pace(paces, worth, span=SPAN),
                alt="Pace and expected goals of the team and its opponents over the match",
                caption="Blue the team, orange its opponents. The shaded last quarter of each half is when to look for "
                "tired legs.",
            )
        )
    return made


def _mean(sums: Floats) -> Floats:
    """Return means of sums (..., 2) with their counts; NaN of none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        found: Floats = sums[..., 0] / sums[..., 1]
    return found


def _by_number(looks: Looks, groups: list[tuple[str, Ints]]) -> Table:
    stamina, empty, way = (looks.total(name) for name in ("stamina", "empty", "way"))
    capacity = _mean(looks.total("capacity"))
    columns = {
        "stamina": _mean(stamina[LATE].sum(0)),
        "empty": _mean(empty[LATE].sum(0)),
        "capacity": capacity,
        "way": _mean(way.sum(0)),
    }
    each = looks.each("types")
    known = np.isfinite(each)
    types = _mean(np.stack([np.where(known, each, 0).sum(0), known.sum(0)], -1))
    substituted = np.bincount(looks.joined("substituted")[:, 0].astype(np.int64), minlength=N_TEAM + 1)
    role = {int(player): words for words, who in groups for player in who}
    rows: list[tuple[str | float | int | None, ...]] = []
    for player in range(N_TEAM):
        values = [float(column[player]) for column in (*columns.values(), *types.T)]
        rows.append(
            (
                player + 1,
                role.get(player, ""),
                *(value if np.isfinite(value) else None for value in values),
                int(substituted[player + 1]),
            )
        )
    return Table(
        name="stamina",
        caption="By number: the last quarter of a half, the capacity left at its end, and how many of a match's types "
        "are worse than its own",
        columns=(
            "number",
            "among",
            "stamina (share)",
            "empty (share)",
            "capacity (share)",
            "m a cycle",
            *(f"{key} (share)" for key, *_ in TRAITS.values()),
            "substituted",
        ),
        rows=rows,
        folded=True,
    )
