#pragma once
// MORPHBUS_CHECK(condition) is for our own bugs only, never for input: bad text gets diagnostics,
// bad bytes a Result, a faulty role a fault (CONTRIBUTING.md, four kinds of error). If the
// condition does not hold, it prints the file, the line and the condition to stderr and aborts, in
// release builds too. The condition is evaluated once. A MORPHBUS_CHECK is a statement and ends
// with a semicolon, also as the only one behind an `if`.

#include <cstdio>
#include <cstdlib>

#define MORPHBUS_CHECK(condition)                                                                 \
  do {                                                                                            \
    if (!(condition)) {                                                                           \
      std::fprintf(stderr, "%s:%d: internal check failed: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                               \
    }                                                                                             \
  } while (false)
