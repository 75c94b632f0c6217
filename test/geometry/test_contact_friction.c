// TEST quick seconds=60
/* test_contact_friction.c: friction between surfaces: Coulomb's law for any triangles, a potential, forces without
 * moment, and no friction if everything rotates together. */
#include "facing.h"
#include "geometry/contact_friction.h"

static facing f; /* large */
static const double e = 1e-3; /* m/s */

/* Two bodies and the friction between them at f.x. */
static void start(double thickness, double edge_thickness, flesh_contact_set *set, flesh_contact_friction *friction)
{
  const flesh_contact_law law = {3e4, thickness, edge_thickness};
  *friction = (flesh_contact_friction){.coefficient = 0.4, .slip_speed = e};
  facing_finish(&f);
  CHECK_OK(flesh_contact_set_create(&f.surface, f.X, &law, set));
  CHECK_OK(flesh_contact_set_update(set, &f.candidates, f.x, NULL));
  CHECK_OK(flesh_contact_friction_update(friction, set, f.x));
}

static void end(flesh_contact_set *set, flesh_contact_friction *friction)
{
  flesh_contact_friction_clear(friction);
  flesh_contact_set_clear(set);
  facing_clear(&f);
}

/* Crumpled sheets. */
static void crumple(int cells, flesh_contact_set *set, flesh_contact_friction *friction)
{
  facing_add_sheet(&f, cells, 0, 0, 1, 0, 1, 0.3);
  facing_add_sheet(&f, cells - 1, 0.1, -0.05, 1, 0.1, 0, 0.3);
  for (int i = 0; i < f.nodes; i++)
    for (int c = 0; c < 3; c++) f.x[3 * i + c] += 0.03 * uniform();
  start(0.25, 0.15, set, friction);
}

/* Makes a velocity field v = speed (w x x + t) + noise. */
static void move(double rotation, double translation, double noise, double *v)
{
  double w[3], t[3];
  for (int c = 0; c < 3; c++) w[c] = rotation * uniform(), t[c] = translation * uniform();
  for (int i = 0; i < f.nodes; i++) {
    flesh_vec3_cross(w, f.x + 3 * i, v + 3 * i);
    for (int c = 0; c < 3; c++) v[3 * i + c] += t[c] + noise * uniform();
  }
}

/* Flat squares that slide on each other: mu times the whole normal force, against the velocity, for any triangles;
 * below the slip speed the fraction f of it. */
static void flat_faces_rub_by_coulombs_law(void)
{
  static double v[3 * FACING_NODES], r[3 * FACING_NODES], pressed[3 * FACING_NODES];
  for (int trial = 0; trial < 8; trial++) {
    const double w = trial % 2 ? 0.5 : 0.05, speed = trial < 4 ? 3 * e : 0.3 * e;
    flesh_contact_set set;
    flesh_contact_friction friction;
    double force[3] = {0}, normal = 0;
    facing_add_sheet(&f, 3 + trial, 0, 0, 1, 0, 1, 0.3);
    facing_add_sheet(&f, 8 - trial / 2, 0, 0, 1, 0.4 * w, 0, 0.3);
    start(w, w / 4, &set, &friction);
    facing_energy(&f, &set, f.x, pressed);
    memset(r, 0, sizeof r);
    for (int i = 0; i < f.nodes; i++)
      v[3 * i] = f.body[i] ? speed * 0.6 : 0, v[3 * i + 1] = f.body[i] ? speed * 0.8 : 0, v[3 * i + 2] = 7 * speed;
    flesh_contact_friction_evaluate(&friction, &(flesh_contact_motion){f.x, f.x, v, 1, 1}, NULL, NULL, r);
    for (int i = 0; i < f.nodes; i++) {
      normal -= f.body[i] ? pressed[3 * i + 2] : 0;
      for (int c = 0; c < 3; c++) force[c] += f.body[i] ? r[3 * i + c] : 0;
    }
    const double y = speed / e, expected = 0.4 * normal * (y < 1 ? y * (2 - y) : 1);
    CHECK(normal > 1e4);
    CHECK_NEAR(force[0], 0.6 * expected, 1e-10 * expected);
    CHECK_NEAR(force[1], 0.8 * expected, 1e-10 * expected);
    CHECK_NEAR(force[2], 0, 1e-10 * expected);
    end(&set, &friction);
  }
}

