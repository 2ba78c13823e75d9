/* Orocos BFL: its bootstrap filter, dynamic resampling by its multinomial scheme. The models are its ConditionalPdf, with
 * no more in them than the work asks for, and its own normals. */
#include "work.h"

#include <bfl/filter/bootstrapfilter.h>
#include <bfl/model/measurementmodel.h>
#include <bfl/model/systemmodel.h>
#include <bfl/pdf/conditionalpdf.h>
#include <bfl/wrappers/rng/rng.h>

using namespace BFL;
using namespace MatrixWrapper;

static work_t work;

class Motion : public ConditionalPdf<ColumnVector, ColumnVector>
{
  public:
    Motion() : ConditionalPdf<ColumnVector, ColumnVector>(4, 2)
    {
    }
    virtual Motion *Clone() const
    {
        return new Motion(*this);
    }
    virtual bool SampleFrom(Sample<ColumnVector> &sample, int, void *) const
    {
        const ColumnVector &x = ConditionalArgumentGet(0);
        const ColumnVector &u = ConditionalArgumentGet(1); /* throttle, tan(steer) */
        const double v = x(3);
        ColumnVector &to = sample.ValueGet();
        to(1) = x(1) + work.dt * (v * cos(x(4)) + work.sigma_position * rnorm(0.0, 1.0));
        to(2) = x(2) + work.dt * (v * sin(x(4)) + work.sigma_position * rnorm(0.0, 1.0));
        to(3) = v + work.dt * (work.power * u(1) / std::max(v, work.speed_min) - work.drag_area * v * v) / work.mass;
        to(4) = x(4) + work.dt * v * u(2) / work.wheelbase;
        return true;
    }
};

class Seen : public ConditionalPdf<ColumnVector, ColumnVector>
{
  public:
    Seen() : ConditionalPdf<ColumnVector, ColumnVector>(3, 1)
    {
    }
    virtual Seen *Clone() const
    {
        return new Seen(*this);
    }
    virtual Probability ProbabilityGet(const ColumnVector &z) const
    {
        const ColumnVector &x = ConditionalArgumentGet(0);
        double sum = 0.0;
        for (int k = 1; k <= 3; k++) {
            const double miss = (x(k) - z(k)) / work.sigma_seen;
            sum += miss * miss;
        }
        return exp(-0.5 * sum);
    }
};

/* Counts its resamplings. */
class Filter1 : public BootstrapFilter<ColumnVector, ColumnVector>
{
  public:
    unsigned resampled;
    Filter1(MCPdf<ColumnVector> *prior, double threshold)
        : BootstrapFilter<ColumnVector, ColumnVector>(prior, 0, threshold), resampled(0)
    {
    }

  protected:
    virtual bool Resample()
    {
        resampled++;
        return BootstrapFilter<ColumnVector, ColumnVector>::Resample();
    }
};

static Motion motion;
static Seen seen;
static SystemModel<ColumnVector> system_model(&motion);
static MeasurementModel<ColumnVector, ColumnVector> measurement_model(&seen);
static MCPdf<ColumnVector> *prior;
static Filter1 *filter;

void peer_start(const work_t *w, unsigned n, unsigned)
{
    work = *w;
    delete filter;
    delete prior;
    ColumnVector start(4);
    for (int d = 0; d < 4; d++) {
        start(d + 1) = w->start[d];
    }
    Sample<ColumnVector> one(4);
    one.ValueSet(start);
    std::vector<Sample<ColumnVector> > samples(n, one);
    prior = new MCPdf<ColumnVector>(n, 4);
    prior->ListOfSamplesSet(samples);
    filter = new Filter1(prior, 0.5 * n);
}

void peer_cycle(double throttle, double steer, const double *z, double *mean)
{
    ColumnVector u(2), measured(3);
    u(1) = throttle;
    u(2) = tan(steer);
    for (int k = 0; k < 3; k++) {
        measured(k + 1) = z[k];
    }
    filter->Update(&system_model, u, &measurement_model, measured);
    const ColumnVector x = filter->PostGet()->ExpectedValueGet();
    for (int d = 0; d < 4; d++) {
        mean[d] = x(d + 1);
    }
}

unsigned peer_resampled(void)
{
    return filter->resampled;
}
