/* The runner's command line and its JSON: any words are refused with one line and exit code 2, or give a study; and
 * what is written about that study, with any figures, is JSON.
 *
 * The input is the words with a line feed between them. */
#include "fuzz.h"

#include "cli.h"
#include "json.h"
#include "uav_settings.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WORDS_MAX 24

/* ---- Is this JSON? (RFC 8259, by descent) ---------------------------------------------------------------------------- */

#define DEPTH_MAX 16u

static const char *skip_value(const char *at, unsigned depth);

static const char *skip_space(const char *at)
{
    while ((*at != '\0') && (strchr(" \t\r\n", *at) != NULL)) {
        at++;
    }
    return at;
}

static const char *skip_string(const char *at)
{
    REQUIRE(*at == '"');
    for (at++; *at != '"'; at++) {
        REQUIRE((unsigned char)*at >= 0x20u);
        if (*at == '\\') {
            at++;
            REQUIRE((*at != '\0') && (strchr("\"\\/bfnrtu", *at) != NULL));
            for (int k = 0; (k < 4) && (*at == 'u'); k++) {
                REQUIRE(isxdigit((unsigned char)at[k + 1]));
            }
        }
    }
    return at + 1;
}

static const char *skip_digits(const char *at)
{
    REQUIRE(isdigit((unsigned char)*at));
    return at + strspn(at, "0123456789");
}

static const char *skip_number(const char *at)
{
    at += (*at == '-') ? 1 : 0;
    at = (*at == '0') ? (at + 1) : skip_digits(at);
    at = (*at == '.') ? skip_digits(at + 1) : at;
    if ((*at == 'e') || (*at == 'E')) {
        at++;
        at = skip_digits(at + (((*at == '+') || (*at == '-')) ? 1 : 0));
    }
    return at;
}

static const char *skip_members(const char *at, char end, unsigned depth)
{
    at = skip_space(at + 1);
    while (*at != end) {
        if (end == '}') {
            at = skip_space(skip_string(at));
            REQUIRE(*at == ':');
            at = skip_space(at + 1);
        }
        at = skip_space(skip_value(at, depth + 1u));
        REQUIRE((*at == ',') || (*at == end));
        if (*at == ',') {
            at = skip_space(at + 1);
            REQUIRE(*at != end);
        }
    }
    return at + 1;
}

static const char *skip_value(const char *at, unsigned depth)
{
    static const char *const word[] = {"null", "true", "false"};
    REQUIRE(depth < DEPTH_MAX);
    if ((*at == '{') || (*at == '[')) {
        return skip_members(at, (*at == '{') ? '}' : ']', depth);
    }
    if (*at == '"') {
        return skip_string(at);
    }
    for (unsigned k = 0u; k < 3u; k++) {
        if (strncmp(at, word[k], strlen(word[k])) == 0) {
            return at + strlen(word[k]);
        }
    }
    return skip_number(at);
}

static void check_json(const text_t *text)
{
    REQUIRE(!text->spoilt && (text->bytes != NULL) && (strlen(text->bytes) == text->length));
    REQUIRE(*skip_space(skip_value(skip_space(text->bytes), 0u)) == '\0');
}

/* ---- Figures of any kind ------------------------------------------------------------------------------------------------ */

static double number(stream_t *in)
{
    const uint64_t bits = take_u64(in);
    double x;
    memcpy(&x, &bits, sizeof x);
    return ((bits & 7u) == 0u) ? (double)take_float(in) : x;
}

