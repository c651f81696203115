#pragma once
// The tree of a sweep's file before anything in it is understood: settings under their whole names,
// and what the command line says in the place of what the file says.

#include <array>
#include <string>
#include <string_view>

#include "compiler/source/toml.h"

namespace morphbus::tools {

/// Keys at the top of the file that are no inputs of a run.
inline constexpr std::array<std::string_view, 9> kSweepKeys = {
    "variants", "method", "samples", "sample_seed", "set", "run", "expect", "keep", "engine"};

/// The table that makes the file one of a search.
inline constexpr std::string_view kSearchTable = "search";

/// Gives the settings in [set], [search] and every [[run]] their whole names, as commands have
/// them: where TOML reads `MTRAN.link.mass = 0.2` as tables in tables, there is one entry
/// "MTRAN.link.mass" after this.
void FlattenSettings(source::TomlValue::Table* file);

/// Lays "NAME=VALUES" of a command line over a tree with flat settings. It takes the place of all
/// that the file says of that name, also in a [[run]]. The word is added to `sources`. False, after
/// saying why, if it is no such word.
bool LayOver(source::SourceSet* sources, const std::string& text, source::TomlValue::Table* file,
             source::Diagnostics* diagnostics);

}  // namespace morphbus::tools
