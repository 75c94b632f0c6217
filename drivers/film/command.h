/* command.h: `flesh film`. */
#ifndef FLESH_FILM_COMMAND_H
#define FLESH_FILM_COMMAND_H

int flesh_command_film(int argc, char **argv);

#endif
