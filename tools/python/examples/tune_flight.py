"""Tunes the noises and the number of particles on a recorded flight, and prints the configuration in C.

    build/python-venv/bin/python tools/python/examples/tune_flight.py LOG

LOG is a folder that `tools/log import` made. The cells (# %%) run one by one in an editor that knows them, and all of them
as a script.
"""
# %% The flight, once with a first guess
import itertools
import sys

import numpy as np

import pflight as pf

log = sys.argv[1] if len(sys.argv) > 1 else "log"
first = pf.replay.fly(log, model="cv", particles=500, motion=2.0, sigma_gps=1.5)
print(f"{len(first.t_s)} fixes in {first.t_s[-1] - first.t_s[0]:.0f} s; first guess: NIS {first.mean_nis():.2f} (2 is right), "
      f"log-likelihood {first.mean_loglik():.3f} a fix")

# %% The noises that make the measured positions most likely
grid = list(itertools.product([1.0, 2.0, 4.0, 8.0], [0.25, 0.5, 1.0, 2.0]))
likely = {(motion, sigma): pf.replay.fly(log, particles=500, motion=motion, sigma_gps=sigma).mean_loglik()
          for motion, sigma in grid}
motion, sigma = max(likely, key=likely.__getitem__)
best = pf.replay.fly(log, particles=500, motion=motion, sigma_gps=sigma)
print(f"best of {len(grid)}: motion {motion:g}, sigma_gps {sigma:g}: NIS {best.mean_nis():.2f}, "
      f"log-likelihood {best.mean_loglik():.3f}")

# %% The fewest particles whose estimates lie near those of many, by the filter's own standard deviation
many = pf.replay.fly(log, particles=4000, motion=motion, sigma_gps=sigma)
spread = np.sqrt(np.trace(many.cov[:, :2, :2], axis1=1, axis2=2))
chosen = 4000
for n in [2000, 1000, 500, 250, 125]:
    few = pf.replay.fly(log, particles=n, motion=motion, sigma_gps=sigma)
    off = np.linalg.norm(few.mean[:, :2] - many.mean[:, :2], axis=1)
    share = float(np.sqrt(np.mean(off**2) / np.mean(spread**2)))
    print(f"N = {n:4d}: sampling adds {share:.2f} of the filter's standard deviation")
    if share > 0.3:
        break
    chosen = n

# %% What goes into the firmware
final, _ = pf.replay.build(log, particles=chosen, motion=motion, sigma_gps=sigma)
print(f"\nN = {chosen}: {final.arena_bytes} bytes of RAM\n")
print(final.c_config("flight"), end="")
