/* lists.c: comma lists of the command line. */
#include "cli/lists.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "base/text.h"
#include "cli/options.h"
#include "material/form.h"

/* Copies the next item, cut to its room, and moves *text behind it and its comma; returns 0 at the end. */
static int next_item(const char **text, char item[FLESH_LIST_ITEM])
{
  const size_t length = strcspn(*text, ","), most = FLESH_LIST_ITEM - 1;
  if (!**text) return 0;
  snprintf(item, FLESH_LIST_ITEM, "%.*s", (int)(length < most ? length : most), *text);
  *text += length + ((*text)[length] == ',');
  return 1;
}

static int refuse_empty(const char *option, const char *text)
{
  return *text ? FLESH_OK : flesh_fail(FLESH_ERR_ARGUMENT, "--%s is empty; it must be a list with commas", option);
}

int flesh_list_each(const char *option, const char *text, int (*take)(void *data, const char *item), void *data)
{
  char item[FLESH_LIST_ITEM];
  int status = refuse_empty(option, text);
  while (!status && next_item(&text, item)) status = take(data, item);
  return status;
}

int flesh_list_fail_twice(const char *option, const char *item)
{
  return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has %.100s twice; once is enough", option, item);
}

int flesh_list_numbers(const char *option, const char *text, flesh_list_range range, int room, double *values,
                       int *count)
{
  static const char *const valid[] = {"positive", "in (-1, 0.5]", "a whole number from 1 on"};
  char item[FLESH_LIST_ITEM];
  const int status = refuse_empty(option, text);
  for (*count = 0; next_item(&text, item);) {
    double value = NAN;
    const int is_number = !flesh_option_number(item, &value);
    const int fits = range == FLESH_LIST_POISSON  ? value > -1 && value <= 0.5
                     : range == FLESH_LIST_COUNT ? value >= 1 && value == floor(value)
                                                 : value > 0;
    if (!is_number || !fits)
      return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has '%.100s'; every value must be %s", option, item, valid[range]);
    if (*count == room) return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has more than %d values", option, room);
    for (int k = 0; k < *count; k++)
      if (values[k] == value) return flesh_list_fail_twice(option, item);
    values[(*count)++] = value;
  }
  return status;
}

int flesh_list_words(const char *option, const char *text, const char *const *names, int *chosen, int *count)
{
  char item[FLESH_LIST_ITEM], known[512] = "";
  const int status = refuse_empty(option, text);
  for (*count = 0; next_item(&text, item);) {
    int place = 0;
    while (names[place] && strcmp(names[place], item)) place++;
    for (int k = 0; !names[place] && names[k]; k++) flesh_text_add(known, sizeof known, "%s%s", k ? ", " : "", names[k]);
    if (!names[place])
      return flesh_fail(FLESH_ERR_ARGUMENT, "--%s has '%.100s'; it must be a list of some of %s", option, item, known);
    for (int k = 0; k < *count; k++)
      if (chosen[k] == place) return flesh_list_fail_twice(option, item);
    chosen[(*count)++] = place;
  }
  return status;
}

int flesh_list_elements(const char *text, flesh_element *elements, int *count)
{
  const char *names[FLESH_ELEMENT_COUNT] = {NULL};
  int chosen[FLESH_ELEMENT_COUNT];
  for (int e = FLESH_ELEMENT_TET4; e < FLESH_ELEMENT_COUNT; e++)
    names[e - FLESH_ELEMENT_TET4] = flesh_element_name((flesh_element)e);
  const int status = flesh_list_words("elements", text, names, chosen, count);
  for (int k = 0; k < *count; k++) elements[k] = (flesh_element)(FLESH_ELEMENT_TET4 + chosen[k]);
  return status;
}

int flesh_list_energies(const char *text, int room, flesh_energy *chosen, flesh_constants *constants, int *count)
{
  char item[FLESH_LIST_ITEM], name[64];
  int status = refuse_empty("energies", text);
  for (*count = 0; !status && next_item(&text, item); ++*count) {
    const char *dot = constants ? strchr(item, '.') : NULL;
    flesh_energy energy;
    snprintf(name, sizeof name, "%.*s", dot ? (int)(dot - item) : (int)sizeof name - 1, item);
    status = flesh_energy_from_name(name, &energy);
    if (status) return flesh_fail_within(status, "--energies: ");
    flesh_constants given = flesh_form_default_constants(energy);
    if (dot) status = flesh_constants_from_name(dot + 1, &given);
    for (int k = 0; k < *count && !status; k++)
      if (chosen[k] == energy && (!constants || constants[k] == given)) status = flesh_list_fail_twice("energies", item);
    if (!status && *count == room)
      status = flesh_fail(FLESH_ERR_ARGUMENT, "--energies has more than %d values", room);
    if (status) return status;
    if (constants) constants[*count] = given;
    chosen[*count] = energy;
  }
  return status;
}

int flesh_list_parse(const char *text, int room, double *values)
{
  char item[FLESH_LIST_ITEM];
  const size_t length = strlen(text);
  int count = 0;
  if (length && text[length - 1] == ',') return 0;
  while (next_item(&text, item))
    if (count == room || flesh_option_number(item, &values[count++])) return 0;
  return count;
}
