/* touching.h: shared by the tests of bodies that touch each other: scenes in motion, their momenta and energies, and a
 * search for intersections of surfaces after every step. */
#ifndef FLESH_TEST_TOUCHING_H
#define FLESH_TEST_TOUCHING_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "crossings.h"
#include "flesh/integrator.h"
#include "flesh/scene.h"
#include "test.h"

typedef struct touching {
  flesh_scene *scene;
  flesh_integrator *integrator;
  flesh_state state;
  flesh_contact_surface surface;
  int n, effects;
  double h, *mass; /* [n/3] kg, lumped */
  int steps, crossings, solves, newton, impact_steps;
  double slack; /* N s, bound of the momentum error that the solves have left so far */
  flesh_solve_stats last;
} touching;

static inline int touching_integrator(touching *m)
{
  const flesh_scene_time *time = flesh_scene_times(m->scene);
  const int status = flesh_integrator_create(flesh_scene_system(m->scene), time->method, flesh_scene_solver(m->scene),
                                             &m->integrator);
  return status ? status : flesh_integrator_set_adaptive(m->integrator, &time->adaptive);
}

/* Sets up the rest from m->scene, with one density for all bodies, whatever the scene says. */
static inline int touching_start(double density, touching *m)
{
  const flesh_system *system = flesh_scene_system(m->scene);
  const flesh_mesh *mesh = flesh_scene_mesh(m->scene);
  m->n = flesh_system_unknowns(system);
  m->effects = flesh_system_effect_count(system);
  m->h = flesh_scene_times(m->scene)->step;
  m->state.x = calloc((size_t)m->n, sizeof(double));
  m->state.v = calloc((size_t)m->n, sizeof(double));
  m->mass = calloc((size_t)m->n / 3, sizeof(double));
  flesh_scene_start(m->scene, &m->state);
  double *densities = malloc((size_t)flesh_mesh_tet_count(mesh) * sizeof *densities);
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) densities[e] = density;
  flesh_mesh_lumped_mass(mesh, densities, m->mass);
  free(densities);
  int status = flesh_contact_surface_of_mesh(mesh, NULL, &m->surface);
  return status ? status : touching_integrator(m);
}

/* Reads a scene from text, with further values up to NULL; paths are relative to data/scenes. All bodies have one
 * density. */
static inline int touching_begin(const char *text, const char *const *set, double density, touching *m)
{
  int count = 0;
  while (set && set[count]) count++;
  *m = (touching){0};
  int status = flesh_scene_read_text(text, "../data/scenes/touching.yaml", count, set, &m->scene);
  return status ? status : touching_start(density, m);
}

static inline void touching_end(touching *m)
{
  flesh_integrator_destroy(&m->integrator);
  flesh_contact_surface_clear(&m->surface);
  free(m->state.x);
  free(m->state.v);
  free(m->mass);
  flesh_scene_destroy(&m->scene);
}

/* Takes a step and checks that nothing intersects afterwards. */
static inline int touching_step(touching *m)
{
  flesh_solve_stats stats = {0};
  int status = flesh_integrator_step(m->integrator, &m->state, m->h, &stats);
  m->last = stats;
  m->steps++;
  m->solves += stats.solves;
  m->newton += stats.newton;
  m->impact_steps += stats.impact_steps;
  m->slack += m->h * sqrt(m->n / 3.) * stats.residual_target * stats.solves;
  if (!status) m->crossings += crossings_count(&m->surface, m->state.x);
  return status;
}

/* Computes the sums of m v and of m x cross v, about the origin. */
static inline void touching_momenta(const touching *m, double p[3], double L[3])
{
  memset(p, 0, 3 * sizeof *p);
  memset(L, 0, 3 * sizeof *L);
  for (int i = 0; i < m->n / 3; i++) {
    const double *x = m->state.x + 3 * i, *v = m->state.v + 3 * i;
    for (int c = 0; c < 3; c++) {
      const int j = (c + 1) % 3, k = (c + 2) % 3;
      p[c] += m->mass[i] * v[c];
      L[c] += m->mass[i] * (x[j] * v[k] - x[k] * v[j]);
    }
  }
}

/* Returns kinetic plus potential energy of all effects, J; stores that of contact in *contact (may be NULL), 0 if
 * nothing touches. */
static inline double touching_energy(const touching *m, double *contact)
{
  const flesh_system *system = flesh_scene_system(m->scene);
  double energies[16] = {0}, sum = 0, *zeros = calloc((size_t)m->n, sizeof *zeros);
  const flesh_point point = flesh_point_at(m->state.t, m->state.x, m->state.v, zeros);
  CHECK(m->effects <= 16);
  CHECK_OK(flesh_system_energies(system, &point, energies));
  if (contact) *contact = 0;
  for (int k = 0; k < m->effects; k++) {
    sum += energies[k];
    if (contact && !strcmp(flesh_system_effect(system, k)->operations->name, "contact")) *contact += energies[k];
  }
  free(zeros);
  return sum;
}

/* Makes two balls of 0.1 m, the right one moving at 2 m/s along x, offset by `aside`; the caller sets method and
 * step. */
#define TOUCHING_MATERIAL "material: {energy: S, constants: matched, young: 1e5, poisson: 0.4}"
#define TOUCHING_BALLS(aside)                                                                                           \
  "body: {name: left, mesh: ../meshes/ball.msh, density: 1000, " TOUCHING_MATERIAL "}\n"                                 \
  "bodies:\n"                                                                                                           \
  "  - {name: right, mesh: ../meshes/ball.msh, translation: [0.106, " aside "], rotation: [0.3, 0.5, 0.7], "            \
  "density: 1000, velocity: [-2, 0, 0], " TOUCHING_MATERIAL "}\n"                                                       \
  "effects:\n"                                                                                                          \
  "  - inertia: {}\n"                                                                                                   \
  "  - contact: {between: all}\n"                                                                                       \
  "time: {method: backward-euler, step: 1/1000, end: 1}\n"                                                              \
  "solver: {newton_tolerance: 1e-8}\n"

#endif
