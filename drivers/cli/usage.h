/* usage.h: tables of what a command line may have; options.h reads by them, help.h prints them. */
#ifndef FLESH_CLI_USAGE_H
#define FLESH_CLI_USAGE_H

typedef enum flesh_option_kind {
  FLESH_OPTION_SWITCH,   /* int: set to 1 */
  FLESH_OPTION_TEXT,     /* const char *: points into argv */
  FLESH_OPTION_POSITIVE, /* double > 0; also written a/b */
  FLESH_OPTION_NUMBER,   /* double; also written a/b */
  FLESH_OPTION_COUNT,    /* int >= 1 */
  FLESH_OPTION_CHOICE,   /* int: index of the word in `argument` */
  FLESH_OPTION_LIST      /* flesh_texts: may be given many times */
} flesh_option_kind;

/* Texts in the order given; zero-initialised before, freed by free(values). */
typedef struct flesh_texts {
  int count;
  const char **values;
  int room;
} flesh_texts;

typedef struct flesh_option {
  const char *name;     /* long, without the dashes; NULL ends the list */
  const char *argument; /* value's name in the help, or the accepted words as "csv|jsonl"; NULL for a switch */
  flesh_option_kind kind;
  void *target;
  const char *doc;
} flesh_option;

typedef struct flesh_subcommand {
  const char *name, *summary; /* "info", and one line; NULL ends the list */
  int (*run)(int argc, char **argv);
} flesh_subcommand;

/* Exit codes beyond 0 to 3; all commands may end with 0 to 3. */
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
  const char *details;     /* paragraphs; may be NULL */
  int positional_min, positional_max;
  const flesh_option *options;
  const flesh_subcommand *commands; /* subcommands, as "export" of `flesh sweep export`; NULL: none */
  unsigned exits; /* flesh_exits, or'ed */
} flesh_usage;

/* The exit codes, of which a status has the first that names it; a row without `code` ends them. */
typedef struct flesh_exit_row {
  int status;
  const char *code, *doc;
  unsigned exits; /* commands that have one of these may end with it; 0: all commands */
} flesh_exit_row;
extern const flesh_exit_row flesh_exit_rows[];

#endif
