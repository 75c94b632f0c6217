/* step_length.c: chooses the lengths of steps by their errors.
 *
 * The next step is h 0.9 e^(-0.7/k) e_before^(0.4/k), e being the last two steps' errors over those allowed, and k the power
 * of h with which they fall (a PI controller: Gustafsson 1991, Hairer & Wanner 1996, IV.2), within [0.2, 2] times the last.
 * After refusals in a row k is what these show (Gustafsson 1994, ACM Transactions on Mathematical Software 20): the error of
 * a collision hardly falls with h until steps resolve it. */
#include <math.h>

#include "time/error_control.h"

static const double safety = 0.9, shortest = 0.2, longest = 2, longest_first = 10, after_failure = 0.25;
static const double least_error = 1e-6;      /* least error that lengthens a step */
static const double least_power = 0.1;
static const double rounded = 0.01; /* of a brief step: an unjudged step below it is rounding, and the next is doubled */
static const double longer_steps = 1.3, shorter_steps = 0.6; /* factors when the table changes */
enum { MOST_GAINS = 6 * FLESH_GAINS_OF_REFUSAL }; /* from which on shorter steps do not help */

double flesh_error_control_brief(const flesh_error_control *self, double h)
{
  return self->on ? fmin(h, cbrt(self->options.tolerance) * self->period) : h;
}

double flesh_error_control_propose(const flesh_error_control *self, double left)
{
  const double h = fmin(self->h > 0 ? self->h : left, self->options.max_step);
  /* Take all of `left` if the error there may be as large as allowed; not almost all, which would leave a sliver.
   * `left` is rounded. */
  return h >= safety * left && left * (1 - 1e-9) <= self->options.max_step ? left : fmin(h, left / 2);
}

int flesh_error_control_keeps_gaining(const flesh_error_control *self) { return self->gains >= MOST_GAINS; }

int flesh_error_control_misleads(const flesh_error_control *self) { return self->swings || self->gains > FLESH_GAINS_OF_REFUSAL; }

void flesh_error_control_change(flesh_error_control *self, int longer)
{
  self->h *= longer ? longer_steps : shorter_steps;
  self->before = 1;
}

/* Returns the length of the step after one that was accepted, over that one's. */
static double change(const flesh_error_control *self, double h)
{
  if (isnan(self->error)) return h < rounded * flesh_error_control_brief(self, self->period) ? longest : 1;
  const double error = fmax(self->error, least_error);
  const double factor = safety * pow(error, -0.7 / self->falls) * pow(self->before, 0.4 / self->falls);
  const double most = self->rejected + self->failed > 0 ? 1 : self->first ? longest_first : longest;
  return fmax(shortest, fmin(most, factor));
}

/* Returns the power of h with which errors fall, by the last two attempts if both were refused for their errors. */
static double shown_power(const flesh_error_control *self, double h)
{
  if (!(self->refused_h > h && self->error > 0)) return self->falls;
  return fmax(least_power, fmin(self->falls, log(self->error / self->refused_error) / log(h / self->refused_h)));
}

void flesh_error_control_learn(flesh_error_control *self, double h)
{
  if (self->refusal != FLESH_REFUSED_BY_NOTHING) {
    const int by_error = self->refusal == FLESH_REFUSED_BY_ERROR;
    self->rejected += self->refusal != FLESH_REFUSED_BY_SOLVE;
    if (self->refusal == FLESH_REFUSED_BY_ENERGY && self->gains < MOST_GAINS) self->gains += FLESH_GAINS_OF_REFUSAL;
    self->failed += self->refusal == FLESH_REFUSED_BY_SOLVE;
    self->h = h * (by_error && self->error < INFINITY ? fmax(shortest, safety * pow(self->error, -1 / shown_power(self, h)))
                                                      : self->refusal == FLESH_REFUSED_BY_ENERGY ? 0.5 : after_failure);
    if (self->refusal != FLESH_REFUSED_BY_ENERGY) self->before = 1;
    self->refused_h = by_error ? h : 0;
    self->refused_error = self->error;
    return;
  }
  flesh_part_weights_accept(&self->weights, h);
  if (h >= 0.9 * self->h) self->h = h * change(self, h);
  else if (!isnan(self->error)) {
    /* An output or an event has cut the step if it is shorter than was wanted: no controller has made that change, and
     * only the error tells what is allowed. */
    const double factor = safety * pow(fmax(self->error, least_error), -1 / self->falls);
    self->h = factor < longest ? h * factor : fmax(self->h, h * longest);
  }
  if (!isnan(self->error)) self->before = fmax(self->error, least_error);
  if (!self->rejected && !isnan(self->error) && self->gains > 0) self->gains--;
  self->first = self->rejected = self->failed = 0;
  self->refused_h = 0;
}
