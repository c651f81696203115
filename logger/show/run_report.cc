#include "logger/show/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "compiler/base/text.h"
#include "logger/compare/comparer.h"
#include "logger/figures/run_figures.h"
#include "logger/show/command_list.h"
#include "logger/show/moment_pictures.h"
#include "logger/show/report_page.h"
#include "logger/show/robot_scenes.h"
#include "logger/show/timeline.h"

namespace morphbus::logger {
namespace {

/// So many faults are listed on the page; `info` lists all.
constexpr size_t kMostFaults = 50;

/// The page, section by section.
class RunPage : private ReportPage {
 public:
  explicit RunPage(const RunLog& log) : log_(log), facts_(log.facts) {
    marks_ = CommandMarks(facts_);
  }

  std::string Build() {
    const std::string title = fmt::format(
        "{} of {}", facts_.robot_name.empty() ? "a run" : facts_.robot_name, facts_.path);
    Begin(title, title);
    // Without a model or without a tick there is nothing to draw: facts and faults remain.
    if (log_.robot != nullptr && !log_.ticks_us.empty()) Prepare();
    Summary();
    Problems();
    html_ += CommandsHtml(facts_);
    // What readers look for first comes first; the channels, by which the rest can be doubted,
    // last.
    if (prepared_) {
      Pictures();
      Travel();
      Roles();
      Walk();
      Joints();
      Efforts();
    }
    Faults();
    Channels();
    if (prepared_) FiguresForScripts();
    return End();
  }

 private:
  /// What several sections need: who is who, the simulated world, the gait.
  void Prepare() {
    prepared_ = true;
    end_s_ = Seconds(log_.ticks_us.back());
    // A run matched with itself has every module, joint and link in pairs.
    matching_ = Match(log_, log_, log_.ticks_us.back());
    poses_ = std::make_unique<SimulatedPoses>(log_);
    figures_ = FiguresOf(log_);
    colors_ = ColorsOf({&log_});
  }

  /// What ran, and in figures what came of it.
  void Summary() {
    // What ran.
    html_ += "<div class='cards'><section class='card'><h2>The run</h2><dl>";
    RunFacts(log_);
    Fact("hash", facts_.run_hash);
    BuildFacts(facts_);
    html_ += "</dl></section><section class='card'><h2>What came of it</h2><dl>";
    // How far it came, how it stood, and its gait, in the words of `run`.
    if (prepared_) {
      for (const auto& [name, value] : FigureLines(figures_)) Fact(name.c_str(), value);
    }
    // What went wrong in the program, on the bus, and at the end.
    Fact("faults", facts_.num_faults == 0 ? "none" : std::to_string(facts_.num_faults));
    MessageFact(facts_);
    const bool clean = facts_.end && facts_.end->clean;
    Fact("end", std::string(EndStateName(facts_.end_state)) +
                    (facts_.end ? clean ? ", clean" : ", not clean: " + facts_.end->reason : ""));
    html_ += "</dl></section></div>";
  }

  /// What a reader must know before believing the rest.
  void Problems() {
    std::vector<std::string> notes = facts_.problems;
    // Ten notes are enough to make a reader look at the log itself.
    for (const LogDamage& damage : facts_.damage) {
      if (notes.size() >= 10) break;
      notes.push_back(fmt::format("after {:.3f} s: {}", Seconds(damage.time_us), damage.what));
    }
    if (facts_.end_state != EndState::kVerified) {
      notes.push_back(
          fmt::format("END is {}: the log is not whole", EndStateName(facts_.end_state)));
    }
    Notes(notes);
  }

  /// The moments that are worth a picture: start, roles taken, a cycle in four instants, end.
  std::vector<Moment> KeyMoments() const {
    std::vector<Moment> moments = {{log_.world.front().time_us, "start"}};
    // The roles are distributed when the last module has taken its own.
    int64_t cast_us = -1;
    for (const ModulePair& pair : matching_.pairs) cast_us = std::max(cast_us, pair.taken_a_us);
    if (figures_.gait) {
      // The last cycle, since the first ones begin from standing still.
      const std::vector<int64_t>& times_us = figures_.gait->times_us;
      const int64_t begin = times_us[times_us.size() - 2];
      const int64_t length = times_us.back() - begin;
      moments.push_back({times_us.front(), "first cycle begins"});
      for (int quarter = 1; quarter <= 3; ++quarter) {
        moments.push_back(
            {begin + quarter * length / 4, fmt::format("last cycle, {} %", 25 * quarter)});
      }
    } else {
      if (cast_us > 0) moments.push_back({cast_us, "all roles taken"});
      // Without a gait, moments that divide the run evenly.
      const int64_t end = log_.world.back().time_us;
      for (int third = 1; third <= 2; ++third) {
        moments.push_back({third * end / 3, ""});
      }
    }
    moments.push_back({log_.world.back().time_us, "end"});
    // Faults take what room is left of eight pictures.
    for (const FaultFact& fault : facts_.faults) {
      if (moments.size() >= 8) break;
      moments.push_back({fault.time_us, "fault of " + fault.module});
    }
    std::ranges::stable_sort(moments, {}, &Moment::time_us);
    return moments;
  }

