#pragma once
// What stands between an engine, which has rows run, and whoever wants them run.

#include <optional>
#include <string>

#include "compiler/base/result.h"
#include "tools/sweep/chunk.h"

namespace morphbus::tools {

/// Where an engine has its rows from, and where it puts their results.
class RowSource {
 public:
  virtual ~RowSource() = default;
  /// The next row to be run; nothing if there is none left.
  virtual Result<std::optional<RowTask>> Next() = 0;
  /// The inputs of a row that Next has given before, for an engine that hands it over later.
  virtual Result<RowInputs> Inputs(const std::string& key) = 0;
  /// The bytes of a part that a row names.
  virtual Result<std::string> Part(const std::string& hash) = 0;
  virtual Result<void> Take(const RowTask& task, const RowResult& result) = 0;
  /// What was taken is kept after this, whatever becomes of the process.
  virtual Result<void> Settle() { return {}; }
  /// Called several times a second. False: to stop now; runs under way have no results.
  virtual bool GoOn() = 0;
  /// Of a source whose rows come from elsewhere: becomes readable when GoOn should be called, and
  /// where Next gives none there may be some later. -1: what Next says is final.
  [[nodiscard]] virtual int arrivals() const { return -1; }
};

}  // namespace morphbus::tools
