#include "logger/show/build_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "compiler/base/text.h"
#include "logger/show/build_pictures.h"

namespace morphbus::logger {
namespace {

using Eigen::Vector3d;
using LinkPoses = std::vector<std::vector<model::Pose>>;

/// Names that are listed where there may be many, and ends of a robot whose places are told.
constexpr size_t kMostListed = 30;
constexpr size_t kMostEnds = 12;

/// What a pose is called.
const char* NameOf(solver::CheckPose::Kind kind) {
  switch (kind) {
    case solver::CheckPose::Kind::kStart:
      return "start";
    case solver::CheckPose::Kind::kZero:
      return "all at 0";
    case solver::CheckPose::Kind::kBent:
      return "bent";
  }
  return "";
}

/// Builds the sheet part by part.
class Builder {
 public:
  Builder(const Assembly& assembly, const solver::CheckPoses& poses)
      : assembly_(assembly), poses_(poses) {}

  Sheet Build() {
    Sheet sheet;
    sheet.title = fmt::format("{}: how it is put together", assembly_.robot.name);
    sheet.parts.push_back(Needed());
    sheet.parts.push_back(Steps());
    if (poses_.num_loops > 0) sheet.parts.push_back(Loops());
    sheet.parts.push_back(Check());
    return sheet;
  }

 private:
  [[nodiscard]] int NumModules() const { return static_cast<int>(assembly_.robot.modules.size()); }

  /// The names of connectors of a module that are used, or those that stay free.
  [[nodiscard]] std::string Connectors(int module, bool used) const {
    std::vector<std::string> names;
    for (int c = 0; c < std::ssize(assembly_.TypeOf(module).connectors); ++c) {
      if (used_.contains({module, c}) == used) {
        names.push_back(assembly_.TypeOf(module).connectors[c].name);
      }
    }
    return fmt::format("{}", fmt::join(names, ", "));
  }

  /// What the type's joints do: "joint_1 from -90° to 90°".
  static std::string JointRanges(const model::ModuleType& type) {
    std::vector<std::string> ranges;
    for (const model::Joint& joint : type.joints) {
      if (joint.type == model::JointType::kFixed) continue;
      ranges.push_back(std::isfinite(joint.lower) && std::isfinite(joint.upper)
                           ? fmt::format("{} from {} to {}", joint.name,
                                         ValueWords(joint, joint.lower),
                                         ValueWords(joint, joint.upper))
                           : joint.name + " without limits");
    }
    return ListWords(ranges);
  }

  SheetBlock TypeBlock(int type, const std::vector<std::string>& names) const {
    const model::ModuleType& of = assembly_.model.module_types[type];
    SheetBlock block;
    block.heading = fmt::format("{} × {}", names.size(), of.name);
    block.picture = TypePicture(assembly_.model, type);
    block.lines.push_back(
        fmt::format("Write on each its name: {}.", NameFirst(names, kMostListed)));
    std::vector<std::string> connectors;
    for (const model::Connector& c : of.connectors) connectors.push_back(c.name);
    block.lines.push_back(
        connectors.size() == 1
            ? fmt::format("Its connector is {}: mark it as the picture has it.", connectors[0])
            : fmt::format("Its connectors are {}: mark them as the picture has them.",
                          ListWords(connectors)));
    if (std::ranges::any_of(of.connectors, [](const auto& c) { return !c.subpoints.empty(); })) {
      block.lines.push_back("The small names beside a connector are those of its points.");
    }
    if (const std::string ranges = JointRanges(of); !ranges.empty()) {
      block.lines.push_back(fmt::format("Its joints go {}.", ranges));
    }
    return block;
  }

