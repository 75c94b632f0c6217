/* cases.h: the hard cases, which files describe (data/hardcases), with their meshes and start states. */
#ifndef FLESH_HARDCASES_CASES_H
#define FLESH_HARDCASES_CASES_H

#include "flesh/integrator.h"
#include "flesh/mesh.h"
#include "base/key.h"
#include "scene/arena.h"
#include "scene/node.h"

/* The meshes: ROW(id, name). All bodies except single tets fill [0, 0.2] x [0, 0.1] x [0, 0.1] m, or a cube of 0.1 m,
 * approximately. */
#define FLESH_HARDCASES_MESH_LIST(ROW)                                                                                  \
  ROW(BLOCK, "block")           /* a regular block */                                                                  \
  ROW(FINE, "fine")             /* the block with enough layers along x to be twisted by 5 turns */                    \
  ROW(CHECKER, "checker")       /* the block, its cells in two regions like a chess board */                           \
  ROW(HALVES, "halves")         /* the block, each half a region */                                                    \
  ROW(SLIVERS, "slivers")       /* the block with slivers of radius ratio 1e-4 */                                      \
  ROW(GRADED, "graded")         /* a cube, refined towards a corner: edges from 1 to 1e-4 */                           \
  ROW(FAN, "fan")               /* a cube of tets that share the node in its middle */                                 \
  ROW(SINGLE, "single")         /* one tet */                                                                          \
  ROW(TWO_BODIES, "two-bodies") /* two blocks without common nodes */                                                  \
  ROW(BAR, "bar")               /* a bar with the proportions of the benchmark */                                      \
  ROW(LARGE, "large")           /* the block, finer: 15 000 to 50 000 tets, fewer with --quick */

/* The start states: ROW(id, name, whether there is an `amount`). */
typedef enum flesh_hardcases_amount { FLESH_HARDCASES_NO, FLESH_HARDCASES_MAY, FLESH_HARDCASES_MUST } flesh_hardcases_amount;
#define FLESH_HARDCASES_START_LIST(ROW)                                                                                 \
  ROW(REST, "rest", NO)                                                                                                \
  ROW(SCRAMBLE, "scramble", NO)               /* every node anywhere in the bounding box */                            \
  ROW(SCRAMBLE_ONE, "scramble-half", NO)      /* only the nodes with x > 0.1 m */                                      \
  ROW(JITTER, "jitter", MUST)                 /* each coordinate by up to `amount` of the node's mean edge */          \
  ROW(PLANE, "plane", MAY)                    /* onto the middle plane z; `amount`: noise over the length */           \
  ROW(LINE, "line", MAY)                                                                                               \
  ROW(POINT, "point", MAY)                                                                                             \
  ROW(MIRROR, "mirror", NO)                   /* x -> -x */                                                            \
  ROW(INVERT_ONE, "invert-one", NO)           /* a node through the opposite face of a tet, the only inverted one */   \
  ROW(SCALE_X, "scale-x", MUST)               /* x times `amount` */                                                   \
  ROW(SCALE_ALL, "scale", MUST)               /* everything times `amount` */                                          \
  ROW(TWIST, "twist", MUST)                   /* `amount` turns about the long axis */                                 \
  ROW(SHEAR, "shear", MUST)                   /* z += `amount` x */                                                    \
  ROW(STRETCH_TWIST, "stretch-twist", MUST)   /* x times `amount`, half a turn */                                      \
  ROW(SPIN, "spin", MUST)                     /* the shape at rest, turning about z by `amount` turns per step */      \
  ROW(FLY, "fly", MUST)                       /* along x at 100 m/s, from `amount` m before its place */               \
  ROW(SPEED, "speed", MUST)                   /* in its place, moving along x at `amount` m/s */                       \
  ROW(THROW, "throw", MUST)                   /* 1 % of the nodes, at least 3, by `amount` lengths */                  \
  ROW(GAUSS, "gauss", MUST)                   /* normal noise of `amount` lengths on each coordinate */                \
  ROW(HALF_TURN, "half-turn", NO)             /* the half with larger x by half a turn about the long axis */          \
  ROW(INSIDE_OUT, "inside-out", NO)           /* through the middle to the other side */

