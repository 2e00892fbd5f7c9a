"""Numbers that the layers and heads of all networks share, whether PyTorch or these kernels compute them.

Free of Numba, so that settings can name them.
"""

from __future__ import annotations

import math

from teamclone.rcss import pitch
from teamclone.rcss.players import N_TEAM

ACTIVATIONS = ("relu", "gelu", "silu", "tanh")
"""Hidden activations."""

DEGREE = math.pi / 180.0
LEAST_ANGLE = 0.03 * DEGREE
LEAST_POWER = 0.03
LEAST_PLACE = 0.03
"""Smallest scales: agents write arguments to the thousandth, and no density may run away."""
MEDOID_COMPONENTS = 128
"""Components among which a median is looked for: those with the greatest shares."""

TARGET_COLUMNS = 10
"""Inputs that each target point gives."""
PLACE_X, PLACE_Y = 0.75 * pitch.HALF_LENGTH, 0.75 * pitch.HALF_WIDTH
"""Metres of a target point from the middle of the pitch, for outputs of 1."""
TURN_DEG = 15.0
"""Agents of the league dash without a turn at targets closer to straight ahead."""

ATTENTION_HEADS = 4
"""Heads of attention over the other players."""
PLAYER_COLUMNS = 17
"""Inputs of each of them, and of the goal."""
TARGETS = N_TEAM
"""Places to kick to: the team mates of the actor, then the goal."""
PASS_SPEED = 2.7
"""Ball speed of a hard pass, metres per cycle."""
RUN_SPEED = 0.9
"""Speed of a running opponent, metres per cycle."""
NEVER_CYCLES = 20.0

BALL_COMPONENTS = 3
"""Components of a kick that begin at the ball itself."""
DRIBBLES = (1, 2, 3, 4, 5, 7, 10)
"""Cycles after which a dribbler reaches the ball again."""
LEAD_M = 12.0
"""Metres from a team mate, the goal's middle or the ball to the target, for an output of 1."""
TOUCH_M = 3.0
"""Metres from the dribbler's later place to the target of a dribble, for an output of 1."""
AHEAD_M = 0.6
"""Metres in front of a dribbler at which the ball is to be."""
N_COMPONENTS = TARGETS + BALL_COMPONENTS + len(DRIBBLES)
"""Components of a kick whose targets the network chooses."""
USUAL_ERROR = 0.003
"""Metres per cycle between the planned and the real velocity of the ball, before training."""
IMPOSSIBLE = -30.0
"""Logit of a way that the plan does not have."""
LEAST_GAIN = 5e-3
"""Smallest speed that a unit of kick power is taken to give."""
MOST_KICK = 150.0
"""Greatest power that a kick is taken to want; the server clips it."""
TYPICAL_KICK_POWER, TYPICAL_KICK_ANGLE = 5.0, 6 * DEGREE
TYPICAL_DASH, TYPICAL_TURN, TYPICAL_PLACE = 3.0, 2 * DEGREE, 2.0
"""Scales of components before training."""

LEADS_M, LEAD_ANGLES = (3.0, 8.0), (0.0, 60.0, 120.0, 180.0, -120.0, -60.0)
"""Metres and degrees, of the pitch, from a team mate at which candidates of passes aim, beside the mate itself."""
LEADS = 1 + len(LEADS_M) * len(LEAD_ANGLES)
PASS_ARRIVALS = (1.0, 2.2)
"""Speeds with which they arrive, metres per cycle."""
SHOT_YS = (-6.0, -3.0, 0.0, 3.0, 6.0)
"""Where candidates of shots cross the goal line."""
CLEARANCES = 12
"""Directions of hard kicks to nobody."""
RUN_CYCLES = (3.0, 6.0, 10.0)
"""Cycles after which the actor has the ball again after a run."""
CLOSE_SHARES = (0.4, 0.8)
"""Parts of the kickable area at which the ball is kept."""
CANDIDATE_DIRECTIONS = 12
"""Directions of runs, and of where the ball is kept, from the body."""
PASSES_TO_EACH = LEADS * len(PASS_ARRIVALS)
PASSES = (N_TEAM - 1) * PASSES_TO_EACH
N_CANDIDATES = PASSES + len(SHOT_YS) + CLEARANCES + (len(RUN_CYCLES) + len(CLOSE_SHARES)) * CANDIDATE_DIRECTIONS + 1
"""Candidates of a kick, see `candidates`: passes, those to one mate together, then shots and the others."""
CANDIDATE_COLUMNS = 36
"""What is known of each."""
CANDIDATE_REACH = 0.3
"""Metres per cycle by which an output of 1 changes the velocity of a candidate, along it and across."""

INCOMES = 6
"""Components of dash power that are a learned multiple of what the player recovers in a cycle."""
FREE_COMPONENTS = 4
"""Components of dash power and turn moment that hang on nothing."""
FREE_HALF_TURNS = 0.75
"""Of a half turn, to either side, up to which those of a turn begin."""
DASH_REACH = 5.0
"""Units of power by which an output of 1 moves a component of a dash."""
TURN_REACH = 0.05
"""Radians by which an output of 1 moves a component of a turn that is no free one."""
DASH_DIRECTIONS = 24
"""Classes of dash direction, 15 degrees apart."""
CATCH_DIRECTIONS = 40
"""Classes of catch direction, 9 degrees apart."""
CATCH_EDGE_DEG = 22.6
"""Angle from the middle of the catch area to its far corners, 1.2 m ahead and 0.5 m aside."""
CATCH_LIMIT_DEG = 90.0
"""To which the server clips the direction of a catch (since version 17)."""
MOVE_PLACES = tuple((x, y) for x in (-45.0, -30.0, -15.0, -5.0) for y in (-12.0, 12.0))
"""Where the components of a move begin to learn, metres: places of the own half."""
MOVE_REACH_M = 10.0
"""How far from there one goes for an output of 1."""
