/* MRPT: its CParticleFilter over a class of ours for the model, as its tutorial has it: particles by value, its normals,
 * systematic resampling below an ESS of one half. */
#include "work.h"

#include <mrpt/bayes/CParticleFilter.h>
#include <mrpt/bayes/CParticleFilterCapable.h>
#include <mrpt/bayes/CParticleFilterData.h>
#include <mrpt/random/RandomGenerators.h>

using namespace mrpt::bayes;

struct State {
    double east, north, speed, heading;
};

static work_t work;
static double now_throttle, now_tan_steer;
static const double *now_z;

class Vehicle : public CParticleFilterData<State, particle_storage_mode::VALUE>,
                public CParticleFilterDataImpl<Vehicle, CParticleFilterData<State, particle_storage_mode::VALUE>::CParticleList>
{
  public:
    unsigned resampled = 0;

    void performSubstitution(const std::vector<size_t> &indices) override
    {
        resampled++;
        CParticleFilterDataImpl<Vehicle, CParticleList>::performSubstitution(indices);
        for (auto &particle : m_particles) { /* MRPT 2.5.8 keeps the old weights: it would count them twice */
            particle.log_w = 0.0;
        }
    }

    void prediction_and_update_pfStandardProposal(const mrpt::obs::CActionCollection *, const mrpt::obs::CSensoryFrame *,
                                                  const CParticleFilter::TParticleFilterOptions &) override
    {
        auto &random = mrpt::random::getRandomGenerator();
        for (auto &particle : m_particles) {
            State &x = particle.d;
            const double v = x.speed;
            x.east += work.dt * (v * std::cos(x.heading) + work.sigma_position * random.drawGaussian1D_normalized());
            x.north += work.dt * (v * std::sin(x.heading) + work.sigma_position * random.drawGaussian1D_normalized());
            x.speed += work.dt *
                       (work.power * now_throttle / std::max(v, work.speed_min) - work.drag_area * v * v) / work.mass;
            x.heading += work.dt * v * now_tan_steer / work.wheelbase;
            const double a = x.east - now_z[0], b = x.north - now_z[1], c = x.speed - now_z[2];
            particle.log_w -= 0.5 * (a * a + b * b + c * c) / (work.sigma_seen * work.sigma_seen);
        }
    }
};

static CParticleFilter filter;
static Vehicle *vehicle;

void peer_start(const work_t *w, unsigned n, unsigned seed)
{
    work = *w;
    delete vehicle;
    vehicle = new Vehicle;
    vehicle->m_particles.resize(n);
    for (auto &particle : vehicle->m_particles) {
        particle.d = State{w->start[0], w->start[1], w->start[2], w->start[3]};
        particle.log_w = 0.0;
    }
    mrpt::random::getRandomGenerator().randomize(seed);
    filter.m_options.PF_algorithm = CParticleFilter::pfStandardProposal;
    filter.m_options.resamplingMethod = CParticleFilter::prSystematic;
    filter.m_options.BETA = 0.5;
    filter.m_options.sampleSize = n;
}

/* MRPT has no mean of its own for such particles; taken after its resampling, as its classes do. */
void peer_cycle(double throttle, double steer, const double *z, double *mean)
{
    now_throttle = throttle;
    now_tan_steer = std::tan(steer);
    now_z = z;
    filter.executeOn(*vehicle, nullptr, nullptr);
    double sum = 0.0, m[4] = {0.0, 0.0, 0.0, 0.0};
    for (const auto &particle : vehicle->m_particles) {
        const double w = std::exp(particle.log_w);
        sum += w;
        m[0] += w * particle.d.east;
        m[1] += w * particle.d.north;
        m[2] += w * particle.d.speed;
        m[3] += w * particle.d.heading;
    }
    for (int d = 0; d < 4; d++) {
        mean[d] = m[d] / sum;
    }
}

unsigned peer_resampled(void)
{
    return vehicle->resampled;
}
