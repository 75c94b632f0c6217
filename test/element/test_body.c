// TEST quick
/* test_body.c: effects refuse bodies that lack what they need, and motions and amplitudes without their arrays. */
#include "body.h"
#include "test.h"

#define REFUSED(call, part)              \
  do {                                   \
    CHECK((call) == FLESH_ERR_ARGUMENT); \
    CHECK_TEXT(flesh_error_text(), part); \
    CHECK(!effect);                      \
  } while (0)

static void bodies_are_refused(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  flesh_contact_options contact;
  flesh_contact_options_default(&contact);
  CHECK_OK(test_body_create(test_box(2, 2, 2, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  const int tets = flesh_mesh_tet_count(b.mesh);
  const flesh_material unmade = {0};
  flesh_material vague = b.material, endless = b.material;
  vague.mu = NAN, endless.lambda = INFINITY;
  int *materials = calloc((size_t)tets, sizeof *materials);
  materials[7] = -1;
  const flesh_body_part beyond = {"beyond", 1, tets}, both[2] = {{"one", 0, 5}, {"other", 4, tets - 4}};
#define TRY(member, value, part)                                                                 \
  do {                                                                                           \
    flesh_body body = b.body;                                                                    \
    flesh_obstacle *floor;                                                                       \
    body.member = value;                                                                         \
    CHECK_OK(flesh_obstacle_plane((double[]){0, 0, -1}, (double[]){0, 0, 1}, &floor));           \
    REFUSED(flesh_effect_inertia(&body, &effect), part);                                         \
    REFUSED(flesh_effect_elasticity(&body, &effect), part);                                      \
    REFUSED(flesh_effect_surface_contact(&body, &contact, 0, NULL, &effect), part);              \
    REFUSED(flesh_effect_obstacle_contact(&body, &contact, &floor, &effect), part);              \
    CHECK(!floor);                                                                               \
  } while (0)
  TRY(mesh, NULL, "the body has no mesh");
  TRY(mass, (flesh_mass)9, "there is no mass number 9");
  TRY(element, FLESH_ELEMENT_TET10, "the element is tet10, but the mesh has order 1");
  TRY(tet_material, materials, "tet 7 has material -1");
  TRY(materials, &unmade, "material 0 has no psi");
  TRY(materials, &vague, "material 0 has mu nan and lambda");
  TRY(materials, &endless, "lambda inf Pa; mu must be positive, and both finite");
  TRY(part_count, -1, "part_count is -1");
  TRY(part_count, 1, "part_count is 1; parts must be an array of as many");
  TRY(part_count = 1; body.parts, &beyond, "part 0 has 48 tets from tet 1 on; the mesh has the tets 0 to 47");
  TRY(part_count = 2; body.parts, both, "the parts 0 and 1 have tets in common");
  flesh_body light = b.body;
  light.density = NULL;
  REFUSED(flesh_effect_inertia(&light, &effect), "the body has no density");
  REFUSED(flesh_effect_gravity(&light, (double[]){0, 0, -1}, &effect), "the body has no density");
  REFUSED(flesh_effect_damping(&b.body, 0, 1, (flesh_stiffness)7, &effect), "there is no stiffness number 7");
  free(materials);
  test_body_destroy(&b);
}

static void points_without_an_array_are_refused(void)
{
  test_body b;
  flesh_effect *effect = NULL;
  const int node = 0;
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, &b));
  REFUSED(flesh_effect_spring(&b.body, (double[]){0, 0, 0}, 1, &(flesh_motion){.count = 1}, 0, 1, &effect), "keyframe");
  for (int count = -1; count < 2; count += 2)
    REFUSED(flesh_effect_force(&b.body, 1, &node, (double[]){1, 0, 0},
                               &(flesh_amplitude){.count = count, .from = -INFINITY, .until = INFINITY}, &effect),
            "must have an array of as many");
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(bodies_are_refused), TEST(points_without_an_array_are_refused));
}
