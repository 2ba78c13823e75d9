/* The list of scenarios, and the small things that every one of them needs. A new scenario is named here. */
#include "scenario.h"

#include "car.h"
#include "gps.h"
#include "gps_fault.h"
#include "land_vehicle.h"
#include "manoeuvre.h"
#include "replay.h"
#include "road_network.h"
#include "sharp.h"
#include "standoff.h"
#include "terrain.h"
#include "uav_trajectory.h"
#include "uwb_range.h"
#include "wind.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const scenario_t *const all_scenarios[] = {
    &land_vehicle_scenario, &uwb_range_scenario,    &standoff_scenario, &uav_trajectory_scenario, &gps_scenario,
    &wind_scenario,         &gps_fault_scenario,    &car_scenario,      &terrain_scenario,        &sharp_scenario,
    &manoeuvre_scenario,    &road_network_scenario, &replay_scenario};
const size_t all_scenarios_count = sizeof all_scenarios / sizeof all_scenarios[0];

const scenario_t *scenario_find(const char *name)
{
    for (size_t i = 0u; i < all_scenarios_count; i++) {
        if (strcmp(all_scenarios[i]->name, name) == 0) {
            return all_scenarios[i];
        }
    }
    return NULL;
}

const char *study_value(const study_t *study, const char *key)
{
    for (size_t i = 0u; i < study->scenario->settings_count; i++) {
        if (strcmp(study->scenario->settings[i].key, key) == 0) {
            return study->value[i];
        }
    }
    abort(); /* a scenario asked for a setting that it does not have */
}

bool study_is(const study_t *study, const char *key, const char *value)
{
    return strcmp(study_value(study, key), value) == 0;
}

unsigned study_choice(const study_t *study, const char *key)
{
    const char *value = study_value(study, key);
    const size_t length = strlen(value);
    const char *choice = NULL;
    unsigned index = 0u;

    for (size_t i = 0u; i < study->scenario->settings_count; i++) {
        const setting_t *setting = &study->scenario->settings[i];
        choice = strcmp(setting->key, key) == 0 ? setting->choices : choice;
    }
    while (choice != NULL && (strncmp(choice, value, length) != 0 || strchr("|", choice[length]) == NULL)) {
        choice = strchr(choice, '|');
        choice = choice == NULL ? NULL : choice + 1;
        index++;
    }
    return index;
}

double study_number(const study_t *study, const char *key)
{
    return strtod(study_value(study, key), NULL);
}

/* Appends "-WORD", with underscores for what does not belong into the name of a file. */
static void append_word(char *id, const char *word)
{
    size_t length = strlen(id);

    if (length > 0u && length + 1u < STUDY_ID_MAX) {
        id[length++] = '-';
    }
    for (; *word != '\0' && length + 1u < STUDY_ID_MAX; word++) {
        const bool fit = isalnum((unsigned char)*word) != 0 || strchr("+-._", *word) != NULL;
        id[length++] = fit ? *word : '_';
    }
    id[length] = '\0';
}

void study_id(const study_t *study, char *id)
{
    const scenario_t *scenario = study->scenario;
    char number[16];

    id[0] = '\0';
    append_word(id, scenario->name);
    append_word(id, study->filter);
    for (size_t i = 0u; i < scenario->settings_count; i++) {
        if (strcmp(study->value[i], scenario->settings[i].fallback) != 0) {
            append_word(id, scenario->settings[i].key);
            append_word(id, study->value[i]);
        }
    }
    if (study->particles != scenario->particles) {
        (void)snprintf(number, sizeof number, "%lu", (unsigned long)study->particles);
        append_word(id, "particles");
        append_word(id, number);
    }
}

metric_t *verdict_add(verdict_t *verdict, const char *name, figure_t ours)
{
    if (verdict->count == METRICS_MAX) {
        abort(); /* a scenario has more metrics than METRICS_MAX */
    }
    metric_t *metric = &verdict->metric[verdict->count++];
    *metric = (metric_t){name, ours, MISSING, MISSING, MISSING, MISSING};
    return metric;
}

metric_t *verdict_add_of(verdict_t *verdict, const char *what, const char *whose, figure_t ours)
{
    metric_t *metric = verdict_add(verdict, NULL, ours);
    char *name = verdict->name[verdict->count - 1u];

    (void)snprintf(name, sizeof verdict->name[0], "%s_%s", what, whose);
    metric->name = name;
    return metric;
}

metric_t *verdict_add_typical(verdict_t *verdict, const char *name, table_t runs, size_t column)
{
    return verdict_add(verdict, name, runs.n > 1u ? stats_median(runs, column) : stats_mean(runs, column));
}

void metric_accept(metric_t *metric, double lo, double hi)
{
    metric->lo = lo;
    metric->hi = hi;
}