/* In signed sums too, the normal forces of friction are mu times the sum of the normal forces on each point. */
static void signed_sums_rub_by_their_sum(void)
{
  flesh_contact_set set;
  flesh_contact_friction friction;
  double rubbing = 0, pressing = 0;
  int negative = 0;
  crumple(10, &set, &friction);
  for (int k = 0; k < friction.count; k++) {
    rubbing += friction.pairs[k].force;
    CHECK(friction.pairs[k].force > 0);
  }
  for (int k = 0, next; k < set.count; k = next) {
    flesh_contact_closest at;
    double sum = 0;
    const int owner = set.pairs[k].owner;
    for (next = k; next < set.count && (next == k || (owner >= 0 && set.pairs[next].owner == owner)); next++) {
      negative += set.pairs[next].weight < 0;
      sum += flesh_contact_pair_force(&set.pairs[next], f.x, &at);
    }
    pressing += fmax(sum, 0);
  }
  printf("# %d negative pairs of %d\n", negative, set.count);
  CHECK(negative > 10);
  CHECK_NEAR(rubbing, 0.4 * pressing, 1e-12 * pressing);
  end(&set, &friction);
}

static void forces_are_the_derivatives_of_the_potential(void)
{
  static double v[3 * FACING_NODES], moved[3 * FACING_NODES], du[3 * FACING_NODES], r[3][3 * FACING_NODES],
      image[3 * FACING_NODES];
  double worst[2] = {0, 0};
  for (int trial = 0; trial < 6; trial++) {
    flesh_contact_set set;
    flesh_contact_friction friction;
    const double shift = 60, h = 1e-7 * e, speed = (trial + 1) * e / 3;
    double phi[3] = {0}, slope = 0, terms = 0, size = 0;
    crumple(6, &set, &friction);
    double *hessians = malloc(144 * sizeof(double) * (size_t)friction.count);
    move(speed, speed, speed, v);
    memset(r, 0, sizeof r);
    memset(image, 0, sizeof image);
    flesh_contact_friction_evaluate(&friction, &(flesh_contact_motion){f.x, f.x, v, 1, shift}, &phi[0], NULL, r[0]);
    flesh_contact_friction_hessians(&friction, v, shift, 0, hessians);
    for (int k = 0; k < 3 * f.nodes; k++) {
      du[k] = uniform();
      slope += r[0][k] * du[k];
      terms += fabs(r[0][k] * du[k]);
    }
    for (int k = 0; k < friction.count; k++)
      for (int i = 0; i < 12; i++)
        for (int j = 0; j < 12; j++)
          image[3 * friction.pairs[k].nodes[i / 3] + i % 3] +=
              hessians[144 * k + 12 * i + j] * du[3 * friction.pairs[k].nodes[j / 3] + j % 3];
    for (int side = 0; side < 2; side++) {
      for (int k = 0; k < 3 * f.nodes; k++) moved[k] = v[k] + (side ? h : -h) * shift * du[k];
      flesh_contact_friction_evaluate(&friction, &(flesh_contact_motion){f.x, f.x, moved, 1, shift}, &phi[1 + side], NULL,
                                      r[1 + side]);
    }
    worst[0] = fmax(worst[0], fabs((phi[2] - phi[1]) / (2 * h) - slope) / terms);
    for (int k = 0; k < 3 * f.nodes; k++) size = fmax(size, fabs(image[k]));
    for (int k = 0; k < 3 * f.nodes; k++)
      worst[1] = fmax(worst[1], fabs((r[2][k] - r[1][k]) / (2 * h) - image[k]) / size);
    free(hessians);
    end(&set, &friction);
  }
  printf("# residual %.2g, Hessian %.2g\n", worst[0], worst[1]);
  CHECK_BELOW(worst[0], 1e-8);
  CHECK_BELOW(worst[1], 1e-6);
}

/* Implements flesh_block_add: y += block x. */
typedef struct product {
  const double *x;
  double *y;
} product;

static int multiply(void *to, int row, int column, const double block[9])
{
  const product *p = to;
  for (int k = 0; k < 9; k++) p->y[3 * row + k / 3] += block[k] * p->x[3 * column + k % 3];
  return FLESH_OK;
}

