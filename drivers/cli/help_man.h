/* help_man.h: a command's help as a manual page in roff, to stdout. */
#ifndef FLESH_CLI_HELP_MAN_H
#define FLESH_CLI_HELP_MAN_H

#include "cli/usage.h"

/* A page's head, paragraphs (lines that begin with a space stand as they are), and exit codes. */
void flesh_help_man_head(const char *page, const char *summary);
void flesh_help_man_text(const char *text);
void flesh_help_man_exits(unsigned exits); /* flesh_exits, or'ed */

/* The page of "run", but for its end; a section of its command's page for "mesh info". */
void flesh_help_man(const flesh_usage *usage);
void flesh_help_man_end(void);

#endif
