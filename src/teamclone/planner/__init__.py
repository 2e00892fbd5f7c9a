"""What an agent of HELIOS Base would do with the ball: the planner that most agents of the league grew from.

The rules and their numbers are those of the public sources of HELIOS Base and of its library librcsc (Akiyama et al.,
github.com/helios-base) named below, checked against logs. How soon players arrive, what opponents can reach, and how
safe the ball is are written from the physics of the server. Shots, tackles, dribbles, self
passes, holding the ball and sequences of kicks are tables of candidates with a value each; the candidates of passes
(`passes.py`) and the scan of kick sequences (`kick_table._add`) still go in the order of those sources.

helios-base at commit 66fd63d6f9d022423b8c4430668a2b8510353caf (5 October 2025):

    src/player/planner/action_chain_graph.cpp, strict_check_pass_generator.cpp, short_dribble_generator.cpp,
        self_pass_generator.cpp, shoot_generator.cpp, clear_generator.cpp, tackle_generator.cpp,
        field_analyzer.cpp
    src/player/sample_field_evaluator.cpp
    src/player/basic_actions/kick_table.cpp, body_hold_ball2008.cpp, body_clear_ball2009.cpp,
        body_stop_ball.cpp

librcsc at commit 078d59ff85c336f94c021adac060ef6f2e63c575 (13 March 2025):

    rcsc/common/player_type.cpp, rcsc/player/intercept_simulator_player.cpp
"""
