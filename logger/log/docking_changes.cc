#include "logger/log/docking_changes.h"

#include <fmt/format.h>

#include <algorithm>

#include "compiler/base/text.h"
#include "logger/log/text_lines.h"

namespace morphbus::logger {
namespace {

/// A program may dock and part for hours: so many changes are kept.
constexpr size_t kMaxKept = 1000;

}  // namespace

void DockingChanges::Take(const morphbus::module_sensors_t& reading, int64_t time_us) {
  Module& module = modules_[reading.module_id];
  // A log may hold a reading twice, and out of order; the newest is known already.
  if (time_us <= module.time_us) return;
  std::set<Docking> now;
  for (const morphbus::docked_connector_t& d : reading.docked) {
    now.emplace(d.connector, d.mate_module, d.mate_connector);
  }
  // The first reading is what the module was built with, and no change.
  const bool first = module.time_us < 0;
  module.time_us = time_us;
  if (first) module.name = reading.name;
  if (!first && now != module.dockings) {
    // What was sensed and is not any more has parted; what is new has docked.
    for (const Docking& docking : module.dockings) {
      if (now.count(docking) == 0) Note(reading.module_id, time_us, false, docking);
    }
    for (const Docking& docking : now) {
      if (module.dockings.count(docking) == 0) Note(reading.module_id, time_us, true, docking);
    }
  }
  module.dockings = std::move(now);
}

void DockingChanges::Note(int module, int64_t time_us, bool docked, const Docking& docking) {
  // Both modules sense a docking; it is noted for the one with the lower number.
  const auto [connector, mate, mate_connector] = docking;
  if (std::tie(mate, mate_connector) < std::tie(module, connector)) return;
  // All are counted, also those that are not kept.
  ++count_;
  if (changes_.size() < kMaxKept) changes_.push_back({time_us, docked, module, docking});
}

bool DockingChanges::OfLoss(const Change& change) const {
  // A module that is lost lets go of its neighbours, which is told as the loss.
  const auto was_lost = [&](int number) {
    const auto module = modules_.find(number);
    const auto lost = module == modules_.end() ? lost_.end() : lost_.find(module->second.name);
    return lost != lost_.end() && change.time_us >= lost->second;
  };
  return !change.docked && (was_lost(change.module) || was_lost(std::get<1>(change.docking)));
}

int64_t DockingChanges::count() const {
  return count_ - std::ranges::count_if(changes_, [this](const Change& c) { return OfLoss(c); });
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
      if (connector >= 0 && connector < static_cast<int>(connectors.size())) {
        return name + "." + connectors[connector].name;
      }
    }
  }
  return fmt::format("{}.{}", name, connector);
}

std::vector<DockingFact> DockingChanges::Facts(const model::Model* model,
                                               const model::Robot* robot) const {
  std::vector<DockingFact> facts;
  for (const Change& change : changes_) {
    if (OfLoss(change)) continue;
    const auto [connector, mate, mate_connector] = change.docking;
    facts.push_back({change.time_us, change.docked, Name(model, robot, change.module, connector),
                     Name(model, robot, mate, mate_connector)});
  }
  // Modules were read one after the other: the changes of all of them are brought into one order.
  std::stable_sort(facts.begin(), facts.end(), [](const DockingFact& a, const DockingFact& b) {
    return a.time_us < b.time_us;
  });
  return facts;
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