  /// The robot at key moments, all at one scale.
  void Pictures() {
    if (log_.world.empty()) return;
    html_ += "<section><h2>Key moments</h2><div class='pictures'>";
    const std::vector<Moment> moments = KeyMoments();
    html_ += MomentPicturesHtml(log_, *poses_, colors_, moments, 380);
    // One key of colours for all pictures.
    std::vector<std::string> roles;
    for (const Moment& moment : moments) {
      for (const std::string& role : RolesAt(log_, moment.time_us)) roles.push_back(role);
    }
    html_ += "</div>" + RoleKeyHtml(colors_, roles) + "</section>";
  }

  /// The way of the centre of mass from above, and the trunk's height.
  void Travel() {
    const std::vector<RobotSample>& track = figures_.motion.track;
    if (track.empty()) return;
    PlotPoints map, height;
    for (const RobotSample& sample : track) {
      // Seen from above with north to the right, west is up.
      map.emplace_back(sample.p_WCm.x() - track.front().p_WCm.x(),
                       track.front().p_WCm.z() - sample.p_WCm.z());
      height.emplace_back(Seconds(sample.time_us), sample.p_WT.y() * 1e3);
    }
    html_ += "<section><h2>Where it went</h2><div class='plots'>";
    Figure({{"", "line-a", std::move(map)}},
           {"centre of mass from above", "north (m)", "west (m)", 640, 300, true, 0.02, {}});
    Figure({{"", "line-a", std::move(height)}},
           OverTime("trunk, height above the ground", "mm", 300, 10));
    html_ += "</div></section>";
  }

  /// Roles and faults over time, and which foot stood when.
  void Roles() {
    std::vector<TimelineRow> rows;
    for (const ModuleSeries& module : log_.modules) {
      TimelineRow row{module.name, {}, {}};
      for (const RoleSpan& span : RoleSpans(module, log_.ticks_us.back())) {
        // A bar for each stretch of time in which the module played one role.
        const std::string role = RoleName(span.role);
        const Color color = colors_.Of(span.role);
        // A new label does not end a role.
        if (!row.bars.empty() && row.bars.back().text == role) {
          row.bars.back().end = Seconds(span.end_us);
        } else {
          row.bars.push_back({Seconds(span.begin_us), Seconds(span.end_us), color, role});
        }
      }
      for (const FaultFact& fault : facts_.faults) {
        // A dot for each of its faults.
        if (fault.module == module.name) {
          row.marks.push_back({Seconds(fault.time_us), fault.Line()});
        }
      }
      rows.push_back(std::move(row));
    }
    html_ += "<section><h2>Roles and faults over time</h2><figure>" +
             TimelineSvg(rows, "who played what; dots are faults", 0, end_s_) +
             "</figure></section>";
  }

  /// The gait in a table, and the stances of links over the last cycles.
  void Walk() {
    html_ += "<section><h2>Gait</h2>";
    if (figures_.gait) {
      CycleTable(*figures_.gait);
      if (!figures_.gait->duties.empty()) Stances(*figures_.gait);
    } else {
      html_ += "<p class='dim'>No cycle: " + EscapeHtml(figures_.why_no_gait) + ".</p>";
    }
    html_ += "</section>";
  }

