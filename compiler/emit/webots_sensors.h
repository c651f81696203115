#pragma once
// The sensors that M3L declares, as devices of Webots.

#include <string>
#include <vector>

#include "compiler/emit/vrml_writer.h"
#include "compiler/model/convex_hull.h"
#include "compiler/model/robot_model.h"

namespace morphbus::emit {

/// What a contact sensor collides with, in the frame of its link (m): for each convex part of the
/// link a pad of 1 mm on the faces that look within 45 degrees of where the sensor does. With a
/// range only as far as they lie in the cube of that half side around the sensor's place, one face
/// of which looks where the sensor does. Empty where no face is left.
std::vector<model::ConvexHull> ContactPads(const model::Sensor& sensor,
                                           const std::vector<model::ConvexHull>& parts);

/// Writes the device of a sensor among the children of its link's node, called NAME.sensor: a
/// DistanceSensor (a laser) that looks along its x, an Accelerometer for a tilt, or a TouchSensor
/// (a bumper) with its pads; without pads it is a token ball at the sensor's place. `parts` are the
/// convex parts that the link collides with.
void AppendWebotsSensor(const model::Sensor& sensor, const std::vector<model::ConvexHull>& parts,
                        VrmlWriter* vrml);

/// A lookup table that gives back what is measured (`least` to `most`, of which the one is 0 or
/// minus the other), with a standard deviation of `noise`, all in one unit. Webots takes deviations
/// in parts of the value, and interpolates them; so the table has rows, each half as far again as
/// the one before, from a hundredth of `most` on, between which the deviation is at most 5 % more
/// than `noise`. Nearer to 0 it fades.
std::string NoisyTable(double least, double most, double noise);

}  // namespace morphbus::emit
