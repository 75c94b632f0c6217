/* options.c: reads command lines by getopt_long; commands of several words; exit codes. */
#include "cli/options.h"

#include <getopt.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "base/memory.h"
#include "base/text.h"
#include "cli/help.h"
#include "cli/interrupt.h"
#include "scene/words.h"

enum { OPTION_LIMIT = 48, HELP_VALUE = 256 };

int flesh_exit_code(int status)
{
  if (status == FLESH_ERR_INTERRUPTED) return flesh_interrupt_exit_code();
  for (const flesh_exit_row *row = flesh_exit_rows; row->code; row++)
    if (row->status == status) return atoi(row->code);
  return status > 0 ? 4 : 1;
}

int flesh_command_fail(const char *command, int status)
{
  const char *text = flesh_error_text();
  fprintf(stderr, "flesh %s: %s\n", command, *text ? text : flesh_status_text(status));
  return flesh_exit_code(status);
}

int flesh_option_number(const char *text, double *value)
{
  double number;
  if (!flesh_number_parse(text, &number) || !isfinite(number)) return -1;
  *value = number;
  return 0;
}

int flesh_command_refuse(const char *command, const char *format, ...)
{
  char sentence[512];
  va_list args;
  va_start(args, format);
  vsnprintf(sentence, sizeof sentence, format, args);
  va_end(args);
  flesh_fail(FLESH_ERR_ARGUMENT, "%s%s%s: %s", "flesh", *command ? " " : "", command, sentence);
  fprintf(stderr, "%s\n", flesh_error_text());
  return 2;
}

int flesh_option_refuse(const char *command, const char *option, const char *value, const char *valid)
{
  if (!value) return flesh_command_refuse(command, "--%s is missing; it must be %s", option, valid);
  return flesh_command_refuse(command, "--%s is '%.100s'; it must be %s", option, value, valid);
}

static int complain(const flesh_usage *usage, const char *what, const char *which, const char *more)
{
  return flesh_command_refuse(usage->command, "%s%.100s%s; `flesh %s --help` lists what is valid", what, which, more,
                              usage->command);
}

static int take_number(const flesh_usage *usage, const flesh_option *option, const char *text)
{
  static const char *const valid[] = {[FLESH_OPTION_POSITIVE] = "a positive number", [FLESH_OPTION_NUMBER] = "a finite number",
                                      [FLESH_OPTION_COUNT] = "a whole number, at least 1"};
  double number;
  int fits = !flesh_option_number(text, &number);
  if (option->kind == FLESH_OPTION_POSITIVE) fits = fits && number > 0;
  if (option->kind == FLESH_OPTION_COUNT) fits = fits && number >= 1 && number <= 1e9 && number == floor(number);
  if (!fits)
    return flesh_command_refuse(usage->command, "--%s is '%.100s'; it must be %s; `flesh %s --help` lists what is valid",
                                option->name, text, valid[option->kind], usage->command);
  if (option->kind == FLESH_OPTION_COUNT) *(int *)option->target = (int)number;
  else *(double *)option->target = number;
  return FLESH_OPTIONS_GO_ON;
}

/* Sets the target to the index of the text among the words "a|b|c" of the argument. */
static int take_choice(const flesh_usage *usage, const flesh_option *option, const char *text)
{
  char valid[160] = "";
  const char *word = option->argument;
  for (int k = 0;; k++) {
    const size_t length = strcspn(word, "|");
    if (strlen(text) == length && !strncmp(word, text, length)) {
      *(int *)option->target = k;
      return FLESH_OPTIONS_GO_ON;
    }
    flesh_text_add(valid, sizeof valid, "%s%.*s", !k ? "" : word[length] ? ", " : " or ", (int)length, word);
    if (!word[length]) return flesh_option_refuse(usage->command, option->name, text, valid);
    word += length + 1;
  }
}

