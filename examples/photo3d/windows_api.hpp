// Includes the Windows API without the macros that collide with names in C++ code: min, max, near, far, ERROR.
#pragma once

#define WIN32_LEAN_AND_MEAN
#if !defined(NOMINMAX)  // libstdc++ defines it
#define NOMINMAX
#endif
#define PSAPI_VERSION 2
#include <windows.h>
#undef near
#undef far
#undef ERROR
