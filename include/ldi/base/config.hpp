// What a user can set before including any header of ldi, and what ldi learns about the compiler.
//
//   LDI_ASSERT(condition)   checks that the API is used as documented. Defaults to assert(); define it to your engine's own.
//   LDI_HAS_EXCEPTIONS      0 or 1; found out from the compiler unless set. With 0, errors go to the handler of base/error.hpp.
#pragma once

#include <ldi/version.hpp>

#include <cassert>

#ifndef LDI_ASSERT
#define LDI_ASSERT(condition) assert(condition)
#endif

#ifndef LDI_HAS_EXCEPTIONS
#if defined(__cpp_exceptions) || defined(__EXCEPTIONS) || defined(_CPPUNWIND)
#define LDI_HAS_EXCEPTIONS 1
#else
#define LDI_HAS_EXCEPTIONS 0
#endif
#endif
