/* unroll.h: FLESH_UNROLL unrolls a loop for speed. With sanitizers it does nothing, as they make the code of each turn
 * long and its compilation slow. */
#ifndef FLESH_BASE_UNROLL_H
#define FLESH_BASE_UNROLL_H

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FLESH_UNROLL(turns)
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define FLESH_UNROLL(turns)
#endif
#endif

#ifndef FLESH_UNROLL
#define FLESH_PRAGMA(text)  _Pragma(#text)
#define FLESH_UNROLL(turns) FLESH_PRAGMA(GCC unroll turns)
#endif

#endif
