#pragma once

namespace morphbus {

/// The version of this software, "0.1.0-a9c11895": that of the project and, if it was built from a
/// repository, the commit, with "+" if files had been changed since. Logs and HELLO carry it, for
/// people: two builds that say the same thing are not proved to be the same.
const char* Version();

}  // namespace morphbus
