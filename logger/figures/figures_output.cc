// The figures of a run as JSON and as text: run_figures.h.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "compiler/base/text.h"
#include "logger/figures/run_figures.h"
#include "logger/log/text_lines.h"

namespace morphbus::logger {
namespace {

using Json = nlohmann::json;

Json VectorToJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

std::string WayText(const Eigen::Vector3d& v) {
  return fmt::format("{:+.3f} m north, {:+.3f} m up, {:+.3f} m east", v.x(), v.y(), v.z());
}

/// The reason why there is no cost of transport, in the words of a person; empty if there is one.
std::string WhyNoCost(const Transport& transport) {
  if (transport.cost) return {};
  return fmt::format("the robot came only {:.1f} mm far", transport.distance_m * 1e3);
}

Json CostJson(const Transport& transport) {
  return transport.cost ? Json(*transport.cost) : Json(nullptr);
}

/// "3.21 J, cost of transport 12.3".
std::string EnergyText(double energy_j, const Transport& transport) {
  return fmt::format("{:.2f} J, {}", energy_j,
                     transport.cost ? fmt::format("cost of transport {:.2f}", *transport.cost)
                                    : "no cost of transport: " + WhyNoCost(transport));
}

/// How hard motors worked, and what links bore.
Json LoadsJson(const RunFigures& f) {
  Json joints = Json::object(), links = Json::object();
  // Objects by name and not lists, so that a script finds a joint or link whatever else the robot
  // has.
  for (const JointLoad& joint : f.joint_loads) {
    joints[joint.name] = {{"rms", joint.rms}, {"peak", joint.peak}};
  }
  for (const LinkLoad& link : f.motion.loads) {
    links[link.name] = {{"mean_n", VectorToJson(link.mean_W)}, {"peak_n", link.peak_n}};
  }
  return {{"joints", joints}, {"links", links}};
}

/// The keys that say how the trunk went and turned; null for a run without WORLD.
Json WalkJson(const RunFigures& f) {
  if (!f.has_world) return nullptr;
  // A value for each cycle; empty without a gait, as cycle_s is 0.
  Json north = Json::array(), turn = Json::array();
  if (f.gait) {
    for (const GaitCycle& cycle : f.gait->cycles) {
      north.push_back(cycle.advance.x());
      turn.push_back(cycle.turn_rad);
    }
  }
  return {{"cycle_s", f.gait ? f.gait->cycle_s : 0.0},
          {"cycle_north_m", north},
          {"cycle_turn_rad", turn},
          {"turn_rad", f.turn_rad},
          {"max_tilt_rad", f.max_tilt_rad},
          {"min_height_m", f.min_height_m}};
}

}  // namespace

Json GaitJson(const std::optional<Gait>& gait) {
  if (!gait) return nullptr;
  Json json = {{"cycle_s", gait->cycle_s},
               {"cycles", gait->num_cycles()},
               {"begin", Seconds(gait->times_us.front())},
               {"end", Seconds(gait->times_us.back())}};
  // Without WORLD a gait has times and ranges only, and those of joints are in no key.
  if (gait->cycles.empty()) return json;
  // Means over the cycles; energy and cost as docs/cli.md, "Figures", has them.
  json["forward_m"] = gait->forward_m;
  json["sideways_m"] = gait->left_m;
  json["turn_rad"] = gait->turn_rad;
  json["height_m"] = gait->height_m;
  json["energy_j"] = gait->energy_j;
  json["cost_of_transport"] = CostJson(gait->transport);
  Json each = Json::array();
  for (const GaitCycle& cycle : gait->cycles) {
    each.push_back({{"begin", Seconds(cycle.begin_us)},
                    {"seconds", Seconds(cycle.end_us - cycle.begin_us)},
                    {"advance", VectorToJson(cycle.advance)},
                    {"turn_rad", cycle.turn_rad},
                    {"energy_j", cycle.energy_j}});
  }
  json["each"] = std::move(each);
  Json duty = Json::object();
  for (const LinkDuty& link : gait->duties) duty[link.name] = link.duty;
  json["duty"] = std::move(duty);
  return json;
}

Json FiguresJson(const RunFigures& f) {
  // Every key is there in every run, so that a script can tell "not known" from a name that it
  // wrote wrong.
  Json json = {{"displacement", nullptr},
               {"root_displacement", nullptr},
               {"path_length", nullptr},
               {"energy", nullptr},
               {"cost_of_transport", nullptr},
               {"no_cost", nullptr},
               {"loads", nullptr},
               {"walk", WalkJson(f)},
               {"gait", GaitJson(f.gait)},
               {"no_gait", f.gait || f.why_no_gait.empty() ? Json(nullptr) : Json(f.why_no_gait)}};
  if (!f.has_world) return json;
  json["displacement"] = VectorToJson(f.displacement);
  json["root_displacement"] = VectorToJson(f.root_displacement);
  json["path_length"] = f.path_length_m;
  json["energy"] = f.energy_j;
  json["cost_of_transport"] = CostJson(f.transport);
  if (!f.transport.cost) json["no_cost"] = WhyNoCost(f.transport);
  json["loads"] = LoadsJson(f);
  return json;
}

std::vector<std::pair<std::string, std::string>> FigureLines(const RunFigures& f) {
  std::vector<std::pair<std::string, std::string>> lines;
  const auto add = [&lines](const char* name, std::string value) {
    lines.emplace_back(name, std::move(value));
  };
  // Places and energy are known of a simulated world only.
  if (f.has_world) {
    add("moved", WayText(f.displacement));
    add("root body moved", WayText(f.root_displacement));
    add("path", fmt::format("{:.3f} m", f.path_length_m));
    add("turned", fmt::format("{:+.1f} degrees, tilted {:.1f} at most", f.turn_rad * kDegrees,
                              f.max_tilt_rad * kDegrees));
    add("energy", EnergyText(f.energy_j, f.transport));
  }
  if (!f.gait) {
    // Of a run of which nothing was measured there is nothing to say.
    if (!f.why_no_gait.empty()) add("gait", "no cycle: " + f.why_no_gait);
    return lines;
  }
  const Gait& gait = *f.gait;
  add("gait",
      fmt::format("cycle of {:.2f} s: {} from {:.2f} s on", gait.cycle_s,
                  Counted(gait.num_cycles(), "whole cycle"), Seconds(gait.times_us.front())));
  if (gait.cycles.empty()) return lines;
  // A cycle's way is told in millimetres: it is seldom as long as a metre.
  add("a cycle", fmt::format("{:.1f} mm forward, {:+.1f} mm to the left, {:+.2f} degrees",
                             gait.forward_m * 1e3, gait.left_m * 1e3, gait.turn_rad * kDegrees));
  add("energy a cycle", EnergyText(gait.energy_j, gait.transport));
  // A long run has many cycles; the first ones show whether they are alike.
  constexpr size_t kShown = 12;
  std::string north;
  for (size_t i = 0; i < std::min(gait.cycles.size(), kShown); ++i) {
    north += fmt::format("{}{:.0f}", i == 0 ? "" : " ", gait.cycles[i].advance.x() * 1e3);
  }
  add("mm north in each", north + (gait.cycles.size() > kShown ? " …" : ""));
  return lines;
}

}  // namespace morphbus::logger
