"""The bytes of game logs (.rcg, versions 1 to 6 and JSON) and command logs (.rcl) as columns."""

from teamclone.logs.match import Match, Problem, Severity, Team
from teamclone.logs.read import LogPair, find_matches, read_match, read_pair

__all__ = ["LogPair", "Match", "Problem", "Severity", "Team", "find_matches", "read_match", "read_pair"]
