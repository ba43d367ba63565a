// Fixes exceptions in threads for Emscripten 3.1.6 with Debian's clang 14 and -fwasm-exceptions -pthread. There, a `catch` of one
// type catches nothing: the runtime passes the exception's type through the thread-local variable __wasm_lpad_context, but
// clang's code reads a global variable of that name. If the program declares the variable, clang uses the program's
// declaration. The declaration below is thread-local.
#pragma once

#if defined(__EMSCRIPTEN_PTHREADS__) && defined(__wasm_exception_handling__)

extern "C" {

struct ldi_landing_pad {
    __UINTPTR_TYPE__ index, table, selector;
};
extern __thread ldi_landing_pad __wasm_lpad_context;

/// Uses the variable, so that the compiler does not discard its declaration.
[[gnu::used]] inline ldi_landing_pad* ldi_landing_pad_of_thread() { return &__wasm_lpad_context; }

}  // extern "C"

#endif