  /// Modules by type, connections by kind, and which connectors are used.
  SheetPart Needed() {
    SheetPart part;
    part.heading = "What is needed";
    std::map<int, std::vector<std::string>> of_type;
    size_t connectors = 0;
    for (int m = 0; m < NumModules(); ++m) {
      of_type[assembly_.robot.modules[m].type].push_back(assembly_.NameOf(m));
      connectors += assembly_.TypeOf(m).connectors.size();
    }
    for (const model::Docking& d : assembly_.robot.dockings) {
      used_.insert({d.module_a, d.connector_a});
      used_.insert({d.module_b, d.connector_b});
    }
    part.paragraphs.push_back(
        fmt::format("{} and {}; {} of {} used, {} free.", Counted(NumModules(), "module"),
                    Counted(std::ssize(assembly_.robot.dockings), "connection"), used_.size(),
                    Counted(static_cast<int>(connectors), "connector"), connectors - used_.size()));
    for (const auto& [type, names] : of_type) part.blocks.push_back(TypeBlock(type, names));
    // A line a kind of connection, in the order of its numbers.
    std::map<std::pair<int, int>, int> kinds;
    for (const model::Docking& d : assembly_.robot.dockings) ++kinds[{d.connection_type, d.option}];
    SheetTable table = {{"connection", "#number", "joins", "#times"}, {}};
    for (const auto& [kind, times] : kinds) {
      const model::ConnectionType& type = assembly_.model.connection_types[kind.first];
      const model::ConnectionOption& option = type.options[kind.second];
      const model::ModuleType& a = assembly_.model.module_types[type.type_a];
      const model::ModuleType& b = assembly_.model.module_types[type.type_b];
      table.rows.push_back(
          {type.name, std::to_string(option.number),
           fmt::format("{} of {} and {} of {}", a.connectors[option.connector_a].name, a.name,
                       b.connectors[option.connector_b].name, b.name),
           std::to_string(times)});
    }
    if (!table.rows.empty()) part.blocks.push_back({"Connections", {}, {}, std::move(table)});
    table = {{"module", "type", "connectors that are used", "connectors that stay free"}, {}};
    for (int m = 0; m < NumModules(); ++m) {
      table.rows.push_back({assembly_.NameOf(m), assembly_.TypeOf(m).name, Connectors(m, true),
                            Connectors(m, false)});
    }
    part.blocks.push_back({"Connectors", {}, {}, std::move(table)});
    return part;
  }

  SheetPart Steps() const {
    SheetPart part;
    part.heading = "Steps";
    part.paragraphs = {
        "North, up and east are directions of the robot, which the arrows in each picture show. "
        "What "
        "is put on is coloured and drawn off from where it goes; what stands already is pale. The "
        "two connectors that mate have numbers and a dashed line between them; a ring stands for "
        "one "
        "that faces away from the viewer or is hidden.",
        "Set joints before a module is put on, and hold them there until the robot stands."};
    const auto steps = StepsOf(assembly_.plan);
    for (size_t s = 0; s < steps.size(); ++s) {
      SheetBlock block;
      std::vector<std::string> names;
      int mark = 1;
      for (const model::AddedModule& added : steps[s]) {
        names.push_back(fmt::format("{} ({})", assembly_.NameOf(added.module),
                                    assembly_.TypeOf(added.module).name));
        for (std::string& line : Lines(added, mark)) block.lines.push_back(std::move(line));
        mark += 2 * static_cast<int>(added.matings.size());
      }
      block.heading =
          fmt::format("Step {} of {}: {}", s + 1, steps.size(), NameFirst(names, kMostListed));
      block.picture = StepPicture(assembly_, steps[s], 1);
      part.blocks.push_back(std::move(block));
    }
    return part;
  }

  /// What is done with one module.
  [[nodiscard]] std::vector<std::string> Lines(const model::AddedModule& added, int mark) const {
    std::vector<std::string> lines =
        JointLines(assembly_, added.module, assembly_.robot.modules[added.module].start);
    if (added.matings.empty()) {
      lines.push_back(LyingLine(assembly_, added.module));
      return lines;
    }
    for (std::string& line : MatingLines(assembly_, added, mark)) lines.push_back(std::move(line));
    return lines;
  }

