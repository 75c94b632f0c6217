/* methods.c: the registry of methods, made from FLESH_METHOD_LIST, and their parameters. */
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "time/method.h"

#define TEXT(NAME, name, text, order, doc) text,
const char *const flesh_method_names[] = {FLESH_METHOD_LIST(TEXT) "adaptive", NULL};
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

const flesh_method_row *flesh_method_controlled(flesh_method method)
{
  const flesh_method_row *row = flesh_method_find(method);
  if (row && row->controlled) row = row->controlled;
  return row && row->error ? row : NULL;
}

int flesh_method_guess(const flesh_method_memory *memory, const flesh_stage *stage, const double *a, const double *before,
                       double ahead, int which, double *u)
{
  if (which == 0 && !(memory->before < 0)) return 0;
  const double share = which == 0 ? ahead / -memory->before : 0;
  for (int d = 0; d < memory->n; d++) u[d] = (a[d] + share * (a[d] - before[d]) - stage->a0[d]) / stage->shift.a;
  return 1;
}

void flesh_method_finish(const flesh_method_row *row, flesh_method_memory *memory, const double *u, double h,
                         flesh_state *state)
{
  if (row->velocity) row->velocity(memory, state, u, h, memory->v0);
  if (row->finish) row->finish(memory, state, u, h);
  for (int d = 0; d < memory->n; d++) state->x[d] += u[d];
  if (row->position) row->position(memory, state->x);
  if (row->velocity) memcpy(state->v, memory->v0, (size_t)memory->n * sizeof *state->v);
}

const char *flesh_method_name(flesh_method method)
{
  return (size_t)method < METHODS ? flesh_method_names[method] : NULL;
}

int flesh_method_order(flesh_method method) { return (size_t)method < METHODS ? orders[method] : 0; }

void flesh_method_options_default(flesh_method_options *options)
{
#define DEFAULT(name, value, ...) .name = 1.0 * value,
  *options = (flesh_method_options){FLESH_METHOD_OPTION_LIST(DEFAULT)};
#undef DEFAULT
}

/* Refuses a value; gives the range in numbers, too, where it names another option. */
static int fail_range(const char *name, double value, const char *range, double least, double most)
{
  char numbers[64] = "";
  if (strpbrk(range, "abcdefghijklmnopqrstuvwxyz")) snprintf(numbers, sizeof numbers, " = [%g, %g]", least, most);
  return flesh_fail(FLESH_ERR_ARGUMENT, "%s is %g; it must be in %s%s", name, value, range, numbers);
}

int flesh_method_options_check(const flesh_method_options *options)
{
  FLESH_NEED({options, "options"});
#define CHECK(name, value, least, most, range, doc)                                                                    \
  if (!(options->name >= (least) && options->name <= (most)))                                                          \
    return fail_range(#name, options->name, range, least, most);
  FLESH_METHOD_OPTION_LIST(CHECK)
#undef CHECK
  if ((unsigned)options->table > FLESH_TABLE_TRBDF2)
    return flesh_fail(FLESH_ERR_ARGUMENT, "there is no table %d of runge-kutta", (int)options->table);
  return FLESH_OK;
}
