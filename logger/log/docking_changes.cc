#include "logger/log/docking_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "bridge/description/link_places.h"
#include "compiler/base/text.h"
#include "logger/log/run_facts.h"
#include "logger/log/text_lines.h"

namespace morphbus::logger {
namespace {

/// A program may dock and part for hours: so many changes are kept.
constexpr size_t kMaxKept = 1000;

/// Own connector, mate, its connector, of all that is docked.
std::set<std::tuple<int, int, int>> SetOf(const std::vector<morphbus::docked_connector_t>& docked) {
  std::set<std::tuple<int, int, int>> set;
  for (const morphbus::docked_connector_t& d : docked) {
    set.emplace(d.connector, d.mate_module, d.mate_connector);
  }
  return set;
}

}  // namespace

void DockingChanges::Take(const morphbus::module_sensors_t& reading, int64_t time_us) {
  Module& module = modules_[reading.module_id];
  // A log may hold a reading twice, and out of order; the newest is known already.
  if (time_us <= module.time_us) return;
  const bool first = module.time_us < 0;
  module.time_us = time_us;
  // Nearly every reading shows what the one before it did.
  if (!first && bridge::SameDocked(module.docked, reading.docked)) return;
  const std::set<Docking> before = SetOf(module.docked), now = SetOf(reading.docked);
  module.docked = reading.docked;
  // The first reading is what the module was built with, and no change.
  if (first) {
    module.name = reading.name;
    return;
  }
  // What was sensed and is not any more has parted; what is new has docked.
  for (const Docking& docking : before) {
    if (!now.contains(docking)) Note(reading.module_id, time_us, false, docking);
  }
  for (const Docking& docking : now) {
    if (!before.contains(docking)) Note(reading.module_id, time_us, true, docking);
  }
}

void DockingChanges::Note(int module, int64_t time_us, bool docked, const Docking& docking) {
  // Both modules sense a docking; it is noted for the one with the lower number.
  const auto [connector, mate, mate_connector] = docking;
  if (std::tie(mate, mate_connector) < std::tie(module, connector)) return;
  // All are counted, also those that are not kept.
  ++count_;
  if (changes_.size() < kMaxKept) changes_.push_back({time_us, docked, module, docking});
}

bool DockingChanges::OfLoss(const Change& change, const LogFacts& facts) const {
  // A module that is lost lets go of its neighbours, which is told as the loss.
  const auto was_lost = [&](int number) {
    const auto module = modules_.find(number);
    if (module == modules_.end()) return false;
    const auto lost = facts.lost_modules.find(module->second.name);
    return lost != facts.lost_modules.end() && change.time_us >= lost->second;
  };
  return !change.docked && (was_lost(change.module) || was_lost(std::get<1>(change.docking)));
}

std::string DockingChanges::Name(const model::Model* model, const model::Robot* robot, int module,
                                 int connector) const {
  // Of a damaged log the numbers may be any.
  const auto found = modules_.find(module);
  const std::string name =
      found == modules_.end() ? fmt::format("module {}", module) : found->second.name;
  if (model != nullptr && robot != nullptr) {
    const std::optional<int> index = robot->FindModule(name);
    if (index) {
      const std::vector<model::Connector>& connectors = model->TypeOf(*robot, *index).connectors;
      if (bridge::IsIndex(connector, connectors.size())) {
        return name + "." + connectors[connector].name;
      }
    }
  }
  return fmt::format("{}.{}", name, connector);
}

void DockingChanges::Tell(const model::Model* model, const model::Robot* robot,
                          LogFacts* facts) const {
  facts->num_dockings = count_;
  for (const Change& change : changes_) {
    if (OfLoss(change, *facts)) {
      --facts->num_dockings;
      continue;
    }
    const auto [connector, mate, mate_connector] = change.docking;
    facts->dockings.push_back({change.time_us, change.docked,
                               Name(model, robot, change.module, connector),
                               Name(model, robot, mate, mate_connector)});
  }
  // Modules were read one after the other: the changes of all of them are brought into one order.
  std::ranges::stable_sort(facts->dockings, {}, &DockingFact::time_us);
}

std::string DockingsText(const std::vector<DockingFact>& dockings, int64_t count) {
  std::string text;
  if (count == 0) return text;
  AddLine(&text, "{} of connectors:", Counted(count, "change"));
  for (const DockingFact& d : dockings) {
    AddLine(&text, "  {:.3f} s {} and {} {}", Seconds(d.time_us), d.connector, d.mate,
            d.docked ? "docked" : "parted");
  }
  return text;
}

}  // namespace morphbus::logger
