// Windows' functions without the macros that collide with names of C++: min, max, near, far.
#pragma once

#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#define PSAPI_VERSION 2
#include <windows.h>
#undef near
#undef far
#undef ERROR
