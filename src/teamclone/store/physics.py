"""The audit of a match's physics over its tables, with findings as those of the other checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import pyarrow.compute as pc

from teamclone.dynamics.audit import Audit, audit, rules_of
from teamclone.dynamics.logged import Logged
from teamclone.errors import UsageError
from teamclone.logs import columns
from teamclone.logs.columns import Source
from teamclone.store import convert, schema
from teamclone.store.checks import Check, Finding

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, slots=True, kw_only=True)
class Physics:
    """What the audit of a match compared.

    Attributes:
        cycles: compared with the next one. compared: values by quantity, see `dynamics.residuals`.
        unknown: executed commands that no command log has; what they change is not compared.
        left_out: why nothing was compared; None where it was.
    """

    cycles: int = 0
    compared: Mapping[str, int]
    unknown: int = 0
    left_out: str | None = None


def check_physics(tables: Mapping[str, pa.Table]) -> tuple[Physics, list[Finding]]:
    """Return what the physics of one match was compared with, and the laws that it breaks.

    Args:
        tables: those of ``convert.tables_of``.
    """
    params = convert.parameters(tables[schema.PARAMETERS.name])["server"]
    try:
        rules = rules_of(params, convert.numpy_columns(schema.PLAYER_TYPES, tables[schema.PLAYER_TYPES.name]))
        found = audit(_logged(tables), rules)
    except UsageError as error:
        return Physics(compared={}, left_out=str(error)), []
    return (
        Physics(cycles=found.cycles, compared=found.compared, unknown=found.unknown),
        _findings(found),
    )


def _logged(tables: Mapping[str, pa.Table]) -> Logged:
    # Recovered commands follow from the physics: to compare them with it says nothing.
    commands = tables[schema.COMMANDS.name].filter(pc.field("source") == Source.LOGGED)
    text = commands.column("text")
    return Logged.of_columns(
        convert.numpy_columns(schema.FRAMES, tables[schema.FRAMES.name]),
        convert.numpy_columns(schema.PLAYER_STATES, tables[schema.PLAYER_STATES.name]),
        convert.numpy_columns(schema.COMMANDS, commands.select([column.name for column in columns.COMMANDS])),
        lambda index: text[index].as_py() or "",
    )


def _findings(found: Audit) -> list[Finding]:
    return [
        Finding(
            check=Check(name=deviation.law.name, about=deviation.law.about),
            rows=deviation.rows,
            cycle=deviation.cycle,
            what=deviation.what,
        )
        for deviation in found.deviations
    ]
