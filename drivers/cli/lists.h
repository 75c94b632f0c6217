/* lists.h: comma lists of the command line, as in `--poisson 0.3,0.45`. Errors are FLESH_ERR_ARGUMENT with a sentence
 * that names the option, the item and the valid values; a list that is empty or has an item twice is an error. */
#ifndef FLESH_CLI_LISTS_H
#define FLESH_CLI_LISTS_H

#include "flesh/body.h"

/* Room for an item with its end; longer items are cut. */
enum { FLESH_LIST_ITEM = 1024 };

/* Calls take(data, item) for each item in turn, until it returns another status than FLESH_OK. */
int flesh_list_each(const char *option, const char *text, int (*take)(void *data, const char *item), void *data);

typedef enum flesh_list_range {
  FLESH_LIST_POSITIVE,
  FLESH_LIST_POISSON, /* in (-1, 0.5] */
  FLESH_LIST_COUNT    /* whole and positive */
} flesh_list_range;

/* Reads numbers, which may be fractions a/b, into values [room]. */
int flesh_list_numbers(const char *option, const char *text, flesh_list_range range, int room, double *values,
                       int *count);
/* Reads words from `names`, which a NULL ends; their indices go into chosen [number of names]. */
int flesh_list_words(const char *option, const char *text, const char *const *names, int *chosen, int *count);

/* Reads the names of --elements into elements [FLESH_ELEMENT_COUNT]. */
int flesh_list_elements(const char *text, flesh_element *elements, int *count);

/* Reads the forms of --energies into energies [room]. With `constants` [room], an item may be NAME.CONSTANTS, as
 * D.as_e; a name alone gets matched constants if the form takes them, else raw ones. */
int flesh_list_energies(const char *text, int room, flesh_energy *energies, flesh_constants *constants, int *count);

/* Reads up to `room` numbers from a text like "1,2/3,4". Returns their count, or 0 if there is anything else in it. */
int flesh_list_parse(const char *text, int room, double *values);

/* Fails because the item is in the list twice. */
int flesh_list_fail_twice(const char *option, const char *item);

#endif
