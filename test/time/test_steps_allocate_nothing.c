// TEST quick seconds=60
/* test_steps_allocate_nothing.c: no step allocates memory: with any method, also if few nodes are solved for alone or a
 * body is untangled. */
#include <stdlib.h>

#include "body.h"
#include "flesh/sundials_abi.h"
#include "test.h"

/* Counts calls of malloc, including those by SUNDIALS; a sanitizer's own malloc is left alone. */
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#endif

#if defined(__GLIBC__) && !defined(SANITIZED)
static _Thread_local long requests, of_libraries; /* all calls; those by shared libraries */
extern const char __executable_start, etext;
static void count_request(const void *caller)
{
  requests++;
  of_libraries += (const char *)caller < &__executable_start || (const char *)caller >= &etext;
}
extern void *__libc_malloc(size_t), *__libc_calloc(size_t, size_t), *__libc_realloc(void *, size_t),
    *__libc_memalign(size_t, size_t);
void *malloc(size_t size)
{
  count_request(__builtin_return_address(0));
  return __libc_malloc(size);
}
void *calloc(size_t count, size_t size)
{
  count_request(__builtin_return_address(0));
  return __libc_calloc(count, size);
}
void *realloc(void *memory, size_t size)
{
  count_request(__builtin_return_address(0));
  return __libc_realloc(memory, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
  count_request(__builtin_return_address(0));
  return __libc_memalign(alignment, size);
}

/* `ten`: of nearly incompressible ten-node tets. */
static void check_allocations(flesh_method method, int ten)
{
  test_body b;
  flesh_solver_options options = test_options(1e-6);
  flesh_integrator *integrator = NULL;
  flesh_mesh *mesh = test_box(6, 3, 3, 2, 1, 1), *corners = mesh;
  if (ten) CHECK_OK(flesh_mesh_raise_order(corners, &mesh));
  if (ten) flesh_mesh_destroy(&corners);
  CHECK_OK(test_body_create(mesh, test_material(FLESH_ENERGY_S, ten ? 0.499 : 0.45), 1000, FLESH_MASS_CONSISTENT, 1,
                            &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  long before = requests;
  CHECK_OK(flesh_integrator_create(b.system, method, &options, &integrator));
  CHECK(requests > before); /* the count counts */
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL));
  before = requests;
  for (int k = 0; k < 5; k++) {
    test_jitter(b.n, 0.05, (unsigned)k, b.state.x); /* projections and line searches too */
    CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, NULL));
  }
  CHECK(requests == before);
  printf("# %s: %ld requests for memory in five steps\n", flesh_method_name(method), requests - before);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}

static void steps_allocate_nothing(void)
{
  for (flesh_method method = 0; flesh_method_name(method); method++)
    if (method != FLESH_METHOD_STATIC) check_allocations(method, 0);
  check_allocations(FLESH_METHOD_BACKWARD_EULER, 1);
}

/* Nor do steps that solve for few nodes alone: everything they need is made, or has memory, before. In addition to
 * effects that are restricted to the elements there, others have a quadratic model. */
static void subdomains_allocate_nothing(void)
{
  for (int kind = 0; kind < 3; kind++) {
    test_body b;
    flesh_solver_options options = test_options(1e-6);
    flesh_integrator *integrator = NULL;
    flesh_effect *effect = NULL;
    flesh_solve_stats stats = {0};
    CHECK_OK(test_body_create(test_box(24, 12, 12, 0.2, 0.1, 0.1), test_material(FLESH_ENERGY_S, 0.45), 1000,
                              kind ? FLESH_MASS_CONSISTENT : FLESH_MASS_LUMPED, 1, &b));
    CHECK_OK(test_body_gravity(&b, 0, 0, -9.81));
    CHECK_OK(test_body_clamp(&b, 1e-9));
    if (kind == 2) {
      CHECK_OK(flesh_effect_damping(&b.body, 1, 0.01, FLESH_STIFFNESS_CURRENT, &effect));
      CHECK_OK(flesh_system_add_effect(b.system, &effect));
      CHECK_OK(flesh_effect_viscosity(&b.body, 10, 5, &effect));
      CHECK_OK(flesh_system_add_effect(b.system, &effect));
    }
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    const long before = requests, libraries_before = of_libraries;
    double *thrown = __libc_malloc((size_t)b.n * sizeof *thrown);
    for (int k = 0; k < 3; k++) { /* the third uses the memory of the first two */
      const double *X = flesh_mesh_positions(b.mesh);
      memcpy(thrown, b.state.x, (size_t)b.n * sizeof *thrown);
      test_jitter(b.n, 0.017, (unsigned)k + 7, thrown);
      for (int d = 0; d < b.n; d++) {
        const double *P = X + 3 * (d / 3);
        if (hypot(hypot(P[0] - 0.07 - 0.03 * k, P[1] - 0.05), P[2] - 0.05) < 0.016) b.state.x[d] = thrown[d];
      }
      CHECK_OK(flesh_integrator_step(integrator, &b.state, 1. / 60, &stats));
    }
    printf("# %d effects: %ld requests for memory, %d subdomains, %d solves by factorisation\n",
           flesh_system_effect_count(b.system), requests - before, stats.subdomains, stats.direct);
    CHECK(stats.subdomains >= 3 && requests - before == of_libraries - libraries_before);
    /* From SUNDIALS 7 on KINSOL writes a message when a solve for few nodes fails, as some may. */
    CHECK(of_libraries - libraries_before <= (FLESH_SUNDIALS_VERSION_MAJOR >= 7 ? stats.subdomains : 0));
    free(thrown);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* Nor does untangling, from the first suspicion on. */
static void untangling_allocates_nothing(void)
{
  test_body b;
  flesh_solver_options options = test_options(1e-6);
  flesh_integrator *integrator = NULL;
  flesh_solve_stats stats = {0};
  CHECK_OK(test_body_create(test_box(12, 4, 4, 1, 1. / 3, 1. / 3), test_material(FLESH_ENERGY_S, 0.49), 1000,
                            FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  for (int d = 0; d < b.n; d += 3) b.state.x[d] *= -1; /* mirrored */
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  const long before = requests;
  for (int k = 0; k < 400 && !stats.untanglings; k++)
    CHECK_OK(flesh_integrator_step(integrator, &b.state, k < 100 ? 1. / 60 : 0.5, &stats));
  printf("# %ld requests for memory, %d untanglings, %d subdomains, %d solves by factorisation\n", requests - before,
         stats.untanglings, stats.subdomains, stats.direct);
  CHECK(stats.untanglings > 0 && requests == before);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
}
#else
static void subdomains_allocate_nothing(void) { printf("# not tested: this build has a malloc of its own\n"); }
static void untangling_allocates_nothing(void) { printf("# not tested: this build has a malloc of its own\n"); }
static void steps_allocate_nothing(void) { printf("# not tested: this build has a malloc of its own\n"); }
#endif

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(steps_allocate_nothing), TEST(subdomains_allocate_nothing),
                   TEST(untangling_allocates_nothing));
}