  /// A row for each cycle: when it began, how long it took, and how it moved and turned the robot.
  void CycleTable(const Gait& gait) {
    html_ += TableHead({"cycle", "#from|s", "#takes|s", "#moves north|mm", "#moves east|mm",
                        "#turns|deg", "#energy|J"});
    for (int i = 0; i < gait.num_cycles(); ++i) {
      html_ +=
          fmt::format("<tr><td>{}</td><td class='n'>{:.2f}</td><td class='n'>{:.2f}</td>", i + 1,
                      Seconds(gait.times_us[i]), Seconds(gait.times_us[i + 1] - gait.times_us[i]));
      // Without a simulated world the log does not say where the robot was.
      if (gait.cycles.empty()) {
        for (int cell = 0; cell < 4; ++cell) html_ += "<td class='n dim'>–</td>";
        html_ += "</tr>";
        continue;
      }
      // North is x and east is z in the world.
      const GaitCycle& cycle = gait.cycles[i];
      html_ += fmt::format(
          "<td class='n'>{:.1f}</td><td class='n'>{:.1f}</td><td class='n'>{:+.2f}</td>"
          "<td class='n'>{:.2f}</td></tr>",
          cycle.advance.x() * 1e3, cycle.advance.z() * 1e3, cycle.turn_rad * kDegrees,
          cycle.energy_j);
    }
    html_ += kTableEnd;
  }

  /// Which link is on the ground when: in the last two cycles, with its share of all cycles.
  void Stances(const Gait& gait) {
    // A row for each link; older cycles would only make the bars too narrow to be read.
    const int shown = std::min(2, gait.num_cycles());
    const int64_t begin = gait.times_us[gait.num_cycles() - shown];
    const int64_t end = gait.times_us.back();
    const std::vector<RobotSample>& track = figures_.motion.track;
    std::vector<TimelineRow> rows;
    for (const GroundContact& contact : figures_.motion.contacts) {
      const double duty = gait.DutyOf(contact.module, contact.link);
      if (duty == 0.0) continue;
      const std::string role = RoleOfModule(contact.module);
      TimelineRow row{fmt::format("{} ({:.0f} %)", contact.name, duty * 100), {}, {}};
      // The stances, cut where the plot begins and ends.
      for (const auto& [first, behind] : contact.stances) {
        const int64_t from = track[first].time_us, to = track[behind - 1].time_us;
        if (to < begin || from > end) continue;
        // A stance ends with its last sample; the track may have holes, over which nothing is said.
        row.bars.push_back({Seconds(std::max(from, begin)), Seconds(std::min(to, end)),
                            colors_.Of(role), RoleName(role)});
      }
      rows.push_back(std::move(row));
    }
    html_ += "<figure>" +
             TimelineSvg(rows, "links on the ground (share of all cycles)", Seconds(begin),
                         Seconds(end)) +
             "</figure>";
  }

  /// How hard motors worked and what links bore, over the whole run; and each motor's effort.
  void Efforts() {
    if (!figures_.has_world) return;
    html_ += "<section><h2>Effort</h2>";
    html_ += TableHead({"motor", "#root mean square|N m, N", "#most|N m, N"});
    for (const JointLoad& joint : figures_.joint_loads) {
      html_ += fmt::format("<tr><td>{}</td><td class='n'>{:.3f}</td><td class='n'>{:.3f}</td></tr>",
                           EscapeHtml(joint.name), joint.rms, joint.peak);
    }
    html_ += kTableEnd;
    html_ += TableHead({"link on the ground or an obstacle", "#mean load, up|N", "#most|N"});
    // Up is y in W.
    for (const LinkLoad& link : figures_.motion.loads) {
      html_ += fmt::format("<tr><td>{}</td><td class='n'>{:.2f}</td><td class='n'>{:.2f}</td></tr>",
                           EscapeHtml(link.name), link.mean_W.y(), link.peak_n);
    }
    html_ += kTableEnd;
    html_ += "<div class='plots'>";
    // Each motor's effort over time, in the sign of its role's convention.
    for (const ModulePair& pair : matching_.pairs) {
      for (const JointPair& joint : pair.joints) {
        const ModuleSeries& module = log_.modules[pair.a];
        const ScalarTrack efforts = EffortTrack(module, joint.joint_a, SignsOfA(module, joint));
        Figure({{"", "line-a", Over(efforts, 1.0)}},
               OverTime(fmt::format("{} {}  ({})", RoleName(pair.role), joint.label, module.name),
                        joint.prismatic ? "N" : "N m", 190, 0.1));
      }
    }
    html_ += "</div></section>";
  }

