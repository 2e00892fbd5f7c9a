from teamclone.rcss.server_params import DEFAULTS

BALL_DECAY, BALL_SPEED_MAX, BALL_SIZE = (DEFAULTS[name] for name in ("ball_decay", "ball_speed_max", "ball_size"))
TURN_MARGIN_DEG, NEAR_M = 15.0, 10.0
