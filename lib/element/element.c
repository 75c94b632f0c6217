/* element.c: rest shapes of tets, and volume terms of materials. */
#include "element/element.h"

#include <math.h>

#include "base/error.h"
#include "material/form.h"
#include "material/psi.h"
#include "math/mat3.h"
#include "mesh/mesh.h"
#include "mesh/tet10.h"

const char *flesh_element_name(flesh_element element)
{
  static const char *const names[FLESH_ELEMENT_COUNT] = {"auto", "tet4", "tet10", "tet10-mean"};
  return (unsigned)element < FLESH_ELEMENT_COUNT ? names[element] : "unknown";
}

int flesh_body_check_element(const flesh_body *body)
{
  const int order = flesh_mesh_order(body->mesh);
  if ((unsigned)body->element >= FLESH_ELEMENT_COUNT)
    return flesh_fail(FLESH_ERR_ARGUMENT, "there is no element number %d", (int)body->element);
  if (body->element == FLESH_ELEMENT_AUTO || body->mesh->linear) return FLESH_OK;
  if ((body->element == FLESH_ELEMENT_TET4) == (order == 1)) return FLESH_OK;
  return flesh_fail(FLESH_ERR_ARGUMENT, "the element is %s, but the mesh has order %d; it must have order %d",
                    flesh_element_name(body->element), order, 3 - order);
}

flesh_element flesh_body_element_of(const flesh_body *body, int material, int size)
{
  flesh_element own = FLESH_ELEMENT_AUTO;
  if (body->material_elements && material >= 0) own = body->material_elements[material];
  if (own == FLESH_ELEMENT_AUTO) own = body->element;
  if (size == 4) return FLESH_ELEMENT_TET4;
  return own == FLESH_ELEMENT_TET10 ? own : FLESH_ELEMENT_TET10_MEAN;
}

/* Index of the edge between two corners, in VTK's order of edges, 01 12 02 03 13 23. */
static const int edge_of[4][4] = {{-1, 0, 2, 3}, {0, -1, 1, 4}, {2, 1, -1, 5}, {3, 4, 5, -1}};

void flesh_tet10_nodes(const flesh_mesh *mesh, int tet, int nodes[10])
{
  const int *corner = flesh_mesh_tets(mesh) + 4 * (size_t)tet, *edge = flesh_mesh_tet_edges(mesh) + 6 * (size_t)tet;
  int order[4] = {0, 1, 2, 3};
  for (int i = 1; i < 4; i++)
    for (int j = i; j > 0 && corner[order[j]] < corner[order[j - 1]]; j--) {
      int swap = order[j];
      order[j] = order[j - 1];
      order[j - 1] = swap;
    }
  for (int a = 0, next = 4; a < 4; a++) {
    nodes[a] = corner[order[a]];
    for (int b = a + 1; b < 4; b++) nodes[next++] = edge[edge_of[order[a]][order[b]]];
  }
}

void flesh_tet10_masses(const flesh_mesh *mesh, int tet, double density, double masses[55])
{
  const int *corner = flesh_mesh_tets(mesh) + 4 * (size_t)tet, *edge = flesh_mesh_tet_edges(mesh) + 6 * (size_t)tet;
  double M[10][10];
  int nodes[10], place[10] = {0}; /* place: index of each node in the mesh's order */
  flesh_tet10_mass(mesh, tet, M);
  flesh_tet10_nodes(mesh, tet, nodes);
  for (int a = 0; a < 10; a++)
    for (int b = 0; b < 10; b++)
      if ((b < 4 ? corner[b] : edge[b - 4]) == nodes[a]) place[a] = b;
  for (int a = 0; a < 10; a++)
    for (int b = a; b < 10; b++) *masses++ = density * M[place[a]][place[b]];
}

int flesh_element_shapes(const flesh_mesh *mesh)
{
  if (flesh_mesh_order(mesh) == 1) return 1;
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++)
    if (flesh_mesh_tet_curved(mesh)[e]) return FLESH_TET10_POINTS;
  return 1;
}

/* Computes the gradients, the rows of the inverse of D, whose columns are the edges; returns the volume, for either
 * winding of the corners. */
static double shape_of(const double D[9], double gradient[9]) { return flesh_mat3_inverse(D, gradient) / 6; }

double flesh_tet4_shape(const double *X, const int node[4], double gradient[9])
{
  double D[9];
  for (int i = 0; i < 3; i++)
    for (int a = 0; a < 3; a++)
      D[3 * i + a] = X[3 * (size_t)node[a + 1] + i] - X[3 * (size_t)node[0] + i];
  return shape_of(D, gradient);
}

double flesh_tet10_shape(const double *X, const int node[10], int q, double gradient[9])
{
  static const int node_of[4][4] = {{0, 4, 5, 6}, {4, 1, 7, 8}, {5, 7, 2, 9}, {6, 8, 9, 3}};
  double Y[4][3], D[9];
  for (int a = 0; a < 4; a++)
    for (int i = 0; i < 3; i++) {
      Y[a][i] = -(X[3 * (size_t)node[a] + i] - X[3 * (size_t)node[0] + i]);
      for (int k = 0; k < 4; k++)
        Y[a][i] += 4 * (k == q ? FLESH_TET10_NEAR : FLESH_TET10_FAR) *
                   (X[3 * (size_t)node[node_of[a][k]] + i] - X[3 * (size_t)node[0] + i]);
    }
  for (int i = 0; i < 3; i++)
    for (int a = 0; a < 3; a++) D[3 * i + a] = Y[a + 1][i] - Y[0][i];
  return shape_of(D, gradient);
}

