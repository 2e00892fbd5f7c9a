"""`teamclone info`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from teamclone.logs import Match, Problem


def info(
    files: Annotated[list[Path], typer.Argument(help="Logs (.rcg, .rcl, also .gz, .xz, .zst, .bz2) or folders.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object a match, each on a line.")] = False,
) -> None:
    """Show the contents of match logs: teams, score, versions, cycles, commands, and anything odd."""
    import sys

    from teamclone.cli.common import json_text, say
    from teamclone.errors import LogError
    from teamclone.logs import find_matches, read_pair

    failed = False
    for pair in find_matches(files):
        try:
            match = read_pair(pair)
        except LogError as error:
            # The other files are still worth reading.
            say(f"teamclone: {error}", file=sys.stderr)
            failed = True
            continue
        found = summary(match)
        say(json_text(found) if as_json else as_text(found))
    if failed:
        raise typer.Exit(1)


def summary(match: Match) -> dict[str, Any]:
    """Return the object that ``info --json`` prints of a match."""
    import numpy as np

    from teamclone.rcss.commands import CommandKind
    from teamclone.rcss.playmodes import PlayMode

    cycle, commands = match.frames["cycle"], match.commands
    of_players = commands["unum"] > 0
    counts = np.bincount(commands["kind"][of_players], minlength=len(CommandKind))
    return {
        "path": printable(match.rcg_path or match.rcl_path),
        "game_log": printable(match.rcg_path),
        "command_log": printable(match.rcl_path),
        "match_id": match.match_id,
        "log_version": match.game.log_version,
        "server_version": match.game.server_version,
        "complete": match.game.complete,
        **{
            side: {
                "name": team.name,
                "score": team.score,
                "penalties_scored": team.penalties_scored,
                "penalties_missed": team.penalties_missed,
            }
            for side, team in (("left", match.left), ("right", match.right))
        },
        "frames": len(cycle),
        "play_on_frames": int(np.count_nonzero(match.frames["playmode"] == PlayMode.PLAY_ON)),
        "first_cycle": int(cycle[0]) if len(cycle) else None,
        "last_cycle": int(cycle[-1]) if len(cycle) else None,
        "commands": {kind.name.lower(): int(counts[kind]) for kind in CommandKind if counts[kind]},
        "refused_commands": int(np.count_nonzero(~commands["valid"][of_players])),
        "events": len(match.event_texts),
        "problems": [problem_json(problem) for problem in match.problems],
    }


def problem_json(problem: Problem) -> dict[str, Any]:
    """Return a problem as ``info --json`` and ``validate --json`` print it."""
    return {
        "code": problem.code,
        "severity": str(problem.severity),
        "text": problem.text,
        "path": printable(problem.path),
        "line": problem.line,
        "byte": problem.byte,
        "cycle": problem.cycle,
    }


def printable(path: Path | None) -> str | None:
    """Return a path as text that every terminal and JSON reader takes, whatever bytes are in it."""
    return None if path is None else str(path).encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def as_text(found: dict[str, Any]) -> str:
    """Return a summary for people."""
    left, right = found["left"], found["right"]
    penalties = any(team["penalties_scored"] or team["penalties_missed"] for team in (left, right))
    shoot_out = f" (penalties {left['penalties_scored']} : {right['penalties_scored']})" if penalties else ""
    server = f", rcssserver {found['server_version']}" if found["server_version"] else ""
    cycles = f" of cycles {found['first_cycle']} to {found['last_cycle']}" if found["frames"] else ""
    ranked = sorted(found["commands"].items(), key=lambda item: -item[1])
    lines = [
        found["path"],
        f"  {left['name'] or 'no team'} {left['score']} : {right['score']} {right['name'] or 'no team'}{shoot_out}",
        f"  log version {found['log_version']}{server}{'' if found['complete'] else ', not closed by the server'}",
        f"  {found['frames']} frames{cycles}, {found['play_on_frames']} in play_on",
        f"  {sum(found['commands'].values())} commands of players"
        + "".join(f"{', ' if index else ': '}{kind} {count}" for index, (kind, count) in enumerate(ranked)),
    ]
    if found["refused_commands"]:
        lines.append(f"  {found['refused_commands']} of them refused by the server's parser")
    lines += [
        f"  {problem['severity']}: "
        + "".join(f"{name} {problem[name]}: " for name in ("line", "byte", "cycle") if problem[name] is not None)
        + problem["text"]
        for problem in found["problems"]
    ]
    return "\n".join(lines)
