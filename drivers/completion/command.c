/* command.c: `flesh completion`: scripts that complete command lines, from the tables that --help prints. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "scene/schema.h"
#include "cli/help.h"
#include "cli/options.h"

static const char details[] = "Completes commands, options, the keys of a scene after --set, and values where there is a list of them; else\n"
                              "files. `meson install` installs both; without that:\n\n"
                              "  eval \"$(flesh completion bash)\"\n";

static const char bash_begin[] = "# bash completion of flesh, made by `flesh completion bash`.\n";
static const char bash_branches[] =
    "\n"
    "# Sets options, commands, and values of the option before the word, for the COMMAND $1 after the word $2.\n"
    "_flesh_words()\n"
    "{\n"
    "  options= commands= values=\n"
    "  case $1 in\n";
static const char bash_end[] =
    "  esac\n"
    "}\n"
    "\n"
    "_flesh()\n"
    "{\n"
    "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} options commands values\n"
    "  COMPREPLY=()\n"
    "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
    "    COMPREPLY=($(compgen -W \"$_flesh_commands --help --version\" -- \"$word\"))\n"
    "    return\n"
    "  fi\n"
    "  _flesh_words \"${COMP_WORDS[1]}\" \"$before\"\n"
    "  if [ \"$COMP_CWORD\" -gt 2 ] && [[ \" $commands \" == *\" ${COMP_WORDS[2]} \"* ]]; then\n"
    "    _flesh_words \"${COMP_WORDS[1]} ${COMP_WORDS[2]}\" \"$before\"\n"
    "  elif [ \"$COMP_CWORD\" -gt 2 ]; then\n"
    "    commands=\n"
    "  fi\n"
    "  if [ -n \"$values\" ]; then\n"
    "    case $values in\n"
    "      -) compopt +o default +o bashdefault 2>/dev/null ;;\n"
    "      +) ;;\n"
    "      *) COMPREPLY=($(compgen -W \"$values\" -- \"$word\")) ;;\n"
    "    esac\n"
    "    if [ \"$values\" = \"$_flesh_keys\" ]; then compopt -o nospace 2>/dev/null; fi\n"
    "  elif [[ $word == -* ]]; then\n"
    "    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
    "  else\n"
    "    COMPREPLY=($(compgen -W \"$commands\" -- \"$word\"))\n"
    "  fi\n"
    "}\n"
    "complete -o bashdefault -o default -F _flesh flesh\n";

static const char zsh_begin[] = "#compdef flesh\n# zsh completion of flesh, made by `flesh completion zsh`.\n";
static const char zsh_branches[] =
    "\n"
    "# Sets options and commands of the COMMAND $1.\n"
    "_flesh_words()\n"
    "{\n"
    "  options=() commands=()\n"
    "  case $1 in\n";
static const char zsh_end[] =
    "  esac\n"
    "}\n"
    "\n"
    "_flesh()\n"
    "{\n"
    "  local -a options commands\n"
    "  if (( CURRENT == 2 )); then\n"
    "    _describe command _flesh_commands\n"
    "    return\n"
    "  fi\n"
    "  _flesh_words $words[2]\n"
    "  if (( CURRENT == 3 && $#commands )); then\n"
    "    _describe command commands\n"
    "  elif (( CURRENT > 3 && $#commands )) && [[ -n ${(M)commands:#$words[3]:*} ]]; then\n"
    "    _flesh_words \"$words[2] $words[3]\"\n"
    "    shift words\n"
    "    (( CURRENT-- ))\n"
    "  fi\n"
    "  shift words\n"
    "  (( CURRENT-- ))\n"
    "  _arguments $options '*:file:_files'\n"
    "}\n"
    "if [ \"$funcstack[1]\" = _flesh ]; then _flesh \"$@\"; else compdef _flesh flesh; fi\n";

static void print_commands(int zsh)
{
  printf(zsh ? "_flesh_commands=(" : "_flesh_commands='");
  for (const flesh_subcommand *c = flesh_help_commands; c->name; c++) {
    char row[160];
    snprintf(row, sizeof row, "%s:%s", c->name, c->summary);
    if (zsh) flesh_help_quote(row);
    else printf("%s", c->name);
    if (c[1].name) putchar(' ');
  }
  puts(zsh ? ")" : "'");
}

/* The paths of a scene's keys with = behind, as --set takes them. */
static int print_keys(int zsh)
{
  char *paths = NULL;
  int status = flesh_scene_schema_section(FLESH_SCHEMA_PATHS, NULL, &paths);
  if (status) return status;
  printf(zsh ? "_flesh_keys=(\n" : "_flesh_keys='\n");
  for (char *at = strtok(paths, "\n"); at; at = strtok(NULL, "\n")) printf(zsh ? "'%s='\n" : "%s=\n", at);
  puts(zsh ? ")" : "'");
  free(paths);
  return FLESH_OK;
}

int flesh_command_completion(int argc, char **argv)
{
  static const flesh_option none[] = {{0}};
  static const flesh_usage usage = {"completion", "bash|zsh", "Prints what a shell completes command lines with.", details, 1,
                                    1,            none,       NULL, 0};
  int count, code = flesh_options_read(&usage, argc, argv, &count);
  if (code != FLESH_OPTIONS_GO_ON) return code;
  const int zsh = !strcmp(argv[1], "zsh");
  if (!zsh && strcmp(argv[1], "bash"))
    return flesh_command_refuse("completion", "there is none for '%.100s'; it must be bash or zsh", argv[1]);
  fputs(zsh ? zsh_begin : bash_begin, stdout);
  print_commands(zsh);
  int status = print_keys(zsh);
  if (status) return flesh_command_fail("completion", status);
  fputs(zsh ? zsh_branches : bash_branches, stdout);
  flesh_help_set_format(zsh ? FLESH_HELP_ZSH : FLESH_HELP_BASH);
  for (const flesh_subcommand *c = flesh_help_commands; c->name; c++) {
    char name[32], help[] = "--help", *words[] = {name, help, NULL};
    snprintf(name, sizeof name, "%s", c->name);
    c->run(2, words);
  }
  fputs(zsh ? zsh_end : bash_end, stdout);
  return 0;
}