/* Largest moderate part of the mean's modulus, in shear moduli: together with the points' own share it gives the lambda
 * of Poisson's ratio 0.45. */
static const double MODERATE = 7;

/* Modulus that points bear by themselves where their J is far from 1, in shear moduli. A larger value keeps J closer to
 * 1 but makes coarse meshes stiffer (history.md has figures). */
static const double LOCAL = 5;

/* Computes the volume part U of a user's psi at J. */
static int volume_part_at(const flesh_material *material, double J, flesh_volume_part *U)
{
  *U = (flesh_volume_part){.value = 0.5 * (J - 1) * (J - 1), .J = J - 1, .JJ = 1};
  return material->volume ? material->volume(J, material, U) : FLESH_OK;
}

/* Checks that a user's U has unit modulus, and that psi contains lambda U: psi without `share` U, which goes to the
 * mean, must be stable when the volume halves or doubles. */
static int check_users_volume_part(const flesh_material *material, double share)
{
  flesh_volume_part U;
  int status = volume_part_at(material, 1, &U);
  if (status) return flesh_fail(FLESH_ERR_ARGUMENT, "the volume part U of a user's psi has no value at J = 1");
  if (!(fabs(U.J) <= 1e-6 && fabs(U.JJ - 1) <= 1e-6))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "the volume part U of a user's psi has U' = %g and U'' = %g at J = 1; they must be 0 and 1, "
                      "lambda being its modulus",
                      U.J, U.JJ);
  for (double J = 0.5; J <= 2; J *= 4) {
    flesh_psi psi;
    if (material->psi(3 * cbrt(J * J), J, material, &psi) || volume_part_at(material, J, &U)) continue;
    if (psi.JJ - share * U.JJ >= -1e-9 * material->lambda) continue;
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "a user's psi has the second derivative %g Pa by J at J = %g, %g Pa without the term "
                      "that tet10-mean averages: it does not contain lambda %s; set material.volume to its volume part over "
                      "lambda (material.lambda is %g Pa), or take the element tet10",
                      psi.JJ, J, psi.JJ - share * U.JJ, material->volume ? "U(J)" : "(J-1)^2/2", material->lambda);
  }
  return FLESH_OK;
}

/* Returns the part of lambda that goes to the mean of J: all but 2 mu from 3 mu on, nothing up to mu. Between them it
 * is the polynomial that joins both with two continuous derivatives by lambda, so that results are smooth in Poisson's
 * ratio; the part that stays with the points grows with lambda throughout. */
static double share_of_mean(double lambda, double mu)
{
  const double x = lambda / mu - 2;
  if (!(x < 1)) return lambda - 2 * mu;
  return x > -1 ? mu * (x + 1) * (x + 1) * (x + 1) * (3 - x) / 16 : 0;
}

int flesh_volume_share_of(const flesh_material *material, flesh_volume_share *share)
{
  const int user = material->energy == FLESH_ENERGY_USER;
  flesh_psi at;
  double shear;
  const flesh_volume_term own = material->volume ? FLESH_VOLUME_USER : FLESH_VOLUME_QUADRATIC;
  *share = (flesh_volume_share){.term = user ? own : flesh_forms[material->energy].volume_term,
                                .held = material->incompressible};
  if (user && !(fabs(material->lambda) < INFINITY))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "tet10-mean needs the lambda of a user's psi, which contains lambda/2 (J-1)^2 or lambda "
                      "times material.volume; set material.lambda, or take the element tet10");
  if (share->term == FLESH_VOLUME_NONE) return FLESH_OK;
  const int of_stretches = flesh_form_of_stretches(material->energy);
  int status = of_stretches ? flesh_material_small_strain(material, &shear, NULL, NULL)
                            : flesh_psi_at(material, (const double[9]){1, 0, 0, 0, 1, 0, 0, 0, 1}, &at);
  if (status) return status;
  if (!of_stretches) shear = 2 * at.I;
  /* For an incompressible material the points keep 2 mu, the limit for large lambda, whatever the penalty. */
  share->share = share->held ? fmax(0, material->lambda - 2 * shear) : share_of_mean(material->lambda, shear);
  /* LOCAL shear moduli for a large share, 4/5 of the share for a small one, and smooth in between. */
  share->local = LOCAL * shear;
  if (!share->held) share->local *= 0.8 * share->share / hypot(0.8 * share->share, share->local);
  share->moderate = fmin(share->share, MODERATE * shear);
  if (share->held && !(share->share > 0))
    return flesh_fail(FLESH_ERR_ARGUMENT,
                      "lambda is %g Pa, the penalty of an incompressible material; it must be more than twice the shear "
                      "modulus, %g Pa",
                      material->lambda, 2 * shear);
  return user ? check_users_volume_part(material, share->share) : FLESH_OK;
}

int flesh_volume_share_at(const flesh_volume_share *share, const flesh_material *material, double J, double local,
                          flesh_volume_part *part)
{
  const double x = J - 1, t = x * x / (FLESH_LOCAL_RANGE * FLESH_LOCAL_RANGE), q = 1 / (1 + t);
  int status = FLESH_OK;
  if (share->term == FLESH_VOLUME_USER) status = material->volume(J, material, part);
  else if (share->term == FLESH_VOLUME_QUADRATIC) *part = (flesh_volume_part){0.5 * x * x, x, 1};
  else *part = (flesh_volume_part){0.5 * log(J) * log(J), log(J) / J, (1 - log(J)) / (J * J)};
  part->value = share->share * part->value - local * 0.5 * x * x * t * q;
  part->J = share->share * part->J - local * x * (1 - q * q);
  part->JJ = share->share * part->JJ - local * (1 - (1 - 3 * t) * q * q * q);
  return status;
}
