"""Inputs in the actor's axes: places relative to the body, times to the ball, plans, the frames before.

`layout` names the columns, `frame` has what all players of a frame share, `look` what one actor makes of it, `blocks`
fills the columns, `project` does so for many samples.
"""
