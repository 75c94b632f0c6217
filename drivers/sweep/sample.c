/* sample.c: points that fill a cube evenly, by GSL's quasi-random sequences. */
#include <gsl/gsl_qrng.h>
#include <gsl/gsl_rng.h>
#include <math.h>

#include "base/error.h"
#include "sweep/sweep.h"

const char *const flesh_sweep_sequences[] = {"sobol", "niederreiter", "halton", "reverse-halton", "random", NULL};

/* In the order of their names; NULL: random numbers. */
static const gsl_qrng_type **const types[] = {&gsl_qrng_sobol, &gsl_qrng_niederreiter_2, &gsl_qrng_halton,
                                              &gsl_qrng_reversehalton, NULL};

int flesh_sweep_sample(int sequence, int dimensions, int count, int skip, int seed, double *points)
{
  const gsl_qrng_type *type = types[sequence] ? *types[sequence] : NULL;
  if (type && (unsigned)dimensions > type->max_dimension)
    return flesh_fail(FLESH_ERR_ARGUMENT, "sample.axes are %d; %s takes at most %u", dimensions,
                      flesh_sweep_sequences[sequence], type->max_dimension);
  gsl_rng *random = gsl_rng_alloc(gsl_rng_mt19937);
  gsl_qrng *sampler = type ? gsl_qrng_alloc(type, (unsigned)dimensions) : NULL;
  double shift[FLESH_STUDY_COLUMNS] = {0}, point[FLESH_STUDY_COLUMNS];
  if (!random || (type && !sampler)) {
    if (random) gsl_rng_free(random);
    return flesh_no_memory();
  }
  gsl_rng_set(random, (unsigned long)seed);
  for (int d = 0; sampler && seed && d < dimensions; d++) shift[d] = gsl_rng_uniform(random);
  for (int k = -skip; k < count; k++) {
    for (int d = 0; !sampler && d < dimensions; d++) point[d] = gsl_rng_uniform_pos(random);
    if (sampler) gsl_qrng_get(sampler, point);
    for (int d = 0; k >= 0 && d < dimensions; d++) points[k * dimensions + d] = fmod(point[d] + shift[d], 1);
  }
  if (sampler) gsl_qrng_free(sampler);
  gsl_rng_free(random);
  return FLESH_OK;
}
