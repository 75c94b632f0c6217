/* lists.h: comma lists of the command line, as in `--poisson 0.3,0.45`. What is wrong with one is FLESH_ERR_ARGUMENT with
 * a sentence that names the option, the item and what is valid: a list has an item at least, and none twice. */
#ifndef FLESH_CLI_LISTS_H
#define FLESH_CLI_LISTS_H

#include "flesh/body.h"

/* Letters of an item, and the zero behind them; longer ones are cut. */
enum { FLESH_LIST_ITEM = 1024 };

/* Calls take(data, item) with every item in turn, as long as it returns FLESH_OK. */
int flesh_list_each(const char *option, const char *text, int (*take)(void *data, const char *item), void *data);

typedef enum flesh_list_range {
  FLESH_LIST_POSITIVE,
  FLESH_LIST_POISSON, /* in (-1, 0.5] */
  FLESH_LIST_COUNT    /* whole and positive */
} flesh_list_range;

/* Reads numbers, also written a/b, into values [room]. */
int flesh_list_numbers(const char *option, const char *text, flesh_list_range range, int room, double *values,
                       int *count);
/* Reads words of `names`, which a NULL ends, as their places there into chosen [their number]. */
int flesh_list_words(const char *option, const char *text, const char *const *names, int *chosen, int *count);

/* Reads names of elements into elements [FLESH_ELEMENT_COUNT]. */
int flesh_list_elements(const char *option, const char *text, flesh_element *elements, int *count);

/* Reads forms of the energy, those of --energies, into energies [room]; where there are `constants` [room], items may be
 * NAME.CONSTANTS, as D.as_e, and those of a name alone are matched where the form can be, else raw. */
int flesh_list_energies(const char *text, int room, flesh_energy *energies, flesh_constants *constants, int *count);

/* "1,2/3,4" as up to `room` numbers; their count, or 0 when something else stands in it. */
int flesh_list_parse(const char *text, int room, double *values);

/* Fails for an item that stands there twice. */
int flesh_list_fail_twice(const char *option, const char *item);

#endif
