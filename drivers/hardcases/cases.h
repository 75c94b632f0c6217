/* cases.h: the hard cases, which files describe (data/hardcases), their meshes and their start states. */
#ifndef FLESH_HARDCASES_CASES_H
#define FLESH_HARDCASES_CASES_H

#include "flesh/integrator.h"
#include "flesh/mesh.h"
#include "base/key.h"
#include "scene/arena.h"

/* All bodies but single tets fill [0, 0.2] x [0, 0.1] x [0, 0.1] m, or a cube of 0.1 m, or near. */
typedef enum flesh_hardcases_mesh {
  FLESH_HARDCASES_BLOCK,      /* a regular block */
  FLESH_HARDCASES_FINE,       /* the block with enough layers along x to twist it by 5 turns */
  FLESH_HARDCASES_CHECKER,    /* the block, its cells in two regions like a chess board */
  FLESH_HARDCASES_HALVES,     /* the block, its halves in two regions */
  FLESH_HARDCASES_SLIVERS,    /* the block with slivers of radius ratio 1e-4 */
  FLESH_HARDCASES_GRADED,     /* a cube, refined towards a corner: edges from 1 to 1e-4 */
  FLESH_HARDCASES_FAN,        /* a cube of tets that all share the node in its middle */
  FLESH_HARDCASES_SINGLE,     /* one tet */
  FLESH_HARDCASES_TWO_BODIES, /* two blocks that share no node */
  FLESH_HARDCASES_BAR,        /* the benchmark bar's proportions */
  FLESH_HARDCASES_LARGE       /* the block, finer: 15 000 to 50 000 tets but for --quick */
} flesh_hardcases_mesh;

typedef enum flesh_hardcases_start {
  FLESH_HARDCASES_REST,
  FLESH_HARDCASES_SCRAMBLE,     /* every node anywhere in the bounding box */
  FLESH_HARDCASES_SCRAMBLE_ONE, /* those of x > 0.1 m only */
  FLESH_HARDCASES_JITTER,       /* each coordinate by up to `amount` of the node's mean edge */
  FLESH_HARDCASES_PLANE,        /* onto the middle plane z; `amount`: noise over the length */
  FLESH_HARDCASES_LINE,
  FLESH_HARDCASES_POINT,
  FLESH_HARDCASES_MIRROR,        /* x -> -x */
  FLESH_HARDCASES_INVERT_ONE,    /* a node through the opposite face of one of its tets, the only one
                                    inverted */
  FLESH_HARDCASES_SCALE_X,       /* x times `amount` */
  FLESH_HARDCASES_SCALE_ALL,     /* everything times `amount` */
  FLESH_HARDCASES_TWIST,         /* `amount` turns about the long axis */
  FLESH_HARDCASES_SHEAR,         /* z += `amount` x */
  FLESH_HARDCASES_STRETCH_TWIST, /* x times `amount`, half a turn */
  FLESH_HARDCASES_SPIN,          /* at rest shape, turning about z by `amount` turns per step */
  FLESH_HARDCASES_FLY,           /* along x at 100 m/s, `amount` m before its place */
  FLESH_HARDCASES_SPEED,         /* in its place, along x at `amount` m/s */
  FLESH_HARDCASES_THROW,         /* a hundredth of the nodes, 3 at least, `amount` lengths away */
  FLESH_HARDCASES_GAUSS,         /* each coordinate by normal noise of `amount` lengths */
  FLESH_HARDCASES_HALF_TURN,     /* the half of larger x by half a turn about the long axis */
  FLESH_HARDCASES_INSIDE_OUT     /* through the middle to the other side */
} flesh_hardcases_start;

enum {
  FLESH_HARDCASES_PINNED = 1,           /* the face x = 0 is held at rest for all time */
  FLESH_HARDCASES_FEET = 2,             /* the nodes of the first twentieth along x are held at rest for all time */
  FLESH_HARDCASES_KEPT_EQUILIBRIUM = 4, /* accepted as the equilibrium it is, need not recover */
  FLESH_HARDCASES_HARDEST = 8,          /* scramble and point: nothing is guaranteed above nu = 0.495 */
  FLESH_HARDCASES_RANDOM = 16,          /* run once per seed */
  FLESH_HARDCASES_STATIC = 32
};

/* Numbers that a file leaves out are NaN, but for amount, noise and offset: 0. */
typedef struct flesh_hardcases_case {
  const char *name, *group;
  flesh_hardcases_mesh mesh;
  flesh_hardcases_start start;
  double amount;
  unsigned flags;
  double seconds; /* of the hard phase: at least 20 steps; of statics no matter */
  double step;    /* s; NaN: the setting's */
  /* A second phase without `effects`, in which the body is to come back; NaN: none. Steps shorter
   * than 1/60 s make 100 steps of the hard phase and then `seconds` at 1/60 s. */
  double release, release_step; /* s; step NaN: 1/60 */
  double poisson;               /* NaN: the setting's */
  double density;               /* NaN: 1000 kg/m^3 */
  double young_ratio;           /* of region 1; NaN: one material */
  double young;                 /* NaN: 1e5 Pa */
  double scale, offset;         /* of a body of --meshes: times 0.2 m along x, NaN: 1; m along each axis */
  const char *effects;          /* items of the scene's list, beside inertia and what is held; "": none */
  double noise;                 /* every coordinate moved besides by up to this part of the node's mean edge */
  const char *doc;
  unsigned long long fingerprint; /* of all this, for a file that is not the program's own; 0: it is */
} flesh_hardcases_case;

typedef struct flesh_hardcases_battery {
  flesh_arena arena;
  int count;
  flesh_hardcases_case *cases;
} flesh_hardcases_battery;

/* Reads the cases of a file; of the program's own `name` ("battery", study/embedded.h) when `path` is NULL. FLESH_ERR_FILE;
 * FLESH_ERR_ARGUMENT with file, line, key, value and what is valid. The caller closes the battery in any case. */
int flesh_hardcases_open_battery(const char *path, const char *name, flesh_hardcases_battery *battery);
void flesh_hardcases_close_battery(flesh_hardcases_battery *battery);
extern const flesh_key flesh_hardcases_keys[]; /* of a file of cases */

/* Makes the case's mesh. Returns new. */
int flesh_hardcases_make_mesh(const flesh_hardcases_case *row, int quick, flesh_mesh **mesh);

/* Fills state->x, v [3*nodes] and t = 0; `step` is the length of the steps to come. */
int flesh_hardcases_make_start(const flesh_hardcases_case *row, const flesh_mesh *mesh, int seed,
                               double step, flesh_state *state);

#endif
