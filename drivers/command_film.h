/* command_film.h: `flesh film`. */
#ifndef FLESH_DRIVERS_COMMAND_FILM_H
#define FLESH_DRIVERS_COMMAND_FILM_H

int flesh_command_film(int argc, char **argv);

#endif
