/* probe.h: quantities at chosen points or nodes, written to probes.csv. Functions that return no status cannot fail. */
#ifndef FLESH_PROBE_H
#define FLESH_PROBE_H

#include "flesh/observer.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Quantities of a probe. At a point they are those in the tet that contains it at rest; for nodes they are as follows,
 * and "their tets" are the tets all of whose nodes are chosen.
 *
 *   position       [m] mean over the nodes
 *   velocity       [m/s] mean over the nodes
 *   reaction       force [N] on the body, from the pins and prescribed motions that constrain some of
 *                  the nodes, and its moment [N m]
 *   J              det F; for nodes its mean (J_mean) over their tets, weighted by rest volume
 *   stretch        singular values of F, descending, the last with the sign of J; for nodes their mean
 *                  over their tets, weighted by rest volume
 *   stress         Cauchy stress [Pa] of the elastic energy, P F^T / J, and of effects that define one
 *                  (flesh_effect_figures: the fibres of muscles); for nodes its mean over their tets' volume
 *   energy         strain energy relative to rest: at a point its density per rest volume [J/m^3], for
 *                  nodes that of their tets [J]
 *   contact_force  force [N] on the nodes, from all effects of FLESH_ROLE_CONTACT, and its moment [N m],
 *                  at the step's stage (flesh_step_record)
 *
 * Integrals over a tet are those of its element. A value that does not exist (the stress of a form that needs J > 0 at J
 * <= 0) is NaN.
 *
 * The reaction is the sum of all effects at the state, r = sum of r_e(t, x, v, a), on the constrained dofs. v is the
 * state's velocity; a is the prescribed acceleration on constrained dofs, and on free dofs that of the balance r = 0.
 * In statics v and a are 0. Nothing is lagged or frozen: the reaction differs from that within a step by an error of
 * order 1 in the step with friction, of the method's order with viscosity or muscles with a max_shortening_velocity. */
typedef enum flesh_probe_quantity {
  FLESH_PROBE_POSITION = 1,
  FLESH_PROBE_VELOCITY = 2,
  FLESH_PROBE_REACTION = 4,
  FLESH_PROBE_J = 8,
  FLESH_PROBE_STRETCH = 16,
  FLESH_PROBE_STRESS = 32,
  FLESH_PROBE_ENERGY = 64,
  FLESH_PROBE_CONTACT_FORCE = 128
} flesh_probe_quantity;

/* A place and the quantities that are written there; all pointers are borrowed. */
typedef struct flesh_probe {
  const char *name;    /* a letter, then letters, digits, _ and - */
  unsigned quantities; /* flesh_probe_quantity, or'ed; not 0 */
  double point[3];     /* m, at rest; NaN: nodes */
  int node_count;
  const int *nodes; /* [node_count], without repetition; not read for a point */
  double about[3];  /* m, the point about which moments are taken; NaN: the mean of the nodes' rest positions */
  /* The constraint whose forces are summed, over the components that it constrains: 0, all pins and prescribed
   * motions; k, the k-th of the system in the order of their addition. A component with several constraints belongs
   * to the last one. */
  int holder;
  /* The contact whose forces are summed: 0, all; k, only the system's effect k - 1 (flesh_system_effect), a contact
   * or an effect of FLESH_ROLE_OTHER (a weld, a joint). */
  int contact;
  /* Set by flesh_probe_prepare: a point's tet, else -1, and its barycentric coordinates for the corners that
   * flesh_mesh_tets has; in a curved tet, the coordinates in the straight tet whose image it is. */
  int tet;
  double weights[4];
} flesh_probe;

/* Checks a probe, and sets probe->tet, weights and about.
 *
 * On a part of a body (flesh/ranks.h) a probe has only the nodes that are in the part, maybe none; a point's tet is -1
 * on all ranks but one. Every rank calls these functions, with the same probes, and the first rank writes.
 *
 * FLESH_ERR_ARGUMENT with a sentence: a body of another mesh than the system's; a bad name; no quantity; a point
 * farther than 1e-6 of the body's diagonal from all tets (with the distance); forces at a point; a holder or a
 * contact that the system does not have; quantities of tets when no tet has all its nodes chosen; stress or energy
 * without a material; contact_force without contact. Further errors: FLESH_ERR_MEMORY. */
FLESH_API int flesh_probe_prepare(flesh_probe *probe, const flesh_body *body, const flesh_system *system);

/* The file probes.csv: a header and a row per step, flushed as it is written, so that an interrupted run leaves a
 * valid file. Columns: "t [s]", then "<name>.<quantity>_<component> [<unit>]" by probe; numbers read back exactly. */
typedef struct flesh_probes flesh_probes;
/* Opens the file for prepared probes [count], which have different names and are copied; borrows the rest. `method`
 * is the run's. Returns new. Errors: FLESH_ERR_ARGUMENT, also for a body of another mesh than the system's and for
 * probes of another body; FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
FLESH_API int flesh_probes_create(const char *path, const flesh_body *body, const flesh_system *system,
                                  flesh_method method, int count, const flesh_probe *probes,
                                  flesh_probes **result);
/* NULL-safe; sets *probes to NULL. FLESH_ERR_FILE when not all could be written. */
FLESH_API int flesh_probes_close(flesh_probes **probes);
/* A flesh_observer's function. Errors: FLESH_ERR_ARGUMENT, FLESH_ERR_FILE. */
FLESH_API int flesh_probes_observe(void *probes, const flesh_step_record *record);

#ifdef __cplusplus
}
#endif
#endif
