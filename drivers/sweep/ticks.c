/* ticks.c: queries for a picture, and the distinct values along its axes. */
#include <stdio.h>
#include <string.h>

#include "base/error.h"
#include "picture/plot_text.h"
#include "cli/safe_text.h"
#include "sweep/plot.h"

int flesh_sweep_plot_prepare(flesh_sweep_picture *p, sqlite3_stmt **query, char *sql)
{
  if (!sql) return flesh_fail(FLESH_ERR_MEMORY, "out of memory");
  int status = FLESH_OK;
  if (sqlite3_prepare_v2(p->store.database, sql, -1, query, NULL))
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: --x %s --y %s%s%s%s%s --where %s: %s", p->store.path, p->x, p->y,
                        p->z ? " --z " : "", p->z ? p->z : "", p->by ? " --by " : "", p->by ? p->by : "", p->where,
                        sqlite3_errmsg(p->store.database));
  sqlite3_free(sql);
  return status;
}

int flesh_sweep_plot_next(const flesh_sweep_picture *p, sqlite3_stmt *query, int *status)
{
  const int code = sqlite3_step(query);
  if (code != SQLITE_ROW && code != SQLITE_DONE) *status = flesh_study_store_fail(&p->store, "cannot be read");
  return code == SQLITE_ROW;
}

/* A word as a label: cut between letters where it is long. */
static void label_word(const char *word, char label[FLESH_SWEEP_LABEL])
{
  static const char more[] = "...";
  size_t room = FLESH_SWEEP_LABEL - sizeof more, length = 0;
  while (word[length]) {
    int size = flesh_text_letter(word + length);
    if (length + (size_t)(size ? size : 1) > room) break;
    length += (size_t)(size ? size : 1);
  }
  snprintf(label, FLESH_SWEEP_LABEL, "%.*s%s", (int)length, word, word[length] ? more : "");
}

/* Numbers with as many digits as distinguish them, four at least. */
static void label_numbers(flesh_sweep_ticks *t)
{
  for (int k = 0; k < t->count; k++) {
    if (!t->is_number[k]) continue;
    for (int digits = 4; digits <= 17; digits++) {
      int distinct = 1;
      snprintf(t->label[k], FLESH_SWEEP_LABEL, "%.*g", digits, t->value[k]);
      for (int other = k - 1; other <= k + 1 && distinct; other += 2) { /* they are in order */
        char text[FLESH_SWEEP_LABEL];
        if (other < 0 || other >= t->count || !t->is_number[other]) continue;
        snprintf(text, sizeof text, "%.*g", digits, t->value[other]);
        distinct = strcmp(text, t->label[k]) != 0;
      }
      if (distinct) break;
    }
  }
}

int flesh_sweep_ticks_read(flesh_sweep_picture *p, const char *column, flesh_sweep_ticks *t)
{
  sqlite3_stmt *query = NULL;
  *t = (flesh_sweep_ticks){0};
  if (!column) {
    t->count = 1;
    return FLESH_OK;
  }
  int status = flesh_sweep_plot_prepare(
      p, &query, sqlite3_mprintf("SELECT DISTINCT (%s) FROM %s WHERE (%s) ORDER BY 1", column, p->table, p->where));
  while (!status && flesh_sweep_plot_next(p, query, &status)) {
    int k = t->count, type = sqlite3_column_type(query, 0);
    if (k == FLESH_SWEEP_TICKS) {
      status = flesh_fail(FLESH_ERR_ARGUMENT, "%s has more than %d values; narrow it by --where", column, k);
      continue;
    }
    t->is_number[k] = type == SQLITE_FLOAT || type == SQLITE_INTEGER;
    t->words |= !t->is_number[k];
    t->value[k] = sqlite3_column_double(query, 0);
    const char *word = (const char *)sqlite3_column_text(query, 0);
    if (!t->is_number[k]) label_word(word ? word : "none", t->label[k]);
    t->count++;
  }
  sqlite3_finalize(query);
  label_numbers(t);
  if (!status && !t->count)
    status = flesh_fail(FLESH_ERR_ARGUMENT, "%s: no case fits --where %s", p->store.path, p->where);
  return status;
}

/* Only complete cases have a value; the tables of other commands have words of their own. */
char *flesh_sweep_plot_value(const flesh_sweep_picture *p, const char *figure)
{
  return sqlite3_mprintf(strcmp(p->table, "results") ? "(%s)" : "CASE WHEN status = 'complete' THEN (%s) END", figure);
}

void flesh_sweep_ticks_write(FILE *stream, char axis, const flesh_sweep_ticks *t)
{
  fprintf(stream, "set %ctics noenhanced (", axis);
  for (int k = 0; k < t->count; k++) {
    if (k) fputs(", ", stream);
    flesh_plot_quote_tick(stream, t->label[k]);
    fprintf(stream, " %d", k);
  }
  fputs(")\n", stream);
}
