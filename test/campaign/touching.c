/* touching.c: runs a scene of touching bodies and checks after every step for intersecting surfaces, by exact
 * predicates over all edges and faces, and for spurious energy.
 *   touching SCENE SEED STEPS [KEY=VALUE ...]
 * The seed (0: none) gives all free nodes a random velocity of up to 0.5 m/s. Prints one line: scene, steps done,
 * touching pairs (total over all steps, and the most in one step), crossings, steps in which the energy rose above the
 * work put in by more than ever before, largest gain, Newton iterations, outcome. Exit code 1 if anything crossed or
 * failed, if the energy rose under backward Euler, or if it gained more than 1.1 % under another method. */
#include "touching.h"

#include "effect/surface_contact.h"

/* Least energy gain that counts as a rise, in addition to the solves' tolerance and rounding, which are subtracted. */
static const double RISES = 1e-6;

static void shake(touching *m, unsigned long long seed)
{
  uint8_t *fixed = calloc((size_t)m->n, 1);
  flesh_system_fixed(flesh_scene_system(m->scene), m->state.t, fixed);
  for (int d = 0; d < m->n && seed; d++)
    if (!fixed[d]) m->state.v[d] += test_uniform(&seed) - 0.5;
  free(fixed);
}

/* Finds the contact cache of the first effect of contact between bodies. */
static int watch(const touching *m, flesh_surface_near **near)
{
  *near = NULL;
  for (int k = 0; k < m->effects; k++) {
    const flesh_effect *effect = flesh_system_effect(flesh_scene_system(m->scene), k);
    if (effect->operations == &flesh_surface_contact_operations)
      return flesh_surface_near_create(effect->data, NULL, near);
  }
  return FLESH_OK;
}

typedef struct counts {
  long pairs, most;
  int rises;
  double gain;
} counts;

static int step(touching *m, flesh_surface_near *near, counts *c)
{
  int status = touching_step(m);
  if (!status && near) status = flesh_surface_near_update_pairs(near, m->state.x);
  if (status) return status;
  const long pairs = near ? near->set.count : 0;
  const double gain = flesh_integrator_energy_balance(m->integrator)->gain;
  c->pairs += pairs;
  c->most = pairs > c->most ? pairs : c->most;
  c->rises += gain > fmax(c->gain, RISES);
  c->gain = gain;
  return FLESH_OK;
}

int main(int argc, char **argv)
{
  if (argc < 4) return fprintf(stderr, "touching: SCENE SEED STEPS [KEY=VALUE ...]\n"), 2;
  touching m = {0};
  counts c = {0};
  flesh_surface_near *near = NULL;
  int status = flesh_scene_read(argv[1], argc - 4, (const char *const *)argv + 4, &m.scene);
  if (!status) status = touching_start(1000, &m);
  if (!status) status = watch(&m, &near);
  if (status) return fprintf(stderr, "touching: %s\n", flesh_error_text()), 2;
  const flesh_scene_time *time = flesh_scene_times(m.scene);
  const int steps = atoi(argv[3]);
  shake(&m, strtoull(argv[2], NULL, 10));
  while (!status && m.steps < steps && m.state.t < time->end - m.h / 2) status = step(&m, near, &c);
  printf("%s seed %s: %d steps, %ld pairs, %ld at most, %d crossings, %d rises, gain %.2g, %.2f Newton; %s", argv[1],
         argv[2], m.steps, c.pairs, c.most, m.crossings, c.rises, c.gain, (double)m.newton / (m.steps ? m.steps : 1),
         status ? flesh_error_text() : "ok");
  for (int k = 4; k < argc; k++) printf(" %s", argv[k]);
  puts("");
  const int gained = time->method == FLESH_METHOD_BACKWARD_EULER ? c.rises > 0 : c.gain > 1.1e-2;
  const int bad = status || m.crossings || gained;
  flesh_surface_near_destroy(near);
  touching_end(&m);
  return bad;
}
