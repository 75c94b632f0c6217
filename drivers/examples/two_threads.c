/* two_threads.c: computes two motions in two threads, each with its own integrator; both share one body.
 *
 * Meshes, materials, effects and finalized systems are const and may serve many threads; an integrator (or a
 * flesh_problem) belongs to one thread at a time. flesh_error_text() is the calling thread's. Both motions are then
 * computed once more, one after the other: the results are bitwise identical.
 *
 * Sample output:
 *   thread 0, backward-euler: tip at z = -1.1687 m, bit for bit as alone
 *   thread 1, ida: tip at z = -1.0952 m, bit for bit as alone
 */
#include <pthread.h>

#include "bar.h"

typedef struct job {
  const bar *body;
  flesh_method method;
  flesh_state state;
  int status;
  char words[256]; /* of a failure */
} job;

static void *run(void *data)
{
  job *self = data;
  flesh_solver_options options;
  flesh_integrator *integrator;
  flesh_solver_options_default(&options);
  self->status = flesh_integrator_create(self->body->system, self->method, &options, &integrator);
  for (int step = 0; step < 30 && !self->status; step++)
    self->status = flesh_integrator_step(integrator, &self->state, 1. / 60, NULL);
  if (self->status) snprintf(self->words, sizeof self->words, "%s", flesh_error_text());
  flesh_integrator_destroy(&integrator);
  return NULL;
}

int main(void)
{
  bar b;
  bar_begin(&b, FLESH_ELEMENT_TET4, bar_soft(), 1);
  bar_gravity(&b, -9.81);
  bar_finish(&b);
  const flesh_method methods[2] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_IDA};
  job apart[2], after[2];
  pthread_t threads[2];

  /* 1. At once. */
  for (int k = 0; k < 2; k++) {
    apart[k] = (job){.body = &b, .method = methods[k], .state = bar_rest(b.mesh)};
    if (pthread_create(&threads[k], NULL, run, &apart[k])) return 1;
  }
  for (int k = 0; k < 2; k++) pthread_join(threads[k], NULL);

  /* 2. One after the other. */
  for (int k = 0; k < 2; k++) {
    after[k] = (job){.body = &b, .method = methods[k], .state = bar_rest(b.mesh)};
    run(&after[k]);
    if (apart[k].status || after[k].status) {
      fprintf(stderr, "%s%s\n", apart[k].words, after[k].words);
      return 1;
    }
  }
  for (int k = 0; k < 2; k++) {
    const size_t bytes = 3 * (size_t)b.nodes * sizeof(double);
    printf("thread %d, %s: tip at z = %.4f m, %s\n", k, flesh_method_name(methods[k]), apart[k].state.x[3 * b.tip + 2],
           memcmp(apart[k].state.x, after[k].state.x, bytes) ? "not as alone" : "bit for bit as alone");
    free(apart[k].state.x), free(apart[k].state.v);
    free(after[k].state.x), free(after[k].state.v);
  }
  bar_destroy(&b);
  return 0;
}
