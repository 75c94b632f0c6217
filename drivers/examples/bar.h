/* bar.h: the body of the examples: a soft bar of 2 m x 0.5 m x 0.5 m along x, and the functions that make it. */
#ifndef FLESH_EXAMPLES_BAR_H
#define FLESH_EXAMPLES_BAR_H

#include <flesh/flesh.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sundials/sundials_context.h>

/* Ends the program if a call fails; prints the call (for functions of SUNDIALS, which set no message) and flesh's
 * message. */
#define TRY(call)                                                                              \
  do {                                                                                         \
    if (call) {                                                                                \
      fprintf(stderr, "%s:%d: %s fails: %s\n", __FILE__, __LINE__, #call, flesh_error_text()); \
      exit(1);                                                                                 \
    }                                                                                          \
  } while (0)

typedef struct bar {
  flesh_mesh *mesh;
  int nodes, tip; /* tip: the node in the middle of the free end */
  double *density;
  flesh_material material;
  flesh_body body;
  flesh_system *system;
  flesh_state state; /* at rest */
} bar;

/* Returns a new state at rest. */
static inline flesh_state bar_rest(const flesh_mesh *mesh)
{
  const size_t n = 3 * (size_t)flesh_mesh_node_count(mesh);
  flesh_state state = {.x = malloc(n * sizeof(double)), .v = calloc(n, sizeof(double))};
  memcpy(state.x, flesh_mesh_positions(mesh), n * sizeof(double));
  return state;
}

/* Makes the body and the system of b->mesh, which *b owns: elasticity, and inertia if `moves`. */
static inline void bar_make(bar *b, flesh_element element, flesh_material material, int moves)
{
  const int tets = flesh_mesh_tet_count(b->mesh);
  b->nodes = flesh_mesh_node_count(b->mesh);
  b->density = malloc((size_t)tets * sizeof(double));
  for (int e = 0; e < tets; e++) b->density[e] = 1000; /* kg/m^3 */
  b->material = material;
  b->body = (flesh_body){.mesh = b->mesh, .density = b->density, .materials = &b->material,
                         .mass = FLESH_MASS_LUMPED, .element = element};
  TRY(flesh_system_create(b->mesh, &b->system));
  flesh_effect *effect;
  TRY(flesh_effect_elasticity(&b->body, &effect));
  TRY(flesh_system_add_effect(b->system, &effect));
  if (moves) {
    TRY(flesh_effect_inertia(&b->body, &effect));
    TRY(flesh_system_add_effect(b->system, &effect));
  }
  b->state = bar_rest(b->mesh);
}

/* Makes the bar up to bar_finish, before which the program may add effects. For elements with ten nodes per tet, nodes
 * on the mesh's edges are numbered after those at its vertices. */
static inline void bar_begin(bar *b, flesh_element element, flesh_material material, int moves)
{
  TRY(flesh_mesh_box((int[]){8, 2, 2}, (double[]){2, 0.5, 0.5}, (double[]){0, 0, 0}, &b->mesh));
  if (element != FLESH_ELEMENT_TET4) {
    flesh_mesh *four = b->mesh;
    TRY(flesh_mesh_raise_order(four, &b->mesh));
    flesh_mesh_destroy(&four);
  }
  b->tip = (1 * 3 + 1) * 9 + 8; /* node (8,1,1) */
  bar_make(b, element, material, moves);
}

static inline void bar_gravity(bar *b, double z)
{
  flesh_effect *effect;
  TRY(flesh_effect_gravity(&b->body, (double[]){0, 0, z}, &effect));
  TRY(flesh_system_add_effect(b->system, &effect));
}

/* Adds a spring of 2000 N/m from the free end to a point above it, which acts from t = 0.2 s to 0.4 s. */
static inline void bar_pull(bar *b)
{
  const flesh_keyframe above = {.translation = {2, 0.25, 2}};
  const flesh_motion target = {.count = 1, .keyframes = &above};
  flesh_effect *spring;
  TRY(flesh_effect_spring(&b->body, (double[]){2, 0.25, 0.25}, 2000, &target, 0.2, 0.4, &spring));
  TRY(flesh_system_add_effect(b->system, &spring));
}

/* Pins the end at x = 0 and finalizes the system. */
static inline void bar_finish(bar *b)
{
  int *nodes = malloc((size_t)b->nodes * sizeof(int)), count = 0;
  for (int i = 0; i < b->nodes; i++)
    if (flesh_mesh_positions(b->mesh)[3 * i] == 0) nodes[count++] = i;
  TRY(flesh_system_add_pin(b->system, count, nodes, FLESH_AXES_ALL, -INFINITY, INFINITY));
  TRY(flesh_system_finalize(b->system));
  free(nodes);
}

static inline void bar_destroy(bar *b)
{
  flesh_system_destroy(&b->system);
  flesh_mesh_destroy(&b->mesh);
  free(b->density);
  free(b->state.x);
  free(b->state.v);
}

/* Returns a material with the energy Psi_S, Young's modulus 5e4 Pa and Poisson's ratio 0.45. */
static inline flesh_material bar_soft(void)
{
  flesh_material material;
  TRY(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 5e4, 0.45, &material));
  return material;
}

#endif
