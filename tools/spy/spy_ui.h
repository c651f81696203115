#pragma once
// What the spy's screen is showing, and how keys change it.

#include <optional>
#include <string>
#include <vector>

#include "tools/spy/spy_snapshot.h"

namespace morphbus::tools {

/// A key that was pressed.
struct Key {
  enum class Code : uint8_t {
    kCharacter,
    kUp,
    kDown,
    kLeft,
    kRight,
    kPageUp,
    kPageDown,
    kHome,
    kEnd,
    kEnter,
    kEscape,
    kBackspace,
    kTab,
    kOther,
  };
  Code code = Code::kOther;  ///< kOther: one that means nothing here.
  char character = 0;        ///< kCharacter: printable ASCII.
};

/// By which column channels are sorted.
enum class SortBy : uint8_t {
  kName,
  kType,
  kRate,
  kJitter50,
  kJitter99,
  kBandwidth,
  kCount,
  kLost,
  kUndecodable,
};
/// The number of them.
inline constexpr int kSortColumns = 9;

/// What the screen is showing. Selections are names, so that they stay where they are when rows
/// come, go and change places.
struct SpyUi {
  /// The lists, the fields of a channel, all about a process, the keys.
  enum class Page : uint8_t { kLists, kChannel, kProcess, kHelp };
  Page page = Page::kLists;
  Page below_help = Page::kLists;  ///< To which the help returns.
  bool on_processes = false;       ///< Keys move in the list of modules, not of channels.
  SortBy sort = SortBy::kName;
  bool reverse =
      false;           ///< Against the column's own order, which is up for texts, down for numbers.
  std::string filter;  ///< Words that channels' names or types hold; "" shows all.
  bool typing = false;  ///< Characters go to the filter.
  bool frozen = false;  ///< The figures stand still.
  std::string channel;  ///< Selected, "" for the first one.
  std::string process;  ///< "RUN/PROCESS", "" for the first one.
  /// The run that the first line and the keys for pause, step and speed are about; "" for the first
  /// one that was heard.
  std::string run;
  /// The speed that the run has agreed to and CLOCK has not named yet: it is paused.
  std::optional<double> asked_speed;
  /// Whether that run takes commands from here: a run of this machine on a bus.
  bool takes_commands = false;
  bool quit = false;    ///< The user wants to leave.
  std::string message;  ///< What was said last, such as the answer to a command.
  bool failed = false;  ///< The message is an error.
  // Where the parts of the screen are scrolled to, and how many rows a list had when it was drawn.
  int channel_top = 0, process_top = 0, field_top = 0, help_top = 0;
  int list_rows = 10;
};

/// The channels that the filter lets through, in the order of the sort.
std::vector<const ChannelRow*> ListedChannels(const SpySnapshot& spy, const SpyUi& ui);
/// The processes that the filter lets through.
std::vector<const ProcessRow*> ListedProcesses(const SpySnapshot& spy, const SpyUi& ui);
/// "RUN/PROCESS".
std::string ProcessKey(const ProcessRow& row);

/// What all channels of runs begin with, "walk/", if that is the run that the screen is about and
/// no other run is heard; else empty. Where the screen names the run once, its lists need not.
std::string RunPrefix(const SpySnapshot& spy, const SpyUi& ui);

/// The index of the selected channel or process among those; 0 if it is not among them.
int SelectedChannel(const std::vector<const ChannelRow*>& rows, const SpyUi& ui);
int SelectedProcess(const std::vector<const ProcessRow*>& rows, const SpyUi& ui);

/// The run that the screen is about; null if there is none.
const RunRow* ShownRun(const SpySnapshot& spy, const SpyUi& ui);

/// Whether the run holds still, as far as one can see: by a command, or since before the spy came.
bool HoldsStill(const RunRow& run);

/// Obeys a key: changes what is shown. Returns the command that it gives to the run, as for
/// `morphbus control`; empty for most.
std::string Press(const Key& key, const SpySnapshot& spy, SpyUi* ui);

}  // namespace morphbus::tools
