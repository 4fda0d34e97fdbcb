#ifndef CYLCHAIN_INLINE_H_
#define CYLCHAIN_INLINE_H_

/**
 * For functions that must be compiled within their callers: one that is called cannot keep vectors in registers, and of
 * several that are compiled for different instruction sets, a linker would keep one.
 */
#define CYLCHAIN_INLINE inline __attribute__((always_inline))

#endif /*CYLCHAIN_INLINE_H_*/
