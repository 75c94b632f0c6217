/* shared_body.h: a body as a whole, and in parts for the ranks. */
#ifndef FLESH_TEST_SHARED_BODY_H
#define FLESH_TEST_SHARED_BODY_H

#include "body.h"
#include "ranks.h"

/* The whole body, which every rank has, and this rank's part of it. */
typedef struct bodies {
  flesh_mesh *mesh;
  flesh_rank_part *part;
  test_body whole, own;
} bodies;

/* Makes the body; takes the mesh. Gravity is along -z; if it is held, x = 0 is clamped. */
static inline void open_body(bodies *b, flesh_mesh *mesh, flesh_material material, flesh_mass mass, double gravity, int holds)
{
  *b = (bodies){.mesh = mesh, .part = ranks_cut(mesh)};
  for (int k = 0; k < 2; k++) {
    test_body *body = k ? &b->own : &b->whole;
    CHECK_OK(test_body_create(k ? (flesh_mesh *)flesh_rank_part_mesh(b->part) : mesh, material, 1000, mass, 1, body));
    if (k) CHECK_OK(flesh_system_set_part(body->system, b->part));
    if (gravity != 0) CHECK_OK(test_body_gravity(body, 0, 0, -gravity));
    if (holds) CHECK_OK(test_body_clamp(body, 1e-9));
    CHECK_OK(flesh_system_finalize(body->system));
  }
}

static inline void close_body(bodies *b)
{
  b->own.mesh = NULL; /* the part's */
  test_body_destroy(&b->own);
  test_body_destroy(&b->whole);
  flesh_rank_part_destroy(&b->part);
}

#endif