  /// The role by which a module of the model is known; empty if it has none.
  [[nodiscard]] std::string RoleOfModule(int model_index) const {
    for (const ModulePair& pair : matching_.pairs) {
      if (log_.modules[pair.a].model_index == model_index) return pair.role;
    }
    return "";
  }

  /// Every joint: where it was, and where it was told to go.
  void Joints() {
    html_ +=
        "<section><h2>Joints under their conventions</h2><p class='dim'>Measured, and dashed "
        "what the module commanded.</p><div class='plots'>";
    // A run is matched with itself, so that either side of a pair will do.
    for (const ModulePair& pair : matching_.pairs) {
      for (const JointPair& joint : pair.joints) {
        const ModuleSeries& module = log_.modules[pair.a];
        // Values are those of the program: degrees or millimetres under the convention of the role.
        const JointSigns signs = SignsOfA(module, joint);
        const double scale = joint.prismatic ? 1e3 : kDegrees;
        PlotPoints told;
        const ScalarTrack angles = AngleTrack(module, joint.joint_a, signs);
        // Of the commands only positions; a velocity is no place to go.
        const Track<JointCommand> commands = CommandsOf(module, joint.joint_a, signs);
        for (size_t i = 0; i < commands.value.size(); ++i) {
          if (commands.value[i].mode != morphbus::joint_command_t::MODE_POSITION) continue;
          told.emplace_back(Seconds(commands.time_us[i]), commands.value[i].value * scale);
        }
        Figure(
            {{"measured", "line-a", Over(angles, scale)}, {"command", "line-b", std::move(told)}},
            OverTime(fmt::format("{} {}  ({})", RoleName(pair.role), joint.label, module.name),
                     joint.prismatic ? "mm" : "degrees", 190, joint.prismatic ? 1.0 : 5.0));
      }
    }
    html_ += "</div></section>";
  }

  /// The first faults, with their places in the source.
  void Faults() {
    if (facts_.faults.empty()) return;
    html_ += "<section><h2>Faults of the program</h2>";
    html_ += TableHead({"#time|s", "module", "role", "what"});
    for (size_t i = 0; i < std::min(facts_.faults.size(), kMostFaults); ++i) {
      const FaultFact& fault = facts_.faults[i];
      html_ += fmt::format(
          "<tr><td class='n'>{:.3f}</td><td>{}</td><td>{}</td><td class='m'>{}</td></tr>",
          Seconds(fault.time_us), EscapeHtml(fault.module), EscapeHtml(fault.role),
          EscapeHtml(fault.Line()));
    }
    html_ += kTableEnd;
    // The page stays readable, and says where the others are.
    if (facts_.num_faults > static_cast<int64_t>(kMostFaults)) {
      html_ +=
          fmt::format("<p class='dim'>{} in all; morphbus info lists more.</p>", facts_.num_faults);
    }
    html_ += "</section>";
  }

  /// The figures that are shown above, to the last digit.
  void FiguresForScripts() {
    html_ += "<script type='application/json' id='figures'>";
    // A name with "</script>" in it must not end the element.
    for (const char c :
         FiguresJson(figures_).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)) {
      html_ += c == '<' ? std::string("\\u003c") : std::string(1, c);
    }
    html_ += "</script>";
  }

  /// What was said on which channel, folded away.
  void Channels() {
    html_ += "<details><summary>Channels</summary>";
    html_ += TableHead({"channel", "#messages", "#bytes", "#lost", "#bad"});
    // Channels that lack something stand out; a damaged log can name any number of them.
    size_t listed = 0;
    for (const auto& [name, channel] : facts_.channels) {
      if (!channel.ours || ++listed > 1000) continue;
      html_ += fmt::format(
          "<tr{}><td>{}</td><td class='n'>{}</td><td class='n'>{}</td>"
          "<td class='n'>{}</td><td class='n'>{}</td></tr>",
          channel.lost + channel.bad > 0 ? " class='over'" : "", EscapeHtml(name), channel.messages,
          channel.bytes, channel.lost, channel.bad);
    }
    html_ += kTableEnd;
    html_ += "</details>";
  }

  const RunLog& log_;
  const LogFacts& facts_;
  bool prepared_ = false;
  double end_s_ = 0.0;
  Matching matching_;
  std::unique_ptr<SimulatedPoses> poses_;
  RunFigures figures_;
  RoleColors colors_;
};

}  // namespace

std::string RunReportHtml(const RunLog& log) { return RunPage(log).Build(); }

}  // namespace morphbus::logger
