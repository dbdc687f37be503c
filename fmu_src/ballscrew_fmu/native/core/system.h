/* What the system offers beyond C99; included before any other header. */
#ifndef BALLSCREW_SYSTEM_H
#define BALLSCREW_SYSTEM_H

#define _POSIX_C_SOURCE 200809L /* O_NOFOLLOW, */
#define _DARWIN_C_SOURCE        /* on macOS */
#if defined(_WIN32)
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#undef near
#undef far
#endif

#endif
