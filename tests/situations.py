"""Made situations of a match: everything a state holds, within what the server allows."""

from __future__ import annotations

import torch

from teamclone.rcss.commands import CLONED_KINDS
from teamclone.rcss.player_types import DEFAULTS, FIELDS, GROUPS, RANGES
from teamclone.rcss.playmodes import PlayMode
from teamclone.world.channels import CHANNEL, FLAG_COLLIDED, FLAG_ON_FIELD, FLAG_TACKLING, TYPE_FIELD
from teamclone.world.state import State


def situations(n: int, *, seed: int = 0, history: int = 0, dtype: torch.dtype = torch.float32) -> State:
    """``n`` of them; players crowd around the ball as in play, every third actor has it at his feet.

    The past is what led to it, but that nobody turned; the first situation has none.
    """
    generator = torch.Generator().manual_seed(seed)

    def uniform(low: float, high: float, *shape: int) -> torch.Tensor:
        return low + (high - low) * torch.rand(*shape, generator=generator, dtype=dtype)

    ball = torch.cat([uniform(-50, 50, n, 1), uniform(-33, 33, n, 1), uniform(-1, 1, n, 2)], 1)
    actor = torch.randint(0, 11, (n,), generator=generator)
    players = torch.zeros(n, 22, len(CHANNEL), dtype=dtype)
    spread = uniform(1, 40, n, 1)
    for axis, (name, limit) in enumerate((("x", 55.0), ("y", 37.0))):
        place = ball[:, axis, None] + spread * uniform(-1, 1, n, 22)
        place = torch.where(place.abs() > limit, 2 * limit * place.sign() - place, place)  # folded back onto the pitch
        players[..., CHANNEL[name]] = place
    at_feet = torch.arange(0, n, 3)
    for axis, name in enumerate("xy"):
        players[at_feet, actor[at_feet], CHANNEL[name]] = ball[at_feet, axis] + uniform(-0.7, 0.7, len(at_feet))
    for name, low, high in (
        ("vx", -0.4, 0.4),
        ("vy", -0.4, 0.4),
        ("body", -180, 180),
        ("neck", -90, 90),
        ("stamina", 2000, 8000),
        ("effort", 0.6, 1),
        ("recovery", 0.5, 1),
        ("capacity", 0, 130600),
    ):
        players[..., CHANNEL[name]] = uniform(low, high, n, 22)
    players[..., CHANNEL["view_width"]] = 60.0 * torch.randint(1, 4, (n, 22), generator=generator)
    players[..., CHANNEL["flags"]] = FLAG_ON_FIELD
    for flag, share in ((FLAG_TACKLING, 0.05), (FLAG_COLLIDED, 0.1)):
        players[..., CHANNEL["flags"]] += flag * (uniform(0, 1, n, 22) < share)
    kinds = torch.tensor((0, *CLONED_KINDS), dtype=dtype)
    ages = torch.Generator().manual_seed(seed)
    players[..., CHANNEL["age"]] = torch.randint(40, (n, 22), generator=ages).to(dtype)
    players[..., CHANNEL["last_command"]] = kinds[torch.randint(0, len(kinds), (n, 22), generator=generator)]

    types = torch.tensor(list(DEFAULTS.values()), dtype=dtype).repeat(n, 22, 1)
    for name in (name for group in GROUPS.values() for name in group):
        types[..., TYPE_FIELD[name]] = uniform(*RANGES[name], n, 22)

    back = torch.arange(1, history + 1, dtype=dtype)
    past_ball = ball[:, None].repeat(1, history, 1)
    past_ball[..., :2] -= back[:, None] * past_ball[..., 2:]
    past_players = players[:, None].repeat(1, history, 1, 1)
    past_players[..., CHANNEL["x"]] -= back[:, None] * past_players[..., CHANNEL["vx"]]
    past_players[..., CHANNEL["y"]] -= back[:, None] * past_players[..., CHANNEL["vy"]]
    past_players[..., CHANNEL["stamina"]] -= 10 * back[:, None]
    known = torch.ones(n, history, dtype=torch.bool)
    known[:1] = False
    return State.now(
        ball=ball,
        players=players,
        types=types,
        actor=actor,
        mode=torch.randint(len(PlayMode), (n,), generator=generator),
        mode_cycles=torch.randint(120, (n,), generator=generator).to(dtype),
    )._replace(past_ball=past_ball, past_players=past_players, past_known=known)


def resting(n: int = 1, *, history: int = 0, dtype: torch.dtype = torch.float32) -> State:
    """Everybody but the actor, player 0, off the field, all of the default type and unmoving at the centre."""
    types = torch.tensor(list(DEFAULTS.values()), dtype=dtype).repeat(n, 22, 1)
    assert types.shape[2] == len(FIELDS)
    players = torch.zeros(n, 22, len(CHANNEL), dtype=dtype)
    for name, value in (("stamina", 8000.0), ("effort", 1.0), ("recovery", 1.0), ("capacity", 130600.0)):
        players[..., CHANNEL[name]] = value
    players[:, 0, CHANNEL["flags"]] = FLAG_ON_FIELD
    return State.now(
        ball=torch.zeros(n, 4, dtype=dtype), players=players, types=types, actor=torch.zeros(n, dtype=torch.int64)
    )._replace(
        past_ball=torch.zeros(n, history, 4, dtype=dtype),
        past_players=players[:, None].repeat(1, history, 1, 1),
        past_known=torch.zeros(n, history, dtype=torch.bool),
    )


def put(state: State, player: int, **values: float) -> None:
    """Set channels of a player in all situations, and put him on the field."""
    for name, value in values.items():
        state.players[:, player, CHANNEL[name]] = value
    flags = state.players[:, player, CHANNEL["flags"]].long() | FLAG_ON_FIELD
    state.players[:, player, CHANNEL["flags"]] = flags.to(state.players.dtype)


def dashed(count: int) -> float:
    """Metres of dashes at full power of the default type from rest."""
    speed = metres = 0.0
    for _ in range(count):
        speed += 0.6
        metres += speed
        speed *= 0.4
    return metres
