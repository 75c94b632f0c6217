/* methods.h: the methods of the registry, for tests that apply to all of them, and steps that errors choose. */
#ifndef FLESH_TEST_METHODS_H
#define FLESH_TEST_METHODS_H

#include "flesh/integrator.h"
#include "test.h"

/* Lets errors choose an integrator's steps. */
static inline void test_control(flesh_integrator *integrator, double tolerance)
{
  flesh_adaptive_options adaptive;
  flesh_adaptive_options_default(&adaptive);
  adaptive.control = 1;
  adaptive.tolerance = tolerance;
  CHECK_OK(flesh_integrator_set_adaptive(integrator, &adaptive));
}

/* Kinds of methods, combined with |. */
typedef enum test_methods {
  TEST_FIXED_STEPS = 1, /* also runge-kutta, whose error is often dominated by its solves and too small to show an order */
  TEST_ADAPTIVE = 2, /* IDA, which varies its order */
  TEST_STATIC = 4,
  TEST_MOVING = TEST_FIXED_STEPS | TEST_ADAPTIVE
} test_methods;

static inline test_methods test_kind_of(flesh_method method)
{
  return method == FLESH_METHOD_STATIC ? TEST_STATIC : flesh_method_order(method) > 0 ? TEST_FIXED_STEPS : TEST_ADAPTIVE;
}

/* Returns the first method from `method` on that is of these kinds; after the last, one without a name. */
static inline flesh_method test_method_from(int method, unsigned kinds)
{
  while (flesh_method_name((flesh_method)method) && !(test_kind_of((flesh_method)method) & kinds)) method++;
  return (flesh_method)method;
}

/* Loops over the methods of these kinds: for_every_method(method, TEST_MOVING) {...}. */
#define for_every_method(method, kinds)                                                        \
  for (flesh_method method = test_method_from(0, kinds); flesh_method_name(method);            \
       method = test_method_from((int)method + 1, kinds))

#endif
