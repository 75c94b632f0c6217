/* usage.h: what a command line may have, as tables: reading them is in options.h, printing them in help.h. */
#ifndef FLESH_CLI_USAGE_H
#define FLESH_CLI_USAGE_H

typedef enum flesh_option_kind {
  FLESH_OPTION_SWITCH,   /* int: set to 1 */
  FLESH_OPTION_TEXT,     /* const char *: points into argv */
  FLESH_OPTION_POSITIVE, /* double > 0; also written a/b */
  FLESH_OPTION_NUMBER,   /* double; also written a/b */
  FLESH_OPTION_COUNT,    /* int >= 1 */
  FLESH_OPTION_CHOICE,   /* int: the place of the word in `argument` */
  FLESH_OPTION_LIST      /* flesh_texts: may be given many times */
} flesh_option_kind;

/* Texts in the order given; `values` has room for argc of them. */
typedef struct flesh_texts {
  int count;
  const char **values;
} flesh_texts;

typedef struct flesh_option {
  const char *name;     /* long, without the dashes; NULL ends the list */
  const char *argument; /* how the help calls its value, "csv|jsonl" where it is one of these; NULL for a switch */
  flesh_option_kind kind;
  void *target;
  const char *doc;
} flesh_option;

typedef struct flesh_subcommand {
  const char *name, *summary; /* "info"; one line. NULL ends the list */
  int (*run)(int argc, char **argv);
} flesh_subcommand;

/* Exit codes beyond 0 to 3, which every command may end with. */
typedef enum flesh_exits {
  FLESH_EXITS_OF_SOLVES = 1,     /* 4, 5, 7, 8 */
  FLESH_EXITS_OF_BUDGETS = 2,    /* 6 */
  FLESH_EXITS_OF_INTERRUPTS = 4, /* 128 and more */
  FLESH_EXITS_ALL = 7
} flesh_exits;

typedef struct flesh_usage {
  const char *command;     /* "run" */
  const char *positionals; /* "SCENE" */
  const char *summary;     /* one line */
  const char *details;     /* paragraphs, may be NULL */
  int positional_min, positional_max;
  const flesh_option *options;
  const flesh_subcommand *commands; /* "export" of `flesh sweep export`; NULL: none */
  unsigned exits; /* flesh_exits, or'ed */
} flesh_usage;

/* Exit codes in words; a row without `code` ends them. */
typedef struct flesh_exit_row {
  const char *code, *doc;
  unsigned exits; /* the commands that have one of these end with it; 0: all */
} flesh_exit_row;
extern const flesh_exit_row flesh_exit_rows[];

#endif
