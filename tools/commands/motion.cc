#include "tools/commands/motion.h"

#include <fmt/format.h>

#include <cmath>

#include "compiler/base/text.h"
#include "compiler/solver/motion_check.h"
#include "tools/base/print.h"

namespace morphbus::tools {
namespace {

using solver::LinkMeeting;
using solver::MeetingPosture;
using solver::MeetingsOfDockings;
using solver::MotionReport;

/// Names a robot's parts for the messages of --motion.
class MotionText {
 public:
  MotionText(const model::Model& model, const model::Robot& robot) : model_(model), robot_(robot) {}

  /// "m1" of member a of a docking, "m2" of member b.
  [[nodiscard]] const std::string& ModuleOf(int docking, bool of_a) const {
    return robot_.modules[Module(docking, of_a)].name;
  }
  [[nodiscard]] const std::string& LinkOf(int docking, bool of_a, int link) const {
    return model_.TypeOf(robot_, Module(docking, of_a)).links[link].name;
  }

  /// "m1 and m2".
  [[nodiscard]] std::string Neighbours(int docking) const {
    return fmt::format("{} and {}", ModuleOf(docking, true), ModuleOf(docking, false));
  }
  /// "m1.left and m2.right".
  [[nodiscard]] std::string Links(int docking, const LinkMeeting& meeting) const {
    return fmt::format("{}.{} and {}.{}", ModuleOf(docking, true),
                       LinkOf(docking, true, meeting.link_a), ModuleOf(docking, false),
                       LinkOf(docking, false, meeting.link_b));
  }

  /// "m1.joint_1=45deg m2.lift=0.1": what `fk --set` takes.
  [[nodiscard]] std::string Posture(int docking, const LinkMeeting& meeting,
                                    const MeetingPosture& posture) const {
    std::string text;
    for (size_t i = 0; i < posture.values.size(); ++i) {
      const model::Joint& joint = JointOf(docking, meeting.joints[i]);
      const bool slides = joint.type == model::JointType::kPrismatic;
      // A ten-thousandth of a degree, and a micrometre.
      const double value = slides ? std::round(posture.values[i] * 1e6) / 1e6
                                  : std::round(posture.values[i] / EIGEN_PI * 180.0 * 1e4) / 1e4;
      text += fmt::format("{}{}={}{}", i == 0 ? "" : " ", JointText(docking, meeting.joints[i]),
                          model::NumberText(value), slides ? "" : "deg");
    }
    return text;
  }
  /// The same with full precision, in radians and metres.
  [[nodiscard]] Json PostureJson(int docking, const LinkMeeting& meeting,
                                 const MeetingPosture& posture) const {
    Json joints = Json::object();
    for (size_t i = 0; i < posture.values.size(); ++i) {
      joints[JointText(docking, meeting.joints[i])] = posture.values[i];
    }
    return {{"depth_m", posture.depth_m}, {"joints", joints}};
  }

 private:
  [[nodiscard]] int Module(int docking, bool of_a) const {
    return of_a ? robot_.dockings[docking].module_a : robot_.dockings[docking].module_b;
  }
  [[nodiscard]] const model::Joint& JointOf(int docking, const solver::PairJoint& at) const {
    return model_.TypeOf(robot_, Module(docking, at.of_a)).joints[at.joint];
  }
  [[nodiscard]] std::string JointText(int docking, const solver::PairJoint& at) const {
    return ModuleOf(docking, at.of_a) + "." + JointOf(docking, at).name;
  }

