/* mechanisms.c: names and docs of the mechanisms. */
#include "newton/mechanisms.h"

#include <assert.h>
#include <stddef.h>

#define NAME(id, name, doc) name,
#define DOC(id, name, doc) doc,
#define BIT(id, name, doc) FLESH_TECHNIQUE_##id,

const char *const flesh_mechanism_names[] = {FLESH_MECHANISM_ROWS(NAME) NULL};
static const char *const docs[] = {FLESH_MECHANISM_ROWS(DOC)};
static const flesh_technique bits[] = {FLESH_MECHANISM_ROWS(BIT)};

enum { COUNT = sizeof bits / sizeof *bits };
static_assert(FLESH_TECHNIQUES_ALL == (1 << COUNT) - 1, "a row of every technique");

/* Returns the row of a technique; -1: there is none. */
static int row_of(flesh_technique technique)
{
  for (int k = 0; k < COUNT; k++)
    if (bits[k] == technique) return k;
  return -1;
}

const char *flesh_technique_name(flesh_technique technique)
{
  const int row = row_of(technique);
  return row < 0 ? NULL : flesh_mechanism_names[row];
}

const char *flesh_technique_doc(flesh_technique technique)
{
  const int row = row_of(technique);
  return row < 0 ? NULL : docs[row];
}
