"""What an agent of HELIOS Base would do with the ball: the planner that most agents of the league grew from.

The rules and their numbers were read from the public sources of HELIOS Base and of its library librcsc (Akiyama et al.,
github.com/helios-base), and from logs. The code is our own, written from the physics of the server.

helios-base at commit 66fd63d6f9d022423b8c4430668a2b8510353caf (5 October 2025):

    src/player/basic_actions/body_clear_ball2009.cpp
    src/player/basic_actions/body_hold_ball2008.cpp
    src/player/basic_actions/body_smart_kick.cpp
    src/player/basic_actions/kick_table.cpp
    src/player/bhv_basic_tackle.cpp
    src/player/planner/actgen_cross.cpp
    src/player/planner/actgen_direct_pass.cpp
    src/player/planner/actgen_self_pass.cpp
    src/player/planner/actgen_shoot.cpp
    src/player/planner/actgen_short_dribble.cpp
    src/player/planner/actgen_simple_dribble.cpp
    src/player/planner/actgen_strict_check_pass.cpp
    src/player/planner/action_chain_graph.cpp
    src/player/planner/action_chain_holder.cpp
    src/player/planner/bhv_normal_dribble.cpp
    src/player/planner/bhv_pass_kick_find_receiver.cpp
    src/player/planner/bhv_planned_action.cpp
    src/player/planner/bhv_strict_check_shoot.cpp
    src/player/planner/body_force_shoot.cpp
    src/player/planner/clear_ball.cpp
    src/player/planner/clear_generator.cpp
    src/player/planner/cooperative_action.cpp
    src/player/planner/cross_generator.cpp
    src/player/planner/dribble.cpp
    src/player/planner/field_analyzer.cpp
    src/player/planner/hold_ball.cpp
    src/player/planner/neck_turn_to_receiver.cpp
    src/player/planner/pass.cpp
    src/player/planner/positioning.cpp
    src/player/planner/predict_state.cpp
    src/player/planner/self_pass_generator.cpp
    src/player/planner/shoot.cpp
    src/player/planner/shoot_generator.cpp
    src/player/planner/short_dribble_generator.cpp
    src/player/planner/simple_pass_checker.cpp
    src/player/planner/strict_check_pass_generator.cpp
    src/player/planner/tackle_generator.cpp
    src/player/sample_field_evaluator.cpp

librcsc at commit 078d59ff85c336f94c021adac060ef6f2e63c575 (13 March 2025):

    rcsc/action/body_tackle_to_point.h
    rcsc/common/player_type.cpp
    rcsc/player/intercept.cpp
    rcsc/player/intercept.h
    rcsc/player/intercept_simulator_player.cpp
    rcsc/player/intercept_simulator_player.h
    rcsc/player/intercept_simulator_self.h
    rcsc/player/intercept_simulator_self_v13.cpp
    rcsc/player/intercept_simulator_self_v13.h
    rcsc/player/intercept_simulator_self_v17.cpp
    rcsc/player/intercept_simulator_self_v17.h
    rcsc/player/intercept_simulator_self_v7.cpp
    rcsc/player/intercept_simulator_self_v7.h
    rcsc/player/intercept_table.cpp
    rcsc/player/intercept_table.h
    rcsc/soccer_math.h
    rcsc/util/soccer_math.cpp
"""
