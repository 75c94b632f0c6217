/* coupled_reflex.c: couples flesh to another equation: a muscle with a stretch reflex, in one IDA residual.
 *
 * A bar hangs along x from its end at x = 0. Fibres along it carry a prestress that is scaled by an activation A: the
 * energy A s/2 (|F e_x|^2 - 1) per volume. The prestress and a resistance to motion are an effect of the program's own.
 * The activation follows the stretch of the bar with a delay:
 *
 *   x' = v,   r(t, x, v, v'; A) = 0,   A' = (G (x_tip - L)/L - A) / T
 *
 * The unknown is (x, v, A); its first 2*3*n numbers are flesh's, as in ida.h. The Jacobian is flesh's sparse one with
 * one more column, dr/dA, and one more row; KLU solves. When the motion has died away, the bar must be in the static
 * equilibrium with that activation, which the integrator layer computes independently.
 *
 * Sample output:
 *       t   tip x        A
 *    0.10  2.0406   0.0127
 *    0.20  2.1254   0.0744
 *    0.30  2.2146   0.1833
 *    0.50  2.2361   0.3760
 *    1.00  2.0958   0.2298
 *   20.00  2.1408   0.2817
 *   statics 2.1408   0.2817
 */
#include <flesh/ida.h>
#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include "bar.h"

static const double gain = 4, delay = 0.2, strength = 2e4 /* Pa */, resistance = 40 /* N s/m per node */;

/* 1. The effect. */
typedef struct muscle {
  double activation; /* set before each call of flesh, so the effect serves only one thread */
  int nodes;
  flesh_cells cells;
  double *volumes, *along; /* [cells]; [4*cells] derivatives of the nodes' shape functions along x */
} muscle;

static void muscle_create(const flesh_mesh *mesh, muscle *m)
{
  *m = (muscle){.nodes = flesh_mesh_node_count(mesh)};
  TRY(flesh_cells_of_tets(mesh, &m->cells));
  m->volumes = malloc((size_t)m->cells.count * sizeof(double));
  m->along = malloc(4 * (size_t)m->cells.count * sizeof(double));
  const double *X = flesh_mesh_positions(mesh);
  for (int c = 0; c < m->cells.count; c++) {
    const int *p = m->cells.nodes + 4 * c;
    double e[3][3], *g = m->along + 4 * c;
    for (int k = 0; k < 3; k++)
      for (int i = 0; i < 3; i++) e[k][i] = X[3 * p[k + 1] + i] - X[3 * p[0] + i];
    for (int k = 0; k < 3; k++) {
      const double *u = e[(k + 1) % 3], *w = e[(k + 2) % 3];
      g[k + 1] = u[1] * w[2] - u[2] * w[1];
    }
    double det = e[0][0] * g[1] + e[1][0] * g[2] + e[2][0] * g[3];
    for (int k = 1; k < 4; k++) g[k] /= det;
    g[0] = -g[1] - g[2] - g[3];
    m->volumes[c] = fabs(det) / 6;
  }
}

static void muscle_destroy(muscle *m)
{
  flesh_cells_clear(&m->cells);
  free(m->volumes);
  free(m->along);
}

/* Adds activation * dr/dA to r. */
static void muscle_tension(const muscle *m, double activation, const double *x, double *r)
{
  for (int c = 0; c < m->cells.count; c++) {
    const int *p = m->cells.nodes + 4 * c;
    const double *g = m->along + 4 * c;
    for (int i = 0; i < 3; i++) {
      double fibre = 0; /* component i of F e_x */
      for (int k = 0; k < 4; k++) fibre += g[k] * x[3 * p[k] + i];
      for (int k = 0; k < 4; k++) r[3 * p[k] + i] += activation * strength * m->volumes[c] * g[k] * fibre;
    }
  }
}

static const flesh_cells *muscle_cells(const flesh_effect *effect) { return &((const muscle *)effect->data)->cells; }

static int muscle_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const muscle *m = effect->data;
  muscle_tension(m, m->activation, point->x, r);
  for (int d = 0; d < 3 * m->nodes; d++) r[d] += resistance * point->v[d];
  return FLESH_OK;
}

static int muscle_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                           flesh_block_matrix *K, const int *slots)
{
  (void)point;
  const muscle *m = effect->data;
  for (int c = 0; c < m->cells.count; c++) {
    const double *g = m->along + 4 * c, factor = shift->x * m->activation * strength * m->volumes[c];
    for (int a = 0, pair = 0; a < 4; a++)
      for (int b = a; b < 4; b++, pair++)
        for (int i = 0; i < 3; i++) K->values[9 * slots[10 * c + pair] + 4 * i] += factor * g[a] * g[b];
  }
  for (int i = 0; i < m->nodes; i++)
    for (int k = 0; k < 3; k++) K->values[9 * K->row_start[i] + 4 * k] += shift->v * resistance;
  return FLESH_OK;
}

