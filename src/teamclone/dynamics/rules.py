"""``Rules``: by which parameters a match was played."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import UsageError
from teamclone.rcss import player_types
from teamclone.rcss import server_params as server_of

LEGS_SINCE = 19
"""The version of rcssserver from which a player dashes with two legs."""
CATCHES_FAIL_SINCE = 15
"""The version from which a goalkeeper that reaches the ball and does not hold it turns the ball around, and waits."""

_KICK_POWER_OF_TYPES = 14
"""The version from which types have a kick_power_rate of their own, and the server's counts no more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """The parameters that enter the computations of a cycle.

    Attributes:
        server: parameters of the server by name, those of `rcss.server_params`.
        types: parameters of the player types by name, each (n_types,) float64; row = type id.
        version: the version of rcssserver, see `rcss.server_params.version`.
        referee: a referee keeps players near the pitch and freezes whom a foul meets. A server for a trainer has none.
    """

    server: Mapping[str, float]
    types: Mapping[str, NDArray[np.float64]]
    version: int
    referee: bool = True

    @classmethod
    def of(
        cls, params: Mapping[str, float | str], types: Mapping[str, NDArray[Any]], *, version: int | None = None
    ) -> Rules:
        """Return the rules of a match.

        Args:
            params: the server's parameters as its log lists them; the defaults of ``version`` where one is missing.
            types: the columns of ``player_types.FIELDS``, (n_types,).
            version: of rcssserver; None for what the parameters show.

        Raises:
            UsageError: the match has rules that are not computed here: wind, or noise by team; or rules that no match
                can be played by, such as a decay of 1.
        """
        version = server_of.version(params) if version is None else version
        server = _server(params, version=version)
        for name in ("wind_rand", "team_actuator_noise"):
            if server[name] != 0:
                raise UsageError(f"expected a match without wind and noise by team, got {name} = {server[name]:g}")
        of_type = {name: np.asarray(types[name], np.float64) for name in player_types.FIELDS}
        if version < _KICK_POWER_OF_TYPES and isinstance(params.get("kick_power_rate"), float):
            of_type["kick_power_rate"] = np.full_like(of_type["kick_power_rate"], params["kick_power_rate"])
        _check(server, of_type)
        return cls(
            server=server,
            types=of_type,
            version=version,
            referee=not params.get("coach") or bool(params.get("coach_w_referee")),
        )

    def ends_half(self, cycle: NDArray[Any]) -> NDArray[np.bool_]:
        """Return whether cycles, any shape, are the last of a half: behind them there is a pause."""
        normal, extra = (
            max(round(self.server[name] * 1000.0 / self.server["simulator_step"]), 1)
            for name in ("half_time", "extra_half_time")
        )
        whole = normal * round(self.server["nr_normal_halfs"])
        beyond = cycle - whole
        ends: NDArray[np.bool_] = (cycle > 0) & ((cycle % normal == 0) | ((beyond > 0) & (beyond % extra == 0)))
        return ends

    @property
    def catches_fail(self) -> bool:
        """Whether a failed catch within reach moves the ball, and bans the goalkeeper from catching."""
        return self.version >= CATCHES_FAIL_SINCE

    @property
    def legs(self) -> bool:
        """Whether players dash with two legs, each with a power and a direction of its own."""
        return self.version >= LEGS_SINCE


def check_parameters(params: Mapping[str, float | str], types: Mapping[str, NDArray[Any]]) -> None:
    """Raise unless a match can be played by these parameters; arguments as of `Rules.of`.

    Raises:
        UsageError: it cannot: a decay of 1, a power of 1e308, a text in place of a number.
    """
    server = _server(params, version=server_of.version(params))
    _check(server, {name: np.asarray(types[name], np.float64) for name in player_types.FIELDS})


def _server(params: Mapping[str, float | str], *, version: int) -> dict[str, float]:
    """Return the parameters of the server that enter computations."""
    names = (*server_of.DEFAULTS, *server_of.FURTHER)
    for name in names:
        if not isinstance(params.get(name, 0.0), int | float):
            raise UsageError(f"expected {name} to be a number, got {params[name]!r}")
    return {name: server_of.number(params, name, version=version) for name in names}


_MOST = 1e7
"""No parameter of a match is greater."""
_DECAYS = ("ball_decay", "player_decay")
_SHARES = ("player_rand", "ball_rand")
_POSITIVE = (
    "ball_size",
    "player_size",
    "kickable_margin",
    "tackle_dist",
    "tackle_width",
    "maxpower",
    "ball_speed_max",
    "simulator_step",
)


def _check(server: Mapping[str, float], types: Mapping[str, NDArray[np.float64]]) -> None:
    """Raise unless a match can be played by these parameters.

    Raises:
        UsageError: it cannot.
    """
    for name, values in {**server, **types}.items():
        given = np.atleast_1d(np.asarray(values, np.float64))
        low, high, words = -_MOST, _MOST, f"a number within {_MOST:.0e}"
        if name in _DECAYS:
            low, high, words = np.nextafter(0.0, 1.0), np.nextafter(1.0, 0.0), "more than 0 and less than 1"
        elif name in _SHARES:
            low, high, words = 0.0, np.nextafter(1.0, 0.0), "at least 0 and less than 1"
        elif name in _POSITIVE:
            low, words = np.nextafter(0.0, 1.0), f"more than 0 and at most {_MOST:.0e}"
        # Written so that NaN is wrong.
        wrong = ~((given >= low) & (given <= high))
        if wrong.any():
            raise UsageError(f"expected {name} to be {words}, got {given[wrong][0]:g}")
    if 0 < server["dash_angle_step"] < _FINEST_STEP:
        step = server["dash_angle_step"]
        raise UsageError(f"expected a dash_angle_step of 0 or at least {_FINEST_STEP:g} degrees, got {step:g}")
    fastest = 100.0 * np.abs(types["dash_power_rate"]).max(initial=0.0)
    if fastest > _FASTEST_DASH:
        raise UsageError(f"expected a dash_power_rate of at most {_FASTEST_DASH / 100:g}, got {fastest / 100:g}")


_FINEST_STEP = 0.1
"""Degrees between the directions of dashes: a tenth of that of the latest servers. Each of them is looked at."""
_FASTEST_DASH = 10.0
"""Metres per cycle of a dash with all power: ten times what a server draws."""
