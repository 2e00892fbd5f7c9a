"""What an agent of HELIOS Base would do with the ball: the planner that most agents of the league grew from.

Rules, thresholds and allowances are those of the public sources named below, of HELIOS Base and of its library librcsc
(Akiyama et al., github.com/helios-base). The code is ours: motion, dashes, turns and tackles from the physics of the
server, candidates and sequences of kicks as tables of which the best is taken.

helios-base at commit 66fd63d6f9d022423b8c4430668a2b8510353caf (5 October 2025):

    src/player/planner/action_chain_graph.cpp, strict_check_pass_generator.cpp, short_dribble_generator.cpp,
        self_pass_generator.cpp, shoot_generator.cpp, tackle_generator.cpp, field_analyzer.cpp,
        bhv_strict_check_shoot.cpp, bhv_planned_action.cpp, bhv_pass_kick_find_receiver.cpp
    src/player/sample_field_evaluator.cpp, sample_player.cpp, role_*.cpp
    src/player/basic_actions/kick_table.cpp, body_kick_one_step.cpp, body_smart_kick.cpp, body_hold_ball2008.cpp,
        body_stop_ball.cpp

librcsc at commit 078d59ff85c336f94c021adac060ef6f2e63c575 (13 March 2025):

    rcsc/common/player_type.cpp
"""