/* Adds the potential of the tension and that of the resistance; in statics the latter is left out (shift->v is 0). */
static int muscle_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                            double *magnitude)
{
  const muscle *m = effect->data;
  double V = 0, drag = 0;
  for (int c = 0; c < m->cells.count; c++)
    for (int i = 0; i < 3; i++) {
      double fibre = 0;
      for (int k = 0; k < 4; k++) fibre += m->along[4 * c + k] * point->x[3 * m->cells.nodes[4 * c + k] + i];
      V += m->activation * strength * m->volumes[c] / 2 * fibre * fibre;
    }
  for (int d = 0; d < 3 * m->nodes; d++) drag += resistance / 2 * point->v[d] * point->v[d];
  if (shift->x != 0) *phi += V / shift->x, *magnitude += V / shift->x;
  if (shift->v != 0) *phi += drag / shift->v, *magnitude += drag / shift->v;
  return FLESH_OK;
}

static const flesh_effect_operations muscle_operations = {.name = "muscle",
                                                          .cells = muscle_cells,
                                                          .residual = muscle_residual,
                                                          .jacobian = muscle_jacobian,
                                                          .potential = muscle_potential};

/* 2. The coupled system: IDA's user_data. */
typedef struct coupled {
  flesh_ida_problem *body;
  const bar *bar;
  muscle *muscle;
  int n;               /* number of flesh's dofs; y has 2*n + 1 */
  N_Vector y, yp, r;   /* vectors [2*n], aliases of the body's part of longer ones */
  SUNMatrix J;         /* the body's Jacobian */
  uint8_t *fixed;
  double *tension;     /* dr/dA */
} coupled;

static int residual(sunrealtype t, N_Vector y, N_Vector yp, N_Vector r, void *data)
{
  coupled *self = data;
  const int last = 2 * self->n;
  const double *at = N_VGetArrayPointer(y), *rate = N_VGetArrayPointer(yp), A = at[last];
  N_VSetArrayPointer(N_VGetArrayPointer(y), self->y);
  N_VSetArrayPointer(N_VGetArrayPointer(yp), self->yp);
  N_VSetArrayPointer(N_VGetArrayPointer(r), self->r);
  self->muscle->activation = A;
  int status = flesh_ida_residual(t, self->y, self->yp, self->r, self->body);
  N_VGetArrayPointer(r)[last] = rate[last] - (gain * (at[3 * self->bar->tip] - 2) / 2 - A) / delay;
  return status;
}

static int jacobian(sunrealtype t, sunrealtype cj, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix J, void *data,
                    N_Vector w1, N_Vector w2, N_Vector w3)
{
  coupled *self = data;
  const int n = self->n, last = 2 * n;
  N_VSetArrayPointer(N_VGetArrayPointer(y), self->y);
  N_VSetArrayPointer(N_VGetArrayPointer(yp), self->yp);
  self->muscle->activation = N_VGetArrayPointer(y)[last];
  int status = flesh_ida_jacobian(t, cj, self->y, self->yp, r, self->J, self->body, w1, w2, w3);
  if (status) return status;
  const sunindextype *starts = SUNSparseMatrix_IndexPointers(self->J), *rows = SUNSparseMatrix_IndexValues(self->J);
  const double *values = SUNSparseMatrix_Data(self->J);
  sunindextype *to_starts = SUNSparseMatrix_IndexPointers(J), *to_rows = SUNSparseMatrix_IndexValues(J), next = 0;
  double *to_values = SUNSparseMatrix_Data(J);
  for (int c = 0; c < last; c++) {
    to_starts[c] = next;
    for (sunindextype k = starts[c]; k < starts[c + 1]; k++) to_rows[next] = rows[k], to_values[next++] = values[k];
    if (c == 3 * self->bar->tip) to_rows[next] = last, to_values[next++] = -gain / 2 / delay;
  }
  to_starts[last] = next;
  memset(self->tension, 0, (size_t)n * sizeof(double));
  muscle_tension(self->muscle, 1, N_VGetArrayPointer(y), self->tension);
  for (int d = 0; d < n; d++) to_rows[next] = n + d, to_values[next++] = self->fixed[d] ? 0 : self->tension[d];
  to_rows[next] = last, to_values[next++] = cj + 1 / delay;
  to_starts[last + 1] = next;
  return 0;
}

