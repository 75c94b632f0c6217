/* isa.h: the names of what is compiled once for every instruction set, FLESH_ISA being that of the source at hand. */
#ifndef FLESH_BASE_ISA_H
#define FLESH_BASE_ISA_H

/* flesh_elastic -> flesh_elastic_avx2 */
#define FLESH_PASTE(name, set)       name##_##set
#define FLESH_PASTE_VALUE(name, set) FLESH_PASTE(name, set)
#define FLESH_OF_ISA(name)           FLESH_PASTE_VALUE(name, FLESH_ISA)

/* Begins the declaration of a function that is compiled for every instruction set and has no name outside the
 * translation unit of its set. Functions stay apart, so that the code of one does not depend on its neighbours. */
#ifdef FLESH_ISA
#define FLESH_PER_ISA static __attribute__((noinline, unused))
#else
#define FLESH_PER_ISA
#endif

#endif
