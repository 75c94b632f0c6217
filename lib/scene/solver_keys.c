/* solver_keys.c: the keys of a scene's solver. */
#include "scene/scene_keys.h"

#include <assert.h>
#include <stddef.h>

#include "linear/preconditioner.h"
#include "newton/mechanisms.h"

/* Doc of a mechanism: "name: doc; ". */
#define DOC(id, name, doc) name ": " doc "; "

/* Choices are read as int into fields of enum type. */
static_assert(sizeof(flesh_linear_solver) == sizeof(int), "enums must have the size of int");

/* Names in the order of the enums. */
static const char *const linear_solvers[] = {"pcg", "klu", "cholmod", NULL};
static_assert(sizeof linear_solvers / sizeof *linear_solvers == FLESH_LINEAR_CHOLMOD + 2, "a name of every solver");
/* Names in the order of flesh_eigenvalue_filter. */
static const char *const eigenvalue_filters[] = {"none", "clamp", "absolute", "trust-region", "auto",
                                                 "clamp-always", "absolute-always", "trust-region-always", NULL};
static_assert(sizeof eigenvalue_filters / sizeof *eigenvalue_filters == FLESH_FILTER_TRUST_REGION_ALWAYS + 2,
              "a name of every filter");
static const char *const line_searches[] = {"potential", "none", "residual", NULL};
static_assert(sizeof line_searches / sizeof *line_searches == FLESH_LINE_SEARCH_RESIDUAL + 2, "a name of every search");

/* The defaults are those of flesh_solver_options_default; a test compares them. */
const flesh_key flesh_solver_table[] = {
    {.name = "newton_tolerance",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_solver_options, newton_tolerance),
     .range = FLESH_RANGE_FRACTION,
     .default_value = "1e-4",
     .doc = "a solve has converged when the residual's 2-norm over the free dofs is at most this times the larger of "
            "the applied load and the first iterate's residual, which counts at most as much as the largest force at the "
            "current iterate: of loads, contact, inertia, elements and reactions; for incompressible tets (poisson 0.5) the "
            "mean of J is within 0.01 times this of 1. If errors choose the steps, the residual follows from "
            "time.tolerance instead"},
    {.name = "linear_tolerance",
     .type = FLESH_KEY_NUMBER,
     .offset = offsetof(flesh_solver_options, linear_tolerance),
     .range = FLESH_RANGE_FRACTION,
     .default_value = "1e-2",
     .doc = "largest ratio of the residual after an iterative linear solve to that before it; forcing_terms of "
            "techniques makes it smaller as Newton's iteration converges"},
    {.name = "max_newton",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, max_newton),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "1200",
     .doc = "most Newton iterations of a solve, which ends sooner when 300 (100 in a motion of bodies that touch) "
            "lower the potential by less than a tenth of its decrease so far"},
    {.name = "max_linear",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, max_linear),
     .range = FLESH_RANGE_POSITIVE,
     .default_value = "2000",
     .doc = "iterations per linear solve; if they do not converge, a direct factorisation solves, unless that costs "
            "more"},
    {.name = "max_cutbacks",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, max_cutbacks),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "8",
     .doc = "how often a failed step or load increment may be halved"},
    {.name = "lag_iterations",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, lag_iterations),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "0",
     .doc = "most solves of a step, each with friction's normal forces and follower loads as the solve before has "
            "left them; 0: one for backward-euler, two for methods of order 2 and up to four if friction is off by a "
            "hundredth; 1: friction uses the normal forces of the previous step"},
    {.name = "linear_solver",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, linear_solver),
     .choices = linear_solvers,
     .default_value = "pcg",
     .doc = "pcg: preconditioned conjugate gradients; klu: sparse LU; cholmod: sparse Cholesky, "
            "where built in"},
    {.name = "preconditioner",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, preconditioner),
     .choices = flesh_preconditioner_names,
     .default_value = "auto",
     .doc = "preconditioner of pcg: ic: incomplete Cholesky on 3x3 blocks; two-level: ic and a coarse level, "
            "displacements that are trilinear between the vertices of a grid over the body; jacobi: inverse diagonal "
            "blocks; none; volume-projection: projects the stiff volume terms of tet10-mean out and preconditions "
            "the rest as auto does; auto: two-level, or ic on meshes of a few hundred nodes, with volume-projection "
            "from a Poisson's ratio of 0.493 on, in statics from 0.489 on"},
    {.name = "eigenvalue_filter",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, eigenvalue_filter),
     .choices = eigenvalue_filters,
     .default_value = "auto",
     .doc = "treatment of negative eigenvalues of the elements' Hessians if the true Hessian is indefinite: clamp: "
            "zero; absolute: their absolute values; trust-region: zero after a filtered step whose decrease was "
            "predicted to 1 %, else absolute; auto: the same in dynamics, absolute in statics; none: they stay; with "
            "-always: in every iteration"},
    {.name = "line_search",
     .type = FLESH_KEY_CHOICE,
     .offset = offsetof(flesh_solver_options, line_search),
     .choices = line_searches,
     .default_value = "potential",
     .doc = "potential: full steps, reduced by a search on the incremental potential; none: plain full "
            "Newton steps; "
            "residual: KINSOL's line search on the residual"},
    {.name = "techniques",
     .type = FLESH_KEY_SET,
     .offset = offsetof(flesh_solver_options, techniques),
     .choices = flesh_mechanism_names,
     .may_be_all = 1,
     .default_value = "[all]",
     .doc = "which mechanisms of a solve are on. " FLESH_MECHANISM_ROWS(DOC) "[]: none; [-watchdog]: all but the "
            "watchdog"},
    {.name = "accept_unconverged",
     .type = FLESH_KEY_BOOLEAN,
     .offset = offsetof(flesh_solver_options, accept_unconverged),
     .default_value = "false",
     .doc = "true: a solve that ends at max_newton without convergence is accepted, as in programs that take a "
            "fixed number of iterations; false: the step is retried in halves and then fails"},
    {.name = "threads",
     .type = FLESH_KEY_INTEGER,
     .offset = offsetof(flesh_solver_options, threads),
     .range = FLESH_RANGE_NOT_NEGATIVE,
     .default_value = "1",
     .doc = "threads of a solve, at most 256; 0: one for each processor the process may use; results "
            "do not depend on it"},
    {.name = NULL},
};