static void write_json(const study_t *study, const char *id, stream_t *in)
{
    char name[24];
    const plan_t plan = {.budget_reason = "5 % of \"10 Hz\""};
    outcome_t outcome = {.study = study, .plan = &plan};
    text_t text = {0};
    for (size_t k = 0u; k + 1u < sizeof name; k++) {
        const uint8_t byte = take_u8(in) & 0x7Fu;
        name[k] = (char)((byte == 0u) ? 1u : byte);
    }
    name[sizeof name - 1u] = '\0';
    for (uint32_t k = take_below(in, 3u); k > 0u; k--) {
        metric_t *metric = verdict_add(&outcome.verdict, (k == 1u) ? name : "rmse_m", (figure_t){0});
        metric->ours.mean = number(in);
        metric->ours.error = number(in);
        metric->paper = number(in);
        metric->lo = number(in);
        metric->hi = number(in);
    }
    text_add(&outcome.verdict.notes, "%s", name);
    outcome.timing.cycle = (spread_t){number(in), number(in), number(in)};
    outcome.timing.resampling = (spread_t){number(in), number(in), number(in)};
    outcome.timing.resampled_share = number(in);
    outcome.timing.budget_us = number(in);
    outcome.hash = take_u64(in);
    outcome.elapsed_s = number(in);
    json_study(&outcome, &text);
    check_json(&text);
    text_free(&text);
    const traced_t traced = {.cloud = (outcome.hash & 1u) != 0u, .look = (outcome.hash & 2u) != 0u};
    json_summary_study(&outcome, id, &traced, &text);
    check_json(&text);
    text_free(&text);
    json_look(study, &plan, 1u, &text); /* the beginning of an object */
    text_add(&text, "}");
    check_json(&text);
    text_free(&text);
    text_free(&outcome.verdict.notes);
}

/* ---- Words ---------------------------------------------------------------------------------------------------------------- */

static void check_failure(const failure_t *failure)
{
    REQUIRE(failure->exit_code == EXIT_USAGE);
    REQUIRE((strlen(failure->text) > 0u) && (strlen(failure->text) < sizeof failure->text));
    for (const char *c = failure->text; *c != '\0'; c++) {
        REQUIRE(((unsigned char)*c >= 0x20u) && (*c != 0x7F));
    }
}

static void check_study(const cli_t *cli, stream_t *in)
{
    study_t study;
    failure_t failure = {.exit_code = EXIT_PASS};
    char id[STUDY_ID_MAX];
    if (!cli_study(cli, cli->scenario, &study, &failure)) {
        check_failure(&failure);
        return;
    }
    REQUIRE((study.particles >= 1u) && (study.particles <= 1048576u) && (study.runs >= 1u));
    for (size_t k = 0u; k < study.scenario->settings_count; k++) {
        const setting_t *setting = &study.scenario->settings[k];
        REQUIRE(study.value[k] != NULL);
        if (setting->choices == NULL) {
            const double value = study_number(&study, setting->key);
            REQUIRE((value >= setting->lo) && (value <= setting->hi));
        } else {
            (void)study_choice(&study, setting->key);
        }
    }
    study_id(&study, id);
    REQUIRE((strlen(id) > 0u) && (strlen(id) < sizeof id) && (strpbrk(id, "/\\ ") == NULL));
    if (strcmp(study.scenario->name, "uav-trajectory") == 0) {
        static uav_study_t uav;
        if (!uav_read_settings(&study, &uav, &failure)) {
            check_failure(&failure);
        } else {
            REQUIRE((uav.filter_seconds <= uav.seconds) && (uav.horizons <= 4u));
        }
    }
    if ((take_u8(in) & 7u) == 0u) { /* takes ten times as long as all else */
        write_json(&study, id, in);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char name[] = "run";
    static cli_t cli;
    char *argv[WORDS_MAX + 2] = {name};
    int argc = 1;
    failure_t failure = {.exit_code = EXIT_PASS};
    char *words = malloc(size + 1u);
    memcpy(words, data, size);
    words[size] = '\0';
    for (char *at = words; (at != NULL) && (argc <= WORDS_MAX) && (size > 0u); argc++) {
        argv[argc] = at;
        at = strchr(at, '\n');
        if (at != NULL) {
            *at++ = '\0';
        }
    }
    stream_t in = stream_of(data + size, 0u);
    for (size_t k = 0u; k < size; k++) {
        in.beyond = (in.beyond ^ data[k]) * 16777619u;
    }
    if (!cli_parse(argc, argv, &cli, &failure)) {
        check_failure(&failure);
    } else {
        REQUIRE((cli.threads >= 1u) && (cli.data != NULL) && (cli.out != NULL));
        if (cli.command == COMMAND_ONE) {
            check_study(&cli, &in);
        }
    }
    free(words);
    return 0;
}
