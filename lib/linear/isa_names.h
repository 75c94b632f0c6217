/* isa_names.h: the linear solver is compiled once for every instruction set, and its functions are then named after
 * that, flesh_pcg_avx2 and so on. Who does not ask for a certain one goes by linear.h. */
#ifndef FLESH_LINEAR_ISA_NAMES_H
#define FLESH_LINEAR_ISA_NAMES_H

#ifdef FLESH_ISA
#include "base/isa.h"

#define flesh_pcg_space_create FLESH_OF_ISA(flesh_pcg_space_create)
#define flesh_pcg_space_destroy FLESH_OF_ISA(flesh_pcg_space_destroy)
#define flesh_pcg_space_memory FLESH_OF_ISA(flesh_pcg_space_memory)
#define flesh_pcg FLESH_OF_ISA(flesh_pcg)
#define flesh_pcg_departure FLESH_OF_ISA(flesh_pcg_departure)
#define flesh_pcg_guided FLESH_OF_ISA(flesh_pcg_guided)

#define flesh_preconditioner_create FLESH_OF_ISA(flesh_preconditioner_create)
#define flesh_preconditioner_destroy FLESH_OF_ISA(flesh_preconditioner_destroy)
#define flesh_power_to_one FLESH_OF_ISA(flesh_power_to_one)
#define flesh_preconditioner_setup FLESH_OF_ISA(flesh_preconditioner_setup)
#define flesh_preconditioner_solve FLESH_OF_ISA(flesh_preconditioner_solve)
#define flesh_preconditioner_scale FLESH_OF_ISA(flesh_preconditioner_scale)
#define flesh_preconditioner_result FLESH_OF_ISA(flesh_preconditioner_result)
#define flesh_preconditioner_apply FLESH_OF_ISA(flesh_preconditioner_apply)
#define flesh_preconditioner_memory FLESH_OF_ISA(flesh_preconditioner_memory)

#define flesh_cholesky_create FLESH_OF_ISA(flesh_cholesky_create)
#define flesh_cholesky_destroy FLESH_OF_ISA(flesh_cholesky_destroy)
#define flesh_cholesky_factor FLESH_OF_ISA(flesh_cholesky_factor)
#define flesh_cholesky_solve FLESH_OF_ISA(flesh_cholesky_solve)
#define flesh_cholesky_result FLESH_OF_ISA(flesh_cholesky_result)
#define flesh_cholesky_memory FLESH_OF_ISA(flesh_cholesky_memory)

#define flesh_coarse_create FLESH_OF_ISA(flesh_coarse_create)
#define flesh_coarse_destroy FLESH_OF_ISA(flesh_coarse_destroy)
#define flesh_coarse_setup FLESH_OF_ISA(flesh_coarse_setup)
#define flesh_coarse_restrict FLESH_OF_ISA(flesh_coarse_restrict)
#define flesh_coarse_solve FLESH_OF_ISA(flesh_coarse_solve)
#define flesh_coarse_add FLESH_OF_ISA(flesh_coarse_add)
#define flesh_coarse_memory FLESH_OF_ISA(flesh_coarse_memory)

#define flesh_coarse_cholesky_create FLESH_OF_ISA(flesh_coarse_cholesky_create)
#define flesh_coarse_cholesky_clear FLESH_OF_ISA(flesh_coarse_cholesky_clear)
#define flesh_coarse_cholesky_memory FLESH_OF_ISA(flesh_coarse_cholesky_memory)
#define flesh_coarse_cholesky_zero FLESH_OF_ISA(flesh_coarse_cholesky_zero)
#define flesh_coarse_cholesky_at FLESH_OF_ISA(flesh_coarse_cholesky_at)
#define flesh_coarse_cholesky_factor FLESH_OF_ISA(flesh_coarse_cholesky_factor)
#define flesh_coarse_cholesky_solve FLESH_OF_ISA(flesh_coarse_cholesky_solve)

#define flesh_product_create FLESH_OF_ISA(flesh_product_create)
#define flesh_product_clear FLESH_OF_ISA(flesh_product_clear)
#define flesh_product_memory FLESH_OF_ISA(flesh_product_memory)
#define flesh_product_multiply FLESH_OF_ISA(flesh_product_multiply)
#define flesh_product_multiply_single FLESH_OF_ISA(flesh_product_multiply_single)

#endif

#endif
