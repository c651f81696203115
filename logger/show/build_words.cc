#include "logger/show/build_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace morphbus::logger {
namespace {

using Eigen::Vector3d;

/// So many connectors that face alike, or points that meet, are enough to check.
constexpr size_t kMostFacings = 4;
constexpr size_t kMostPoints = 6;
/// Directions this near to a line lie along it (some 2 degrees).
constexpr double kAlong = 0.9994;

/// A number with at most one decimal, without a negative zero.
std::string Rounded(double value) { return model::NumberText(std::round(value * 10.0) / 10.0); }

/// Which way a joint of a module lies: one turned about half round has its axis on the same line.
std::string AxisWords(const Assembly& assembly, int module, const model::Joint& joint) {
  const model::ModuleType& type = assembly.TypeOf(module);
  const Vector3d axis_R = assembly.plan.X_RL[module][joint.link_a].linear() * joint.axis;
  const std::string& moves = type.links[joint.link_a].name;
  return fmt::format("the axis of {}.{} points {}, {} at positive values", assembly.NameOf(module),
                     joint.name, DirectionWords(axis_R),
                     joint.type == model::JointType::kPrismatic
                         ? "where " + moves + " goes"
                         : "about which " + moves + " turns anticlockwise");
}

/// The connectors of a module that say something of how it is turned about the line on which it
/// mates: those that do not face along it.
std::vector<int> AcrossConnectors(const Assembly& assembly, int module,
                                  const model::Mating& mating) {
  const auto& faces = assembly.plan.faces_R[module];
  const std::optional<Vector3d>& line = faces[mating.own_connector];
  std::vector<int> across;
  for (int c = 0; c < std::ssize(faces); ++c) {
    if (c != mating.own_connector && faces[c] && line && std::abs(faces[c]->dot(*line)) < kAlong) {
      across.push_back(c);
    }
  }
  return across;
}

/// "m2.c3 extended = true".
std::string StateWords(const Assembly& assembly, const model::Docking& d,
                       const model::StateSetting& setting) {
  std::vector<std::string> words;
  for (const model::StateRequirement& s : setting) {
    const std::string end = s.of_a ? assembly.EndOf(d.module_a, d.connector_a)
                                   : assembly.EndOf(d.module_b, d.connector_b);
    words.push_back(fmt::format("{} {} = {}", end, s.variable, model::ValueText(s.value)));
  }
  return ListWords(words);
}

/// Which of the numbered ways it is.
std::string NumberLine(const Assembly& assembly, int module, const model::Mating& mating) {
  const model::Docking& d = assembly.robot.dockings[mating.docking];
  const std::string& name = assembly.model.connection_types[d.connection_type].name;
  const std::string own = assembly.EndOf(module, mating.own_connector);
  if (mating.ways.size() == 1) {
    return fmt::format("{} fits there in one way only, number {} of {}.", own, mating.number, name);
  }
  const std::string among = fmt::format("the {} ways of these two ({})", mating.ways.size(),
                                        fmt::join(mating.ways, ", "));
  const int first = mating.ways.front();
  const std::string number =
      fmt::format("Which way round {} lies: number {} of {}", own, mating.number, name);
  if (mating.number == first) return fmt::format("{}, the first of {}.", number, among);
  if (!mating.turn) return fmt::format("{}, not number {}, the first of {}.", number, first, among);
  // Clockwise is to whoever looks at the face on which it is put.
  const std::string words = TurnWords(*mating.turn);
  const std::string looked =
      words.ends_with("clockwise")
          ? fmt::format(" as you look at {}",
                        assembly.EndOf(mating.standing, mating.standing_connector))
          : "";
  return fmt::format("{}, {}{} from number {}, the first of {}.", number, words, looked, first,
                     among);
}

}  // namespace

std::string ListWords(const std::vector<std::string>& words) {
  if (words.size() < 2) return words.empty() ? "" : words.front();
  const std::vector<std::string> most(words.begin(), words.end() - 1);
  return fmt::format("{} and {}", fmt::join(most, ", "), words.back());
}

std::string DirectionWords(const Vector3d& direction_R) {
  // Less than 22.5 degrees to a side are not told.
  constexpr double kTold = 0.38;
  constexpr std::array<std::array<const char*, 2>, 3> kNames = {
      {{"north", "south"}, {"up", "down"}, {"east", "west"}}};
  std::array<int, 3> by_size = {0, 1, 2};
  std::ranges::stable_sort(by_size, [&](int i, int j) {
    return std::abs(direction_R[i]) > std::abs(direction_R[j]) + 1e-6;
  });
  std::vector<std::string> words;
  for (const int i : by_size) {
    if (std::abs(direction_R[i]) >= kTold)
      words.emplace_back(kNames[i][direction_R[i] < 0 ? 1 : 0]);
  }
  return ListWords(words);
}

std::string TurnWords(const model::MatingTurn& turn) {
  const double degrees = std::abs(turn.degrees);
  struct Part {
    double degrees;
    const char* name;
  };
  constexpr Part kParts[] = {{180, "half a turn"},
                             {120, "a third of a turn"},
                             {90, "a quarter turn"},
                             {60, "a sixth of a turn"},
                             {45, "an eighth of a turn"}};
  std::string words = fmt::format("a turn of {}°", Rounded(degrees));
  for (const Part& part : kParts) {
    if (std::abs(degrees - part.degrees) < 1e-3) words = part.name;
  }
  // Half a turn is the same either way.
  if (std::abs(degrees - 180.0) < 1e-3) return words;
  if (!turn.signed_) return words + " to one side";
  return words + (turn.degrees > 0 ? " anticlockwise" : " clockwise");
}

