#include "bridge/outward/session_hub.h"

#include <chrono>

namespace morphbus::bridge {

void SessionHub::Start(Catalogue catalogue, std::function<void()> wake) {
  // There are no clients yet, so that nobody needs the mutex.
  catalogue_ = std::move(catalogue);
  last_.resize(catalogue_.channels.size());
  wake_ = std::move(wake);
}

uint64_t SessionHub::Enter(bool may_control, bool knows_playback) {
  const std::lock_guard lock(mutex_);
  ClientRequest connected;
  connected.may_control = may_control;
  connected.client = ++last_id_;
  // The greeting says what was refused so far, which is the only place where clients see it.
  nlohmann::json counts = nlohmann::json::object();
  for (const auto& [kind, count] : refused_) counts[kind] = count;
  catalogue_.metadata["refused"] = counts.dump();
  auto session =
      std::make_unique<ClientSession>(connected.client, may_control, catalogue_, knows_playback);
  // What was said before it came: the last of each state, and all parameters.
  for (size_t c = 0; c < last_.size(); ++c) {
    if (last_[c].second != nullptr) session->Offer(c, last_[c].first, last_[c].second);
  }
  for (const auto& [name, value] : parameters_) session->SetParameter(name, value);
  sessions_[connected.client] = std::move(session);
  if (!may_control) ++guests_;
  Keep({connected});
  return connected.client;
}

void SessionHub::Leave(uint64_t client) {
  const std::lock_guard lock(mutex_);
  // Leaving twice, or without having entered, changes nothing.
  const auto found = sessions_.find(client);
  if (found == sessions_.end()) return;
  if (!found->second->may_control()) --guests_;
  sessions_.erase(found);
  ClientRequest gone;
  gone.kind = ClientRequest::Kind::kDisconnected;
  gone.client = client;
  Keep({gone});
}

void SessionHub::Keep(std::vector<ClientRequest> requests) {
  if (requests.empty()) return;
  // One thread takes them all, whichever client they are of.
  for (ClientRequest& request : requests) requests_.push_back(std::move(request));
  requested_.notify_one();
}

// Every call for one client comes through here: the session is looked up, since the client may be
// gone by now, and who sends is woken when the mutex is free again.
template <class Act>
void SessionHub::WithSession(uint64_t client, const Act& act) {
  {
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(client);
    if (found == sessions_.end()) return;
    act(found->second.get());
  }
  wake_();
}

void SessionHub::TakeText(uint64_t client, std::string_view text) {
  WithSession(client, [&](ClientSession* session) {
    std::vector<ClientRequest> requests;
    session->TakeText(text, &requests);
    Keep(std::move(requests));
  });
}

void SessionHub::TakeBinary(uint64_t client, std::string_view bytes) {
  WithSession(client, [&](ClientSession* session) {
    std::vector<ClientRequest> requests;
    session->TakeBinary(bytes, &requests);
    Keep(std::move(requests));
  });
}

bool SessionHub::Next(uint64_t client, double now_s, OutgoingFrame* frame) {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(client);
  if (found == sessions_.end()) return false;
  // The server's thread writes one frame at a time, so that the others can wait in the session,
  // which knows what to leave out.
  std::optional<OutgoingFrame> next = found->second->Next(now_s);
  if (next) *frame = std::move(*next);
  return next.has_value();
}

bool SessionHub::IsOverrun(uint64_t client) const {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(client);
  return found != sessions_.end() && found->second->overrun();
}

void SessionHub::Count(const std::string& kind) {
  // Refusals come from the server's thread, before there is a session to count them.
  const std::lock_guard lock(mutex_);
  ++refused_[kind];
}

int SessionHub::num_guests() const {
  // Guests have places of their own, so that they leave room for those who have the token.
  const std::lock_guard lock(mutex_);
  return guests_;
}

void SessionHub::Publish(size_t channel, int64_t time_ns, const std::string& bytes) {
  // One copy of the bytes serves all clients.
  auto body = std::make_shared<const std::string>(bytes);
  {
    const std::lock_guard lock(mutex_);
    // For who comes later, also while nobody is there.
    if (catalogue_.channels[channel].is_state) last_[channel] = {time_ns, body};
    if (sessions_.empty()) return;
    for (const auto& [id, session] : sessions_) session->Offer(channel, time_ns, body);
  }
  wake_();
}

void SessionHub::PublishTo(uint64_t client, size_t channel, int64_t time_ns,
                           const std::string& bytes) {
  // Copied before the mutex is taken, which other threads may be waiting for.
  auto body = std::make_shared<const std::string>(bytes);
  WithSession(client, [&](ClientSession* s) { s->Offer(channel, time_ns, std::move(body)); });
}

bool SessionHub::HasRoom(uint64_t client) const {
  // Who reads a log to a client goes no faster than the client takes it.
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find(client);
  return found != sessions_.end() && found->second->HasRoom();
}

void SessionHub::PublishTime(int64_t time_ns) {
  // Times are not kept for who comes later: the next one follows at once.
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, session] : sessions_) session->OfferTime(time_ns);
  }
  wake_();
}

void SessionHub::PublishTimeTo(uint64_t client, int64_t time_ns) {
  WithSession(client, [&](ClientSession* s) { s->OfferTime(time_ns); });
}

void SessionHub::SetParameter(const std::string& name, const nlohmann::json& value) {
  {
    const std::lock_guard lock(mutex_);
    nlohmann::json& known = parameters_[name];
    // Nobody is woken for what is no news.
    if (known == value) return;
    known = value;
    for (const auto& [id, session] : sessions_) session->SetParameter(name, value);
  }
  wake_();
}

void SessionHub::SetParameterOf(uint64_t client, const std::string& name,
                                const nlohmann::json& value) {
  WithSession(client, [&](ClientSession* s) { s->SetParameter(name, value); });
}

std::vector<ClientRequest> SessionHub::TakeRequests(int wait_ms) {
  std::unique_lock lock(mutex_);
  // A source that has other work to do asks with 0, and waits for nothing.
  requested_.wait_for(lock, std::chrono::milliseconds(wait_ms),
                      [this] { return !requests_.empty(); });
  return std::exchange(requests_, {});
}

void SessionHub::AnswerSet(const ClientRequest& request) {
  WithSession(request.client,
              [&](ClientSession* s) { s->AnswerSet(request.name, request.set_id); });
}

void SessionHub::AnswerCall(const ClientRequest& request, const nlohmann::json& answer) {
  WithSession(request.client,
              [&](ClientSession* s) { s->AnswerCall(request.service, request.call, answer); });
}

void SessionHub::RefuseCall(const ClientRequest& request, const std::string& reason) {
  WithSession(request.client,
              [&](ClientSession* s) { s->RefuseCall(request.service, request.call, reason); });
}

void SessionHub::SendPlayback(uint64_t client, const PlaybackState& state) {
  WithSession(client, [&](ClientSession* s) { s->SendPlayback(state); });
}

void SessionHub::SendStatus(uint64_t client, int level, const std::string& text) {
  WithSession(client, [&](ClientSession* s) { s->SendStatus(level, text); });
}

std::map<std::string, int64_t> SessionHub::refused() const {
  const std::lock_guard lock(mutex_);
  return refused_;
}

}  // namespace morphbus::bridge
