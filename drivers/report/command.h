/* command.h: `flesh report`. */
#ifndef FLESH_REPORT_COMMAND_H
#define FLESH_REPORT_COMMAND_H

int flesh_command_report(int argc, char **argv);

#endif
