/* Guidance calls off a tape. */
#include "play.h"

bool play_standoff(play_t *p)
{
    static pfl_standoff_state_t state; /* the library's from step to step: only its zero comes off the tape */
    mark_t mark;
    pfl_standoff_t standoff;
    pfl_standoff_state_t before;
    words_next_type(&tape_standoff, &standoff, 1.0f);
    const float reach_m = words_next_float();
    const float dt_s = words_next_float();
    words_next_type(&tape_standoff_state, &before, 1.0f);
    state = before;
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_standoff_step(&standoff, reach_m, dt_s, &state);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_STANDOFF, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    words_put_type(&tape_standoff_state, &state);
    return true;
}

bool play_lvfg(play_t *p)
{
    mark_t mark;
    pfl_lvfg_t lvfg;
    pfl_uav_t uav[2];
    pfl_target_t target;
    pfl_standoff_state_t standoff;
    pfl_planar_uav_input_t command[2] = {{0.0f, 0.0f}, {0.0f, 0.0f}};
    words_next_type(&tape_lvfg, &lvfg, 1.0f);
    const uint32_t count = words_next();
    for (uint32_t k = 0u; k < 2u; k++) {
        words_next_type(&tape_uav, &uav[k], 1.0f);
    }
    words_next_type(&tape_target, &target, 1.0f);
    words_next_type(&tape_standoff_state, &standoff, 1.0f);
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_lvfg_command(&lvfg, uav, count, &target, &standoff, command);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_LVFG, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    words_put_type(&tape_command, &command[0]);
    words_put_type(&tape_command, &command[1]);
    return true;
}

bool play_nmpc_solve(play_t *p)
{
    mark_t mark;
    pfl_nmpc_t nmpc;
    pfl_nmpc_path_t target, pair;
    pfl_nmpc_plan_t plan;
    pfl_nmpc_work_t work;
    pfl_nmpc_report_t report = {0.0f, 0u};
    pfl_nmpc_problem_t problem;
    words_next_type(&tape_nmpc, &nmpc, 1.0f);
    words_next_type(&tape_uav, &problem.uav, 1.0f);
    words_next_type(&tape_nmpc_path, &target, 1.0f);
    problem.target = &target;
    problem.pair = NULL;
    if (words_next() != 0u) {
        words_next_type(&tape_nmpc_path, &pair, 1.0f);
        problem.pair = &pair;
    }
    problem.distance_m = words_next_float();
    words_next_type(&tape_nmpc_plan, &plan, 1.0f);
    PLAY_MARK(mark);
    const pfl_status_t status = pfl_nmpc_solve(&nmpc, &problem, &plan, &work, &report);
    const uint32_t stop = pfl_port_cycles();
    play_count(p, TAPE_NMPC_SOLVE, mark, stop);
    words_put(IO_OUT, (uint32_t)(int32_t)status);
    words_put_type(&tape_nmpc_plan, &plan);
    words_put_type(&tape_nmpc_report, &report);
    return true;
}
