// Sends LCM messages at even times and records when it sent them, for tests of what a listener
// tells of rates and jitter. Sends through LCM's own library.
//
//   bus_generator [--url URL] [--size BYTES] --seconds S RECORD HZ...
//
// Publishes on GEN_<HZ> for each rate, S * HZ + 1 messages, beside each other. RECORD gets a line
// "CHANNEL NANOSECONDS" a message (CLOCK_REALTIME, taken just before it was handed to LCM). A
// payload begins with the message's number, eight bytes.

#include <lcm/lcm.h>
#include <time.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

namespace {

constexpr int64_t kSecond = 1'000'000'000;

int64_t Now(clockid_t clock) {
  timespec time = {};
  clock_gettime(clock, &time);
  return int64_t{time.tv_sec} * kSecond + time.tv_nsec;
}

/// One channel: what to send, and when it was sent.
struct Stream {
  int64_t hz = 1;
  std::string channel;
  std::vector<int64_t> sent_ns;
};

/// Sends all messages of a channel, each at its time after `begin_ns` on the monotonic clock.
void Send(const std::string& url, int64_t begin_ns, size_t messages, size_t size, Stream* stream) {
  lcm_t* lcm = lcm_create(url.empty() ? nullptr : url.c_str());
  if (lcm == nullptr) std::exit(3);
  std::vector<uint8_t> payload(size, 0xA5);
  stream->sent_ns.reserve(messages);
  for (size_t i = 0; i < messages; ++i) {
    const int64_t due = begin_ns + static_cast<int64_t>(i) * kSecond / stream->hz;
    const timespec time = {due / kSecond, due % kSecond};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) != 0) {
    }
    for (size_t b = 0; b < 8; ++b) payload[b] = static_cast<uint8_t>(i >> (56 - 8 * b));
    stream->sent_ns.push_back(Now(CLOCK_REALTIME));
    lcm_publish(lcm, stream->channel.c_str(), payload.data(), static_cast<unsigned>(size));
  }
  lcm_destroy(lcm);
}

}  // namespace

int main(int argc, char** argv) {
  std::string url;
  size_t size = 64;
  double seconds = 1;
  std::vector<std::string> words;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool more = i + 1 < argc;
    if (word == "--url" && more) {
      url = argv[++i];
    } else if (word == "--size" && more) {
      size = std::max(8, std::atoi(argv[++i]));
    } else if (word == "--seconds" && more) {
      seconds = std::atof(argv[++i]);
    } else {
      words.push_back(word);
    }
  }
  if (words.size() < 2) return 2;
  std::vector<Stream> streams;
  for (size_t i = 1; i < words.size(); ++i)
    streams.push_back({std::atoi(words[i].c_str()), "GEN_" + words[i], {}});
  // All threads are there before the first message is due.
  const int64_t begin_ns = Now(CLOCK_MONOTONIC) + kSecond / 5;
  std::vector<std::thread> threads;
  for (Stream& stream : streams) {
    const auto messages = static_cast<size_t>(seconds * static_cast<double>(stream.hz)) + 1;
    threads.emplace_back(Send, url, begin_ns, messages, size, &stream);
  }
  for (std::thread& thread : threads) thread.join();
  std::FILE* record = std::fopen(words[0].c_str(), "we");
  if (record == nullptr) return 3;
  for (const Stream& stream : streams) {
    for (const int64_t ns : stream.sent_ns) {
      std::fprintf(record, "%s %lld\n", stream.channel.c_str(), static_cast<long long>(ns));
    }
  }
  return std::fclose(record) == 0 ? 0 : 3;
}
