/* probe_place.c: checks probes and finds their places. */
#include "output/probe_place.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "parallel/body_figures.h"
#include "skin/locator.h"
#include "system/parts.h"
#include "system/ranks.h"

int flesh_probe_find_tets(const flesh_mesh *mesh, const flesh_probe *probe, int *count, int **tets)
{
  const int total = flesh_mesh_tet_count(mesh);
  unsigned char *chosen = calloc((size_t)flesh_mesh_node_count(mesh) + 1, 1);
  *tets = malloc(((size_t)total + 1) * sizeof **tets);
  *count = 0;
  if (!chosen || !*tets) {
    free(chosen);
    free(*tets);
    *tets = NULL;
    return flesh_fail(FLESH_ERR_MEMORY, "no memory for the tets of a probe");
  }
  for (int k = 0; k < probe->node_count; k++) chosen[probe->nodes[k]] = 1;
  for (int e = 0; e < total; e++) {
    int nodes[10], all = 1;
    const int size = flesh_mesh_tet_nodes(mesh, e, nodes);
    for (int a = 0; a < size; a++) all &= chosen[nodes[a]];
    if (all) (*tets)[(*count)++] = e;
  }
  free(chosen);
  return FLESH_OK;
}

static int check_name(const char *name)
{
  int good = name && isalpha((unsigned char)*name);
  for (const char *c = name; good && *c; c++) good = isalnum((unsigned char)*c) || *c == '_' || *c == '-';
  if (good) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "name is '%s'; it must be a letter, then letters, digits, _ and -",
                    name ? name : "");
}

/* Finds the tet of this rank that contains a point at rest, or is nearest to it, and the box around the whole body. */
static int find_place(const flesh_mesh *mesh, const flesh_team *team, const double p[3], flesh_place *place,
                      double box[6])
{
  flesh_locator *locator = NULL;
  const int status = flesh_team_agree(team, flesh_locator_create(mesh, &locator));
  if (!status) flesh_locator_find(locator, p, -1, place);
  flesh_locator_destroy(&locator);
  if (status) return status;
  flesh_body_rest_box(mesh, team, box);
  return FLESH_OK;
}

/* Chooses the nearest of the ranks' places; of equally near ones, the first tet of the body. Only the rank that has it
 * keeps it. */
static void choose_place(const flesh_team *team, flesh_place *place)
{
  if (!team) return;
  double nearest = place->tet < 0 ? -INFINITY : -place->distance;
  const double own = place->tet < 0 ? -INFINITY : -team->tets[place->tet],
               first = flesh_team_argmax(team, &nearest, own);
  if (-place->distance != nearest || own != first) place->tet = -1;
  place->distance = -nearest;
}

/* Finds the tet that contains the probe's point at rest. */
static int locate(flesh_probe *probe, const flesh_mesh *mesh, const flesh_team *team)
{
  flesh_place place;
  const double *p = probe->point;
  double diagonal = 0, box[6];
  int status = find_place(mesh, team, p, &place, box);
  if (status) return status;
  choose_place(team, &place);
  for (int d = 0; d < 3; d++) diagonal += pow(box[3 + d] - box[d], 2);
  if (team ? place.distance == INFINITY : place.tet < 0)
    return flesh_fail(FLESH_ERR_ARGUMENT, "point is [%g, %g, %g], far outside the body; it must lie in it at rest", p[0],
                      p[1], p[2]);
  if (place.distance > 1e-6 * sqrt(diagonal))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "point is [%g, %g, %g], which no tet holds at rest; the nearest is %g m away, and the body reaches "
                      "from [%g, %g, %g] to [%g, %g, %g]",
                      p[0], p[1], p[2], place.distance, box[0], box[1], box[2], box[3], box[4], box[5]);
  probe->tet = place.tet;
  memcpy(probe->weights, place.weights, sizeof place.weights);
  return FLESH_OK;
}

int flesh_probe_check_nodes(const flesh_probe *probe, int total)
{
  for (int k = 0; k < probe->node_count; k++)
    if (probe->nodes[k] < 0 || probe->nodes[k] >= total)
      return flesh_fail(FLESH_ERR_ARGUMENT, "nodes[%d] is %d; the mesh has the nodes 0 to %d", k, probe->nodes[k],
                        total - 1);
  return FLESH_OK;
}

int flesh_probe_counts(const flesh_probe *probe, const flesh_team *team, int k)
{
  return !team || probe->nodes[k] < team->own;
}

/* Returns whether flesh_probe_prepare has been called; on a part of a body, a probe may have no node or tet here. */
static int is_prepared(const flesh_probe *p, const flesh_team *team, int tets)
{
  const double *w = p->weights;
  const int has_tet = p->tet < 0 ? team != NULL : p->tet < tets && fabs(w[0] + w[1] + w[2] + w[3] - 1) < 1e-6;
  return p->name && p->quantities && (!isnan(p->point[0]) ? has_tet : (team || p->node_count > 0) && p->nodes);
}

