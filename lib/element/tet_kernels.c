/* tet_kernels.c: the kernels of one instruction set, by one name. */
#include "element/tet_lanes.h"

const flesh_tet_kernels FLESH_OF_ISA(flesh_kernels)[FLESH_ELEMENT_COUNT] = {
    [FLESH_ELEMENT_TET4] = {.lanes = FLESH_LANES,
                            .elastic = &FLESH_OF_ISA(flesh_elastic),
                            .stiffness = &FLESH_OF_ISA(flesh_stiffness),
                            .viscous = &FLESH_OF_ISA(flesh_viscous)},
    [FLESH_ELEMENT_TET10] = {.lanes = FLESH_LANES,
                             .elastic = &FLESH_OF_ISA(flesh_elastic10),
                             .stiffness = &FLESH_OF_ISA(flesh_stiffness10),
                             .viscous = &FLESH_OF_ISA(flesh_viscous10)},
    [FLESH_ELEMENT_TET10_MEAN] = {.lanes = FLESH_LANES,
                                  .elastic = &FLESH_OF_ISA(flesh_elastic10_mean),
                                  .stiffness = &FLESH_OF_ISA(flesh_stiffness10),
                                  .viscous = &FLESH_OF_ISA(flesh_viscous10),
                                  .gaps = &FLESH_OF_ISA(flesh_gaps10_mean)},
};
