/* words.h: finds the known word nearest to a misspelt one, and parses numbers of a scene. */
#ifndef FLESH_SCENE_WORDS_H
#define FLESH_SCENE_WORDS_H

/* A search for the nearest word: start with {.word = ...}, offer every known word, then call flesh_suggestion_text. */
typedef struct flesh_suggestion {
  const char *word, *best;
  int distance, count;
  char list[400]; /* the words offered, if they fit */
} flesh_suggestion;

void flesh_suggestion_offer(flesh_suggestion *suggestion, const char *known);
/* Writes the end of a sentence, such as "did you mean density? Known here: mesh, density, ...". Returns `text`. */
const char *flesh_suggestion_text(const flesh_suggestion *suggestion, char text[512]);

/* Parses a decimal number, a fraction a/b of two, or .inf with a sign; the decimal point is the same in any locale.
 * Returns whether `text` is one; a number too large for a double is not. */
int flesh_number_parse(const char *text, double *value);

#endif