static int take(const flesh_usage *usage, const flesh_option *option, const char *text)
{
  flesh_texts *texts = option->target;
  if (option->kind == FLESH_OPTION_SWITCH) *(int *)option->target = 1;
  else if (option->kind == FLESH_OPTION_TEXT) *(const char **)option->target = text;
  else if (option->kind == FLESH_OPTION_CHOICE) return take_choice(usage, option, text);
  else if (option->kind != FLESH_OPTION_LIST) return take_number(usage, option, text);
  else if (!flesh_grow(&texts->values, sizeof *texts->values, texts->count, &texts->room))
    return flesh_command_fail(usage->command, flesh_no_memory());
  else texts->values[texts->count++] = text;
  return FLESH_OPTIONS_GO_ON;
}

/* Returns whether the word is the name of an option. */
static int is_option(const flesh_usage *usage, const char *word)
{
  int found = !strcmp(word, "--help");
  for (const flesh_option *option = usage->options; option->name; option++)
    found |= !strncmp(word, "--", 2) && !strcmp(word + 2, option->name);
  return found;
}

int flesh_options_read(const flesh_usage *usage, int argc, char **argv, int *positional_count)
{
  struct option rows[OPTION_LIMIT + 2] = {{0}};
  int count = 0;
  for (; usage->options[count].name && count < OPTION_LIMIT; count++)
    rows[count] =
        (struct option){.name = usage->options[count].name,
                        .has_arg = usage->options[count].argument ? required_argument : no_argument,
                        .val = HELP_VALUE + 1 + count};
  rows[count] = (struct option){.name = "help", .val = HELP_VALUE};
  opterr = 0;
  optind = 0; /* reinitialises glibc's scanner */
  for (int found; (found = getopt_long(argc, argv, ":h", rows, NULL)) != -1;) {
    if (found == HELP_VALUE || found == 'h') {
      flesh_help_print(usage);
      return 0;
    }
    const char *word = argv[optind - 1];
    if (found == ':') return complain(usage, "option ", word, " needs a value");
    if (found == '?') {
      if (optopt > HELP_VALUE) return complain(usage, "option ", word, " takes no value");
      char letter[8] = {'-', (char)optopt, 0};
      return complain(usage, "unknown or ambiguous option ", optopt ? letter : word, "");
    }
    if (optarg == word && is_option(usage, word)) /* a folder named --quiet must be given as --out=--quiet */
      return complain(usage, "option ", argv[optind - 2], " needs a value");
    int code = take(usage, &usage->options[found - HELP_VALUE - 1], optarg);
    if (code != FLESH_OPTIONS_GO_ON) return code;
  }
  *positional_count = argc - optind;
  for (int p = 0; p < *positional_count; p++) argv[1 + p] = argv[optind + p];
  if (*positional_count < usage->positional_min) { /* without options that the usage lists after them */
    char names[128];
    const char *end = strstr(usage->positionals, " --");
    snprintf(names, sizeof names, "%.*s", end ? (int)(end - usage->positionals) : 127, usage->positionals);
    return complain(usage, "missing ", names, "");
  }
  if (*positional_count > usage->positional_max) {
    const char *first = argv[1 + usage->positional_max];
    const int is_value = strchr(first, '=') && is_option(usage, "--set");
    return complain(usage, "too many arguments: '", first,
                    is_value ? "'; a value of the scene is given by --set KEY=VALUE" : "'");
  }
  return FLESH_OPTIONS_GO_ON;
}

int flesh_subcommand_run(const char *command, const char *about, const char *more, const flesh_subcommand *list,
                         int argc, char **argv)
{
  const char *name = argc > 1 ? argv[1] : NULL;
  if (name && (!strcmp(name, "--help") || !strcmp(name, "-h"))) {
    flesh_help_print_list(command, about, more, list);
    return 0;
  }
  char known[256] = "";
  for (int k = 0; list[k].name; k++) {
    if (name && !strcmp(name, list[k].name)) return list[k].run(argc - 1, argv + 1);
    flesh_text_add(known, sizeof known, "%s%s", !k ? "" : list[k + 1].name ? ", " : " and ", list[k].name);
  }
  if (!name) return flesh_command_refuse(command, "no command given; the commands are %s", known);
  return flesh_command_refuse(command, "unknown command '%.100s'; the commands are %s", name, known);
}
