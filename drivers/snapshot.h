/* snapshot.h: what `flesh snap` and `flesh film` share: runs, how they are to be seen, and their
 * panels. */
#ifndef FLESH_DRIVERS_SNAPSHOT_H
#define FLESH_DRIVERS_SNAPSHOT_H

#include "options.h"
#include "picture.h"
#include "run_folder.h"

/* A run with its skin. */
typedef struct flesh_snapshot_run {
  flesh_run_folder folder;
  flesh_surface *surface;
  flesh_skin *skin;
  char title[64];
} flesh_snapshot_run;

typedef struct flesh_snapshot {
  /* As given on the command line. */
  const char *colour, *range, *camera, *target, *surface;
  double height, field_of_view;
  int width, picture_height, columns;
  int edges, no_skin, bare;
  /* Opened. */
  int count;
  flesh_snapshot_run *runs;
  flesh_picture_options options;
} flesh_snapshot;

/* The options of a command line into *s, to stand in a command's list. */
#define FLESH_SNAPSHOT_OPTIONS(s)                                                                  \
  {"colour", "NAME", FLESH_OPTION_TEXT, &(s).colour, "J, stress (von Mises), speed or none (J)"},  \
      {"range", "LOW,HIGH", FLESH_OPTION_TEXT, &(s).range, "ends of the colours (fitted)"},        \
      {"camera", "AZIMUTH,ELEVATION", FLESH_OPTION_TEXT, &(s).camera,                              \
       "degrees; at 0,0 it looks along y, at 90,0 along -x (the scene's)"},                        \
      {"target", "X,Y,Z", FLESH_OPTION_TEXT, &(s).target, "middle of the picture (fitted)"},       \
      {"height", "H", FLESH_OPTION_POSITIVE, &(s).height, "height of what is seen there, m"},      \
      {"field-of-view", "DEGREES", FLESH_OPTION_NUMBER, &(s).field_of_view,                        \
       "0: parallel rays (the scene's)"},                                                          \
      {"width", "PIXELS", FLESH_OPTION_COUNT, &(s).width, "of a panel (480)"},                     \
      {"picture-height", "PIXELS", FLESH_OPTION_COUNT, &(s).picture_height, "of a panel (fitted)"}, \
      {"columns", "N", FLESH_OPTION_COUNT, &(s).columns, "panels side by side"},                   \
      {"surface", "FILE", FLESH_OPTION_TEXT, &(s).surface, "skin to draw, .obj or .ply"},          \
      {"no-skin", NULL, FLESH_OPTION_SWITCH, &(s).no_skin, "draw the tets' own boundary"},         \
      {"edges", NULL, FLESH_OPTION_SWITCH, &(s).edges, "draw the boundary's edges"},               \
      {"bare", NULL, FLESH_OPTION_SWITCH, &(s).bare, "without titles and times"}

/* Defaults, before the command line is read. */
void flesh_snapshot_default(flesh_snapshot *s);
/* Opens `paths` [count]: folders of runs, or scenes. FLESH_ERR_ARGUMENT for options. */
int flesh_snapshot_open(flesh_snapshot *s, int count, char **paths);
void flesh_snapshot_close(flesh_snapshot *s); /* harmless after a failed open */

/* Frame k of run r as a panel that borrows the run's state: the next load changes it. `subtitle`
 * [size] is filled with its time. */
int flesh_snapshot_panel(flesh_snapshot *s, int r, int k, char *subtitle, size_t size,
                         flesh_picture_panel *panel);

/* "1,2/3,4" as up to `room` numbers; their count, or 0 when something else stands in it. */
int flesh_parse_numbers(const char *text, int room, double *values);

#endif
