/* set.h: the names of what is compiled once for every instruction set, FLESH_SET being that of the source at hand. */
#ifndef FLESH_BASE_SET_H
#define FLESH_BASE_SET_H

/* flesh_elastic -> flesh_elastic_avx2 */
#define FLESH_PASTE(name, set)       name##_##set
#define FLESH_PASTE_VALUE(name, set) FLESH_PASTE(name, set)
#define FLESH_OF_SET(name)           FLESH_PASTE_VALUE(name, FLESH_SET)

#endif
