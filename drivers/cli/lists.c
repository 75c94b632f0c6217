/* lists.c: comma lists of the command line. */
#include "cli/lists.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/options.h"
#include "material/form.h"

int flesh_list_each(const char *option, const char *text, int (*take)(void *data, const char *item), void *data)
{
  char item[FLESH_LIST_ITEM];
  int status = FLESH_OK;
  if (!*text) return flesh_fail(FLESH_ERR_ARGUMENT, "--%s is empty; it must be a list with commas", option);
  while (*text && !status) {
    const size_t length = strcspn(text, ","), most = sizeof item - 1;
    snprintf(item, sizeof item, "%.*s", (int)(length < most ? length : most), text);
    status = take(data, item);
    text += length + (text[length] == ',');
  }
  return status;
}

int flesh_list_fail_twice(const char *option, const char *item)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has %.100s twice; once is enough", option, item);
}

typedef struct numbers {
  const char *option;
  flesh_list_range range;
  int room, *count;
  double *values;
} numbers;

static int take_number(void *data, const char *item)
{
  static const char *const valid[] = {"positive", "in (-1, 0.5]", "a whole number from 1 on"};
  const numbers *n = data;
  double value = NAN;
  const int is_number = !flesh_option_number(item, &value);
  const int fits = n->range == FLESH_LIST_POISSON  ? value > -1 && value <= 0.5
                   : n->range == FLESH_LIST_COUNT ? value >= 1 && value == floor(value)
                                                  : value > 0;
  if (!is_number || !fits)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has '%.100s'; every value must be %s", n->option, item, valid[n->range]);
  if (*n->count == n->room)
    return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has more than %d values", n->option, n->room);
  for (int k = 0; k < *n->count; k++)
    if (n->values[k] == value) return flesh_list_fail_twice(n->option, item);
  n->values[(*n->count)++] = value;
  return FLESH_OK;
}

int flesh_list_numbers(const char *option, const char *text, flesh_list_range range, int room, double *values,
                       int *count)
{
  numbers n = {option, range, room, count, values};
  *count = 0;
  return flesh_list_each(option, text, take_number, &n);
}

typedef struct words {
  const char *option;
  const char *const *names;
  int *chosen, *count;
} words;

static int take_word(void *data, const char *item)
{
  const words *w = data;
  char known[512] = "";
  int place = 0;
  while (w->names[place] && strcmp(w->names[place], item)) place++;
  if (!w->names[place]) {
    for (int k = 0; w->names[k]; k++) flesh_text_add(known, sizeof known, "%s%s", k ? ", " : "", w->names[k]);
    return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has '%.100s'; it must be a list of some of %s", w->option, item, known);
  }
  for (int k = 0; k < *w->count; k++)
    if (w->chosen[k] == place) return flesh_list_fail_twice(w->option, item);
  w->chosen[(*w->count)++] = place;
  return FLESH_OK;
}

int flesh_list_words(const char *option, const char *text, const char *const *names, int *chosen, int *count)
{
  words w = {option, names, chosen, count};
  *count = 0;
  return flesh_list_each(option, text, take_word, &w);
}

int flesh_list_elements(const char *option, const char *text, flesh_element *elements, int *count)
{
  const char *names[FLESH_ELEMENT_COUNT] = {NULL};
  int chosen[FLESH_ELEMENT_COUNT];
  for (int e = FLESH_ELEMENT_TET4; e < FLESH_ELEMENT_COUNT; e++)
    names[e - FLESH_ELEMENT_TET4] = flesh_element_name((flesh_element)e);
  const int status = flesh_list_words(option, text, names, chosen, count);
  for (int k = 0; k < *count; k++) elements[k] = (flesh_element)(FLESH_ELEMENT_TET4 + chosen[k]);
  return status;
}

typedef struct energies {
  int room, *count;
  flesh_energy *energies;
  flesh_constants *constants; /* NULL: items have no constants */
} energies;

static int take_energy(void *data, const char *item)
{
  const energies *e = data;
  const char *dot = e->constants ? strchr(item, '.') : NULL;
  char name[64];
  flesh_energy energy;
  snprintf(name, sizeof name, "%.*s", dot ? (int)(dot - item) : (int)sizeof name - 1, item);
  int status = flesh_energy_from_name(name, &energy);
  if (status) return flesh_fail_within(status, "--energies: ");
  flesh_constants constants = flesh_form_default_constants(energy);
  if (dot) status = flesh_constants_from_name(dot + 1, &constants);
  for (int k = 0; k < *e->count && !status; k++)
    if (e->energies[k] == energy && (!e->constants || e->constants[k] == constants))
      status = flesh_list_fail_twice("energies", item);
  if (!status && *e->count == e->room)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "--energies has more than %d values", e->room);
  if (status) return status;
  if (e->constants) e->constants[*e->count] = constants;
  e->energies[(*e->count)++] = energy;
  return FLESH_OK;
}

int flesh_list_energies(const char *text, int room, flesh_energy *chosen, flesh_constants *constants, int *count)
{
  energies e = {room, count, chosen, constants};
  *count = 0;
  return flesh_list_each("energies", text, take_energy, &e);
}

int flesh_list_parse(const char *text, int room, double *values)
{
  char part[64];
  for (int count = 0; count < room; text++) {
    size_t length = strcspn(text, ",");
    if (length >= sizeof part) return 0;
    memcpy(part, text, length);
    part[length] = 0;
    if (flesh_option_number(part, &values[count++])) return 0;
    text += length;
    if (!*text) return count;
  }
  return 0;
}
