// The key of a run: what `auth` is, and that nothing goes past it.

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "bridge/bus/inproc_bus.h"
#include "bridge/wire/channels.h"
#include "bridge/wire/codec.h"
#include "bridge/wire/sealed_bus.h"
#include "bridge/wire/stream_hash.h"
#include "test/bridge/sample_messages.h"

namespace morphbus::bridge {
namespace {

using Bytes = std::vector<uint8_t>;

/// The key of SipHash's own test: 00, 01, ... 0f.
RunKey::Bytes CountingKey() {
  RunKey::Bytes key;
  for (size_t i = 0; i < key.size(); ++i) key[i] = static_cast<uint8_t>(i);
  return key;
}

uint64_t LittleEndian(const uint8_t* at, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) value |= static_cast<uint64_t>(at[i]) << (8 * i);
  return value;
}

/// SipHash-2-4 word by word, as its authors describe it (Aumasson and Bernstein, "SipHash: a fast
/// short-input PRF", 2012).
uint64_t PlainSipHash(const RunKey::Bytes& key, const Bytes& text) {
  const uint64_t k0 = LittleEndian(key.data(), 8), k1 = LittleEndian(key.data() + 8, 8);
  uint64_t v[4] = {k0 ^ 0x736f6d6570736575ULL, k1 ^ 0x646f72616e646f6dULL,
                   k0 ^ 0x6c7967656e657261ULL, k1 ^ 0x7465646279746573ULL};
  const auto turn = [](uint64_t x, int by) { return x << by | x >> (64 - by); };
  const auto rounds = [&](int count) {
    for (int i = 0; i < count; ++i) {
      v[0] += v[1], v[2] += v[3];
      v[1] = turn(v[1], 13) ^ v[0], v[3] = turn(v[3], 16) ^ v[2];
      v[0] = turn(v[0], 32);
      v[2] += v[1], v[0] += v[3];
      v[1] = turn(v[1], 17) ^ v[2], v[3] = turn(v[3], 21) ^ v[0];
      v[2] = turn(v[2], 32);
    }
  };
  const auto compress = [&](uint64_t word) {
    v[3] ^= word;
    rounds(2);
    v[0] ^= word;
  };
  size_t at = 0;
  for (; at + 8 <= text.size(); at += 8) compress(LittleEndian(text.data() + at, 8));
  compress(LittleEndian(text.data() + at, text.size() - at) | static_cast<uint64_t>(text.size())
                                                                  << 56);
  v[2] ^= 0xff;
  rounds(4);
  return v[0] ^ v[1] ^ v[2] ^ v[3];
}

/// A message of each type that travels.
std::vector<Bytes> Messages() {
  std::vector<Bytes> messages;
  for (const SampleMessage& sample : SampleMessages()) messages.push_back(sample.bytes);
  return messages;
}

TEST(RunKeyTest, AuthIsTheSipHashOfChannelAndMessage) {
  Bytes fifteen(15);
  for (size_t i = 0; i < fifteen.size(); ++i) fifteen[i] = static_cast<uint8_t>(i);
  ASSERT_EQ(PlainSipHash(CountingKey(), fifteen), 0xa129ca6149be45e5u) << "the authors' own value";
  const std::string channel = "walk/m1/TRANSFORM";
  for (const Bytes& message : Messages()) {
    Bytes text = {static_cast<uint8_t>(channel.size())};
    text.insert(text.end(), channel.begin(), channel.end());
    text.insert(text.end(), message.begin(), message.end());
    std::fill_n(text.begin() + 1 + static_cast<std::ptrdiff_t>(channel.size()) + 8, 12, 0);
    EXPECT_EQ(RunKey(CountingKey()).AuthOf(channel, message.data(), message.size()),
              PlainSipHash(CountingKey(), text));
  }
}

TEST(RunKeyTest, WhateverIsAnotherMessageIsNotAuthentic) {
  const RunKey key(CountingKey());
  const std::string channel = "walk/m1/TRANSFORM";
  for (const Bytes& message : Messages()) {
    Bytes sealed = message;
    key.Seal(channel, sealed.data(), sealed.size());
    EXPECT_TRUE(key.IsAuthentic(channel, sealed.data(), sealed.size()));
    morphbus::header_t header;
    EXPECT_TRUE(DecodeHeader(sealed.data(), sealed.size(), &header)) << "the CRC fits again";
    EXPECT_EQ(MessageDigest(sealed.data(), sealed.size()),
              MessageDigest(message.data(), message.size()));
    // On another channel, of another run, in an open run, before it was sealed.
    EXPECT_FALSE(key.IsAuthentic("walk/m2/TRANSFORM", sealed.data(), sealed.size()));
    EXPECT_FALSE(key.IsAuthentic("walk/m1/TRANSFOR", sealed.data(), sealed.size()));
    RunKey::Bytes other = CountingKey();
    other[15] ^= 1;
    EXPECT_FALSE(RunKey(other).IsAuthentic(channel, sealed.data(), sealed.size()));
    EXPECT_FALSE(RunKey().IsAuthentic(channel, sealed.data(), sealed.size()));
    EXPECT_FALSE(key.IsAuthentic(channel, message.data(), message.size()));
    // A bit of it is flipped, or it is shorter; only the CRC is nobody's business here.
    for (size_t i = 0; i < sealed.size(); ++i) {
      Bytes altered = sealed;
      altered[i] ^= 1;
      EXPECT_EQ(key.IsAuthentic(channel, altered.data(), altered.size()), i >= 8 && i < 12) << i;
      EXPECT_FALSE(key.IsAuthentic(channel, sealed.data(), i)) << i;
    }
  }
  const Bytes longer(kMaxPayloadBytes + 1);
  EXPECT_FALSE(key.IsAuthentic(channel, longer.data(), longer.size()));
}

TEST(RunKeyTest, AMessageCannotLendBytesToTheNameOfItsChannel) {
  const RunKey key(CountingKey());
  // The same bytes in a row, divided elsewhere.
  Bytes message(60, 'x');
  std::fill_n(message.begin() + 8, 12, 0);
  const auto auth = key.AuthOf("walk/a", message.data(), message.size());
  EXPECT_NE(key.AuthOf("walk/ax", message.data(), message.size() - 1), auth);
}

TEST(RunKeyTest, AnOpenRunHasAuthZero) {
  const Bytes message = Messages().front();
  Bytes sealed = message;
  RunKey().Seal("walk/SIM/CLOCK", sealed.data(), sealed.size());
  EXPECT_EQ(sealed, message);
  EXPECT_TRUE(RunKey().IsAuthentic("walk/SIM/CLOCK", sealed.data(), sealed.size()));
  EXPECT_TRUE(RunKey().open());
  EXPECT_FALSE(RunKey(CountingKey()).open());
}

/// A fresh key in a new file.
Result<RunKey> CreateKey(const std::string& path) {
  Result<RunKey> key = RunKey::Random();
  if (!key) return key;
  if (Result<void> written = key->WriteTo(path); !written) return Fail(written.error().message);
  return key;
}

TEST(RunKeyTest, AKeyIsItsOwnersAlone) {
  char folder[] = "/tmp/morphbus-key-XXXXXX";
  ASSERT_NE(mkdtemp(folder), nullptr);
  const std::string path = std::string(folder) + "/key";
  const Result<RunKey> made = CreateKey(path);
  ASSERT_TRUE(made);
  struct stat info = {};
  ASSERT_EQ(stat(path.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  EXPECT_EQ(info.st_size, 16);
  const Result<RunKey> read = RunKey::Read(path);
  ASSERT_TRUE(read);
  const Bytes message = Messages().front();
  const auto auth_of = [&](const RunKey& key) {
    return key.AuthOf("walk/HELLO", message.data(), message.size());
  };
  EXPECT_EQ(auth_of(*read), auth_of(*made));
  EXPECT_NE(auth_of(*RunKey::Random()), auth_of(*made));
  EXPECT_FALSE(CreateKey(path)) << "a key that is there already is not used";
  ASSERT_EQ(chmod(path.c_str(), 0640), 0);
  EXPECT_FALSE(RunKey::Read(path)) << "others may read it";
  ASSERT_EQ(chmod(path.c_str(), 0600), 0);
  for (const char* text : {"short", "a text of more than sixteen bytes"}) {
    std::ofstream(path) << text;
    EXPECT_EQ(RunKey::Read(path).error().message, path + " is no key, which is a file of 16 bytes");
  }
  // What is no key is not to be made private, as it may be anything; a pipe is not waited for.
  EXPECT_EQ(RunKey::Read("/etc/passwd").error().message,
            "/etc/passwd is no key, which is a file of 16 bytes");
  EXPECT_EQ(RunKey::Read("/etc").error().message, "/etc is no key, which is a file of 16 bytes");
  ASSERT_EQ(mkfifo((path + ".pipe").c_str(), 0600), 0);
  EXPECT_EQ(RunKey::Read(path + ".pipe").error().message,
            path + ".pipe is no key, which is a file of 16 bytes");
  std::ofstream(path) << "0123456789abcdef";
  EXPECT_TRUE(RunKey::Read(path));
  // Another user's key is refused, whoever may read it: root may read everything.
  if (geteuid() == 0 && chown(path.c_str(), 12345, 12345) == 0) {
    EXPECT_EQ(RunKey::Read(path).error().message, path + " belongs to another user");
  }
  std::filesystem::create_symlink(path, path + ".link");
  EXPECT_FALSE(RunKey::Read(path + ".link"));
  std::filesystem::remove_all(folder);
}

TEST(SealedBusTest, LetsThroughWhatHasTheKeyAndCountsTheRestByChannel) {
  InprocHub hub;
  const auto ours = hub.Connect(), theirs = hub.Connect(), strangers = hub.Connect();
  SealedBus sender(ours.get(), RunKey(CountingKey())),
      receiver(theirs.get(), RunKey(CountingKey()));
  const Bytes message = Messages().front();
  // In a run of one process there is nobody else, and all is heard.
  SealedBus trusting(ours.get(), RunKey(CountingKey()), SealedBus::Hears::kAll);
  int all = 0;
  trusting.Subscribe("walk/m1/ACTUATOR", [&](std::string_view, const uint8_t*, size_t) { ++all; });
  strangers->Publish("walk/m1/ACTUATOR", message.data(), message.size());
  hub.HandleAll();
  EXPECT_EQ(all, 1);
  EXPECT_EQ(trusting.unauthentic().all, 0);
  std::vector<Bytes> heard;
  const auto hear = [&](std::string_view, const uint8_t* data, size_t size) {
    heard.emplace_back(data, data + size);
  };
  receiver.Subscribe("walk/m1/ACTUATOR", hear);
  receiver.SubscribePrefix("walk/m2/", hear);
  receiver.SubscribeQuietly("walk/", "/TRANSFORM", hear);
  const std::vector<std::string> channels = {"walk/m1/ACTUATOR", "walk/m2/STATUS"};
  for (const std::string& channel : channels) {
    sender.Publish(channel, message.data(), message.size());
    hub.HandleAll();
    // Unsealed, and what was said before on the other channel.
    strangers->Publish(channel, message.data(), message.size());
    strangers->Publish(channel, heard.front().data(), heard.front().size());
    hub.HandleAll();
  }
  // On its own channel it says nothing new; whether it was had before others find out.
  EXPECT_EQ(heard.size(), 3u);
  EXPECT_EQ(MessageDigest(heard.front().data(), heard.front().size()),
            MessageDigest(message.data(), message.size()));
  EXPECT_EQ(receiver.unauthentic().all, 3);
  EXPECT_EQ(receiver.unauthentic().channels,
            (std::vector<std::pair<std::string, int64_t>>{{"m1/ACTUATOR", 1}, {"m2/STATUS", 2}}));
  EXPECT_EQ(sender.unauthentic().all, 0);
  // However many channels somebody makes up, few are told apart.
  for (int i = 0; i < 100; ++i) {
    strangers->Publish("walk/m2/x" + std::to_string(i), message.data(), message.size());
  }
  hub.HandleAll();
  EXPECT_EQ(receiver.unauthentic().all, 103);
  EXPECT_EQ(receiver.unauthentic().channels.size(), SealedBus::kMostChannels);
}

}  // namespace
}  // namespace morphbus::bridge