  /// What closes each loop.
  SheetPart Loops() const {
    SheetPart part;
    part.heading = "Loops";
    part.paragraphs.push_back(
        fmt::format("These connections close loops. At the joints' start values they fit to {:.3f} "
                    "mm and {:.3f}°"
                    ": if one does not, a module of its loop is put on the wrong way round, or a "
                    "joint of it is "
                    "not at its angle.",
                    poses_.closure_m * 1000.0, poses_.closure_rad * 180.0 / std::numbers::pi));
    SheetTable table = {{"#step", "what closes", "loop"}, {}};
    const auto steps = StepsOf(assembly_.plan);
    for (size_t s = 0; s < steps.size(); ++s) {
      for (const model::AddedModule& added : steps[s]) {
        for (const model::Mating& mating : added.matings) {
          if (mating.loop.empty()) continue;
          std::vector<std::string> names;
          for (const int module : mating.loop) names.push_back(assembly_.NameOf(module));
          table.rows.push_back(
              {std::to_string(s + 1),
               fmt::format("{} on {}", assembly_.EndOf(added.module, mating.own_connector),
                           assembly_.EndOf(mating.standing, mating.standing_connector)),
               fmt::format("{}", fmt::join(names, " – "))});
        }
      }
    }
    part.blocks.push_back({"", {}, {}, std::move(table)});
    return part;
  }

  /// The middle of a module: the mean of those of its links' corners (m, in R).
  [[nodiscard]] Vector3d MiddleOf(int module, const LinkPoses& X_RL) const {
    const model::ModuleType& type = assembly_.TypeOf(module);
    Vector3d sum = Vector3d::Zero();
    int corners = 0;
    for (size_t l = 0; l < type.links.size(); ++l) {
      for (const Vector3d& p : type.links[l].hull) {
        sum += X_RL[module][l] * p;
        ++corners;
      }
    }
    return corners > 0 ? Vector3d(sum / corners) : X_RL[module][0].translation();
  }

  /// The modules on which no other one was put, the last ones first: where mistakes add up.
  [[nodiscard]] std::vector<int> Ends() const {
    std::set<int> bears;
    for (const model::AddedModule& added : assembly_.plan.modules) {
      for (const model::Mating& mating : added.matings) bears.insert(mating.standing);
    }
    std::vector<int> ends;
    for (const model::AddedModule& added : assembly_.plan.modules) {
      if (!bears.contains(added.module) && !added.matings.empty()) ends.push_back(added.module);
    }
    std::ranges::reverse(ends);
    if (ends.size() > kMostEnds) ends.resize(kMostEnds);
    std::ranges::sort(ends);
    return ends;
  }

  SheetBlock PoseBlock(const solver::CheckPose& pose, size_t number) const {
    SheetBlock block;
    block.heading = fmt::format("Pose {}: {}", number, NameOf(pose.kind));
    std::string words = "the robot with its joints as in the column \"";
    block.picture =
        PosePicture(assembly_, pose.X_RL, words + NameOf(pose.kind) + "\" of the table of joints");
    if (pose.kind == solver::CheckPose::Kind::kStart) {
      block.lines.push_back("This is the robot as it was put together.");
    } else if (pose.kind == solver::CheckPose::Kind::kZero) {
      block.lines.push_back("Set all joints to 0.");
    } else {
      block.lines.push_back("Set the joints as the last table says, and compare with the picture.");
    }
    AddTelling(pose, block);
    // Where the ends of the robot must be, to be measured with a ruler.
    const int root = assembly_.robot.root_module;
    SheetTable table = {{"middle of", "#north (mm)", "#up (mm)", "#east (mm)", "#distance (mm)"},
                        {}};
    for (const int module : Ends()) {
      const Vector3d p = 1000.0 * (MiddleOf(module, pose.X_RL) - MiddleOf(root, pose.X_RL));
      const auto text = [](double v) { return fmt::format("{:.0f}", v + 0.0); };
      table.rows.push_back({assembly_.NameOf(module), text(Plain(p.x())), text(Plain(p.y())),
                            text(Plain(p.z())), text(p.norm())});
    }
    if (!table.rows.empty()) {
      block.lines.push_back(
          fmt::format("The table has where ends of the robot are then, from the middle of {}.",
                      assembly_.NameOf(root)));
      block.table = std::move(table);
    }
    return block;
  }

  /// Without the sign of what rounds to 0.
  static double Plain(double mm) { return std::abs(mm) < 0.5 ? 0.0 : mm; }

