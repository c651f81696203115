#include "logger/show/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bridge/description/run_model.h"
#include "logger/compare/source_trace.h"
#include "logger/show/command_list.h"
#include "logger/show/report_page.h"
#include "logger/show/report_robots.h"

namespace morphbus::logger {
namespace {

/// So many paths of feet are shown at most: more would not be read.
constexpr size_t kMaxFeet = 12;

/// A value (SI) in the unit of the tables, without its name.
std::string Number(double value, const std::string& unit) {
  return EscapeHtml(NumberText(value, unit));
}

/// The unit's name that goes with Number().
const char* UnitName(const std::string& unit) { return DisplayUnitOf(unit).name; }

/// A module's name in a table; an en dash if only the other run has a module there.
std::string NameOrDash(const std::string& module) {
  return module.empty() ? "–" : EscapeHtml(module);
}

/// Both modules' names, or the one name that both have.
std::string NamesOfBoth(const std::string& a, const std::string& b) {
  return a == b ? NameOrDash(a) : NameOrDash(a) + " / " + NameOrDash(b);
}

/// A name as HTML that browsers may break where a word begins in it: "Front|Left|Foot".
std::string BreakableName(const std::string& name) {
  std::string html;
  const std::string text = EscapeHtml(name);
  for (size_t i = 0; i < text.size(); ++i) {
    const bool begins =
        i > 0 && text[i] >= 'A' && text[i] <= 'Z' && text[i - 1] >= 'a' && text[i - 1] <= 'z';
    if (begins) html += "<wbr>";
    html += text[i];
  }
  return html;
}

/// Coordinate `y` of the position (m) of a point of a track's frame, given in that frame, over
/// coordinate `x`, or over sim time (s) where x is -1. Coordinates are 0 north, 1 up, 2 east of R0
/// or R; `y_sign` -1 turns the axis of `y` round.
PlotPoints Path(const PoseTrack& track, int x, int y, double y_sign = 1.0,
                const Eigen::Vector3d& point = Eigen::Vector3d::Zero()) {
  PlotPoints points;
  for (size_t i = 0; i < track.value.size(); ++i) {
    const Eigen::Vector3d p = track.value[i] * point;
    points.emplace_back(x < 0 ? Seconds(track.time_us[i]) : p[x], y_sign * p[y]);
  }
  return points;
}

/// The lines of both runs, named and styled.
std::vector<PlotLine> BothRuns(PlotPoints a, PlotPoints b) {
  return {{"A", "line-a", std::move(a)}, {"B", "line-b", std::move(b)}};
}

/// The page, section by section.
class ComparisonPage : private ReportPage {
 public:
  ComparisonPage(const RunLog& a, const RunLog& b, const Comparison& comparison)
      : a_(a), b_(b), comparison_(comparison) {
    // What people did to the robots, and where the first divergence is.
    marks_ = CommandMarks(comparison);
    if (!comparison.first) return;
    marks_.push_back(
        {Seconds(comparison.items[*comparison.first].first_over_us), "first divergence"});
  }

  /// The page from top to bottom. Without models there are no poses to plot.
  std::string Build() {
    Begin(fmt::format("{}: {} and {}", VerdictName(comparison_.verdict), a_.facts.path,
                      b_.facts.path),
          "Comparison of two runs");
    // What needs no poses comes first, so that it is there for any two logs.
    Banner();
    Cards();
    Remarks();
    html_ += CommandsHtml(comparison_);
    if (a_.robot != nullptr && b_.robot != nullptr) {
      rest_a_ = a_.described->X_RL_start;
      rest_b_ = b_.described->X_RL_start;
      simulated_a_ = std::make_unique<SimulatedPoses>(a_);
      simulated_b_ = std::make_unique<SimulatedPoses>(b_);
      html_ += RobotsHtml(a_, b_, comparison_);
      RoleTable();
      ItemTable();
      Travel();
      Feet();
      DifferencePlots();
      Joints();
    }
    return End();
  }

