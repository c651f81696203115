#include "tools/commands/run_pairs.h"

#include <algorithm>
#include <string>
#include <utility>

#include "compiler/base/text.h"
#include "logger/compare/matcher.h"
#include "tools/base/print.h"
#include "tools/monitor/log_source.h"

namespace morphbus::tools {
namespace {

/// Seconds between two looks at whether something of the runs has changed.
constexpr double kPairsEvery = 0.5;

/// Sim time of the last tick, µs; 0 without any.
int64_t LastTickOf(const logger::RunLog& log) {
  return log.ticks_us.empty() ? 0 : log.ticks_us.back();
}

const model::ModuleType& PairedTypeOf(const logger::RunLog& log,
                                      const logger::ModuleSeries& module) {
  return log.model->TypeOf(*log.robot, module.model_index);
}

/// The signs of a joint over time, as spans.
void AddSignSpans(const logger::JointSigns& signs,
                  google::protobuf::RepeatedPtrField<morphbus::SignSpan>* out) {
  for (const auto& [since_us, sign] : signs.spans()) {
    morphbus::SignSpan& span = *out->Add();
    span.set_since_us(since_us);
    span.set_sign(sign);
  }
}

}  // namespace

morphbus::Pairs PairsOf(const logger::RunLog& a, const logger::RunLog& b) {
  morphbus::Pairs out;
  const logger::Matching matching = logger::Match(a, b, std::min(LastTickOf(a), LastTickOf(b)));
  for (const logger::ModulePair& pair : matching.pairs) {
    const logger::ModuleSeries& module_a = a.modules[pair.a];
    const logger::ModuleSeries& module_b = b.modules[pair.b];
    const model::ModuleType& type_a = PairedTypeOf(a, module_a);
    const model::ModuleType& type_b = PairedTypeOf(b, module_b);
    morphbus::PairedModule& paired = *out.add_modules();
    // Names of roles and labels come from the bus, and may hold anything.
    paired.set_role(EscapeControl(pair.role));
    paired.set_module_a(module_a.name);
    paired.set_module_b(module_b.name);
    for (const logger::LinkPair& link : pair.links) {
      morphbus::PairedLink& told = *paired.add_links();
      told.set_label(EscapeControl(link.label));
      told.set_labelled(link.labelled);
      told.set_link_a(type_a.links[link.link_a].name);
      told.set_link_b(type_b.links[link.link_b].name);
    }
    for (const logger::JointPair& joint : pair.joints) {
      morphbus::PairedJoint& told = *paired.add_joints();
      told.set_label(EscapeControl(joint.label));
      told.set_labelled(joint.labelled);
      told.set_joint_a(type_a.joints[joint.joint_a].name);
      told.set_joint_b(type_b.joints[joint.joint_b].name);
      AddSignSpans(logger::SignsOfA(module_a, joint), told.mutable_signs_a());
      AddSignSpans(logger::SignsOfB(module_b, joint), told.mutable_signs_b());
    }
  }
  for (const logger::Unmatched& module : matching.unmatched) {
    morphbus::UnpairedModule& told = *out.add_unpaired();
    told.set_in_a(module.in_a);
    told.set_module((module.in_a ? a : b).modules[module.module].name);
    told.set_role(EscapeControl(module.role));
  }
  return out;
}

PairTeller::PairTeller(std::vector<MonitorSource*> sources, bridge::SessionHub* hub, size_t channel)
    : sources_(std::move(sources)), hub_(hub), channel_(channel) {}

void PairTeller::Step() {
  if (sources_.size() < 2 || timer_.seconds() < next_s_) return;
  next_s_ = timer_.seconds() + kPairsEvery;
  const int64_t version = sources_[0]->outline_version() + sources_[1]->outline_version();
  if (version == told_) return;
  told_ = version;
  // A log does not change, and is read once.
  for (size_t i = 0; i < 2; ++i) {
    if (outlines_[i] && dynamic_cast<LogSource*>(sources_[i]) != nullptr) continue;
    Result<logger::RunLog> outline = sources_[i]->Outline();
    if (!outline) return Warn("the two runs cannot be matched: " + outline.error().message);
    outlines_[i] = std::move(*outline);
  }
  const std::string pairs = PairsOf(*outlines_[0], *outlines_[1]).SerializeAsString();
  hub_->Publish(channel_, 0, pairs);
}

}  // namespace morphbus::tools
