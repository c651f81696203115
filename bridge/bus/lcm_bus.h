#pragma once
// The bus over LCM. Stock tools on the same group see and may send everything.

#include <memory>
#include <string>

#include "bridge/bus/bus.h"
#include "compiler/base/result.h"

namespace morphbus::bridge {

/// Messages that one call of Handle takes at most, about; the in-process bus's queue holds as many.
inline constexpr size_t kBusQueueDepth = 4096;

/// Opens a bus on `url` (empty: $LCM_DEFAULT_URL, else LCM's default with ttl=0); see
/// bridge/bus/lcm_url.h. Fails in one sentence if the URL is bad, multicast has no route here, or
/// LCM refuses. Sends through LCM. On udpm it receives by a socket of its own, without LCM's
/// thread; opened at the first subscription, so a process that only publishes costs no wake-ups.
/// While only exact subscriptions exist, a kernel filter on it passes just their channels: foreign
/// traffic does not wake us. Messages of more than one datagram are not received at all.
Result<std::unique_ptr<Bus>> OpenLcmBus(const std::string& url);
/// The same for a process of a run; fails also if the URL cannot carry one (CheckCarriesRuns).
Result<std::unique_ptr<Bus>> OpenRunBus(const std::string& url);

}  // namespace morphbus::bridge
