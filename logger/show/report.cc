#include "logger/show/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>

#include "logger/show/report_style.h"
#include "logger/show/svg_plot.h"

namespace morphbus::logger {
namespace {

/// Degrees in a radian.
constexpr double kDegrees = 180.0 / std::numbers::pi;
/// So many paths of feet are shown at most: more would be a page that nobody reads.
constexpr size_t kMaxFeet = 12;

/// A role's name for people.
std::string RoleName(const std::string& role) { return role.empty() ? "(no role)" : role; }

/// A value (SI) in the unit of the tables, without its name.
std::string Number(double value, const std::string& unit) {
  const double scaled = value * DisplayUnitOf(unit).scale;
  // Rounding of the arithmetic itself is not worth a reader's attention.
  if (std::abs(scaled) >= 1e-7 && std::abs(scaled) < 5e-4) return fmt::format("{:.1e}", scaled);
  return fmt::format("{:.{}f}", scaled, unit.empty() ? 0 : 3);
}

/// The unit's name that goes with Number().
const char* UnitName(const std::string& unit) { return DisplayUnitOf(unit).name; }

using Points = std::vector<std::pair<double, double>>;

/// Builds the page piece by piece, from top to bottom: each function appends one section to html_.
class Page {
 public:
  Page(const RunLog& a, const RunLog& b, const Comparison& comparison)
      : a_(a), b_(b), comparison_(comparison) {}

  std::string Build();

 private:
  void Banner();
  void Cards();
  void Card(const RunLog& log, const char* which);
  void Notes();
  void RoleTable();
  void ItemTable();
  void Travel();
  void Feet();
  void DifferencePlots();
  void Joints();
  void Joint(const ModulePair& pair, const JointPair& joint);
  std::vector<std::pair<const ModulePair*, const LinkPair*>> FootLinks() const;
  [[nodiscard]] std::vector<PlotMark> Marks() const;

