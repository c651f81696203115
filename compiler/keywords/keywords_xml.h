#pragma once
// The XML file that extends the role language by a module type's links, joints, connectors and
// state variables (paper, Sec. III B).
//
//   <module version="1" name="MTRAN">
//     <link name="connecting_bar" keyword="LINK_CONNECTING_BAR"/>
//     <joint name="joint_1" keyword="JOINT_1" type="revolute"/>
//     <connector name="c1" keyword="C1">
//       <state name="extended" keyword="EXTENDED" type="bool"/>
//       <state name="mode" keyword="MODE" type="string"><value>slow</value>…</state>
//     </connector>
//   </module>

#include <string>
#include <string_view>

#include "compiler/keywords/module_keywords.h"

namespace morphbus::keywords {

/// The keywords as XML, UTF-8, two blanks an indent. ParseKeywordsXml reads it back unchanged.
std::string KeywordsXml(const ModuleKeywords& keywords);

/// Reads what KeywordsXml wrote, at most 1 MiB of it. As strict as the schema,
/// keywords.rng: unknown elements, missing attributes, stray text, keywords that are no identifiers
/// in capitals are errors, with the line they stand in; so are keywords that clash and numbers that
/// no double holds, which the schema cannot tell.
Result<ModuleKeywords> ParseKeywordsXml(std::string_view text);

}  // namespace morphbus::keywords
