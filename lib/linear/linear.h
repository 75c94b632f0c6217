/* linear.h: conjugate gradients, their preconditioners and products, compiled for each instruction set. The functions are
 * those of pcg.h, preconditioner.h and product.h; an object made by one set may only be used by that set. */
#ifndef FLESH_LINEAR_LINEAR_H
#define FLESH_LINEAR_LINEAR_H

#include "flesh/instructions.h"
#include "linear/exact.h"
#include "linear/pcg.h"
#include "linear/product.h"

typedef struct flesh_linear {
  const flesh_exact_solver *exact;
  int (*preconditioner_create)(flesh_preconditioner kind, const flesh_block_matrix *A, const double *positions, int order,
                               flesh_threads *threads, flesh_preconditioner_data **preconditioner);
  int (*preconditioner_create_levels)(flesh_preconditioner kind, const flesh_block_matrix *A, const double *positions,
                                      const flesh_levels *levels, flesh_threads *threads,
                                      flesh_preconditioner_data **preconditioner);
  int (*preconditioner_project)(flesh_preconditioner_data *preconditioner, const flesh_block_matrix *A,
                                const flesh_stiff_rows *rows, const double *positions, int polynomial);
  void (*preconditioner_destroy)(flesh_preconditioner_data **preconditioner);
  int (*preconditioner_setup)(flesh_preconditioner_data *preconditioner, const flesh_block_matrix *A,
                              const uint8_t *fixed);
  void (*preconditioner_apply)(flesh_preconditioner_data *preconditioner, const double *r, double *z);
  double (*preconditioner_solve)(flesh_preconditioner_data *preconditioner, const float *r);
  double (*preconditioner_scale)(const flesh_preconditioner_data *preconditioner);
  int (*preconditioner_correct_volumes)(flesh_preconditioner_data *preconditioner, const float *error, double *step);
  double (*preconditioner_drift)(const flesh_preconditioner_data *preconditioner);
  void (*preconditioner_archive)(flesh_preconditioner_data *preconditioner, flesh_archive *archive);
  int (*pcg_space_create)(const flesh_block_matrix *A, int single, flesh_threads *threads, flesh_pcg_space **space);
  void (*pcg_space_destroy)(flesh_pcg_space **space);
  int (*pcg)(flesh_pcg_space *space, const flesh_pcg_request *request, double *x, flesh_pcg_result *result);
  double (*pcg_model_error)(const flesh_pcg_space *space, const double *weights, const double *r);
  int (*product_create)(const flesh_block_matrix *A, const flesh_bisection *bisection, int single,
                        flesh_product *product);
  void (*product_clear)(flesh_product *product);
  double (*product_multiply)(flesh_product *product, const flesh_block_matrix *A, flesh_threads *threads,
                             const flesh_product_maker *maker, double *x, double *y);
  double (*product_multiply_single)(flesh_product *product, const flesh_block_matrix *A, double scale,
                                    flesh_threads *threads, const flesh_product_maker *maker, float *x, float *y);
} flesh_linear;

extern const flesh_linear flesh_linear_portable, flesh_linear_avx2, flesh_linear_avx512;

/* Returns the functions for instructions that this machine has; AUTO: the best. */
const flesh_linear *flesh_linear_for(flesh_instructions instructions);

#endif
