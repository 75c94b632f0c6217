/* words.h: the nearest known word to a misspelt one, and numbers as a scene may write them. */
#ifndef FLESH_SCENE_WORDS_H
#define FLESH_SCENE_WORDS_H

/* Start with {.word = ...}, offer every known word, then ask for the sentence's end. */
typedef struct flesh_suggestion {
  const char *word, *best;
  int distance, count;
  char list[400]; /* the words offered, while they fit */
} flesh_suggestion;

void flesh_suggestion_offer(flesh_suggestion *suggestion, const char *known);
/* "did you mean density? Known here: mesh, density, ...". Returns `text`. */
const char *flesh_suggestion_text(const flesh_suggestion *suggestion, char text[512]);

/* A decimal number, a fraction a/b of two, or .inf with a sign; a point in any locale. Returns
 * whether `text` is one; what is too large for a double is not. */
int flesh_number_parse(const char *text, double *value);

#endif
