/* words.c: finds the known word nearest to a misspelt one, and parses numbers of a scene. */
#define _GNU_SOURCE /* strtod_l */
#include "scene/words.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Returns how many insertions, deletions, replacements and swaps of neighbours turn a into b. */
static int word_distance(const char *a, const char *b)
{
  enum { LONGEST = 40 };
  int n = (int)strnlen(a, LONGEST + 1), m = (int)strnlen(b, LONGEST + 1);
  if (n > LONGEST || m > LONGEST) return LONGEST;
  int rows[3][LONGEST + 1];
  for (int j = 0; j <= m; j++) rows[0][j] = j;
  for (int i = 1; i <= n; i++) {
    int *row = rows[i % 3], *above = rows[(i + 2) % 3], *above2 = rows[(i + 1) % 3];
    row[0] = i;
    for (int j = 1; j <= m; j++) {
      int best = above[j - 1] + (a[i - 1] != b[j - 1]);
      if (above[j] + 1 < best) best = above[j] + 1;
      if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
      int swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped && above2[j - 2] + 1 < best) best = above2[j - 2] + 1;
      row[j] = best;
    }
  }
  return rows[n % 3][m];
}

/* Other names of keys, from formulas and from other programs. */
static const char *const synonyms[][2] = {
    {"E", "young"},  {"youngs_modulus", "young"},    {"nu", "poisson"},      {"poisson_ratio", "poisson"}, {"G", "mu"},
    {"rho", "density"}, {"dt", "step"},              {"time_step", "step"},  {"t_end", "end"},             {"duration", "end"},
    {"g", "acceleration"}, {"tol", "tolerance"}};

static int is_synonym(const char *word, const char *known)
{
  for (size_t k = 0; k < sizeof synonyms / sizeof *synonyms; k++)
    if (!strcmp(word, synonyms[k][0]) && !strcmp(known, synonyms[k][1])) return 1;
  return 0;
}

void flesh_suggestion_offer(flesh_suggestion *s, const char *known)
{
  int distance = is_synonym(s->word, known) ? 0 : word_distance(s->word, known);
  if (!s->best || distance < s->distance) s->best = known, s->distance = distance;
  size_t used = strlen(s->list);
  if (s->count >= 0 && used + strlen(known) + 3 < sizeof s->list) {
    snprintf(s->list + used, sizeof s->list - used, "%s%s", s->count ? ", " : "", known);
    s->count++;
  } else {
    s->count = -1; /* too many to list */
    s->list[0] = 0;
  }
}

const char *flesh_suggestion_text(const flesh_suggestion *s, char text[512])
{
  int length = (int)strlen(s->word);
  int near = s->best && s->distance <= (length < 4 ? 1 : length < 7 ? 2 : length / 3);
  int listed = s->count > 0;
  snprintf(text, 512, "%s%s%s%s%s", near ? "did you mean " : "", near ? s->best : "",
           near ? "? " : "", listed ? near ? "Known here: " : "known here: " : "",
           listed ? s->list : "");
  size_t end = strlen(text);
  if (end && text[end - 1] == ' ') text[end - 1] = 0;
  return text;
}

/* Reads a decimal number of [0-9.eE+-] at *text and moves past it; strtod alone would accept hexadecimals, "nan" and
 * blanks. */
static int parse_decimal(const char **text, double *value)
{
  size_t size = strspn(*text, "0123456789.eE+-");
  if (!size || !strpbrk(*text, "0123456789")) return 0;
  locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
  if (!c_locale) return 0;
  char *end;
  *value = strtod_l(*text, &end, c_locale);
  freelocale(c_locale);
  if (end != *text + size || !isfinite(*value)) return 0;
  *text = end;
  return 1;
}

int flesh_number_parse(const char *text, double *value)
{
  static const char *const infinities[] = {".inf", ".Inf", ".INF", "inf"};
  const char *digits = text + (*text == '+' || *text == '-');
  for (int i = 0; i < 4; i++)
    if (!strcmp(digits, infinities[i])) {
      *value = *text == '-' ? -INFINITY : INFINITY;
      return 1;
    }
  double over, under = 1;
  if (!parse_decimal(&text, &over)) return 0;
  text += strspn(text, " ");
  if (*text == '/') {
    text++;
    text += strspn(text, " ");
    if (!parse_decimal(&text, &under) || under == 0) return 0;
  }
  if (*text || !isfinite(over / under)) return 0;
  *value = over / under;
  return 1;
}