/* Positions change the contact, the signed sums and the slip, below the slip speed and above. */
static void lagged_places_have_their_derivative(void)
{
  static double v[3 * FACING_NODES], du[3 * FACING_NODES], places[3 * FACING_NODES], r[2][3 * FACING_NODES],
      image[3 * FACING_NODES];
  for (int trial = 0; trial < 4; trial++) {
    flesh_contact_set set;
    flesh_contact_friction friction;
    const double h = 1e-7, speed = e * pow(10, trial - 2);
    double size = 0, off = 0;
    crumple(6, &set, &friction);
    move(speed, speed, speed, v);
    for (int k = 0; k < 3 * f.nodes; k++) du[k] = uniform();
    memset(image, 0, sizeof image);
    memset(r, 0, sizeof r);
    CHECK_OK(flesh_contact_friction_turn(&friction, &set, f.x, v, multiply, &(product){du, image}));
    for (int side = 0; side < 2; side++) {
      for (int k = 0; k < 3 * f.nodes; k++) places[k] = f.x[k] + (side ? h : -h) * du[k];
      CHECK_OK(flesh_contact_set_update(&set, &f.candidates, places, NULL));
      CHECK_OK(flesh_contact_friction_update(&friction, &set, places));
      flesh_contact_friction_evaluate(&friction, &(flesh_contact_motion){places, places, v, 1, 1}, NULL, NULL, r[side]);
    }
    for (int k = 0; k < 3 * f.nodes; k++) {
      size = fmax(size, fabs(image[k]));
      off = fmax(off, fabs((r[1][k] - r[0][k]) / (2 * h) - image[k]));
    }
    printf("# at %g of the slip speed: off by %.2g of %.2g\n", speed / e, off / size, size);
    CHECK_BELOW(off, 1e-6 * size);
    end(&set, &friction);
  }
}

/* If the unknown does not change velocities, the force is constant and its potential linear. */
static void without_velocities_the_force_is_constant(void)
{
  static double v[3 * FACING_NODES], x[3 * FACING_NODES], r[3 * FACING_NODES];
  flesh_contact_set set;
  flesh_contact_friction friction;
  double phi = 0, size = 0, work = 0;
  crumple(6, &set, &friction);
  move(e, e, e, v);
  for (int k = 0; k < 3 * f.nodes; k++) x[k] = f.x[k] + 0.01 * uniform();
  flesh_contact_friction_evaluate(&friction, &(flesh_contact_motion){x, f.x, v, 2, 0}, &phi, &size, r);
  for (int k = 0; k < 3 * f.nodes; k++) work += r[k] * (x[k] - f.x[k]) / 2;
  CHECK_NEAR(phi, work, 1e-10 * size);
  CHECK(size >= fabs(phi) && size > 0);
  flesh_contact_friction_evaluate(&friction, &(flesh_contact_motion){x, f.x, v, 0, 0}, &phi, &size, NULL);
  CHECK_NEAR(phi, work, 1e-10 * size); /* nothing is added */
  end(&set, &friction);
}

/* Returns the larger slip of a pair. */
static double slip_of(const flesh_friction_pair *pair, const double *v)
{
  double u[2] = {0};
  for (int k = 0; k < 24; k++) u[k / 12] += pair->slip[k / 12][k % 12] * v[3 * pair->nodes[k % 12 / 3] + k % 3];
  return fmax(fabs(u[0]), fabs(u[1]));
}

/* Forces sum to 0, and so do their moments; nothing slips if everything rotates together. */
static void forces_balance(void)
{
  static double v[3 * FACING_NODES], r[3 * FACING_NODES];
  flesh_contact_set set;
  flesh_contact_friction friction;
  double sums[6] = {0}, size = 0, slip = 0;
  crumple(6, &set, &friction);
  move(1, 1, 0, v);
  for (int k = 0; k < friction.count; k++) slip = fmax(slip, slip_of(friction.pairs + k, v));
  printf("# %d pairs\n", friction.count);
  CHECK(friction.count > 50);
  move(e, e, e, v);
  memset(r, 0, sizeof r);
  flesh_contact_friction_evaluate(&friction, &(flesh_contact_motion){f.x, f.x, v, 1, 1}, NULL, NULL, r);
  for (int i = 0; i < f.nodes; i++) {
    double moment[3];
    flesh_vec3_cross(f.x + 3 * i, r + 3 * i, moment);
    for (int c = 0; c < 3; c++) {
      sums[c] += r[3 * i + c], sums[3 + c] += moment[c];
      size += fabs(r[3 * i + c]);
    }
  }
  printf("# turning together slips by %.2g of its speed; forces %.2g, moments %.2g m of all\n", slip,
         fmax(fmax(fabs(sums[0]), fabs(sums[1])), fabs(sums[2])) / size,
         fmax(fmax(fabs(sums[3]), fabs(sums[4])), fabs(sums[5])) / size);
  CHECK_BELOW(slip, 1e-13);
  for (int c = 0; c < 6; c++) CHECK_BELOW(fabs(sums[c]), 1e-13 * size);
  end(&set, &friction);
}

