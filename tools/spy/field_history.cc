#include "tools/spy/field_history.h"

#include <cmath>
#include <utility>

namespace morphbus::tools {

void FieldHistory::Take(MessageFields message) {
  fields_.clear();
  more_ = message.more;
  for (MessageField& field : message.fields) fields_.push_back({std::move(field), {}});
  // Histories go over to the fields of this message; those of others end.
  std::map<std::string, std::vector<double>> before = std::exchange(histories_, {});
  for (FieldRow& field : fields_) {
    if (histories_.size() >= kMostHistories) break;
    if (std::isnan(field.number)) continue;
    std::vector<double>& history = histories_[field.path];
    // A field keeps its history as long as every message has it.
    const auto known = before.find(field.path);
    if (known != before.end()) history = std::move(known->second);
    if (history.size() >= kMostValues) history.erase(history.begin());
    history.push_back(field.number);
    field.history = history;
  }
}

}  // namespace morphbus::tools
