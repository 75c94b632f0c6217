/* linear_isa.c: the linear solver of one instruction set, in one translation unit: its functions have no external names,
 * and rooms call them through the table. Static names in these files must differ from each other. */
#include "linear/linear.h"

#include "linear/chebyshev.c"
#include "linear/cholesky.c"
#include "linear/coarse.c"
#include "linear/coarse_cholesky.c"
#include "linear/coarse_team.c"
#include "linear/diagonal_blocks.c"
#include "linear/local_level.c"
#include "linear/pcg.c"
#include "linear/pcg_team.c"
#include "linear/preconditioner.c"
#include "linear/preconditioner_solve.c"
#include "linear/product.c"
#include "linear/row_coupling.c"
#include "linear/sparse_cholesky.c"
#include "linear/volume_projection.c"

const flesh_linear FLESH_OF_ISA(flesh_linear) = {
    .exact = &FLESH_OF_ISA(flesh_exact),
    .preconditioner_create = flesh_preconditioner_create,
    .preconditioner_create_levels = flesh_preconditioner_create_levels,
    .preconditioner_project = flesh_preconditioner_project,
    .preconditioner_destroy = flesh_preconditioner_destroy,
    .preconditioner_setup = flesh_preconditioner_setup,
    .preconditioner_apply = flesh_preconditioner_apply,
    .preconditioner_solve = flesh_preconditioner_solve,
    .preconditioner_scale = flesh_preconditioner_scale,
    .preconditioner_correct_volumes = flesh_preconditioner_correct_volumes,
    .preconditioner_drift = flesh_preconditioner_drift,
    .preconditioner_archive = flesh_preconditioner_archive,
    .pcg_space_create = flesh_pcg_space_create,
    .pcg_space_destroy = flesh_pcg_space_destroy,
    .pcg = flesh_pcg,
    .pcg_model_error = flesh_pcg_model_error,
    .product_create = flesh_product_create,
    .product_clear = flesh_product_clear,
    .product_multiply = flesh_product_multiply,
    .product_multiply_single = flesh_product_multiply_single,
};