/* Solves of a point that the force k (w - u) drags against friction N, from a slip aside, with the matrices that solves
 * use: it sticks, sticks just so, slips just so, and slips. Secants to rest take 14 to more than 1000 iterations, tangents
 * more than 1000 but for the last. */
static void points_that_are_dragged_stick_or_slip_in_few_iterations(void)
{
  static const double drags[] = {0.3, 0.99, 1.01, 3}, k = 1, w[3] = {1, 0.5, 0};
  for (int of = 0; of < 8; of++) {
    const double N = k * hypot(w[0], w[1]) / drags[of / 2], slip_speed = of % 2 ? 1e-6 : 1e-3;
    flesh_slip_expected expected = {0};
    double u[3] = {0.4, -0.2, 0}, r[3] = {0}, stiffness[9];
    int iterations = 0, matrix = 1;
    do {
      const double ratio = N * flesh_slip_ratio(hypot(u[0], u[1]), slip_speed);
      flesh_slip_stiffness(&expected, ++matrix, u, NULL, slip_speed, stiffness);
      for (int c = 0; c < 2; c++) r[c] = k * (w[c] - u[c]) - ratio * u[c];
      const double a = k + N * stiffness[0], b = N * stiffness[1], c = k + N * stiffness[4], det = a * c - b * b;
      CHECK(a > 0 && det > 0);
      u[0] += (c * r[0] - b * r[1]) / det;
      u[1] += (a * r[1] - b * r[0]) / det;
    } while (hypot(r[0], r[1]) > 1e-9 * N && ++iterations < 1000);
    printf("# dragged by %g of friction, slip speed %g: %d iterations\n", drags[of / 2], slip_speed, iterations);
    CHECK(iterations <= 20);
  }
}

/* Matrices of a solve are never indefinite, whatever they expect. The first is the secant to rest, which is never less
 * stiff than the tangent, and stiffer along a slip at full friction. */
static void hessians_are_positive(void)
{
  static double v[3 * FACING_NODES];
  flesh_contact_set set;
  flesh_contact_friction friction;
  double least = 0, least_more = 0, most_more = 0;
  crumple(6, &set, &friction);
  const size_t entries = 144 * (size_t)friction.count;
  double *tangents = malloc(2 * entries * sizeof(double)), *expected = tangents + entries;
  for (int trial = 0, matrix = 1; trial < 15; trial++) {
    const int first = trial % 3 == 0;
    const double speed = trial < 3 ? 0 : e * pow(10, trial / 3 - 3);
    move(speed, speed, speed, v);
    matrix += first ? 2 : 1;
    flesh_contact_friction_hessians(&friction, v, 1, 0, tangents);
    flesh_contact_friction_hessians(&friction, v, 1, matrix, expected);
    for (int k = 0; k < friction.count; k++)
      for (int sample = 0; sample < 20; sample++) {
        double d[12], form = 0, more = 0, size = 0;
        for (int i = 0; i < 12; i++) d[i] = uniform();
        for (int i = 0; i < 144; i++) {
          form += d[i / 12] * expected[144 * k + i] * d[i % 12];
          more += d[i / 12] * (expected[144 * k + i] - tangents[144 * k + i]) * d[i % 12];
          size = fmax(size, fabs(expected[144 * k + i]));
        }
        CHECK(size > 0);
        least = fmin(least, form / size);
        if (first) least_more = fmin(least_more, more / size);
        if (first && speed > e) most_more = fmax(most_more, more / size);
      }
  }
  CHECK_BELOW(-least, 1e-14);
  CHECK_BELOW(-least_more, 1e-14);
  CHECK(most_more > 0.1);
  free(tangents);
  end(&set, &friction);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(flat_faces_rub_by_coulombs_law), TEST(signed_sums_rub_by_their_sum),
                   TEST(forces_are_the_derivatives_of_the_potential), TEST(lagged_places_have_their_derivative),
                   TEST(without_velocities_the_force_is_constant),
                   TEST(forces_balance),
                   TEST(points_that_are_dragged_stick_or_slip_in_few_iterations), TEST(hessians_are_positive));
}