std::string ValueWords(const model::Joint& joint, double value) {
  if (joint.type == model::JointType::kPrismatic) return Rounded(value * 1000.0) + " mm";
  return Rounded(value * 180.0 / std::numbers::pi) + "°";
}

std::vector<std::string> JointLines(const Assembly& assembly, int module,
                                    const std::vector<double>& values) {
  const model::ModuleType& type = assembly.TypeOf(module);
  std::vector<std::string> settings;
  bool all_zero = true;
  for (size_t j = 0; j < type.joints.size(); ++j) {
    if (type.joints[j].type == model::JointType::kFixed) continue;
    all_zero = all_zero && values[j] == 0.0;
    settings.push_back(fmt::format("{}.{} to {}", assembly.NameOf(module), type.joints[j].name,
                                   ValueWords(type.joints[j], values[j])));
  }
  if (settings.empty()) return {};
  if (all_zero && settings.size() > 1) {
    return {fmt::format("Set all joints of {} to 0.", assembly.NameOf(module))};
  }
  return {"Set " + ListWords(settings) + "."};
}

std::string LyingLine(const Assembly& assembly, int module) {
  const auto& faces = assembly.plan.faces_R[module];
  std::vector<std::string> words;
  for (int c = 0; c < std::ssize(faces); ++c) {
    if (!faces[c]) continue;
    words.push_back(
        fmt::format("{} faces {}", assembly.EndOf(module, c), DirectionWords(*faces[c])));
  }
  if (words.empty())
    return fmt::format("Lay {} down as the picture shows.", assembly.NameOf(module));
  return fmt::format("Lay {} down so that {}.", assembly.NameOf(module), ListWords(words));
}

std::vector<std::string> WayLines(const Assembly& assembly, int module,
                                  const model::Mating& mating) {
  std::vector<std::string> lines = {NumberLine(assembly, module, mating)};
  // What faces alike, and where to: of a few connectors across the line on which the two mate.
  std::vector<std::string> facings;
  const auto& faces = assembly.plan.faces_R[module];
  for (const int c : AcrossConnectors(assembly, module, mating)) {
    if (facings.size() == kMostFacings) break;
    std::string words =
        fmt::format("{} faces {}", assembly.EndOf(module, c), DirectionWords(*faces[c]));
    const auto alike = std::ranges::find(mating.same_way, c, &std::pair<int, int>::first);
    if (alike != mating.same_way.end()) {
      words += fmt::format(", as {} does", assembly.EndOf(mating.standing, alike->second));
    }
    facings.push_back(std::move(words));
  }
  // A module without such connectors has joints, whose axes lie across it or along it.
  const model::ModuleType& type = assembly.TypeOf(module);
  if (facings.empty()) {
    for (const model::Joint& joint : type.joints) {
      if (joint.type == model::JointType::kFixed) continue;
      facings.push_back(AxisWords(assembly, module, joint));
    }
  }
  if (!facings.empty()) lines.push_back(fmt::format("Then {}.", fmt::join(facings, "; ")));
  if (!mating.points.empty()) {
    const auto& own = type.connectors[mating.own_connector].subpoint_names;
    const auto& standing =
        assembly.TypeOf(mating.standing).connectors[mating.standing_connector].subpoint_names;
    std::vector<std::string> pairs;
    for (const auto& [i, j] : mating.points) {
      if (pairs.size() < kMostPoints) pairs.push_back(fmt::format("{} on {}", own[i], standing[j]));
    }
    lines.push_back(fmt::format(
        "Points of {} that meet those of {}: {}.", assembly.EndOf(module, mating.own_connector),
        assembly.EndOf(mating.standing, mating.standing_connector), fmt::join(pairs, ", ")));
  }
  return lines;
}

std::vector<std::string> MatingLines(const Assembly& assembly, const model::AddedModule& added,
                                     int first_mark) {
  // What meets what, all at once where a loop is closed.
  std::vector<std::string> put;
  int mark = first_mark;
  for (const model::Mating& mating : added.matings) {
    put.push_back(fmt::format("{} (no. {}) on {} (no. {})",
                              assembly.EndOf(added.module, mating.own_connector), mark + 1,
                              assembly.EndOf(mating.standing, mating.standing_connector), mark));
    mark += 2;
  }
  std::vector<std::string> lines = {
      fmt::format("Put {}{}.", ListWords(put), put.size() > 1 ? ", all at once" : "")};
  if (added.sideways) {
    lines.push_back(fmt::format("Faces are on either side of {}: slide it in from the side ({}).",
                                assembly.NameOf(added.module), DirectionWords(added.from_R)));
  }
  for (const model::Mating& mating : added.matings) {
    // Which way the module lies follows from the first mating; the others fit or do not.
    std::vector<std::string> way = WayLines(assembly, added.module, mating);
    if (!mating.loop.empty()) way.resize(1);
    lines.insert(lines.end(), way.begin(), way.end());
    const model::Docking& d = assembly.robot.dockings[mating.docking];
    const model::ConnectionOption& option = assembly.model.OptionOf(d);
    if (!option.states.empty()) {
      std::string line = "To join them, set " + StateWords(assembly, d, option.states);
      for (const model::StateSetting& other : option.other_states) {
        line += ", or " + StateWords(assembly, d, other);
      }
      lines.push_back(line + ".");
    }
    if (!mating.loop.empty()) {
      std::vector<std::string> names;
      for (const int module : mating.loop) names.push_back(assembly.NameOf(module));
      lines.push_back(fmt::format(
          "{} on {} closes a loop: {}.", assembly.EndOf(added.module, mating.own_connector),
          assembly.EndOf(mating.standing, mating.standing_connector), fmt::join(names, " – ")));
    }
  }
  return lines;
}

}  // namespace morphbus::logger
