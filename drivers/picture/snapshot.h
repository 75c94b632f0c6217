/* snapshot.h: the part that `flesh snap` and `flesh film` share: runs, how they are seen, and their panels. */
#ifndef FLESH_PICTURE_SNAPSHOT_H
#define FLESH_PICTURE_SNAPSHOT_H

#include "cli/options.h"
#include "picture/picture.h"
#include "run/run_folder.h"

/* A run with its skin. */
typedef struct flesh_snapshot_run {
  flesh_run_folder folder;
  flesh_surface *surface;
  flesh_skin *skin;
  const char *title; /* in the folder's memory */
} flesh_snapshot_run;

typedef struct flesh_snapshot {
  /* Options, as given on the command line. */
  int colour; /* flesh_picture_field */
  const char *error, *range, *camera, *up, *target, *surface;
  double height, field_of_view;
  int no_skin, bare;
  flesh_picture_options options; /* the values of the options above are added once the runs are opened */
  /* Opened. */
  int count;
  flesh_snapshot_run *runs;
  const char *up_origin; /* where the camera's upward direction comes from */
} flesh_snapshot;

/* Rows for a command's list of options, which read them into *s. */
#define FLESH_SNAPSHOT_OPTIONS(s) \
  {"colour", "none|J|stress|speed|young", FLESH_OPTION_CHOICE, &(s).colour, /* of flesh_picture_field */ \
   "what the colours show: J (det F, in ten-node tets its mean J_mean), stress (von Mises), speed, young (Young's " \
   "modulus of the material, as of a map of flesh fit) or none (default J)"}, \
  {"error", "COLUMN", FLESH_OPTION_TEXT, &(s).error, \
   "colours show how much each ten-node tet of an equilibrium adds to the mesh's error of a probe's position, as " \
   "tip.position_z; flesh run --to refines where that is most"}, \
  {"range", "LOW,HIGH", FLESH_OPTION_TEXT, &(s).range, "ends of the colours, for stress in Pa (default: fitted)"}, \
  {"camera", "AZIMUTH,ELEVATION", FLESH_OPTION_TEXT, &(s).camera, \
   "angles in degrees around up and above the horizon; with z up, 0,0 looks along y and 90,0 along -x (default: the " \
   "scene's, else 30,20)"}, \
  {"up", "X,Y,Z", FLESH_OPTION_TEXT, &(s).up, "upwards in the picture (default: the scene's, else against gravity, else z)"}, \
  {"target", "X,Y,Z", FLESH_OPTION_TEXT, &(s).target, "the place in the middle of the picture, m (default: fitted)"}, \
  {"height", "H", FLESH_OPTION_POSITIVE, &(s).height, "height of what is seen at the target, m (default: fitted)"}, \
  {"field-of-view", "DEGREES", FLESH_OPTION_NUMBER, &(s).field_of_view, \
   "angle from the lower to the upper edge, below 120; 0: parallel rays (default: the scene's, else 20)"}, \
  {"width", "PIXELS", FLESH_OPTION_COUNT, &(s).options.width, "width of a panel (default 480)"}, \
  {"picture-height", "PIXELS", FLESH_OPTION_COUNT, &(s).options.height, "height of a panel (default: fitted)"}, \
  {"columns", "N", FLESH_OPTION_COUNT, &(s).options.columns, \
   "panels per row (default: the frames of a run, or a number that looks well)"}, \
  {"surface", "FILE", FLESH_OPTION_TEXT, &(s).surface, \
   "skin to draw in place of the body, .obj or .ply, at rest (default: the scene's)"}, \
  {"no-skin", NULL, FLESH_OPTION_SWITCH, &(s).no_skin, "draw the body's own boundary, also where there is a skin"}, \
  {"edges", NULL, FLESH_OPTION_SWITCH, &(s).options.edges, "draw the edges of the boundary's triangles"}, \
  {"flat", NULL, FLESH_OPTION_SWITCH, &(s).options.style.flat, \
   "the colours of the scale as they are, without light and shadow"}, \
  {"no-shadow", NULL, FLESH_OPTION_SWITCH, &(s).options.style.no_shadow, "light, but no shadows"}, \
  {"bare", NULL, FLESH_OPTION_SWITCH, &(s).bare, "without titles and times"}

/* Sets the defaults. To be called before the command line is read. */
void flesh_snapshot_default(flesh_snapshot *s);
/* Opens `paths` [count]: folders of runs, or scenes. FLESH_ERR_ARGUMENT for wrong options, besides errors of files. */
int flesh_snapshot_open(flesh_snapshot *s, int count, char **paths);
void flesh_snapshot_close(flesh_snapshot *s); /* harmless after a failed open */

/* Makes a panel of frame k of a run. It borrows the run's state, and is valid until another frame is loaded. */
int flesh_run_panel(flesh_run_folder *run, int k, flesh_picture_panel *panel);

/* Makes a panel of frame k of run r. It borrows the run's state, which the next load changes; its subtitle, the time,
 * is in the arena. */
int flesh_snapshot_panel(flesh_snapshot *s, int r, int k, flesh_arena *arena, flesh_picture_panel *panel);

/* Prints to stdout which direction is up, and what the colours of pictures in this frame mean. */
void flesh_snapshot_report(const flesh_snapshot *s, const flesh_picture_frame *frame);

#endif
