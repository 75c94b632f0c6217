/* methods.c: the registry of methods, made from FLESH_METHOD_LIST, and their parameters. */
#include <stddef.h>

#include "base/error.h"
#include "time/method.h"

#define TEXT(NAME, name, text, order, doc) text,
const char *const flesh_method_names[] = {FLESH_METHOD_LIST(TEXT) NULL};
#undef TEXT

#define ADDRESS(NAME, name, text, order, doc) &flesh_method_##name,
static const flesh_method_row *const rows[] = {FLESH_METHOD_LIST(ADDRESS)};
#undef ADDRESS

#define ORDER(NAME, name, text, order, doc) order,
static const int orders[] = {FLESH_METHOD_LIST(ORDER)};
#undef ORDER

enum { METHODS = sizeof rows / sizeof rows[0] };

const flesh_method_row *flesh_method_find(flesh_method method)
{
  return (size_t)method < METHODS ? rows[method] : NULL;
}

const char *flesh_method_name(flesh_method method)
{
  return (size_t)method < METHODS ? flesh_method_names[method] : NULL;
}

int flesh_method_order(flesh_method method) { return (size_t)method < METHODS ? orders[method] : 0; }

void flesh_method_options_default(flesh_method_options *options)
{
  *options = (flesh_method_options){.alpha = -0.1, .beta = 0.25, .gamma = 0.5};
}

int flesh_method_options_check(const flesh_method_options *options)
{
  FLESH_NEED({options, "options"});
  if (!(options->alpha >= -1. / 3 && options->alpha <= 0))
    return flesh_fail(FLESH_ERR_ARGUMENT, "alpha is %g; it must be in [-1/3, 0]", options->alpha);
  if (!(options->gamma >= 0.5 && options->gamma <= 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "gamma is %g; it must be in [1/2, 1]", options->gamma);
  if (!(options->beta >= options->gamma / 2 && options->beta <= 1))
    return flesh_fail(FLESH_ERR_ARGUMENT, "beta is %g; it must be in [gamma/2, 1] = [%g, 1]",
                      options->beta, options->gamma / 2);
  return FLESH_OK;
}