  const RunLog& a_;
  const RunLog& b_;
  const Comparison& comparison_;
  /// Poses of all links at rest, and in the simulated world; only if both logs have a model.
  RestPoses rest_a_, rest_b_;
  std::unique_ptr<SimulatedPoses> simulated_a_, simulated_b_;
  std::string html_;
};

/// Verdict, first divergence and largest differences.
void Page::Banner() {
  // The verdict's word is also the class by which the style sheet colors the banner.
  const char* verdict = VerdictName(comparison_.verdict);
  html_ += fmt::format(
      "<header class='banner {0}'><div class='verdict'>{0}</div><div><p class='reason'>{1}</p>",
      verdict, EscapeHtml(comparison_.reason));
  if (comparison_.first) {
    const Item& item = comparison_.items[*comparison_.first];
    html_ += fmt::format(
        "<p>First divergence at <b>{:.3f} s</b>: <b>{}</b> of <b>{}</b>{} ({} in A, {} in B), "
        "{} {} against a tolerance of {} {}. {}</p>",
        Seconds(item.first_over_us), QuantityName(item.quantity), EscapeHtml(RoleName(item.role)),
        item.label.empty() ? "" : " <b>" + EscapeHtml(item.label) + "</b>",
        item.module_a.empty() ? "nobody" : EscapeHtml(item.module_a),
        item.module_b.empty() ? "nobody" : EscapeHtml(item.module_b),
        Number(item.first_over, item.unit), UnitName(item.unit), Number(item.tolerance, item.unit),
        UnitName(item.unit), EscapeHtml(item.detail));
  }
  html_ += fmt::format(
      "<p class='figures'>largest difference in position <b>{:.2g} mm</b>, in rotation "
      "<b>{:.2g}°</b>, over {:.3f} s of sim time</p></div></header>",
      comparison_.max_position_m * 1e3, comparison_.max_rotation_rad * kDegrees,
      Seconds(comparison_.compared_until_us));
}

/// What a log is of.
void Page::Card(const RunLog& log, const char* which) {
  const LogFacts& f = log.facts;
  // Lines without a value are left out.
  const auto row = [&](const char* name, const std::string& value) {
    if (value.empty()) return;
    html_ += fmt::format("<dt>{}</dt><dd>{}</dd>", name, EscapeHtml(value));
  };
  html_ += fmt::format("<section class='card'><h2><span class='chip {0}'>{0}</span> {1}</h2><dl>",
                       which, EscapeHtml(f.path));
  row("robot", f.robot + (f.model_file.empty() ? "" : "  (" + f.model_file + ")"));
  row("program", f.program_file);
  row("run", f.run + (f.mode.empty() ? "" : ", " + f.mode));
  row("length",
      fmt::format("{:.3f} s, {} ticks of {:.0f} ms", f.seconds, f.ticks, f.tick_us * 1e-3));
  row("modules",
      fmt::format("{}, root {}", log.modules.size(), f.root_module.empty() ? "?" : f.root_module));
  row("messages",
      fmt::format("{} events, {} lost, {} damaged places", f.events, f.lost(), f.num_damage));
  row("end", EndStateName(f.end_state));
  row("hash", f.run_hash);
  row("world", f.world_hash);
  row("started", f.started);
  row("build", f.build);
  html_ += "</dl></section>";
}

void Page::Cards() {
  html_ += "<div class='cards'>";
  Card(a_, "A");
  Card(b_, "B");
  html_ += "</div>";
}

/// Damage, losses, and what could not be compared.
void Page::Notes() {
  if (comparison_.notes.empty() && comparison_.not_compared.empty()) return;
  html_ += "<section class='notes'><h2>What to know</h2><ul>";
  for (const std::string& note : comparison_.notes) {
    html_ += "<li>" + EscapeHtml(note) + "</li>";
  }
  for (const std::string& what : comparison_.not_compared) {
    html_ += "<li>not compared: " + EscapeHtml(what) + "</li>";
  }
  html_ += "</ul></section>";
}

/// One row a role, one column a quantity: the largest difference of all its joints and links.
void Page::RoleTable() {
  // The largest item of each role and quantity, and who plays the role.
  std::map<Quantity, std::string> columns;  // Value: unit.
  std::map<std::string, std::map<Quantity, const Item*>> rows;
  std::map<std::string, std::vector<std::string>> modules;
  for (const Item& item : comparison_.items) {
    columns.emplace(item.quantity, item.unit);
    const Item*& worst = rows[item.role][item.quantity];
    if (worst == nullptr || item.max > worst->max) worst = &item;
    if (item.quantity == Quantity::kRole && item.label.empty()) {
      modules[item.role].push_back((item.module_a.empty() ? "–" : item.module_a) + " / " +
                                   (item.module_b.empty() ? "–" : item.module_b));
    }
  }
  // The head of the table, then a row each with an en dash where a role lacks the quantity.
  if (rows.empty()) return;
  html_ +=
      "<section><h2>Largest differences by role</h2><div class='scroll'><table><thead><tr>"
      "<th>role</th><th>A / B</th>";
  for (const auto& [quantity, unit] : columns) {
    html_ += fmt::format("<th class='n'>{}<br><small>{}</small></th>", QuantityName(quantity),
                         UnitName(unit));
  }
  html_ += "</tr></thead><tbody>";
  // Rows are in order of role, values beyond their tolerance in another color.
  for (const auto& [role, worst] : rows) {
    std::string names;
    for (const std::string& pair : modules[role]) names += (names.empty() ? "" : ", ") + pair;
    html_ += fmt::format("<tr><td>{}</td><td class='m'>{}</td>", EscapeHtml(RoleName(role)),
                         EscapeHtml(names));
    for (const auto& [quantity, unit] : columns) {
      const auto found = worst.find(quantity);
      if (found == worst.end()) {
        html_ += "<td class='n dim'>–</td>";
        continue;
      }
      const Item& item = *found->second;
      html_ += fmt::format("<td class='n{}'>{}</td>", item.first_over_us >= 0 ? " over" : "",
                           Number(item.max, item.unit));
    }
    html_ += "</tr>";
  }
  html_ += "</tbody></table></div></section>";
}

/// Every item of the comparison, folded away.
void Page::ItemTable() {
  // The table is long, so it stays closed until somebody asks for it.
  if (comparison_.items.empty()) return;
  html_ += fmt::format(
      "<details><summary>All {} compared quantities</summary><div class='scroll'><table><thead><tr>"
      "<th>role</th><th>joint or link</th><th>A / B</th><th>quantity</th><th class='n'>largest</th>"
      "<th class='n'>at</th><th class='n'>RMS</th><th class='n'>tolerance</th>"
      "<th class='n'>beyond from</th><th class='n'>instants</th></tr></thead><tbody>",
      comparison_.items.size());
  for (const Item& item : comparison_.items) {
    html_ += fmt::format(
        "<tr{}><td>{}</td><td>{}</td><td class='m'>{} / {}</td><td>{}</td><td class='n'>{} {}</td>"
        "<td class='n'>{:.3f} s</td><td class='n'>{}</td><td class='n'>{}</td><td class='n'>{}</td>"
        "<td class='n'>{}</td></tr>",
        item.first_over_us >= 0 ? " class='over'" : "", EscapeHtml(RoleName(item.role)),
        item.label.empty() ? "root link" : EscapeHtml(item.label),
        item.module_a.empty() ? "–" : EscapeHtml(item.module_a),
        item.module_b.empty() ? "–" : EscapeHtml(item.module_b), QuantityName(item.quantity),
        Number(item.max, item.unit), UnitName(item.unit), Seconds(item.max_time_us),
        Number(item.rms, item.unit), Number(item.tolerance, item.unit),
        item.first_over_us < 0 ? "" : fmt::format("{:.3f} s", Seconds(item.first_over_us)),
        item.samples);
  }
  html_ += "</tbody></table></div></details>";
}

/// Where the first divergence is, for plots over sim time (s); nothing if there is none.
std::vector<PlotMark> Page::Marks() const {
  if (!comparison_.first) return {};
  return {{Seconds(comparison_.items[*comparison_.first].first_over_us), "first divergence"}};
}

/// (time, value) pairs: sim time in seconds, values times `scale` in the plot's unit.
Points Over(const std::vector<int64_t>& time_us, const std::vector<double>& values, double scale) {
  Points points;
  points.reserve(values.size());
  for (size_t i = 0; i < values.size(); ++i) {
    points.emplace_back(Seconds(time_us[i]), values[i] * scale);
  }
  return points;
}

/// Coordinate `y` of a track's position (m) over coordinate `x`, or over sim time (s) where x is
/// -1. Coordinates are 0 north, 1 up, 2 east of R0 or R; `y_sign` -1 turns the axis of `y` round.
Points Path(const PoseTrack& track, int x, int y, double y_sign = 1.0) {
  Points points;
  points.reserve(track.p.size());
  for (size_t i = 0; i < track.p.size(); ++i) {
    points.emplace_back(x < 0 ? Seconds(track.time_us[i]) : track.p[i][x], y_sign * track.p[i][y]);
  }
  return points;
}

/// The way of the root body in the simulated world, relative to where it began (R0): north and
/// east, and height.
void Page::Travel() {
  if (!simulated_a_->available() && !simulated_b_->available()) return;
  const PoseTrack a = simulated_a_->RootTrack();
  const PoseTrack b = simulated_b_->RootTrack();
  html_ += "<section><h2>Where the robot went</h2><div class='plots'>";
  // Seen from above with north to the right, west is up: east up would be the view from below.
  PlotOptions from_above{"root body from above", "north (m)", "west (m)", 640, 300, true, 0.02, {}};
  html_ += "<figure>" +
           PlotSvg({{"A", "line-a", Path(a, 0, 2, -1.0)}, {"B", "line-b", Path(b, 0, 2, -1.0)}},
                   from_above) +
           "</figure>";
  PlotOptions height{"root body, height above its start",
                     "sim time (s)",
                     "up (m)",
                     640,
                     300,
                     false,
                     0.01,
                     Marks()};
  html_ += "<figure>" +
           PlotSvg({{"A", "line-a", Path(a, -1, 1)}, {"B", "line-b", Path(b, -1, 1)}}, height) +
           "</figure>";
  html_ += "</div></section>";
}

/// Links whose label speaks of a foot; else all labelled links; else the modules' root links.
std::vector<std::pair<const ModulePair*, const LinkPair*>> Page::FootLinks() const {
  // Labels are the program's choice, so "foot" is found in any case of letters. Every link may be a
  // candidate of three kinds; the most telling kind that there is, is chosen.
  std::vector<std::pair<const ModulePair*, const LinkPair*>> feet, labelled, roots;
  for (const ModulePair& pair : comparison_.matching.pairs) {
    for (const LinkPair& link : pair.links) {
      std::string name = link.label;
      std::transform(name.begin(), name.end(), name.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (name.find("foot") != std::string::npos) feet.emplace_back(&pair, &link);
      if (link.labelled) labelled.emplace_back(&pair, &link);
      if (link.label.empty()) roots.emplace_back(&pair, &link);
    }
  }
  auto& chosen = !feet.empty() ? feet : !labelled.empty() ? labelled : roots;
  if (chosen.size() > kMaxFeet) chosen.resize(kMaxFeet);
  return chosen;
}

/// The paths of feet from the side, where the simulator tells them, else as propagated.
void Page::Feet() {
  const auto links = FootLinks();
  if (links.empty()) return;
  const bool simulated = simulated_a_->available() && simulated_b_->available();
  html_ += fmt::format(
      "<section><h2>Paths from the side</h2><p class='dim'>The middle of labelled links, {}; "
      "B dashed over A.</p><div class='plots'>",
      simulated ? "in the simulated world" : "in the robot frame, as propagated");
  // Both paths are those of one and the same point of the robot.
  for (const auto& [pair, link] : links) {
    const ModuleSeries& ma = a_.modules[pair->a];
    const ModuleSeries& mb = b_.modules[pair->b];
    PoseTrack a = simulated ? simulated_a_->LinkTrack(ma.model_index, link->link_a)
                            : PropagatedTrack(ma, link->link_a);
    PoseTrack b = simulated ? simulated_b_->LinkTrack(mb.model_index, link->link_b)
                            : PropagatedTrack(mb, link->link_b);
    // The middle of A's link, and the point of B's link that at rest is at the same place.
    const Eigen::Vector3d p_AoP_A =
        LinkCentre(a_.model->TypeOf(*a_.robot, ma.model_index).links[link->link_a]);
    const Eigen::Vector3d p_BoP_B = rest_b_[mb.model_index][link->link_b].inverse() *
                                    (rest_a_[ma.model_index][link->link_a] * p_AoP_A);
    for (size_t i = 0; i < a.p.size(); ++i) a.p[i] += a.q[i] * p_AoP_A;
    for (size_t i = 0; i < b.p.size(); ++i) b.p[i] += b.q[i] * p_BoP_B;
    PlotOptions options{
        fmt::format("{} {}", RoleName(pair->role), link->label.empty() ? "root link" : link->label),
        "forward, north (m)",
        "up (m)",
        640,
        220,
        false,
        0.01,
        {}};
    html_ += "<figure>" +
             PlotSvg({{"A", "line-a", Path(a, 0, 1)}, {"B", "line-b", Path(b, 0, 1)}}, options) +
             "</figure>";
  }
  html_ += "</div></section>";
}

/// The largest difference over all links, at each instant.
void Page::DifferencePlots() {
  // The largest values at each instant (sim time, µs): [0] as propagated, [1] as simulated.
  std::map<int64_t, double> metres[2], radians[2];
  for (const ModulePair& pair : comparison_.matching.pairs) {
    const ModuleSeries& ma = a_.modules[pair.a];
    const ModuleSeries& mb = b_.modules[pair.b];
    for (const LinkPair& link : pair.links) {
      for (int simulated = 0; simulated < 2; ++simulated) {
        const PoseDifferences d =
            Differences(simulated ? simulated_a_->LinkTrack(ma.model_index, link.link_a)
                                  : PropagatedTrack(ma, link.link_a),
                        simulated ? simulated_b_->LinkTrack(mb.model_index, link.link_b)
                                  : PropagatedTrack(mb, link.link_b),
                        rest_a_[ma.model_index][link.link_a], rest_b_[mb.model_index][link.link_b],
                        comparison_.compared_until_us);
        for (size_t i = 0; i < d.time_us.size(); ++i) {
          double& m = metres[simulated][d.time_us[i]];
          double& r = radians[simulated][d.time_us[i]];
          m = std::max(m, d.metres[i]);
          r = std::max(r, d.radians[i]);
        }
      }
    }
  }
  // Four plots: both differences, as propagated and as simulated.
  html_ += "<section><h2>Largest difference of any link</h2><div class='plots'>";
  const auto plot = [&](const char* title, const char* unit,
                        const std::map<int64_t, double>& values, double scale) {
    Points points;
    for (const auto& [time, value] : values) points.emplace_back(Seconds(time), value * scale);
    PlotOptions options{title, "sim time (s)", unit, 640, 200, false, 1e-3, Marks()};
    html_ += "<figure>" + PlotSvg({{"", "line-d", std::move(points)}}, options) + "</figure>";
  };
  plot("position, as propagated", "mm", metres[0], 1e3);
  plot("rotation, as propagated", "degrees", radians[0], kDegrees);
  plot("position, as simulated", "mm", metres[1], 1e3);
  plot("rotation, as simulated", "degrees", radians[1], kDegrees);
  html_ += "</div></section>";
}

/// Both runs' values of a joint in one plot, and their difference below.
void Page::Joint(const ModulePair& pair, const JointPair& joint) {
  // Both rows of angles or travels are brought under one sign first.
  const ModuleSeries& ma = a_.modules[pair.a];
  const ModuleSeries& mb = b_.modules[pair.b];
  const ScalarTrack a = AngleTrack(ma, joint.joint_a, SignsOfA(ma, joint));
  const ScalarTrack b = AngleTrack(mb, joint.joint_b, SignsOfB(mb, joint));
  const double scale = joint.prismatic ? 1e3 : kDegrees;
  const char* unit = joint.prismatic ? "mm" : "degrees";
  Points difference;
  ForCommonTimes(a.time_us, b.time_us, comparison_.compared_until_us, [&](size_t i, size_t j) {
    difference.emplace_back(Seconds(a.time_us[i]), (a.value[i] - b.value[j]) * scale);
  });
  // The plot of both values, which is not blown up for a joint that stands still.
  PlotOptions options{
      fmt::format("{} {}  ({} / {})", RoleName(pair.role), joint.label, ma.name, mb.name),
      "",
      unit,
      640,
      190,
      false,
      joint.prismatic ? 1.0 : 5.0,
      Marks()};
  html_ += "<figure>" + PlotSvg({{"A", "line-a", Over(a.time_us, a.value, scale)},
                                 {"B", "line-b", Over(b.time_us, b.value, scale)}},
                                options);
  // The difference has a plot of its own, since it is far smaller than the values.
  PlotOptions below{"A − B", "sim time (s)", unit, 640, 130, false, 1e-3, Marks()};
  html_ += PlotSvg({{"", "line-d", std::move(difference)}}, below) + "</figure>";
}

/// All joints of all pairs, in order of role. Joints without a convention are shown with the sign
/// by which their axes lie.
void Page::Joints() {
  html_ += "<section><h2>Joints under their conventions</h2><div class='plots'>";
  for (const ModulePair& pair : comparison_.matching.pairs) {
    for (const JointPair& joint : pair.joints) Joint(pair, joint);
  }
  html_ += "</div></section>";
}

/// The page from top to bottom. Without models there are no poses to plot.
std::string Page::Build() {
  html_ = fmt::format(
      "<!DOCTYPE html>\n<html lang='en'><head><meta charset='utf-8'>"
      "<meta name='viewport' content='width=device-width, initial-scale=1'>"
      "<title>{}: {} and {}</title><style>{}</style></head><body><main>",
      VerdictName(comparison_.verdict), EscapeHtml(a_.facts.path), EscapeHtml(b_.facts.path),
      kReportStyle);
  // What needs no poses comes first, so that it is there for any two logs.
  html_ += "<h1>Comparison of two runs</h1>";
  Banner();
  Cards();
  Notes();
  if (a_.robot != nullptr && b_.robot != nullptr) {
    rest_a_ = RestPosesOf(a_);
    rest_b_ = RestPosesOf(b_);
    simulated_a_ = std::make_unique<SimulatedPoses>(a_);
    simulated_b_ = std::make_unique<SimulatedPoses>(b_);
    RoleTable();
    ItemTable();
    Travel();
    Feet();
    DifferencePlots();
    Joints();
  }
  html_ += "</main></body></html>\n";
  return std::move(html_);
}

}  // namespace

std::string ReportHtml(const RunLog& a, const RunLog& b, const Comparison& comparison) {
  return Page(a, b, comparison).Build();
}

}  // namespace morphbus::logger