  /// Which mistakes the pose shows.
  void AddTelling(const solver::CheckPose& pose, SheetBlock& block) const {
    if (pose.num_other_ways == 0) return;
    // First how many of the other ways would show in this pose, and how clearly.
    const int alike = static_cast<int>(pose.alike.size());
    const std::string others = fmt::format("There {} {} in which these connectors mate as well",
                                           pose.num_other_ways == 1 ? "is" : "are",
                                           Counted(pose.num_other_ways, "other way"));
    const double shift_mm = std::floor(pose.least_shift_m * 1000.0);
    if (alike == pose.num_other_ways) {
      block.lines.push_back(others + ", of which none shows here.");
    } else {
      block.lines.push_back(fmt::format(
          "{}; {} would show here, something would be {:.0f} mm or more from its place.", others,
          alike == 0 ? "each" : std::to_string(pose.num_other_ways - alike), shift_mm));
    }
    if (alike == 0) return;
    // Then those that would not, by the module that would be put on wrongly.
    std::map<int, std::vector<std::string>> by_module;
    for (const solver::AlikeWay& way : pose.alike) {
      by_module[way.added].push_back(std::to_string(way.number));
    }
    std::vector<std::string> texts;
    for (const auto& [added, numbers] : by_module) {
      texts.push_back(fmt::format("{} ({})", assembly_.NameOf(assembly_.plan.modules[added].module),
                                  fmt::join(numbers, ", ")));
    }
    block.lines.push_back(
        fmt::format("Not seen here, so look at their connectors as in the steps: {}.",
                    NameFirst(texts, kMostListed)));
  }

  SheetPart Check() const {
    SheetPart part;
    part.heading = "Check it";
    part.paragraphs.push_back(
        "Hold the robot up, or lay it on its side, and set its joints to each of these poses.");
    if (poses_.num_ways_in_loops > 0) {
      part.paragraphs.push_back(
          fmt::format("With any of {} of the connections in loops a loop would not have closed.",
                      Counted(poses_.num_ways_in_loops, "other way")));
    }
    for (const std::string& text : poses_.left_out) part.paragraphs.push_back(text);
    for (size_t i = 0; i < poses_.poses.size(); ++i) {
      part.blocks.push_back(PoseBlock(poses_.poses[i], i + 1));
    }
    SheetTable table = {{"joint"}, {}};
    for (const solver::CheckPose& pose : poses_.poses) {
      table.columns.push_back(std::string("#") + NameOf(pose.kind));
    }
    for (int m = 0; m < NumModules(); ++m) {
      const model::ModuleType& type = assembly_.TypeOf(m);
      for (size_t j = 0; j < type.joints.size(); ++j) {
        if (type.joints[j].type == model::JointType::kFixed) continue;
        std::vector<std::string> row = {assembly_.NameOf(m) + "." + type.joints[j].name};
        for (const solver::CheckPose& pose : poses_.poses) {
          row.push_back(ValueWords(type.joints[j], pose.q[m][j]));
        }
        table.rows.push_back(std::move(row));
      }
    }
    if (!table.rows.empty()) part.blocks.push_back({"Joints", {}, {}, std::move(table)});
    return part;
  }

  const Assembly& assembly_;
  const solver::CheckPoses& poses_;
  /// Modules and connectors that a docking uses.
  std::set<std::pair<int, int>> used_;
};

}  // namespace

std::vector<std::span<const model::AddedModule>> StepsOf(const model::AssemblyPlan& plan) {
  const size_t modules = plan.modules.size();
  const size_t in_one = (modules + kMostBuildSteps - 1) / kMostBuildSteps;
  std::vector<std::span<const model::AddedModule>> steps;
  for (size_t at = 0; at < modules; at += in_one) {
    steps.push_back(std::span(plan.modules).subspan(at, std::min(in_one, modules - at)));
  }
  return steps;
}

Sheet BuildSheet(const Assembly& assembly, const solver::CheckPoses& poses) {
  return Builder(assembly, poses).Build();
}

}  // namespace morphbus::logger
