/* help_formats.h: a command's help in formats for programs; private to help.c. */
#ifndef FLESH_SHARED_HELP_FORMATS_H
#define FLESH_SHARED_HELP_FORMATS_H

#include "shared/help.h"

/* A whole page for "run"; a section of its command's page for "mesh info". */
void flesh_help_man(const flesh_usage *usage);
void flesh_help_man_end(void);
/* A branch of `case` on the command's words, see drivers/manual/completion.c. */
void flesh_help_bash(const flesh_usage *usage);
void flesh_help_zsh(const flesh_usage *usage);

/* " (may be repeated)", or "". */
const char *flesh_help_repeated(const flesh_option *option);

#endif
