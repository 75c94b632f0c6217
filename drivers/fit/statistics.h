/* statistics.h: errors of fitted parameters by the linearised model, and what the measurements do not determine. */
#ifndef FLESH_FIT_STATISTICS_H
#define FLESH_FIT_STATISTICS_H

enum { FLESH_FIT_SENTENCE = 600 };

/* A direction in which the Jacobian's columns, each of length 1, have a singular value below this share of the largest is
 * not determined: differences of solves leave as much. */
static const double flesh_fit_least_share = 1e-5;
/* Changes of a combination that are a smaller share of its largest are left out. */
static const double flesh_fit_small_share = 1e-2;

/* The error of a parameter; NaN where it is not determined or stays at a bound. */
typedef struct flesh_fit_error {
  double standard, low, high; /* standard error in the parameter's unit; ends of the 95 % interval */
} flesh_fit_error;

typedef struct flesh_fit_statistics {
  int count;      /* keys */
  int freedom;    /* degrees of freedom: measured numbers less parameters that are free and determined */
  double squares; /* sum of squared residuals, each over its deviation */
  double scale;   /* root of squares / freedom: residuals, in the stated deviations; NaN without freedom */
  double quantile; /* of Student's t at 97.5 % */
  flesh_fit_error *errors;
  double *covariance;  /* [count * count] in the parameters' units; NaN where not determined */
  double *correlation; /* [count * count] */
  int sentence_count;
  char (*sentences)[FLESH_FIT_SENTENCE]; /* what is, and what is not determined */
} flesh_fit_statistics;

void flesh_fit_statistics_close(flesh_fit_statistics *statistics);

#endif
