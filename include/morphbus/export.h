#pragma once
// What the shared libraries of Morphbus show of themselves. Everything else in them is hidden.

/// Marks what can be used from outside. Classes without it have all their members in the header.
#define MORPHBUS_EXPORT __attribute__((visibility("default")))
/// Marks what lies in a class that can be used, and cannot.
#define MORPHBUS_HIDDEN __attribute__((visibility("hidden")))