 private:
  /// Verdict, first divergence and largest differences.
  void Banner() {
    // The verdict's word is also the class by which the style sheet colors the banner.
    const char* verdict = VerdictName(comparison_.verdict);
    html_ += fmt::format(
        "<header class='banner {0}'><div class='verdict'>{0}</div><div><p class='reason'>{1}</p>",
        verdict, EscapeHtml(comparison_.reason));
    // Where two runs part is what a reader looks for first: who, when, and by how much.
    if (comparison_.first) {
      const Item& item = comparison_.items[*comparison_.first];
      html_ += fmt::format(
          "<p>First divergence at <b>{:.3f} s</b>: <b>{}</b> of <b>{}</b>{} ({} in A, {} in B), "
          "{} {} against a tolerance of {} {}. {}</p>",
          Seconds(item.first_over_us), QuantityName(item.quantity), EscapeHtml(RoleName(item.role)),
          item.label.empty() ? "" : " <b>" + EscapeHtml(item.label) + "</b>",
          item.module_a.empty() ? "nobody" : EscapeHtml(item.module_a),
          item.module_b.empty() ? "nobody" : EscapeHtml(item.module_b),
          Number(item.first_over, item.unit), UnitName(item.unit),
          Number(item.tolerance, item.unit), UnitName(item.unit), EscapeHtml(item.detail));
    }
    Sender();
    html_ += fmt::format(
        "<p class='figures'>largest difference in position <b>{}</b>, in rotation "
        "<b>{}</b>, over {:.3f} s of sim time</p></div></header>",
        EscapeHtml(ValueText(comparison_.max_position_m, "m")),
        EscapeHtml(ValueText(comparison_.max_rotation_rad, "rad")),
        Seconds(comparison_.compared_until_us));
  }

  /// The message from which the divergence comes, and who sent it.
  void Sender() {
    if (!comparison_.trace) return;
    const Trace& trace = *comparison_.trace;
    for (const auto& [message, which] : {std::pair(&trace.a, "A"), std::pair(&trace.b, "B")}) {
      if (message->tick < 0) continue;
      html_ += fmt::format(
          "<p><span class='chip {0}'>{0}</span> {1} of tick {2}{3}</p>", which,
          EscapeHtml(message->channel), message->tick,
          message->line ? ", sent by <b>" + EscapeHtml(SourceLineText(*message->line)) + "</b>"
                        : "");
    }
  }

  void Cards() {
    html_ += "<div class='cards'>";
    Card(a_, "A");
    Card(b_, "B");
    html_ += "</div>";
  }

  /// What a log is of.
  void Card(const RunLog& log, const char* which) {
    html_ += fmt::format("<section class='card'><h2><span class='chip {0}'>{0}</span> {1}</h2><dl>",
                         which, EscapeHtml(log.facts.path));
    RunFacts(log);
    MessageFact(log.facts);
    Fact("end", EndStateName(log.facts.end_state));
    Fact("hash", log.facts.run_hash);
    Fact("world", log.facts.world_hash);
    BuildFacts(log.facts);
    html_ += "</dl></section>";
  }

  /// Damage, losses, and what could not be compared.
  void Remarks() {
    std::vector<std::string> notes = comparison_.notes;
    if (const std::string settings = SettingsText(comparison_.settings); !settings.empty()) {
      notes.insert(notes.begin(), settings);
    }
    for (const std::string& what : comparison_.not_compared) {
      notes.push_back("not compared: " + what);
    }
    Notes(notes);
  }

  /// One row a role, one column a quantity: the largest difference of all its joints and links.
  void RoleTable() {
    const std::map<std::string, RoleFigures> roles = FiguresByRole(comparison_);
    std::map<Quantity, std::string> columns;  // Value: unit.
    for (const Item& item : comparison_.items) columns.emplace(item.quantity, item.unit);
    // The head of the table, then a row each with an en dash where a role lacks the quantity.
    if (roles.empty()) return;
    std::vector<std::string> head = {"role", "A / B"};
    for (const auto& [quantity, unit] : columns) {
      head.push_back(fmt::format("#{}|{}", QuantityName(quantity), UnitName(unit)));
    }
    html_ += "<section><h2>Largest differences by role</h2>" + TableHead(head, "wide");
    // Rows are in order of role, values beyond their tolerance in another color.
    for (const auto& [role, figures] : roles) {
      std::string names;
      for (const auto& [a, b] : figures.modules) {
        names += (names.empty() ? "" : ", ") + NamesOfBoth(a, b);
      }
      html_ +=
          fmt::format("<tr><td>{}</td><td class='m'>{}</td>", BreakableName(RoleName(role)), names);
      for (const auto& [quantity, unit] : columns) {
        const auto found = figures.worst.find(quantity);
        if (found == figures.worst.end()) {
          html_ += "<td class='n dim'>–</td>";
          continue;
        }
        const Item& item = found->second;
        html_ += fmt::format("<td class='n{}'>{}</td>", item.first_over_us >= 0 ? " over" : "",
                             Number(item.max, item.unit));
      }
      html_ += "</tr>";
    }
    html_ += kTableEnd;
    html_ += "</section>";
  }

