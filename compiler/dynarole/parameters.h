#pragma once
// The parameters of a program image, and images in which they have other values.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "compiler/base/result.h"
#include "vm/image/program.h"

namespace morphbus::dynarole {

/// A parameter as people see it: `param NAME = value in [least, most];`. Its unit is the program's.
struct ProgramParameter {
  /// With its role's name before it if it stands in one: "Leg.swing".
  std::string name;
  /// Whether its values are ints; else they are floats of single precision.
  bool is_int = false;
  /// In this image, and in the source.
  double value = 0.0, source_value = 0.0;
  /// Both ends are allowed.
  double least = 0.0, most = 0.0;

  /// A value of it as text, "45" or "22.5": the shortest that is read as the same value.
  [[nodiscard]] std::string Text(double number) const;
};

/// The parameters of a program, in the order of its image; none for an image without notes, which
/// hold their names.
std::vector<ProgramParameter> ParametersOf(const vm::VerifiedProgram& program);

/// "swing 45 (30 in the source), lift 5": all of them with their values.
std::string ParametersText(const std::vector<ProgramParameter>& parameters);

/// The same program with another value of a parameter: an image with a hash of its own.
/// @param name  as in ProgramParameter; the role may be left out where one parameter only is so
///              called.
/// @returns the image; or why not, in one sentence: no such parameter, no number of its type, or
///          one that is out of its range.
Result<std::string> WithParameter(const vm::VerifiedProgram& program, std::string_view name,
                                  std::string_view value);

/// The hash of the image that the program's source compiles to: that of this one with the values
/// of the source for all parameters.
uint64_t HashOfSource(const vm::VerifiedProgram& program);

}  // namespace morphbus::dynarole
