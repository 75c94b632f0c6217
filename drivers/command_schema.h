/* command_schema.h: `flesh schema`: the documentation of a scene's keys. */
#ifndef FLESH_DRIVERS_COMMAND_SCHEMA_H
#define FLESH_DRIVERS_COMMAND_SCHEMA_H

/* argv[0] is "schema". Returns the exit code: 0 fine, 2 usage, 3 standard output cannot be written.
 */
int flesh_command_schema(int argc, char **argv);

#endif