int main(void)
{
  /* 3. The body with its own effect, whose derivatives are audited. */
  bar b;
  muscle m;
  flesh_effect *effect;
  flesh_derivative_report audit;
  bar_begin(&b, FLESH_ELEMENT_TET4, bar_soft(), 1);
  TRY(flesh_effect_gravity(&b.body, (double[]){9.81, 0, 0}, &effect));
  TRY(flesh_system_add_effect(b.system, &effect));
  muscle_create(b.mesh, &m);
  TRY(flesh_effect_create(&muscle_operations, b.mesh, &m, &effect));
  m.activation = 0.7;
  TRY(flesh_effect_check_derivatives(effect, b.mesh, 0, b.state.x, 1, &audit));
  if (!flesh_derivative_report_passes(&audit, 1e-6)) printf("the muscle's derivatives are wrong\n");
  TRY(flesh_system_add_effect(b.system, &effect));
  bar_finish(&b);

  /* 4. Flesh's side, and vectors that will be aliases of the body's part. */
  SUNContext context;
  TRY(SUNContext_Create(SUN_COMM_NULL, &context));
  const int n = flesh_system_unknowns(b.system);
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  coupled c = {.bar = &b, .muscle = &m, .n = n};
  TRY(flesh_ida_problem_create(b.system, &options, &c.body));
  N_Vector y = N_VNew_Serial(2 * n + 1, context), yp = N_VClone(y), atol = N_VClone(y);
  c.y = N_VMake_Serial(2 * n, N_VGetArrayPointer(y), context);
  c.yp = N_VMake_Serial(2 * n, N_VGetArrayPointer(yp), context);
  c.r = N_VMake_Serial(2 * n, N_VGetArrayPointer(atol), context);
  c.J = SUNSparseMatrix(2 * n, 2 * n, flesh_ida_entries(c.body), CSC_MAT, context);
  c.fixed = malloc((size_t)n);
  c.tension = malloc((size_t)n * sizeof(double));
  flesh_system_fixed(b.system, 0, c.fixed);

  /* 5. Consistent initial values: unstretched, at rest, without activation. */
  m.activation = 0;
  TRY(flesh_ida_start(c.body, &b.state, c.y, c.yp));
  TRY(flesh_ida_tolerances(c.body, 1e-6, c.r));
  N_VGetArrayPointer(y)[2 * n] = N_VGetArrayPointer(yp)[2 * n] = 0;
  N_VGetArrayPointer(atol)[2 * n] = 1e-6;

  /* 6. IDA on the coupled system. */
  void *ida = IDACreate(context);
  SUNMatrix J = SUNSparseMatrix(2 * n + 1, 2 * n + 1, flesh_ida_entries(c.body) + n + 2, CSC_MAT, context);
  SUNLinearSolver solver = SUNLinSol_KLU(y, J, context);
  TRY(IDAInit(ida, residual, 0, y, yp));
  TRY(IDASetUserData(ida, &c));
  TRY(IDASVtolerances(ida, 0, atol));
  TRY(IDASetMaxOrd(ida, 2));
  TRY(IDASetMaxNumSteps(ida, 100000));
  TRY(IDASetLinearSolver(ida, solver, J));
  TRY(IDASetJacFn(ida, jacobian));
  const double outputs[] = {0.1, 0.2, 0.3, 0.5, 1, 20};
  printf("    t   tip x        A\n");
  for (int k = 0; k < 6; k++) {
    double t;
    TRY(IDASolve(ida, outputs[k], &t, y, yp, IDA_NORMAL) < 0);
    printf("%5.2f %7.4f %8.4f\n", t, N_VGetArrayPointer(y)[3 * b.tip], N_VGetArrayPointer(y)[2 * n]);
  }

  /* 7. The static equilibrium with the final activation. */
  flesh_integrator *integrator;
  m.activation = N_VGetArrayPointer(y)[2 * n];
  TRY(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  TRY(flesh_integrator_step(integrator, &b.state, 1, NULL));
  printf("statics %5.4f %8.4f\n", b.state.x[3 * b.tip], gain * (b.state.x[3 * b.tip] - 2) / 2);
  flesh_integrator_destroy(&integrator);

  IDAFree(&ida);
  SUNLinSolFree(solver);
  SUNMatDestroy(J);
  SUNMatDestroy(c.J);
  N_Vector vectors[] = {c.y, c.yp, c.r, y, yp, atol};
  for (int k = 0; k < 6; k++) N_VDestroy(vectors[k]);
  free(c.fixed);
  free(c.tension);
  flesh_ida_problem_destroy(&c.body);
  SUNContext_Free(&context);
  muscle_destroy(&m);
  bar_destroy(&b);
  return 0;
}
