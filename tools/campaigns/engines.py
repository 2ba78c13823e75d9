"""Who flies shards: processes of this machine, Dask's workers, or the tasks of a Slurm array. The first two hand back what
a shard became as soon as it is there, in any order."""
import concurrent.futures
import contextlib
import itertools
import logging
import os
import shlex

import shard
import sweep

ARRAY_MAX = 1000  # tasks: MaxArraySize is 1001 where nobody has changed it
SCRIPT = """#!/bin/sh
# A Slurm array of the shards that were missing when tools/campaign wrote this. A task that is lost costs its shard: Slurm
# queues it again, or the same tools/campaign line writes this anew.
#SBATCH --job-name=pflight-{scenario}
#SBATCH --array={array}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --output="{folder}/slurm/%a.log"
exec {tool} fly {quoted} "$SLURM_ARRAY_TASK_ID"
"""


def on_processes(jobs, workers):
    """A thread waits for each runner."""
    pool = concurrent.futures.ThreadPoolExecutor(workers)
    try:
        for future in concurrent.futures.as_completed([pool.submit(shard.fly, job) for job in jobs]):
            yield future.result()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def on_dask(jobs, workers, scheduler=None):
    """A shard whose worker dies goes to another one; more than three such deaths are taken to be its own fault."""
    os.environ["DASK_LOGGING__DISTRIBUTED"] = "critical"  # of the workers; a lost one is no news
    logging.disable()
    import cloudpickle
    import distributed
    cloudpickle.register_pickle_by_value(shard)
    fly = shard.fly  # a lambda of it is sent as code, where the function itself would be sent as a name
    with contextlib.ExitStack() as stack:
        try:
            where = scheduler or stack.enter_context(distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None))
            client = stack.enter_context(distributed.Client(where, timeout=20))
            futures = [client.submit(lambda job: fly(job), job, key=f"{job['campaign']}-{job['shard']}") for job in jobs]
            for future in distributed.as_completed(futures):
                yield future.result()
        except Exception as error:  # no list of Dask's own is complete
            raise sweep.Failure(f"Dask: {' '.join(str(error).split())}") from error


def ranges(numbers):
    """0-3,5 of 0 1 2 3 5."""
    groups = [[n for _, n in group] for _, group in itertools.groupby(enumerate(numbers), lambda pair: pair[1] - pair[0])]
    return ",".join(f"{group[0]}-{group[-1]}" if len(group) > 1 else str(group[0]) for group in groups)


def slurm_script(missing, folder):
    if len(missing) > ARRAY_MAX:
        raise sweep.Failure(f"{len(missing)} shards are more than the {ARRAY_MAX} tasks of an array: --shard with more seeds", 2)
    return SCRIPT.format(scenario=folder.plan["scenario"], folder=folder.path, quoted=shlex.quote(str(folder.path)),
                         array=ranges(missing), tool=shlex.quote(str(sweep.ROOT / "tools/campaign")))
