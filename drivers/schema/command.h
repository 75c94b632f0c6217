/* command.h: `flesh schema`: the documentation of a scene's keys. */
#ifndef FLESH_SCHEMA_COMMAND_H
#define FLESH_SCHEMA_COMMAND_H

/* argv[0] is "schema". Returns the exit code: 0 fine, 2 usage, 3 standard output cannot be written.
 */
int flesh_command_schema(int argc, char **argv);

#endif
