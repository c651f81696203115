#pragma once
// MORPHBUS_CHECK: for our own bugs only, never for input. Prints the place and aborts, in all
// builds.

#include <cstdio>
#include <cstdlib>

#define MORPHBUS_CHECK(condition)                                                                 \
  do {                                                                                            \
    if (!(condition)) {                                                                           \
      std::fprintf(stderr, "%s:%d: internal check failed: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                               \
    }                                                                                             \
  } while (false)