  /// Every item of the comparison, folded away.
  void ItemTable() {
    // The table is long, so it stays closed until a reader opens it.
    if (comparison_.items.empty()) return;
    html_ += fmt::format("<details><summary>All {} compared quantities</summary>",
                         comparison_.items.size());
    html_ += TableHead({"role", "joint or link", "A / B", "quantity", "#largest", "#at", "#RMS",
                        "#tolerance", "#beyond from", "#instants"});
    for (const Item& item : comparison_.items) {
      html_ += fmt::format(
          "<tr{}><td>{}</td><td>{}</td><td class='m'>{} / {}</td><td>{}</td><td class='n'>{} "
          "{}</td>"
          "<td class='n'>{:.3f} s</td><td class='n'>{}</td><td class='n'>{}</td><td "
          "class='n'>{}</td>"
          "<td class='n'>{}</td></tr>",
          item.first_over_us >= 0 ? " class='over'" : "", EscapeHtml(RoleName(item.role)),
          item.label.empty() ? "root link" : EscapeHtml(item.label), NameOrDash(item.module_a),
          NameOrDash(item.module_b), QuantityName(item.quantity), Number(item.max, item.unit),
          UnitName(item.unit), Seconds(item.max_time_us), Number(item.rms, item.unit),
          Number(item.tolerance, item.unit),
          item.first_over_us < 0 ? "" : fmt::format("{:.3f} s", Seconds(item.first_over_us)),
          item.samples);
    }
    html_ += kTableEnd;
    html_ += "</details>";
  }

  /// The way of the root body in the simulated world, relative to where it began (R0): north and
  /// east, and height.
  void Travel() {
    if (!simulated_a_->available() && !simulated_b_->available()) return;
    const PoseTrack a = simulated_a_->RootTrack();
    const PoseTrack b = simulated_b_->RootTrack();
    html_ += "<section><h2>Where the robot went</h2><div class='plots'>";
    // Seen from above with north to the right, west is up: east up would be the view from below.
    Figure(BothRuns(Path(a, 0, 2, -1.0), Path(b, 0, 2, -1.0)),
           {"root body from above", "north (m)", "west (m)", 640, 300, true, 0.02, {}});
    Figure(BothRuns(Path(a, -1, 1), Path(b, -1, 1)),
           OverTime("root body, height above its start", "up (m)", 300, 0.01));
    html_ += "</div></section>";
  }

  /// The paths of feet from the side, where the simulator tells them, else as propagated.
  void Feet() {
    auto links = FootPairs(comparison_.matching);
    if (links.size() > kMaxFeet) links.resize(kMaxFeet);
    if (links.empty()) return;
    const bool simulated = simulated_a_->available() && simulated_b_->available();
    html_ += fmt::format(
        "<section><h2>Paths from the side</h2><p class='dim'>The middle of labelled links, {}; "
        "B dashed over A.</p><div class='plots'>",
        simulated ? "in the simulated world: north from where its robot began, and up from the "
                    "world's ground (y = 0)"
                  : "in the robot frame, as propagated");
    // Both paths are those of one and the same point of the robot.
    for (const auto& [pair, link] : links) {
      const ModuleSeries& ma = a_.modules[pair->a];
      const ModuleSeries& mb = b_.modules[pair->b];
      // The middle of A's link, and the point of B's link that at rest is at the same place.
      const Eigen::Vector3d p_AoP_A =
          LinkCentre(a_.model->TypeOf(*a_.robot, ma.model_index).links[link->link_a]);
      const Eigen::Vector3d p_BoP_B = rest_b_[mb.model_index][link->link_b].inverse() *
                                      (rest_a_[ma.model_index][link->link_a] * p_AoP_A);
      const auto [a, b] = Tracks(*pair, *link, simulated);
      const std::string name = link->label.empty() ? "root link" : link->label;
      Figure(BothRuns(Side(*simulated_a_, simulated, Path(a, 0, 1, 1.0, p_AoP_A)),
                      Side(*simulated_b_, simulated, Path(b, 0, 1, 1.0, p_BoP_B))),
             {fmt::format("{} {}", RoleName(pair->role), name),
              "forward, north (m)",
              simulated ? "above the ground (m)" : "up (m)",
              640,
              220,
              false,
              0.01,
              {}});
    }
    html_ += "</div></section>";
  }

  /// A path with heights above the world's ground in place of those above R0, which is where the
  /// robot's frame began, where poses are simulated.
  static PlotPoints Side(const SimulatedPoses& poses, bool simulated, PlotPoints path) {
    if (!simulated) return path;
    // R0 is where the robot frame was at the start, its origin above the ground by this height.
    const double height = poses.X_WR0().translation().y();
    for (auto& [north, up] : path) up += height;
    return path;
  }

