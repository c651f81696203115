#include "tools/machine/machine_findings.h"

#include <fmt/format.h>

#include <algorithm>

#include "bridge/bus/lcm_url.h"
#include "sim/arithmetic.h"

namespace morphbus::tools {
namespace {

/// What limits are raised to: ample for a robot of 100 modules.
constexpr rlim_t kAmple = 4096;

/// A limit of the shell's, as its builtin ulimit and as prlimit call it.
struct LimitName {
  const char* finding;
  const char* what;
  const char* ulimit;
  const char* prlimit;
};

/// Whether a limit is enough.
Finding JudgeLimit(const LimitName& name, const rlimit& limit, rlim_t needed) {
  // A limit that there is not is told as -1 to scripts.
  const bool endless = limit.rlim_cur == RLIM_INFINITY;
  Finding finding{name.finding, Health::kGood, "", "", {}};
  // The figures are told whether or not they are enough, so that two machines can be compared.
  finding.text =
      fmt::format("{}: {}, {} are needed for 100 modules", name.what,
                  endless ? "no limit" : fmt::format("at most {}", limit.rlim_cur), needed);
  finding.figures = {{"limit", endless ? -1.0 : static_cast<double>(limit.rlim_cur)},
                     {"needed", static_cast<double>(needed)}};
  if (endless || limit.rlim_cur >= needed) return finding;
  // Nobody but root gets above the hard limit; the shell from which runs are started inherits it.
  finding.health = Health::kWarning;
  finding.mend = limit.rlim_max >= kAmple
                     ? fmt::format("ulimit {} {}", name.ulimit, kAmple)
                     : fmt::format("sudo prlimit --pid $$ {}={}", name.prlimit, kAmple);
  return finding;
}

}  // namespace

Finding JudgeBuffer(const Burst& burst) {
  Finding finding{"buffer", Health::kGood, "", "", {}};
  finding.figures = {{"asked_bytes", burst.asked_bytes},
                     {"got_bytes", burst.got_bytes},
                     {"burst", burst.sent},
                     {"kept", burst.kept},
                     {"needed", kNeededMessages}};
  finding.text = fmt::format(
      "receive buffer: asked {} bytes, got {}; of a burst of {} messages {} were kept, {} are "
      "needed for {} modules",
      burst.asked_bytes, burst.got_bytes, burst.sent, burst.kept, kNeededMessages, kDoctorModules);
  if (burst.kept >= kNeededMessages) return finding;
  // Lockstep asks again for what was lost and only becomes slower; in real time it stays lost.
  finding.health = Health::kWarning;
  constexpr int kEnoughBytes = 4'194'304;
  finding.mend = fmt::format(
      "echo net.core.rmem_max={} | sudo tee /etc/sysctl.d/60-morphbus.conf && sudo sysctl --system",
      std::max(burst.asked_bytes, kEnoughBytes));
  // The system would give more than the URL asks for.
  if (burst.got_bytes >= burst.asked_bytes) {
    finding.mend = fmt::format("export LCM_DEFAULT_URL='{}'", bridge::kDefaultLcmUrl);
  }
  return finding;
}

Finding JudgeFilter(int64_t limit_bytes, int instructions, bool taken) {
  Finding finding{"filter", Health::kGood, "", "", {}};
  // Whether the kernel took a filter decides; the limit is told besides, and may not be known.
  finding.figures = {{"limit_bytes", static_cast<double>(limit_bytes)},
                     {"instructions", instructions}};
  finding.text = fmt::format(
      "the kernel {} filters of {} instructions, as robots of any size need (net.core.optmem_max "
      "is "
      "{})",
      taken ? "takes" : "refuses", instructions,
      limit_bytes > 0 ? fmt::format("{} bytes", limit_bytes) : "not told");
  if (taken) return finding;
  // What other kernels since 6.8 have.
  constexpr int kEnoughBytes = 131'072;
  finding.health = Health::kWarning;
  finding.text += "; every message of a run wakes each of its processes";
  finding.mend = fmt::format(
      "echo net.core.optmem_max={} | sudo tee /etc/sysctl.d/61-morphbus.conf && sudo sysctl "
      "--system",
      kEnoughBytes);
  return finding;
}

Finding JudgeArithmetic(const std::string& fingerprint) {
  // A machine whose arithmetic differs is no worse, but its runs cannot be compared with others by
  // their hashes.
  if (fingerprint == sim::kUsualArithmetic) {
    return {
        "arithmetic",
        Health::kGood,
        fmt::format("{}: the usual one, so that runs have the same hash as elsewhere", fingerprint),
        "",
        {}};
  }
  return {
      "arithmetic",
      Health::kWarning,
      fmt::format("{}, where {} is usual: runs may have other hashes here than on other machines "
                  "(docs/arithmetic.md)",
                  fingerprint, sim::kUsualArithmetic),
      "",
      {}};
}

Finding JudgeFiles(const rlimit& limit) {
  // A module's process has few files open; the launcher holds two and a watch for each.
  return JudgeLimit({"files", "open files a process", "-n", "--nofile"}, limit, 512);
}

Finding JudgeProcesses(const rlimit& limit) {
  // Each module is a process, beside those that the user has anyhow.
  return JudgeLimit({"processes", "processes a user", "-u", "--nproc"}, limit, 256);
}

Finding JudgeClock(bool synchronized) {
  if (synchronized) return {"clock", Health::kGood, "the wall clock is synchronized", "", {}};
  return {"clock",
          Health::kWarning,
          "the wall clock is not synchronized: times of logs of several machines differ",
          "sudo timedatectl set-ntp true",
          {}};
}

Finding JudgeTimer(std::vector<double> late_ms) {
  std::sort(late_ms.begin(), late_ms.end());
  // The median tells what a run must live with in every tick; the worst may be a single mishap.
  const double median = late_ms[late_ms.size() / 2];
  const double worst = late_ms.back();
  Finding finding{"timer", Health::kGood, "", "", {{"median_ms", median}, {"worst_ms", worst}}};
  finding.text = fmt::format("a process that sleeps wakes {:.2f} ms late (worst of {}: {:.2f})",
                             median, late_ms.size(), worst);
  // A quarter of a control tick of 20 ms.
  if (median < 5) return finding;
  finding.health = Health::kWarning;
  finding.text += "; run --realtime will miss deadlines";
  finding.mend = "sudo renice -n -10 -p $$";
  return finding;
}

}  // namespace morphbus::tools
