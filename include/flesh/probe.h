/* probe.h: quantities at chosen points or nodes, written to probes.csv. Functions that return no status cannot fail. */
#ifndef FLESH_PROBE_H
#define FLESH_PROBE_H

#include "flesh/observer.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Quantities of a point are those in the tet that contains it at rest; those of nodes are as follows.
 * "Their tets" are the tets all of whose nodes are chosen.
 *
 *   position       [m] mean over the nodes
 *   velocity       [m/s] mean over the nodes
 *   reaction       force [N] on the body, of the pins and prescribed motions that constrain some of
 *                  the nodes, and its moment [N m]
 *   J              det F; of nodes, as J_mean, its mean over the tets' rest volume
 *   stretch        singular values of F, descending, the last with the sign of J; of nodes their mean
 *                  over the tets' rest volume
 *   stress         Cauchy stress [Pa] of the elastic energy, P F^T / J, and of effects that say theirs
 *                  (flesh_effect_figures: the fibres of muscles); of nodes its mean over the tets' volume
 *   energy         strain energy from rest: of a point its density per rest volume [J/m^3], of nodes
 *                  that of their tets [J]
 *   contact_force  force [N] on the nodes, of all effects of FLESH_ROLE_CONTACT, and its moment [N m],
 *                  at the step's stage (flesh_step_record)
 *
 * Integrals over a tet are those of its element. A value that does not exist (the stress of a form
 * that needs J > 0 at J <= 0) is NaN.
 *
 * The reaction is the sum of all effects at the state, r = sum of r_e(t, x, v, a), on the constrained
 * dofs: v is the state's, a on constrained dofs the prescribed one, on free ones that of the balance
 * r = 0. In statics v and a are 0. Nothing is lagged or frozen: it differs from the reaction within
 * a step by an error of order 1 in the step with friction, of the method's order with viscosity or
 * muscles with a max_shortening_velocity. */
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

/* A place and what is written of it; all pointers are borrowed. */
typedef struct flesh_probe {
  const char *name;    /* a letter, then letters, digits, _ and - */
  unsigned quantities; /* flesh_probe_quantity, or'ed; not 0 */
  double point[3];     /* m, at rest; NaN: nodes */
  int node_count;
  const int *nodes; /* [node_count], each once; not read for a point */
  double about[3];  /* m, what moments are about; NaN: the mean of the nodes' rest positions */
  /* The constraint whose forces count, on the components that it holds: 0, all pins and prescribed motions; k, the k-th
   * of the system in the order of their addition. A component that several hold is the last one's. */
  int holder;
  /* 0: all contacts; k: the system's effect k - 1 (flesh_system_effect) alone, a contact or one of
   * FLESH_ROLE_OTHER (a weld, a joint). */
  int contact;
  /* Found by flesh_probe_prepare: of a point its tet, else -1, and its barycentric coordinates for the
   * corners that flesh_mesh_tets has; of a curved tet those of the straight one that it is the image of. */
  int tet;
  double weights[4];
} flesh_probe;

/* On a part of a body (flesh/ranks.h) a probe has only the nodes that are in the part, maybe none; a point's tet is -1
 * on all ranks but one. Every rank calls these functions, with the same probes, and the first writes.
 *
 * Checks a probe, and fills in probe->tet, weights and about. FLESH_ERR_ARGUMENT with a sentence: a body of another mesh
 * than the system's; a bad name; no quantity; a point farther than 1e-6 of the body's diagonal from all tets (with the
 * distance); forces of a point; a holder or a contact that the system has not; quantities of tets where no tet has all
 * its nodes chosen; stress or energy without a material; contact_force without contact. Further errors:
 * FLESH_ERR_MEMORY. */
FLESH_API int flesh_probe_prepare(flesh_probe *probe, const flesh_body *body, const flesh_system *system);

/* probes.csv: a header and a row per step, flushed as it is written, so that an interrupted run leaves
 * a valid file. Columns: "t [s]", then "<name>.<quantity>_<component> [<unit>]" by probe; numbers read
 * back exactly. */
typedef struct flesh_probes flesh_probes;
/* Opens the file for prepared probes [count], which are copied, with different names; borrows the rest.
 * `method` is the run's. Returns new. Errors: FLESH_ERR_ARGUMENT, also for a body of another mesh than the system's and
 * for probes of another body; FLESH_ERR_MEMORY, FLESH_ERR_FILE. */
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