  /// The largest difference over all links, at each instant.
  void DifferencePlots() {
    html_ += "<section><h2>Largest difference of any link</h2><div class='plots'>";
    for (const bool simulated : {false, true}) {
      // The largest values at each instant (sim time, µs).
      std::map<int64_t, PoseDifference> largest;
      for (const ModulePair& pair : comparison_.matching.pairs) {
        for (const LinkPair& link : pair.links) {
          const auto [a, b] = Tracks(pair, link, simulated);
          const Track<PoseDifference> d = Differences(
              a, b, rest_a_[a_.modules[pair.a].model_index][link.link_a],
              rest_b_[b_.modules[pair.b].model_index][link.link_b], comparison_.compared_until_us);
          for (size_t i = 0; i < d.value.size(); ++i) {
            PoseDifference& most = largest[d.time_us[i]];
            most.metres = std::max(most.metres, d.value[i].metres);
            most.radians = std::max(most.radians, d.value[i].radians);
          }
        }
      }
      // One plot for lengths and one for angles.
      const char* how = simulated ? "as simulated" : "as propagated";
      PlotPoints metres, radians;
      for (const auto& [time, most] : largest) {
        metres.emplace_back(Seconds(time), most.metres * 1e3);
        radians.emplace_back(Seconds(time), most.radians * kDegrees);
      }
      Figure({{"", "line-d", std::move(metres)}},
             OverTime(fmt::format("position, {}", how), "mm", 200, 1e-3));
      Figure({{"", "line-d", std::move(radians)}},
             OverTime(fmt::format("rotation, {}", how), "degrees", 200, 1e-3));
    }
    html_ += "</div></section>";
  }

  /// All joints of all pairs, in order of role. Joints without a convention are shown with the sign
  /// by which their axes lie.
  void Joints() {
    html_ += "<section><h2>Joints under their conventions</h2><div class='plots'>";
    for (const ModulePair& pair : comparison_.matching.pairs) {
      for (const JointPair& joint : pair.joints) Joint(pair, joint);
    }
    html_ += "</div></section>";
  }

  /// Both runs' values of a joint in one plot, and their difference below.
  void Joint(const ModulePair& pair, const JointPair& joint) {
    // Both rows of angles or travels are brought under one sign first.
    const ModuleSeries& ma = a_.modules[pair.a];
    const ModuleSeries& mb = b_.modules[pair.b];
    const ScalarTrack a = AngleTrack(ma, joint.joint_a, SignsOfA(ma, joint));
    const ScalarTrack b = AngleTrack(mb, joint.joint_b, SignsOfB(mb, joint));
    const double scale = joint.prismatic ? 1e3 : kDegrees;
    const char* unit = joint.prismatic ? "mm" : "degrees";
    PlotPoints difference;
    ForCommonTimes(a.time_us, b.time_us, comparison_.compared_until_us, [&](size_t i, size_t j) {
      difference.emplace_back(Seconds(a.time_us[i]), (a.value[i] - b.value[j]) * scale);
    });
    // The plot of both values, which is not blown up for a joint that stands still, and below it
    // one of the difference, which is far smaller.
    PlotOptions values = OverTime(
        fmt::format("{} {}  ({} / {})", RoleName(pair.role), joint.label, ma.name, mb.name), unit,
        190, joint.prismatic ? 1.0 : 5.0);
    values.x_label.clear();
    html_ += "<figure>" + PlotSvg(BothRuns(Over(a, scale), Over(b, scale)), values) +
             PlotSvg({{"", "line-d", std::move(difference)}}, OverTime("A − B", unit, 130, 1e-3)) +
             "</figure>";
  }

  /// The poses of both runs' links, as the simulator saw them or as their VMs propagated them.
  std::pair<PoseTrack, PoseTrack> Tracks(const ModulePair& pair, const LinkPair& link,
                                         bool simulated) const {
    const ModuleSeries& ma = a_.modules[pair.a];
    const ModuleSeries& mb = b_.modules[pair.b];
    if (!simulated) return {PropagatedTrack(ma, link.link_a), PropagatedTrack(mb, link.link_b)};
    return {simulated_a_->LinkTrack(ma.model_index, link.link_a),
            simulated_b_->LinkTrack(mb.model_index, link.link_b)};
  }

  const RunLog& a_;
  const RunLog& b_;
  const Comparison& comparison_;
  /// Poses of all links at rest, and in the simulated world; only if both logs have a model.
  RestPoses rest_a_, rest_b_;
  std::unique_ptr<SimulatedPoses> simulated_a_, simulated_b_;
};

}  // namespace

std::string ReportHtml(const RunLog& a, const RunLog& b, const Comparison& comparison) {
  // Aligned runs are shown over one time line, that of A.
  return ComparisonPage(a, comparison.aligned_b ? *comparison.aligned_b : b, comparison).Build();
}

}  // namespace morphbus::logger
