"""filterpy, particles and pfilter on the work of the peers (work.h tells the file and what is printed): numpy arrays all.

    python_peers.py NAME FILE N FLIGHTS REPETITIONS
"""
import sys
import time

import numpy as np


class Work:
    def __init__(self, path):
        numbers = np.array(open(path, encoding="ascii").read().split(), dtype=float)
        self.flights, self.steps = int(numbers[0]), int(numbers[1])
        (self.dt, self.power, self.drag, self.mass, self.base, self.least, self.sigma, self.seen) = numbers[2:10]
        self.start = numbers[10:14]
        self.data = numbers[14:].reshape(self.flights, self.steps, 7)

    def moved(self, x, throttle, steer):
        """A step of the model, noise and all; x has a particle a row."""
        v, heading = x[:, 2], x[:, 3]
        to = np.empty_like(x)
        noise = np.random.standard_normal((len(x), 2))
        to[:, 0] = x[:, 0] + self.dt * (v * np.cos(heading) + self.sigma * noise[:, 0])
        to[:, 1] = x[:, 1] + self.dt * (v * np.sin(heading) + self.sigma * noise[:, 1])
        to[:, 2] = v + self.dt * (self.power * throttle / np.maximum(v, self.least) - self.drag * v * v) / self.mass
        to[:, 3] = heading + self.dt * v * np.tan(steer) / self.base
        return to

    def log_likelihood(self, x, z):
        return -0.5 * np.sum(((x[:, :3] - z) / self.seen) ** 2, axis=1)


class Filterpy:
    """filterpy has resamplers, no particle filter: the loop around them is plain numpy, as in its author's book."""

    def __init__(self, work, n, flight):
        from filterpy.monte_carlo import systematic_resample
        self.resample, self.work, self.flight = systematic_resample, work, flight
        self.x, self.w, self.resampled = np.tile(work.start, (n, 1)), np.full(n, 1.0 / n), 0

    def cycle(self, k):
        step = self.work.data[self.flight, k]
        self.x = self.work.moved(self.x, step[0], step[1])
        self.w *= np.exp(self.work.log_likelihood(self.x, step[2:5]))
        self.w /= self.w.sum()
        mean = self.w @ self.x
        if 1.0 / np.sum(self.w * self.w) < 0.5 * len(self.w):
            index = self.resample(self.w)
            self.x, self.w = self.x[index], np.full(len(self.w), 1.0 / len(self.w))
            self.resampled += 1
        return mean


class Particles:
    """particles.SMC over a Feynman-Kac model; its moments collected at every step. It resamples at the start of a step."""

    def __init__(self, work, n, flight):
        import particles
        from particles import collectors

        class Model(particles.FeynmanKac):
            def M0(self, size):
                return work.moved(np.tile(work.start, (size, 1)), *work.data[flight, 0, :2])

            def M(self, t, xp):
                return work.moved(xp, *work.data[flight, t, :2])

            def logG(self, t, xp, x):
                return work.log_likelihood(x, work.data[flight, t, 2:5])

        self.smc = particles.SMC(fk=Model(T=work.steps), N=n, resampling="systematic", ESSrmin=0.5,
                                 collect=[collectors.Moments()])
        self.resampled = 0

    def cycle(self, _):
        next(self.smc)
        self.resampled += int(self.smc.rs_flag)
        return self.smc.summaries.moments[-1]["mean"]


class Pfilter:
    """pfilter.ParticleFilter; it computes a covariance and an entropy too."""

    def __init__(self, work, n, flight):
        import pfilter
        self.work, self.flight, self.resampled = work, flight, 0
        self.step = work.data[flight, 0]

        def resample(weights):
            self.resampled += 1
            return pfilter.systematic_resample(weights)

        self.pf = pfilter.ParticleFilter(
            prior_fn=lambda size: np.tile(work.start, (size, 1)), n_particles=n, n_eff_threshold=0.5,
            resample_fn=resample, observe_fn=lambda x: x[:, :3], dynamics_fn=lambda x: work.moved(x, *self.step[:2]),
            weight_fn=lambda x, z: np.exp(work.log_likelihood(x, z)))

    def cycle(self, k):
        self.step = self.work.data[self.flight, k]
        self.pf.update(self.step[2:5])
        return self.pf.mean_state


def main():
    name, path, n, flights, repetitions = sys.argv[1], sys.argv[2], *map(int, sys.argv[3:6])
    peer_of = {"filterpy": Filterpy, "particles": Particles, "pfilter": Pfilter}[name]
    work, square, ns, resampled = Work(path), 0.0, 0.0, 0
    for flight in range(flights):
        best = np.full(work.steps, np.inf)
        for repetition in range(repetitions):
            np.random.seed(flight + 1)
            peer = peer_of(work, n, flight)
            for k in range(work.steps):
                begin = time.perf_counter_ns()
                mean = peer.cycle(k)
                best[k] = min(best[k], time.perf_counter_ns() - begin)
                if repetition == 0:
                    square += np.sum((mean[:2] - work.data[flight, k, 5:7]) ** 2)
            resampled += peer.resampled if repetition == 0 else 0
        ns += best.sum()
    print(f"rmse {np.sqrt(square / (flights * work.steps)):.6f}")
    print(f"ns {ns / (flights * work.steps * n):.3f}")
    print(f"resampled {resampled / (flights * work.steps):.4f}")


if __name__ == "__main__":
    main()
