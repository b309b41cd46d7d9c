/* Functions that become part of each of their callers. */
#ifndef REFDYN_INLINE_H
#define REFDYN_INLINE_H

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

#endif
