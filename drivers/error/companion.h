/* companion.h: the runs that a run is compared with. */
#ifndef FLESH_ERROR_COMPANION_H
#define FLESH_ERROR_COMPANION_H

#include "run/runner_options.h"

/* The sources of error. */
typedef enum flesh_error_kind { FLESH_ERROR_MESH, FLESH_ERROR_STEP, FLESH_ERROR_KINDS } flesh_error_kind;

enum { FLESH_ERROR_COMPANIONS = 4, FLESH_ERROR_FOLDER = 32, FLESH_ERROR_WORDS = 320 };

/* How a run is judged in one respect. */
typedef struct flesh_error_judge {
  int count;           /* of its companions; the last shows an order, or the other element. 0: there is no bar */
  char words[FLESH_ERROR_WORDS]; /* what the companions are, or why there is no bar */
  char left_out[FLESH_ERROR_WORDS]; /* what the bars do not count, or "" */
  double factor;       /* of the bar over what the companions differ by */
  int better;          /* the first companion's numbers are better than the run's */
  int coarser;         /* the companions have a coarser mesh */
  int doubled;         /* of a coarser mesh, this companion has twice the step there: 1 as the second of the judge of steps
                        * has on the run's mesh, 2 as the first has there */
  int adds;            /* equilibria: what the companions differ by is added up */
  struct {
    char folder[FLESH_ERROR_FOLDER]; /* within the run's */
    char set[2][64];                 /* key=value beside the scene's keys; the second may be empty */
    flesh_scene *scene;
    double cpu_s;
  } companions[FLESH_ERROR_COMPANIONS];
} flesh_error_judge;

/* Chooses the judge of a kind of a run of this scene, whose file is `path`, and reads its scenes; the mesh's takes up what
 * the steps' has run. FLESH_ERR_MEMORY, FLESH_ERR_INTERRUPTED; what else is wrong leaves the judge without companions. */
int flesh_error_choose(const flesh_scene *scene, const char *path, flesh_error_kind kind,
                       flesh_error_judge judges[FLESH_ERROR_KINDS]);
/* Runs the companions; one that ends before its time leaves the judge without any. FLESH_ERR_INTERRUPTED. */
int flesh_error_run(const flesh_runner_options *options, flesh_error_judge *judge);
void flesh_error_judge_close(flesh_error_judge *judge);

#endif
