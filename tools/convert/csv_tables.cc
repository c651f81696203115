#include "tools/convert/csv_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "bridge/description/program_words.h"

namespace morphbus::tools {
namespace {

using logger::ModuleSeries;
using logger::RunLog;

/// Sim time of a row. Dividing gives the double nearest to the microseconds, whose shortest text is
/// what a person would write.
std::string TimeCell(int64_t time_us) {
  return fmt::format("{}", static_cast<double>(time_us) / 1e6);
}

/// A comma, then the number, so that it reads back as the same double; the floats of the wire are
/// doubles here, too.
void AddNumber(double value, std::string* row) {
  fmt::format_to(std::back_inserter(*row), ",{}", value);
}

/// The type of a module; null if the log has no model or that has no such module.
const model::ModuleType* TypeOf(const RunLog& log, const ModuleSeries& module) {
  return log.robot == nullptr || module.model_index < 0
             ? nullptr
             : &log.model->TypeOf(*log.robot, module.model_index);
}

/// A member's name by its index in order of declaration; without a model, `kind` and the index.
template <class Member>
std::string NameOf(const model::ModuleType* type, std::vector<Member> model::ModuleType::*members,
                   int index, const char* kind) {
  if (type != nullptr && bridge::IsIndex(index, (type->*members).size())) {
    return (type->*members)[index].name;
  }
  return index < 0 ? "" : fmt::format("{}{}", kind, index);
}
std::string JointColumnName(const model::ModuleType* type, int index) {
  return NameOf(type, &model::ModuleType::joints, index, "joint");
}
std::string LinkName(const model::ModuleType* type, int index) {
  return NameOf(type, &model::ModuleType::links, index, "link");
}

/// The unit of a joint's value: rad, or m of a prismatic joint.
const char* JointUnit(const model::ModuleType* type, size_t index) {
  const bool slides = type != nullptr && index < type->joints.size() &&
                      type->joints[index].type == model::JointType::kPrismatic;
  return slides ? "m" : "rad";
}

/// How many members a module's samples have: those of its type, else those of its first sample.
template <class Sample, class Member, class Value>
size_t CountOf(const model::ModuleType* type, std::vector<Member> model::ModuleType::*members,
               const std::vector<Sample>& samples, std::vector<Value> Sample::*values) {
  if (type != nullptr) return (type->*members).size();
  return samples.empty() ? 0 : (samples.front().*values).size();
}

/// A group of columns that is filled from one module's samples.
template <class Sample>
struct ColumnGroup {
  const std::vector<Sample>* samples;
  /// Names with units, each behind a comma.
  std::string names = {};
  /// Appends cells, each behind a comma; those that it leaves out at the end stay empty.
  std::function<void(const Sample&, std::string*)> fill = {};
};

int64_t Commas(std::string_view text) { return std::count(text.begin(), text.end(), ','); }

/// Groups of columns side by side: a row at every time at which one of them has a sample.
template <class Sample>
Result<void> WriteSideBySide(const std::vector<ColumnGroup<Sample>>& groups,
                             const TextSink& write) {
  std::string row = "time [s]";
  for (const auto& group : groups) row += group.names;
  row += "\n";
  // Merges the series, each of which is in order of time: at[g] is the next sample of group g.
  std::vector<size_t> at(groups.size(), 0);
  constexpr int64_t kNever = std::numeric_limits<int64_t>::max();
  while (true) {
    if (Result<void> written = write(row); !written) return written;
    // The next row is of the earliest sample that is left in any series.
    int64_t time_us = kNever;
    for (size_t g = 0; g < groups.size(); ++g) {
      if (at[g] < groups[g].samples->size()) {
        time_us = std::min(time_us, (*groups[g].samples)[at[g]].time_us);
      }
    }
    if (time_us == kNever) return {};
    row = TimeCell(time_us);
    for (size_t g = 0; g < groups.size(); ++g) {
      const auto& samples = *groups[g].samples;
      const size_t begin = row.size();
      // Times are whole microseconds, so that samples of one tick are equal and come into one row.
      if (at[g] < samples.size() && samples[at[g]].time_us == time_us) {
        groups[g].fill(samples[at[g]++], &row);
      }
      // Nothing is carried on from the row before: an empty cell is one that the log lacks.
      const int64_t filled = Commas(std::string_view(row).substr(begin));
      row.append(static_cast<size_t>(Commas(groups[g].names) - filled), ',');
    }
    row += "\n";
  }
}

/// Modules side by side: `describe(module, type, group)` names and fills each one's columns.
template <class Sample, class Describe>
Result<void> WriteModules(const RunLog& log, std::vector<Sample> ModuleSeries::*samples,
                          const Describe& describe, const TextSink& write) {
  std::vector<ColumnGroup<Sample>> groups;
  for (const ModuleSeries& module : log.modules) {
    describe(module, TypeOf(log, module),
             &groups.emplace_back(ColumnGroup<Sample>{&(module.*samples)}));
  }
  return WriteSideBySide(groups, write);
}

/// SENSORS: angle, rate and effort of every joint.
Result<void> WriteJoints(const RunLog& log, const TextSink& write) {
  using logger::SensorSample;
  const auto describe = [](const ModuleSeries& module, const model::ModuleType* type,
                           ColumnGroup<SensorSample>* group) {
    const size_t joints =
        CountOf(type, &model::ModuleType::joints, module.sensors, &SensorSample::position);
    for (size_t j = 0; j < joints; ++j) {
      const std::string joint = module.name + "." + JointColumnName(type, static_cast<int>(j));
      const char* unit = JointUnit(type, j);
      group->names += fmt::format(",{0}.position [{1}],{0}.velocity [{1}/s],{0}.effort [{2}]",
                                  joint, unit, *unit == 'm' ? "N" : "N m");
    }
    group->fill = [joints](const SensorSample& sample, std::string* row) {
      // The columns are the type's; a sample of a damaged log may have fewer joints than it.
      for (size_t j = 0; j < std::min(joints, sample.position.size()); ++j) {
        AddNumber(sample.position[j], row);
        AddNumber(sample.velocity[j], row);
        AddNumber(static_cast<double>(sample.effort[j]), row);
      }
    };
  };
  return WriteModules(log, &ModuleSeries::sensors, describe, write);
}

/// The columns of a module's sensors; without a model, numbered values.
std::string SensorColumns(const model::ModuleType* type, const std::string& module, size_t count) {
  std::string names;
  if (type == nullptr) {
    for (size_t i = 0; i < count; ++i) names += fmt::format(",{}.value{}", module, i);
    return names;
  }
  for (const model::Sensor& sensor : type->sensors) {
    const std::string name = "," + module + "." + sensor.name;
    if (sensor.type == model::SensorType::kDistance) names += name + " [m]";
    if (sensor.type == model::SensorType::kContact) names += name;
    // A tilt sensor measures a direction, which has no unit; a contact sensor 0 or 1.
    if (sensor.type == model::SensorType::kTilt) names += name + ".x" + name + ".y" + name + ".z";
  }
  return names;
}

/// SENSORS: what the sensors that M3L declares measured.
Result<void> WriteSensors(const RunLog& log, const TextSink& write) {
  const auto describe = [](const ModuleSeries& module, const model::ModuleType* type,
                           ColumnGroup<logger::SensorSample>* group) {
    const size_t first = module.sensors.empty() ? 0 : module.sensors.front().values.size();
    group->names = SensorColumns(type, module.name, first);
    group->fill = [count = static_cast<size_t>(Commas(group->names))](
                      const logger::SensorSample& sample, std::string* row) {
      for (size_t i = 0; i < std::min(count, sample.values.size()); ++i) {
        AddNumber(static_cast<double>(sample.values[i]), row);
      }
    };
  };
  return WriteModules(log, &ModuleSeries::sensors, describe, write);
}

/// The seven columns of a pose.
std::string PoseColumns(const std::string& name) {
  return fmt::format(",{0}.x [m],{0}.y [m],{0}.z [m],{0}.qw,{0}.qx,{0}.qy,{0}.qz", name);
}

/// Position and quaternion, of pose_t or body_pose_t.
template <class Pose>
void AddPose(const Pose& pose, std::string* row) {
  for (int i = 0; i < 3; ++i) AddNumber(static_cast<double>(pose.position_m[i]), row);
  for (int i = 0; i < 4; ++i) AddNumber(static_cast<double>(pose.orientation_wxyz[i]), row);
}

/// WORLD tells modules by number, and what it tells of comes and goes. Columns for every link that
/// `entries` ever has, `names_of(name)` for each, filled by `fill` or left empty.
template <class Entry, class NamesOf, class Fill>
Result<void> WriteLinksOfWorld(const RunLog& log, std::vector<Entry> logger::WorldSample::*entries,
                               const NamesOf& names_of, const Fill& fill, const TextSink& write) {
  // A module that WORLD names and whose own messages are all lost has columns by its number.
  std::map<int, const ModuleSeries*> by_id;
  for (const ModuleSeries& module : log.modules) by_id[module.id] = &module;
  // The first pass finds which links there are, by module and link; sorted by them they get their
  // columns in the loop behind it.
  std::map<std::pair<int, int>, size_t> columns;
  for (const logger::WorldSample& sample : log.world) {
    for (const Entry& entry : sample.*entries) columns[{entry.module_id, entry.link}] = 0;
  }
  ColumnGroup<logger::WorldSample> group{&log.world};
  size_t next = 0;
  for (auto& [link, column] : columns) {
    column = next++;
    const auto module = by_id.find(link.first);
    const bool named = module != by_id.end();
    group.names +=
        names_of((named ? module->second->name : fmt::format("module{}", link.first)) + "." +
                 LinkName(named ? TypeOf(log, *module->second) : nullptr, link.second));
  }
  const size_t width = next == 0 ? 0 : static_cast<size_t>(Commas(group.names)) / next;
  group.fill = [&, width](const logger::WorldSample& sample, std::string* row) {
    // WORLD lists its links in any order, and only those that there are.
    std::vector<const Entry*> found(columns.size(), nullptr);
    for (const Entry& entry : sample.*entries) {
      found[columns.at({entry.module_id, entry.link})] = &entry;
    }
    for (const Entry* entry : found) {
      if (entry == nullptr) {
        row->append(width, ',');
      } else {
        fill(*entry, row);
      }
    }
  };
  return WriteSideBySide<logger::WorldSample>({group}, write);
}

/// WORLD: where each simulated body is, named by the link that stands for it.
Result<void> WritePoses(const RunLog& log, const TextSink& write) {
  return WriteLinksOfWorld(log, &logger::WorldSample::bodies, PoseColumns,
                           AddPose<morphbus::body_pose_t>, write);
}

/// WORLD: what the ground and obstacles exert on each link that they ever touch.
Result<void> WriteContactForces(const RunLog& log, const TextSink& write) {
  return WriteLinksOfWorld(
      log, &logger::WorldSample::contacts,
      [](const std::string& name) {
        return fmt::format(",{0}.fx [N],{0}.fy [N],{0}.fz [N]", name);
      },
      [](const morphbus::contact_force_t& contact, std::string* row) {
        for (const float f : contact.force_n) AddNumber(static_cast<double>(f), row);
      },
      write);
}

/// TRANSFORM: where each module believes that its links are.
Result<void> WritePropagatedPoses(const RunLog& log, const TextSink& write) {
  using logger::TransformSample;
  const auto describe = [](const ModuleSeries& module, const model::ModuleType* type,
                           ColumnGroup<TransformSample>* group) {
    const size_t links =
        CountOf(type, &model::ModuleType::links, module.transforms, &TransformSample::X_RL);
    group->names = fmt::format(",{}.pose_stale", module.name);
    for (size_t l = 0; l < links; ++l) {
      group->names += PoseColumns(module.name + "." + LinkName(type, static_cast<int>(l)));
    }
    group->fill = [links](const TransformSample& sample, std::string* row) {
      // Until the root's pose has come to the module, it knows of none.
      if (!sample.has_pose) return;
      *row += sample.pose_stale ? ",1" : ",0";
      for (size_t l = 0; l < std::min(links, sample.X_RL.size()); ++l) AddPose(sample.X_RL[l], row);
    };
  };
  return WriteModules(log, &ModuleSeries::transforms, describe, write);
}

/// The words for joint_command_t's modes.
const char* ModeName(int mode) {
  switch (mode) {
    case morphbus::joint_command_t::MODE_HOLD:
      return "hold";
    case morphbus::joint_command_t::MODE_POSITION:
      return "position";
    case morphbus::joint_command_t::MODE_VELOCITY:
      return "velocity";
    default:
      return "?";
  }
}

/// ACTUATOR: what every joint was told.
Result<void> WriteCommands(const RunLog& log, const TextSink& write) {
  using logger::ActuatorSample;
  const auto describe = [](const ModuleSeries& module, const model::ModuleType* type,
                           ColumnGroup<ActuatorSample>* group) {
    const size_t joints =
        CountOf(type, &model::ModuleType::joints, module.actuators, &ActuatorSample::joints);
    for (size_t j = 0; j < joints; ++j) {
      const std::string joint = module.name + "." + JointColumnName(type, static_cast<int>(j));
      group->names +=
          fmt::format(",{0}.target [{1}],{0}.speed [{1}/s],{0}.mode", joint, JointUnit(type, j));
    }
    group->fill = [joints](const ActuatorSample& sample, std::string* row) {
      for (size_t j = 0; j < std::min(joints, sample.joints.size()); ++j) {
        // The target means something only of a position, the speed nothing of a joint that holds.
        const morphbus::joint_command_t& joint = sample.joints[j];
        const bool position = joint.mode == morphbus::joint_command_t::MODE_POSITION;
        const bool hold = joint.mode == morphbus::joint_command_t::MODE_HOLD;
        const auto add = [row](bool means_something, double value) {
          if (!means_something) return static_cast<void>(row->append(","));
          AddNumber(value, row);
        };
        add(position, joint.target_si);
        add(!hold, joint.speed_si);
        *row += std::string(",") + ModeName(joint.mode);
      }
    };
  };
  return WriteModules(log, &ModuleSeries::actuators, describe, write);
}

/// Rows of all modules in order of time; of equal times in that of the modules.
class Rows {
 public:
  void Add(int64_t time_us, std::string cells) { rows_.emplace_back(time_us, std::move(cells)); }
  Result<void> Write(std::string_view header, const TextSink& write) {
    std::ranges::stable_sort(rows_, {}, &std::pair<int64_t, std::string>::first);
    if (Result<void> written = write(header); !written) return written;
    for (const auto& [time_us, cells] : rows_) {
      Result<void> written = write(TimeCell(time_us) + cells + "\n");
      if (!written) return written;
    }
    return {};
  }

