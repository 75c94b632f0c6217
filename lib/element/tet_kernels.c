/* tet_kernels.c: tables of the kernels of one instruction set. */
#include "element/tet_lanes.h"

#define KERNELS(elastic, stiffness, viscous, fibre, gaps, mass)                                                         \
  {                                                                                                                    \
    .lanes = FLESH_LANES, .of = {                                                                                      \
      [FLESH_KERNEL_ELASTIC] = &FLESH_OF_ISA(elastic),                                                                 \
      [FLESH_KERNEL_STIFFNESS] = &FLESH_OF_ISA(stiffness),                                                             \
      [FLESH_KERNEL_VISCOUS] = &FLESH_OF_ISA(viscous),                                                                 \
      [FLESH_KERNEL_FIBRE] = &FLESH_OF_ISA(fibre),                                                                     \
      [FLESH_KERNEL_GAPS] = gaps,                                                                                      \
      [FLESH_KERNEL_MASS] = &mass,                                                                                     \
    }                                                                                                                  \
  }

const flesh_tet_kernels FLESH_OF_ISA(flesh_kernels)[FLESH_ELEMENT_COUNT] = {
    [FLESH_ELEMENT_TET4] = KERNELS(flesh_elastic, flesh_stiffness, flesh_viscous, flesh_fibre4, NULL, flesh_mass4),
    [FLESH_ELEMENT_TET10] = KERNELS(flesh_elastic10, flesh_stiffness10, flesh_viscous10, flesh_fibre10, NULL,
                                    flesh_mass10),
    [FLESH_ELEMENT_TET10_MEAN] = KERNELS(flesh_elastic10_mean, flesh_stiffness10, flesh_viscous10, flesh_fibre10,
                                         &FLESH_OF_ISA(flesh_gaps10_mean), flesh_mass10),
};
