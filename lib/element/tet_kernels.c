/* tet_kernels.c: the kernels of one instruction set, by one name. */
#include "element/tet_lanes.h"

const flesh_tet_kernels FLESH_OF_ISA(flesh_kernels) = {
    .lanes = FLESH_LANES,
    .elastic = &FLESH_OF_ISA(flesh_elastic),
    .stiffness = &FLESH_OF_ISA(flesh_stiffness),
    .viscous = &FLESH_OF_ISA(flesh_viscous),
};