  const model::Model& model_;
  const model::Robot& robot_;
};

/// A depth to the nanometre, as `check` has it.
std::string DepthText(double depth_m) { return model::NumberText(std::round(depth_m * 1e9) / 1e9); }

/// So many meetings are listed in JSON, some 50 MB of it: a bound on hostile input.
constexpr size_t kMostMeetings = 100000;

/// One of "robots". Every docking has its own entries, so that scripts need not know of kinds; each
/// takes one from `room`, and where that is 0 the rest is left out.
Json MotionJson(const MotionText& text, const model::Robot& robot, const MotionReport& report,
                size_t* room) {
  Json meetings = Json::array();
  bool complete = true;
  // Dockings that are alike were tried once, by the first of them, and meet in the same postures.
  for (const MeetingsOfDockings& alike : report.meetings) {
    for (const int d : alike.dockings) {
      for (const LinkMeeting& meeting : alike.links) {
        complete = *room > 0;
        if (!complete) break;
        --*room;
        meetings.push_back(
            {{"modules", {text.ModuleOf(d, true), text.ModuleOf(d, false)}},
             {"links",
              {text.LinkOf(d, true, meeting.link_a), text.LinkOf(d, false, meeting.link_b)}},
             {"postures", meeting.num_postures},
             {"deepest", text.PostureJson(d, meeting, meeting.deepest)},
             {"first", text.PostureJson(d, meeting, meeting.first)}});
      }
    }
  }
  Json json = {{"name", robot.name},          {"connections", robot.dockings.size()},
               {"kinds", report.num_kinds},   {"link_pairs", report.num_link_pairs},
               {"postures", report.postures}, {"loops", report.num_loops},
               {"meetings", meetings}};
  // The key is there only where something was left out.
  if (!complete) json["meetings_complete"] = false;
  return json;
}

/// Two links that meet, in which postures, and between which other modules it is so too.
void PrintMeeting(const MotionText& text, const MeetingsOfDockings& alike,
                  const LinkMeeting& meeting, int postures) {
  // What is told is told of the first docking; the others have the same links under other names.
  const int d = alike.dockings.front();
  Print("  {} in {} of {}, up to {} m deep\n", text.Links(d, meeting), meeting.num_postures,
        Counted(postures, "posture"), DepthText(meeting.deepest.depth_m));
  Print("    deepest: {}\n", text.Posture(d, meeting, meeting.deepest));
  Print("    first:   {} ({} m)\n", text.Posture(d, meeting, meeting.first),
        DepthText(meeting.first.depth_m));
  // Neighbours docked in the same way meet in the same postures, and are only named.
  std::vector<std::string> others;
  for (size_t i = 1; i < alike.dockings.size(); ++i) {
    others.push_back(text.Neighbours(alike.dockings[i]));
  }
  if (!others.empty()) Print("    alike:   {}\n", NameSome(others));
}

/// What was tried on a robot, and what meets.
void PrintMotion(const MotionText& text, const model::Robot& robot, const MotionReport& report,
                 uint64_t seed) {
  if (report.num_link_pairs == 0) {
    Print(
        "motion of {}: nothing to compare: no two links of neighbours have hulls and a "
        "joint between them\n",
        robot.name);
    return;
  }
  Print("motion of {}: {}links of neighbours meet; tried {} of each of {} ({}, seed {})\n",
        robot.name, report.meetings.empty() ? "no " : "", Counted(report.postures, "posture"),
        Counted(robot.dockings.size(), "connection"),
        Counted(report.num_link_pairs, "pair of links", "pairs of links"), seed);
  // A loop takes freedom away: what meets in a posture may never be reached.
  if (report.num_loops > 0) {
    Print("  closed loops do not allow each of these postures: all were tried as if they did\n");
  }
  if (report.num_locked > 0) {
    Print("  {} that loops lock stayed at the start\n", Counted(report.num_locked, "joint"));
  }
  // Of each robot kMostNamed kinds of meetings are printed, in the order of the report.
  size_t printed = 0;
  size_t left_out = 0;
  for (const MeetingsOfDockings& alike : report.meetings) {
    for (const LinkMeeting& meeting : alike.links) {
      if (printed < kMostNamed) {
        PrintMeeting(text, alike, meeting, report.postures);
        ++printed;
      } else {
        ++left_out;
      }
    }
  }
  if (left_out > 0) Print("  and {} more kinds of meetings, which --json lists\n", left_out);
}

}  // namespace

void AddMotionOptions(Subcommand* sub, MotionChoice* choice) {
  sub->Flag("--motion", &choice->wanted,
            "Also look for links of neighbouring modules that meet as their joints move");
  // Not Subcommand::Robot: its default is the only robot, here it is all of them.
  const Option robot =
      sub->Add("--robot", &choice->robot, "With --motion: only this robot (default: all)")
          .TypeName("ROBOT");
  const Option postures =
      sub->Add("--postures", &choice->postures, "Postures of each connection (default 1000)")
          .Range(1, 1000000);
  const Option seed = sub->Seed(&choice->seed, "Of the postures drawn at random (default 1)");
  // Kept so that IsUsable can tell which of them were given without --motion.
  choice->others = {{"--robot", robot}, {"--postures", postures}, {"--seed", seed}};
}

bool IsUsable(const MotionChoice& choice) {
  for (const auto& [name, option] : choice.others) {
    // An option without --motion would do nothing, and its user would not know.
    if (choice.wanted || !option.given()) continue;
    Unusable(name + " goes with --motion");
    return false;
  }
  return true;
}

bool IsUsable(const MotionChoice& choice, const model::Model& model) {
  if (!choice.wanted) return true;
  if (!choice.robot.empty()) return PickRobot(model, choice.robot) != nullptr;
  if (!model.robots.empty()) return true;
  Unusable("--motion: the model has no robot, and so no neighbours that could meet");
  return false;
}

int CheckMotions(const MotionChoice& choice, const model::Model& model, Json* json) {
  std::vector<const model::Robot*> chosen;
  // That a named robot exists was checked before (IsUsable).
  for (const model::Robot& robot : model.robots) {
    if (choice.robot.empty() || robot.name == choice.robot) chosen.push_back(&robot);
  }
  Json robots = Json::array();
  size_t room = kMostMeetings;
  // In the solver's own measure (MotionReport::work), which depends on the model alone and not on
  // the machine.
  double work = 0.0;
  bool meet = false;
  for (size_t i = 0; i < chosen.size(); ++i) {
    const model::Robot& robot = *chosen[i];
    solver::MotionOptions options;
    options.postures = choice.postures;
    options.seed = choice.seed;
    // The bound holds for all robots together; what one leaves goes to those behind it.
    options.max_work = (solver::kMaxMotionWork - work) / static_cast<double>(chosen.size() - i);
    const MotionReport report = solver::CheckMotion(model, robot, options);
    work += report.work;
    // The bound on work ends with an answer that holds for fewer postures, or with none.
    if (report.postures == 0) {
      return Unusable(fmt::format(
          "--motion: the link hulls of robot {} are too many or too detailed to "
          "compare in a single posture: give them fewer points, or choose one robot with "
          "--robot",
          robot.name));
    }
    if (report.postures < choice.postures) {
      Warn(
          fmt::format("--motion: robot {}: only {} of {} were tried, as many as the bound on work "
                      "allows; hulls with fewer points, or one robot with --robot, allow more",
                      robot.name, report.postures, Counted(choice.postures, "posture")));
    }
    // A single meeting of any robot makes the answer no.
    meet = meet || !report.meetings.empty();
    const MotionText text(model, robot);
    if (json != nullptr) {
      robots.push_back(MotionJson(text, robot, report, &room));
    } else {
      PrintMotion(text, robot, report, choice.seed);
    }
  }
  if (json != nullptr) *json = {{"seed", choice.seed}, {"meet", meet}, {"robots", robots}};
  return meet ? kNo : kDone;
}

}  // namespace morphbus::tools
