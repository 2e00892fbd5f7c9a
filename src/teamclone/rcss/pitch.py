"""Pitch geometry in metres. Constants of the server, not parameters of a match (rcssserver `serverparam.cpp`)."""

from __future__ import annotations

LENGTH = 105.0
WIDTH = 68.0
HALF_LENGTH = LENGTH / 2
HALF_WIDTH = WIDTH / 2
GOAL_WIDTH = 14.02
GOAL_DEPTH = 2.44
PENALTY_AREA_LENGTH = 16.5
PENALTY_AREA_WIDTH = 40.32
GOAL_AREA_LENGTH = 5.5
GOAL_AREA_WIDTH = 18.32
CENTER_CIRCLE_RADIUS = 9.15
PENALTY_SPOT_DISTANCE = 11.0
MARGIN = 5.0
MAX_X = HALF_LENGTH + MARGIN
"""Players are clipped to |x| <= MAX_X, |y| <= MAX_Y at every step."""
MAX_Y = HALF_WIDTH + MARGIN
POST_RADIUS = 0.06
"""Posts stand with their inner edge on the goal's width and their front on the goal line."""