int flesh_probes_check(const flesh_mesh *mesh, int count, const flesh_probe *probes, const flesh_team *team)
{
  for (int k = 0; k < count; k++) {
    const flesh_probe *p = &probes[k];
    if (!is_prepared(p, team, mesh->tets))
      return flesh_fail(FLESH_ERR_ARGUMENT, "probes[%d] is not prepared for this body; flesh_probe_prepare does that", k);
    const int status = !isnan(p->point[0]) ? FLESH_OK : flesh_probe_check_nodes(p, mesh->nodes);
    if (status) return status;
    for (int j = 0; j < k; j++)
      if (!strcmp(probes[j].name, p->name))
        return flesh_fail(FLESH_ERR_ARGUMENT, "probes[%d] and probes[%d] are both named %s; names must differ", j, k,
                          p->name);
  }
  return FLESH_OK;
}

static int check_nodes(flesh_probe *probe, const flesh_body *body, const flesh_team *team)
{
  const double *X = flesh_mesh_positions(body->mesh);
  double sums[5] = {0}; /* number of nodes and sum of their rest positions, each counted once; number of tets between */
  const int wants_tets = (probe->quantities & FLESH_PROBE_OF_TETS) != 0;
  int *tets = NULL, count = 0;
  probe->tet = -1;
  int status = flesh_probe_check_nodes(probe, flesh_mesh_node_count(body->mesh));
  for (int k = 0; k < probe->node_count && probe->nodes && !status; k++) {
    if (!flesh_probe_counts(probe, team, k)) continue;
    sums[0]++;
    for (int d = 0; d < 3; d++) sums[1 + d] += X[3 * (size_t)probe->nodes[k] + (size_t)d];
  }
  if (!status && wants_tets && probe->nodes) status = flesh_probe_find_tets(body->mesh, probe, &count, &tets);
  free(tets);
  sums[4] = count;
  status = flesh_team_sum_agreed(team, status, 5, sums);
  if (status) return status;
  if (sums[0] < 1) return flesh_fail(FLESH_ERR_ARGUMENT, "a probe must have a point or at least one node");
  const int about_middle = isnan(probe->about[0]);
  for (int d = 0; d < 3 && about_middle; d++) probe->about[d] = sums[1 + d] / sums[0];
  if (!wants_tets || sums[4] > 0) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT,
                    "quantities has some of J, stretch, stress and energy, but no tet has all its nodes among the %.0f "
                    "chosen; choose more, or a point",
                    sums[0]);
}

static int check_holder(const flesh_probe *probe, const flesh_system *system)
{
  const int effects = flesh_system_effect_count(system);
  if (probe->holder < 0 || probe->holder > system->constraint_count)
    return flesh_fail(FLESH_ERR_ARGUMENT, "holder is %d; the system has %d pins and prescribed motions, counted from 1",
                      probe->holder, system->constraint_count);
  const flesh_role role = probe->contact > 0 && probe->contact <= effects
                              ? flesh_system_effect(system, probe->contact - 1)->operations->role
                              : FLESH_ROLE_CONTACT;
  if (probe->contact < 0 || probe->contact > effects || (role != FLESH_ROLE_CONTACT && role != FLESH_ROLE_OTHER))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "contact is %d; none of the system's %d effects, counted from 1, is a contact of this number",
                      probe->contact, effects);
  return FLESH_OK;
}

int flesh_probe_prepare(flesh_probe *probe, const flesh_body *body, const flesh_system *system)
{
  FLESH_NEED({probe, "probe"}, {body, "body"}, {system, "system"});
  const unsigned asked = probe->quantities;
  const int is_point = !isnan(probe->point[0]);
  int status = flesh_mesh_check_counts(flesh_system_mesh(system), "the body", "", body->mesh->nodes, body->mesh->tets);
  if (!status) status = check_name(probe->name);
  if (status) return status;
  if (!asked) return flesh_fail(FLESH_ERR_ARGUMENT, "quantities is empty; it must name at least one");
  if (asked > FLESH_PROBE_ALL)
    return flesh_fail(FLESH_ERR_ARGUMENT, "quantities are 0x%x; valid bits are those of 0x%x", asked, FLESH_PROBE_ALL);
  if (is_point && asked & (FLESH_PROBE_REACTION | FLESH_PROBE_CONTACT_FORCE))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "quantities has %s, which a point does not have; choose nodes by box, sphere, nodes, regions, set or body",
                      asked & FLESH_PROBE_REACTION ? "reaction" : "contact_force");
  if (asked & (FLESH_PROBE_STRESS | FLESH_PROBE_ENERGY) && !body->materials)
    return flesh_fail(FLESH_ERR_ARGUMENT, "quantities has %s, but the body has no material",
                      asked & FLESH_PROBE_STRESS ? "stress" : "energy");
  if (asked & FLESH_PROBE_CONTACT_FORCE && !probe->contact && !flesh_system_has_role(system, FLESH_ROLE_CONTACT))
    return flesh_fail(FLESH_ERR_ARGUMENT, "quantities has contact_force, but nothing touches the body; add contact");
  if ((status = check_holder(probe, system))) return status;
  const flesh_team *team = flesh_system_team(system);
  return is_point ? locate(probe, body->mesh, team) : check_nodes(probe, body, team);
}
