/* busy_bar.h: a bar with every kind of constraint and event, for tests of time integration. */
#ifndef FLESH_TEST_BUSY_BAR_H
#define FLESH_TEST_BUSY_BAR_H

#include "body.h"
#include "test.h"

/* Adds a prescribed motion that turns and changes its velocity abruptly, a roller that is released, and a spring that
 * is switched on and off, all at times at which no step ends. */
static inline void make_busy_bar(flesh_mass mass, test_body *b)
{
  const flesh_keyframe turn[] = {
      {0, {0}, {0}}, {0.1307, {0.05, 0, 0.1}, {0.3, 0.1, 0}}, {0.4, {0, 0.1, 0}, {0, 0.5, 0.2}}};
  const flesh_keyframe target[] = {{0, {3, 1, 1}, {0}}, {0.2, {3.5, 1, 2}, {0}}, {1, {3, 0, 1}, {0}}};
  CHECK_OK(test_body_create(test_box(3, 1, 1, 3, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, mass, 1, b));
  CHECK_OK(test_body_gravity(b, 0, 0, -2));
  CHECK_OK(test_body_hold(b, 0, 0, FLESH_AXES_ALL, &(flesh_motion){3, turn, {0, 0.5, 0.5}, 0}, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(b, 0, 3, FLESH_AXIS_Z, NULL, -INFINITY, 0.2617));
  flesh_effect *spring = NULL;
  CHECK_OK(flesh_effect_spring(&b->body, (double[]){3, 1, 1}, 2e3, &(flesh_motion){3, target, {0}, 1}, 0.0913, 0.3111,
                               &spring));
  CHECK_OK(flesh_system_add_effect(b->system, &spring));
  CHECK_OK(flesh_system_finalize(b->system));
}

#endif