 private:
  std::vector<std::pair<int64_t, std::string>> rows_;
};

/// ACTUATOR: what connectors were told, which is seldom.
Result<void> WriteConnectorCommands(const RunLog& log, const TextSink& write) {
  Rows rows;
  for (const ModuleSeries& module : log.modules) {
    const model::ModuleType* type = TypeOf(log, module);
    for (const logger::ActuatorSample& sample : module.actuators) {
      for (const morphbus::connector_command_t& command : sample.connectors) {
        std::string state = fmt::format("state{}", command.state);
        std::string value = fmt::format("{}", command.value);
        // Of a damaged log connector, state and value may be any numbers; those that the type does
        // not have stay numbers.
        const bool known =
            type != nullptr && bridge::IsIndex(command.connector, type->connectors.size()) &&
            bridge::IsIndex(command.state, type->connectors[command.connector].states.size());
        if (known) {
          const model::StateVariable& s = type->connectors[command.connector].states[command.state];
          state = s.name;
          const bool listed = bridge::IsIndex(command.value, s.values.size());
          if (listed) value = model::ValueText(s.values[command.value]);
        }
        rows.Add(sample.time_us, fmt::format(",{},{},{},{}", module.name,
                                             NameOf(type, &model::ModuleType::connectors,
                                                    command.connector, "connector"),
                                             CsvCell(state), CsvCell(value)));
      }
    }
  }
  return rows.Write("time [s],module,connector,state,value\n", write);
}

/// "name=part" of a status's labels, with spaces between.
std::string LabelsText(const model::ModuleType* type, const morphbus::status_t& status) {
  std::string text;
  for (const morphbus::label_t& label : status.labels) {
    const bool joint = label.kind == morphbus::label_t::KIND_JOINT;
    text += (text.empty() ? "" : " ") + label.name + "=" +
            (joint ? JointColumnName(type, label.index) : LinkName(type, label.index));
  }
  return text;
}

/// "joint=+1" of the joints with a convention, with spaces between.
std::string SignsText(const model::ModuleType* type, const morphbus::status_t& status) {
  std::string text;
  for (size_t j = 0; j < status.joint_sign.size(); ++j) {
    if (status.joint_sign[j] == 0) continue;
    text += (text.empty() ? "" : " ") + JointColumnName(type, static_cast<int>(j)) +
            (status.joint_sign[j] > 0 ? "=+1" : "=-1");
  }
  return text;
}

/// STATUS: a row each.
Result<void> WriteRoles(const RunLog& log, const TextSink& write) {
  Rows rows;
  for (const ModuleSeries& module : log.modules) {
    const model::ModuleType* type = TypeOf(log, module);
    for (const logger::StatusSample& sample : module.status) {
      const morphbus::status_t& s = sample.status;
      rows.Add(sample.time_us,
               fmt::format(",{},{},{},{},{},{},{},{},{}", sample.tick, module.name,
                           CsvCell(s.role_name), CsvCell(LabelsText(type, s)), SignsText(type, s),
                           int{s.has_pose}, int{s.pose_stale}, int{s.frozen}, s.incarnation));
    }
  }
  return rows.Write(
      "time [s],tick,module,role,labels,signs,has_pose,pose_stale,frozen,incarnation\n", write);
}

/// Faults of the program, in the words of `info`.
Result<void> WriteFaults(const RunLog& log, const TextSink& write) {
  Rows rows;
  for (const logger::FaultFact& fault : log.facts.faults) {
    // A line of 0 says that the image has no lines; its cell stays empty.
    rows.Add(fault.time_us,
             fmt::format(",{},{},{},{},{},{}", fault.module, CsvCell(fault.role),
                         CsvCell(fault.text), CsvCell(fault.function), CsvCell(fault.file),
                         fault.fault.line > 0 ? std::to_string(fault.fault.line) : ""));
  }
  return rows.Write("time [s],module,role,fault,function,file,line\n", write);
}

/// Lines that the program printed, in the words of `info`.
Result<void> WritePrints(const RunLog& log, const TextSink& write) {
  Rows rows;
  for (const logger::PrintFact& print : log.facts.prints) {
    rows.Add(print.time_us,
             fmt::format(",{},{},{},{},{}", print.module, CsvCell(print.role), CsvCell(print.text),
                         CsvCell(print.file),
                         print.print.line > 0 ? std::to_string(print.print.line) : ""));
  }
  return rows.Write("time [s],module,role,text,file,line\n", write);
}

/// Values of fields that the program traces: a row each.
Result<void> WriteTraces(const RunLog& log, const TextSink& write) {
  bridge::ProgramWords words(log.described);
  words.deployed() = log.deployed;
  Rows rows;
  for (const ModuleSeries& module : log.modules) {
    for (const logger::TraceSample& sample : module.traces) {
      const bridge::TracedValue value = words.Trace(sample.program_hash, sample.role, sample.trace);
      rows.Add(sample.time_us,
               fmt::format(",{},{},{},{},{}", sample.tick, module.name, CsvCell(sample.role_name),
                           CsvCell(value.field), value.value));
    }
  }
  return rows.Write("time [s],tick,module,role,field,value\n", write);
}

/// What people told the run while it went on.
Result<void> WriteControls(const RunLog& log, const TextSink& write) {
  Rows rows;
  for (const auto& [tick, command] : log.facts.commands) {
    // A damaged log may name any tick.
    int64_t time_us = 0;
    if (__builtin_mul_overflow(tick, int64_t{log.tick_us}, &time_us)) continue;
    rows.Add(time_us, fmt::format(",{},{}", tick, CsvCell(command)));
  }
  return rows.Write("time [s],tick,command\n", write);
}

}  // namespace

const std::vector<CsvTable>& CsvTables() {
  static const std::vector<CsvTable> tables = {{"joints.csv", WriteJoints},
                                               {"sensors.csv", WriteSensors},
                                               {"poses.csv", WritePoses},
                                               {"propagated_poses.csv", WritePropagatedPoses},
                                               {"contact_forces.csv", WriteContactForces},
                                               {"commands.csv", WriteCommands},
                                               {"connector_commands.csv", WriteConnectorCommands},
                                               {"roles.csv", WriteRoles},
                                               {"faults.csv", WriteFaults},
                                               {"prints.csv", WritePrints},
                                               {"traces.csv", WriteTraces},
                                               {"controls.csv", WriteControls}};
  return tables;
}

}  // namespace morphbus::tools
