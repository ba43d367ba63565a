// The same without assertions, as programs are delivered.
#undef NDEBUG
#define NDEBUG 1
#define LDI_TEST_CONFIGURATION "without assertions: "
#include "tests/photo3d/extreme_values.cpp"
