/* Writes the work of the peers (work.h) to stdout: FLIGHTS flights of a land vehicle with its measurements, 100 steps of
 * 0.5 s. In double precision and with a generator of its own, so that no filter has an advantage. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#define STEPS 100

static uint64_t state;

static double uniform(void) /* SplitMix64, in (0, 1) */
{
    uint64_t z = (state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return ((double)((z ^ (z >> 31)) >> 12) + 0.5) / 4503599627370496.0;
}

static double normal(void)
{
    const double radius = sqrt(-2.0 * log(uniform()));
    return radius * cos(6.283185307179586 * uniform());
}

int main(int argc, char **argv)
{
    const double dt = 0.5, power = 1e5, drag = 0.3, mass = 1250.0, base = 2.5, least = 0.5;
    const double sigma = sqrt(5.0), sigma_seen = sqrt(10.0);
    const int flights = argc == 2 ? atoi(argv[1]) : 20;
    printf("%d %d\n%.17g %g %g %g %g %g %.17g %.17g\n0 0 4 2.5\n", flights, STEPS, dt, power, drag, mass, base, least,
           sigma, sigma_seen);
    for (int f = 0; f < flights; f++) {
        double e = 0.0, n = 0.0, v = 4.0, th = 2.5;
        state = 2026u + (uint64_t)f;
        for (int k = 0; k < STEPS; k++) {
            const double throttle = 0.03;
            const double steer = (k < 45) ? -0.05 : ((k < 65) ? -0.005 : ((k < 80) ? 0.01 : -0.01));
            const double east_noise = normal();
            const double north_noise = normal();
            const double old = v;
            e += dt * old * cos(th) + dt * sigma * east_noise;
            n += dt * old * sin(th) + dt * sigma * north_noise;
            v += dt * (power * throttle / ((old > least) ? old : least) - drag * old * old) / mass;
            th += dt * old * tan(steer) / base;
            const double z0 = e + sigma_seen * normal();
            const double z1 = n + sigma_seen * normal();
            const double z2 = v + sigma_seen * normal();
            printf("%g %g %.9g %.9g %.9g %.9g %.9g\n", throttle, steer, z0, z1, z2, e, n);
        }
    }
    return 0;
}
