/* isa.h: the names of what is compiled once for every instruction set, FLESH_ISA being that of the source at hand. */
#ifndef FLESH_BASE_ISA_H
#define FLESH_BASE_ISA_H

/* flesh_elastic -> flesh_elastic_avx2 */
#define FLESH_PASTE(name, set)       name##_##set
#define FLESH_PASTE_VALUE(name, set) FLESH_PASTE(name, set)
#define FLESH_OF_ISA(name)           FLESH_PASTE_VALUE(name, FLESH_ISA)

#endif
