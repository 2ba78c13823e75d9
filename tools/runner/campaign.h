/* `tools/run` alone: all scenarios with the studies of their campaigns, and what comes of them in a folder. */
#ifndef RUNNER_CAMPAIGN_H
#define RUNNER_CAMPAIGN_H

#include "cli.h"

/* Tables on standard output; in the folder --out: summary.json, junit.xml, and in csv/ the time series of each study,
 * its run number 0 step by step, and particles of that run. Scenarios whose recordings are missing are named and
 * skipped. Answers and *accepted as execute_one. */
bool campaign_run(const cli_t *cli, bool *accepted, failure_t *failure);

#endif