#define FLESH_HARDCASES_ID(id, ...) FLESH_HARDCASES_##id,
typedef enum flesh_hardcases_mesh { FLESH_HARDCASES_MESH_LIST(FLESH_HARDCASES_ID) } flesh_hardcases_mesh;
typedef enum flesh_hardcases_start { FLESH_HARDCASES_START_LIST(FLESH_HARDCASES_ID) } flesh_hardcases_start;

/* The nodes that are held at rest at all times: none, those of the face x = 0, or those of the first twentieth along x. */
typedef enum flesh_hardcases_held { FLESH_HARDCASES_FREE, FLESH_HARDCASES_FACE, FLESH_HARDCASES_FEET } flesh_hardcases_held;

/* Expected ends; of the hardest cases, recovery is not guaranteed above a Poisson's ratio of 0.495. */
typedef enum flesh_hardcases_expected {
  FLESH_HARDCASES_RECOVERY,
  FLESH_HARDCASES_KEPT_EQUILIBRIUM, /* staying in the equilibrium is accepted, too */
  FLESH_HARDCASES_HARDEST
} flesh_hardcases_expected;

/* A case. Numbers that a file does not give are NaN, except amount, noise and offset, which are 0. */
typedef struct flesh_hardcases_case {
  const char *name, *group;
  flesh_hardcases_mesh mesh;
  flesh_hardcases_start start;
  double amount;
  flesh_hardcases_held held;
  flesh_hardcases_expected expects;
  int random; /* run once for each seed */
  int is_static;
  double seconds; /* of the hard phase, which has at least 20 steps; ignored in statics */
  double step;    /* s; NaN: that of the setting */
  /* Length of a second phase without `effects`, in which the body should recover; NaN: none. With steps shorter than
   * 1/60 s the hard phase has 100 steps, and `seconds` at 1/60 s follow. */
  double release, release_step; /* s; release_step NaN: 1/60 */
  double poisson;               /* NaN: the setting's */
  double density;               /* NaN: 1000 kg/m^3 */
  double young_ratio;           /* of region 1 over the other; NaN: one material */
  double young;                 /* NaN: 1e5 Pa */
  double scale, offset;         /* of a body of --meshes: its length over 0.2 m, NaN: 1; m along each axis */
  const flesh_node *effect_list; /* as in the file; NULL: none */
  const char *effects;          /* items of the scene's list, without inertia and constraints; "": none */
  double noise;                 /* every coordinate is also moved by up to this share of the node's mean edge */
  const char *doc;
  unsigned long long fingerprint; /* hash of the case in a user's file; 0 for the program's own cases */
} flesh_hardcases_case;

typedef struct flesh_hardcases_battery {
  flesh_arena arena;
  int count;
  flesh_hardcases_case *cases;
} flesh_hardcases_battery;

/* Reads the cases of a file, or with `path` NULL those of the program's own `name` ("battery", study/embedded.h).
 * FLESH_ERR_FILE; FLESH_ERR_ARGUMENT with file, line, key, value and what is valid. The caller closes the battery in
 * any case. */
int flesh_hardcases_open_battery(const char *path, const char *name, flesh_hardcases_battery *battery);
void flesh_hardcases_close_battery(flesh_hardcases_battery *battery);
extern const flesh_key flesh_hardcases_keys[]; /* keys of a file of cases */

/* Makes the case's mesh, new. */
int flesh_hardcases_make_mesh(const flesh_hardcases_case *hardcase, int quick, flesh_mesh **mesh);

/* Sets state->x and v [3*nodes] to the start, and t to 0; `step` is the length of the steps of the run. */
int flesh_hardcases_make_start(const flesh_hardcases_case *hardcase, const flesh_mesh *mesh, int seed,
                               double step, flesh_state *state);

#endif
