/* touching.c: runs a scene in which bodies touch and looks after every step for surfaces that go through each other, by
 * exact predicates over all edges and faces, and for energy that nothing put in.
 *   touching SCENE SEED STEPS [KEY=VALUE ...]
 * The seed (0: none) gives all free nodes a random velocity of up to 0.5 m/s. One line: scene, steps done, crossings,
 * worst gain of energy, Newton iterations, how it ended. Exit code 1 where anything crossed, rose or failed. */
#include "touching.h"

/* The gain that counts as rising: the solves' tolerance and rounding are taken off it already. */
static const double RISES = 1e-6;

static void shake(touching *m, unsigned long long seed)
{
  uint8_t *fixed = calloc((size_t)m->n, 1);
  flesh_system_fixed(flesh_scene_system(m->scene), m->state.t, fixed);
  for (int d = 0; d < m->n && seed; d++)
    if (!fixed[d]) m->state.v[d] += test_uniform(&seed) - 0.5;
  free(fixed);
}

int main(int argc, char **argv)
{
  if (argc < 4) return fprintf(stderr, "touching: SCENE SEED STEPS [KEY=VALUE ...]\n"), 2;
  touching m = {0};
  int status = flesh_scene_read(argv[1], argc - 4, (const char *const *)argv + 4, &m.scene);
  if (!status) status = touching_start(1000, &m);
  if (status) return fprintf(stderr, "touching: %s\n", flesh_error_text()), 2;
  const flesh_scene_time *time = flesh_scene_times(m.scene);
  const int is_motion = time->method != FLESH_METHOD_STATIC, steps = atoi(argv[3]);
  shake(&m, strtoull(argv[2], NULL, 10));
  while (!status && m.steps < steps && m.state.t < time->end - m.h / 2) status = touching_step(&m);
  const double gain = is_motion ? flesh_integrator_energy_balance(m.integrator)->gain : 0;
  printf("%s seed %s: %d steps, %d crossings, gain %.2g, %.2f Newton; %s", argv[1], argv[2], m.steps, m.crossings, gain,
         (double)m.newton / (m.steps ? m.steps : 1), status ? flesh_error_text() : "ok");
  for (int k = 4; k < argc; k++) printf(" %s", argv[k]);
  puts("");
  const int euler = time->method == FLESH_METHOD_BACKWARD_EULER;
  const int bad = status || m.crossings || (euler && gain > RISES);
  touching_end(&m);
  return bad;
}
