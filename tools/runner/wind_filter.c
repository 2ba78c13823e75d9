/* pflight on the flights of `wind`: the marginalised filter of the library, or the plain one on the same eight states. */
#include "host_random.h"
#include "wind.h"

#include <math.h>
#include <stdlib.h>

#define START_OFFSET_RAD 0.105f /* 6 degrees */

/* How the constants came about. The gust is what turbulence of some 150 m at 17 m/s is like; yaw errors of 6 degrees and
 * half a minute, a fix's 3 m and 2.5 m/s (fixes of 5 Hz whose errors last for a second) were chosen on both flights
 * together, as was the wind's walk: 0.03 to 0.05 do as well. */
static pfl_wind_t make_wind(const wind_study_t *s)
{
    return (pfl_wind_t){
        .wind_walk = 0.03f,
        .gust_sigma_mps = 0.95f,
        .gust_time_s = 10.0f,
        .scale_walk = 0.002f,
        .offset_sigma_rad = START_OFFSET_RAD,
        .offset_time_s = 30.0f,
        .sigma_position_m = 3.0f,
        .sigma_velocity_mps = 2.5f,
        .dof = 4.0f,
        .start_x_m = s->epoch[0].fix.x_m,
        .start_y_m = s->epoch[0].fix.y_m,
        .start_wind_mps = 6.0f,
        .start_scale = 0.08f,
    };
}

/* ---- The plain filter: draws what the other one computes -------------------------------------------------------- */

enum { PLAIN_NOISES = 6 };

static void plain_draw(void *user, const pfl_batch_t *p)
{
    const pfl_wind_t *m = user;
    const float spread[] = {m->sigma_position_m, m->start_wind_mps, m->gust_sigma_mps};

    pfl_wind_draw(user, p);
    for (uint32_t state = PFL_WIND_X; state <= PFL_WIND_Y_GUST; state++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, state)[i] += spread[state % 3u] * PFL_NOISE(p, state)[i];
        }
    }
}

static void plain_predict(void *user, const void *u, float dt_s, const pfl_batch_t *p)
{
    const pfl_wind_t *m = user;
    const float keep = pfl_expf(-dt_s / m->gust_time_s);
    const float gust = m->gust_sigma_mps * pfl_sqrtf(1.0f - keep * keep);
    const float walk = m->wind_walk * pfl_sqrtf(dt_s);

    pfl_wind_predict(user, u, dt_s, p);
    for (uint32_t axis = 0u; axis < 2u; axis++) {
        for (uint32_t i = 0u; i < p->n; i++) {
            PFL_STATE(p, PFL_WIND_X_WIND + 3u * axis)[i] += walk * PFL_NOISE(p, 2u + axis)[i];
            PFL_STATE(p, PFL_WIND_X_GUST + 3u * axis)[i] += gust * PFL_NOISE(p, 4u + axis)[i];
        }
    }
}

/* ---- Both ------------------------------------------------------------------------------------------------------ */

static bool check(pfl_status_t status, const char *call, size_t i, failure_t *failure)
{
    return status >= 0 || fail(failure, EXIT_HARNESS, "fix %zu: %s: %s", i, call, pfl_status_string(status));
}

bool wind_filter_open(wind_filter_t *f, const wind_study_t *s, uint32_t run, failure_t *failure)
{
    host_random_t random;

    host_random_start(&random, s->seed, run, RANDOM_FILTER_SEED);
    *f = (wind_filter_t){.study = s, .wind = make_wind(s)};
    pfl_wind_start(&f->wind);
    f->sensor = (pfl_sensor_t){.loglik = pfl_wind_loglik, .user = &f->wind};
    f->config = (pfl_config_t){
        .abi = PFL_ABI,
        .particles = s->particles,
        .states = PFL_WIND_STATES,
        .noises = s->bootstrap ? PLAIN_NOISES : 2u,
        .sensor_count = 1u,
        .ess_ratio = 0.5f,
        .seed = host_random_u64(&random),
        .sensors = &f->sensor,
        .predict = s->bootstrap ? plain_predict : pfl_wind_predict,
        .draw = s->bootstrap ? plain_draw : pfl_wind_draw,
        .user = &f->wind,
    };
    f->bytes = pfl_arena_bytes(&f->config);
    f->arena = malloc(f->bytes);
    f->spare = malloc(f->bytes);
    if (f->arena == NULL || f->spare == NULL) {
        wind_filter_close(f);
        return fail(failure, EXIT_HARNESS, "no memory for %lu particles", (unsigned long)s->particles);
    }
    if (!check(pfl_init(f->arena, f->bytes, &f->config, 0u, &f->filter), "pfl_init", 0u, failure)) {
        wind_filter_close(f);
        return false;
    }
    return true;
}

void wind_filter_close(wind_filter_t *f)
{
    free(f->arena);
    free(f->spare);
}

/* The plain filter's particles have no covariance of their own: what is left is the noise of the fix. */
static void forget_covariance(pfl_wind_t *wind)
{
    for (uint32_t k = 0u; k < PFL_WIND_COV; k++) {
        wind->cov[k] = 0.0f;
    }
}

bool wind_filter_cycle(wind_filter_t *f, size_t i, failure_t *failure)
{
    const wind_epoch_t *epoch = &f->study->epoch[i];
    const pfl_wind_fix_t *fix = &epoch->fix;
    const pfl_wind_input_t input = {f->fused, fix->air_mps, fix->yaw_rad};

    if (i > 0u) {
        pfl_wind_move(&f->wind, (float)((double)(epoch->t_us - epoch[-1].t_us) * 1e-6));
    }
    if (f->study->bootstrap) {
        forget_covariance(&f->wind);
    }
    if (!check(pfl_predict(f->filter, epoch->t_us, &input), "pfl_predict", i, failure) ||
        !check(pfl_estimate(f->filter, f->mean, NULL), "pfl_estimate", i, failure)) {
        return false;
    }
    pfl_wind_weigh(&f->wind, f->mean, fix);
    if (!check(pfl_update(f->filter, 0u, epoch->t_us, fix), "pfl_update", i, failure) ||
        !check(pfl_estimate(f->filter, f->mean, NULL), "pfl_estimate", i, failure)) {
        return false;
    }
    if (!f->study->bootstrap) {
        pfl_wind_fuse(&f->wind, f->mean, fix);
        f->fused = fix;
    }
    return true;
}
