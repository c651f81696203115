#pragma once
// How the libraries of Morphbus say that something cannot be done.

#include <morphbus/export.h>

#include <stdexcept>

namespace morphbus {

/// Thrown where what was asked for cannot be had: a file that cannot be read, a name that a model
/// does not have, damaged bytes. what() is one sentence or a few for people, with the place and,
/// where there is one, the way out. The objects that were there before are as they were.
class MORPHBUS_EXPORT Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace morphbus
