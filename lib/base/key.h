/* key.h: describes the keys of a scene, for parsing, validation, the schema and the docs.
 *
 * A table of keys describes a mapping that is read into a plain struct; `offset` is the place of each value in it. */
#ifndef FLESH_BASE_KEY_H
#define FLESH_BASE_KEY_H

#include <stddef.h>

typedef enum flesh_key_type {
  FLESH_KEY_NUMBER,   /* double; NaN when absent without default. Also written a/b */
  FLESH_KEY_INTEGER,  /* int; INT_MIN when absent without default */
  FLESH_KEY_BOOLEAN,  /* int 0 or 1; -1 when absent without default */
  FLESH_KEY_CHOICE,   /* int, the index in `choices`; -1 when absent without default */
  FLESH_KEY_TEXT,     /* char *, NULL when absent */
  FLESH_KEY_PATH,     /* char *, made relative to the scene's file; NULL when absent */
  FLESH_KEY_VECTOR,   /* double[3]; NaN when absent */
  FLESH_KEY_BOX,      /* double[6], [[low], [high]], may be infinite; NaN when absent */
  FLESH_KEY_SET,      /* unsigned bit mask, bit k for choices[k]: a list of choices; 0 when absent or [] */
  FLESH_KEY_INTEGERS, /* flesh_integers */
  FLESH_KEY_OBJECT,   /* nested mapping by `children` into the struct at `offset` */
  FLESH_KEY_OBJECTS,  /* list of mappings by `children`, each `child_size` bytes: flesh_objects */
  FLESH_KEY_EFFECTS,  /* list of one-key mappings named by the registry of effects: flesh_objects */
  FLESH_KEY_TREE      /* const flesh_node *: any node, which its reader checks; NULL when absent */
} flesh_key_type;

typedef struct flesh_integers {
  int count;
  int *values;
} flesh_integers;

typedef struct flesh_objects {
  int count;
  void *values; /* [count] structs of child_size */
} flesh_objects;

/* Range of valid numbers; error messages and docs are made from it. */
typedef enum flesh_key_range {
  FLESH_RANGE_ANY,          /* finite */
  FLESH_RANGE_POSITIVE,     /* > 0 */
  FLESH_RANGE_NOT_NEGATIVE, /* >= 0 */
  FLESH_RANGE_FRACTION,     /* > 0 and < 1 */
  FLESH_RANGE_POISSON       /* > -1 and <= 0.5 */
} flesh_key_range;

typedef struct flesh_key {
  const char *name; /* NULL ends a table */
  flesh_key_type type;
  size_t offset;
  flesh_key_range range;
  const char *unit;          /* "m", "kg/m^3", ...; NULL: none */
  /* The default, written as in a scene. "": the key may be absent (all values of an object are then absent). "{}" for
   * an object: the defaults of its children. NULL: the key is required. A number takes .inf when its default is
   * infinite. */
  const char *default_value;
  const char *doc;
  const char *const *choices; /* NULL-terminated; for FLESH_KEY_CHOICE and FLESH_KEY_SET */
  const char *const *aliases; /* alternative words for the choices, in their order; NULL: none */
  int may_be_all; /* FLESH_KEY_SET: [] is valid and written, [all] is every choice, [-a, -b] all but these */
  const struct flesh_key *children;
  size_t child_size;
  const struct flesh_key_list *list; /* FLESH_KEY_EFFECTS: functions that read and write the list (scene/keys.h) */
} flesh_key;

#endif
