#pragma once
// The spy's two lists as tables: channels and processes.

#include <string>
#include <vector>

#include "tools/spy/spy_snapshot.h"
#include "tools/spy/spy_ui.h"
#include "tools/spy/table_layout.h"

namespace morphbus::tools {

/// A table: its columns, and a row for each channel or process.
struct SpyTableText {
  std::vector<TableColumn> columns;
  std::vector<TableRow> rows;

  /// Leaves out what is drawn, meters and sparklines: for text without a screen.
  void DropDrawn();
};

/// The table of these channels; the titles show by which column `ui` sorts, if it is given. Names
/// that begin with `prefix` are shown without it.
SpyTableText ChannelTableText(const std::vector<const ChannelRow*>& rows, const std::string& prefix,
                              const SpyUi* ui);
/// The table of these processes; with the run's name before each if there are several runs.
SpyTableText ProcessTableText(const std::vector<const ProcessRow*>& rows, bool several_runs);

}  // namespace morphbus::tools
