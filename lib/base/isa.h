/* isa.h: names of functions that are compiled once for every instruction set; FLESH_ISA is the set of the current
 * source. */
#ifndef FLESH_BASE_ISA_H
#define FLESH_BASE_ISA_H

/* flesh_elastic -> flesh_elastic_avx2 */
#define FLESH_PASTE(name, set)       name##_##set
#define FLESH_PASTE_VALUE(name, set) FLESH_PASTE(name, set)
#define FLESH_OF_ISA(name)           FLESH_PASTE_VALUE(name, FLESH_ISA)

/* Begins the declaration of a function that is compiled for every instruction set and is local to the translation unit
 * of its set. The function is not inlined, so that its code does not depend on its neighbours. */
#ifdef FLESH_ISA
#define FLESH_PER_ISA static __attribute__((noinline, unused))
#else
#define FLESH_PER_ISA
#endif

#endif
