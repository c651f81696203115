#pragma once
// Programs that were handed to a robot while it ran, put together from the pieces in SENSORS.

#include <cstdint>
#include <map>
#include <morphbus/sensors_t.hpp>
#include <string>

namespace morphbus::bridge {

/// Collects the pieces of all deployments of a run. Pieces of one image come in order; whoever uses
/// an image has it verified, for the log may be damaged.
class DeployedImages {
 public:
  /// Takes the pieces of a message; the image of a package that is whole goes to `whole`, under its
  /// hash.
  void Take(const morphbus::sensors_t& sensors, std::map<uint64_t, std::string>* whole);

 private:
  // More than one only where a deployment was broken off.
  std::map<int64_t, std::string> begun_;  ///< Packages that are not whole yet, by id.
};

}  // namespace morphbus::bridge
