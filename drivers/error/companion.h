/* companion.h: the companions of a run: further runs with which it is compared. */
#ifndef FLESH_ERROR_COMPANION_H
#define FLESH_ERROR_COMPANION_H

#include "run/runner.h"

/* The sources of error. */
typedef enum flesh_error_kind { FLESH_ERROR_MESH, FLESH_ERROR_STEP, FLESH_ERROR_KINDS } flesh_error_kind;

enum { FLESH_ERROR_COMPANIONS = 4, FLESH_ERROR_WORDS = 320 };

/* Folders of companions within the run's folder, ended by NULL. */
extern const char *const flesh_error_folders[];

/* How one source of error of a run is judged. */
typedef struct flesh_error_judge {
  int count;           /* number of companions; the last one gives an order, or has the other element. 0: there is no bar */
  char words[FLESH_ERROR_WORDS]; /* what the companions are, or why there is no bar */
  char left_out[FLESH_ERROR_WORDS]; /* what the bars leave out, or "" */
  double factor;       /* bar over the difference of the companions */
  int better;          /* the first companion is more accurate than the run */
  int coarser;         /* the companions have a coarser mesh */
  int doubled;         /* index of the companion with twice the step on a coarser mesh. On the run's mesh companion 1
                        * has that step: of the judge of steps if this is 1, of this judge if it is 2. 0: none */
  int adds;            /* equilibria: the differences of the companions are added */
  struct {
    const char *folder; /* one of flesh_error_folders */
    char set[2][64];                 /* key=value in addition to the scene's keys; the second may be empty */
    flesh_scene *scene;
    double cpu_s;
  } companions[FLESH_ERROR_COMPANIONS];
} flesh_error_judge;

/* How stiff a body is against its softest motion in the equilibria of a run, relative to rest. */
typedef struct flesh_error_stability {
  const flesh_scene *scene; /* borrowed */
  const flesh_runner_options *options; /* of the run, whose budget holds; borrowed */
  int from_rest;  /* equilibria on the way from rest to the first one count, too */
  double at_rest; /* N/m; 0: not known yet */
  char words[FLESH_ERROR_WORDS]; /* why other meshes may have other equilibria; "": they have not, as far as is known */
} flesh_error_stability;
/* Takes in an equilibrium of a run of the scene; an observer. FLESH_ERR_MEMORY, FLESH_ERR_INTERRUPTED, FLESH_ERR_BUDGET. */
int flesh_error_watch_stability(void *stability, const flesh_step_record *record);

/* Chooses the judge of a kind for a run of this scene, whose file is `path`, and reads its companions' scenes. The
 * judge of steps is chosen first; that of the mesh uses its runs. FLESH_ERR_MEMORY, FLESH_ERR_INTERRUPTED; with any
 * other error the judge has no companions. */
int flesh_error_choose(const flesh_scene *scene, const char *path, flesh_error_kind kind,
                       flesh_error_judge judges[FLESH_ERROR_KINDS]);
/* Runs the companions. If one ends early and the others do not suffice, the judge has none. FLESH_ERR_INTERRUPTED. */
int flesh_error_run(const flesh_runner_options *options, flesh_error_judge *judge);
void flesh_error_judge_close(flesh_error_judge *judge);

#endif
