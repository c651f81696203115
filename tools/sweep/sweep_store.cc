#include "tools/sweep/sweep_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sqlite3.h>
#include <sys/file.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "compiler/base/text.h"
#include "tools/launch/launcher_link.h"

namespace morphbus::tools {
namespace {

/// "MBsw" in the header of the file says whose database it is.
constexpr int kApplication = 0x4d427377;
/// Of the tables below; goes up with every change of what they mean.
constexpr int kSchema = 1;

constexpr const char* kTables =
    "CREATE TABLE meta(name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;"
    "CREATE TABLE parts(hash TEXT PRIMARY KEY, bytes BLOB NOT NULL);"
    "CREATE TABLE plan(place INTEGER PRIMARY KEY, key TEXT NOT NULL, point TEXT NOT NULL);"
    "CREATE TABLE inputs(key TEXT PRIMARY KEY, parts TEXT NOT NULL, own BLOB NOT NULL);"
    "CREATE TABLE results(key TEXT PRIMARY KEY, status TEXT NOT NULL, hash TEXT NOT NULL,"
    " figures TEXT NOT NULL, error TEXT NOT NULL, seconds REAL NOT NULL, version TEXT NOT NULL,"
    " host TEXT NOT NULL);";

constexpr const char* kRows =
    "SELECT plan.place, plan.key, plan.point, results.status, results.hash, results.figures,"
    " results.error, results.seconds, results.version, results.host"
    " FROM plan LEFT JOIN results ON results.key = plan.key";

/// How long other processes are waited for, in looks at the file and milliseconds between them.
constexpr int kLooks = 1200;
constexpr int kBusyLookMs = 50;
/// SQLite asks this whether it shall look once more at a file that somebody else holds. A signal
/// ends the waiting.
int WaitForOthers(void* /*nothing*/, int looks) {
  if (looks >= kLooks || CaughtSignal() != 0) return 0;
  poll(nullptr, 0, kBusyLookMs);
  return 1;
}

/// The way out for a database that cannot be read.
constexpr const char* kDamagedHint =
    "sqlite3 FILE .recover | sqlite3 NEW saves what is left; without the file all rows are run "
    "again";

}  // namespace

/// A prepared statement; its columns and parameters count from 0.
class SweepStore::Statement {
 public:
  Statement(sqlite3* db, const std::string& sql) {
    sqlite3_prepare_v2(db, sql.c_str(), static_cast<int>(sql.size()), &statement_, nullptr);
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// Each takes the next parameter.
  Statement& Text(const std::string& text) {
    sqlite3_bind_text(statement_, ++bound_, text.data(), static_cast<int>(text.size()),
                      SQLITE_TRANSIENT);
    return *this;
  }
  Statement& Bytes(const std::string& bytes) {
    sqlite3_bind_blob64(statement_, ++bound_, bytes.data(), bytes.size(), SQLITE_TRANSIENT);
    return *this;
  }
  Statement& Whole(int64_t value) {
    sqlite3_bind_int64(statement_, ++bound_, value);
    return *this;
  }
  Statement& Real(double value) {
    sqlite3_bind_double(statement_, ++bound_, value);
    return *this;
  }

  /// True if there is a row; false if there is none (any more); sqlite's error code through
  /// `failed`. A statement that could not be prepared fails here.
  bool Step(bool* failed) {
    const int code = statement_ == nullptr ? SQLITE_ERROR : sqlite3_step(statement_);
    *failed = code != SQLITE_ROW && code != SQLITE_DONE;
    return code == SQLITE_ROW;
  }
  /// For another round with other parameters.
  void Reset() {
    sqlite3_reset(statement_);
    bound_ = 0;
  }

  [[nodiscard]] std::string TextAt(int column) const {
    const void* bytes = sqlite3_column_blob(statement_, column);
    const auto size = static_cast<size_t>(sqlite3_column_bytes(statement_, column));
    return bytes == nullptr ? "" : std::string(static_cast<const char*>(bytes), size);
  }
  [[nodiscard]] int64_t WholeAt(int column) const {
    return sqlite3_column_int64(statement_, column);
  }
  [[nodiscard]] double RealAt(int column) const {
    return sqlite3_column_double(statement_, column);
  }
  [[nodiscard]] bool NullAt(int column) const {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL;
  }

  /// The row of kRows at which it stands. A point that cannot be read is as one that says nothing.
  [[nodiscard]] StoredRow Row() const {
    StoredRow row;
    row.place = WholeAt(0);
    row.key = TextAt(1);
    row.point = Json::parse(TextAt(2), nullptr, false);
    if (row.point.is_discarded()) row.point = Json::object();
    if (NullAt(3)) return row;
    row.result = {
        StatusOfText(TextAt(3)), TextAt(4), TextAt(5), TextAt(6), RealAt(7), TextAt(9), TextAt(8)};
    return row;
  }

 private:
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
};

tl::unexpected<Error> SweepStore::Broken(const std::string& doing) const {
  const int code = sqlite3_errcode(db_) & 0xff;
  if (code == SQLITE_CORRUPT || code == SQLITE_NOTADB) {
    return Fail(
        fmt::format("{} is cut or damaged ({}): {}", path_, sqlite3_errmsg(db_), kDamagedHint));
  }
  if (code == SQLITE_BUSY && CaughtSignal() == 0) {
    return Fail(fmt::format("cannot {} {}: another process has been reading it for {} s", doing,
                            path_, kLooks * kBusyLookMs / 1000));
  }
  // The system's own reason says more than "disk I/O error".
  const int reason = sqlite3_system_errno(db_);
  const bool of_system =
      (code == SQLITE_IOERR || code == SQLITE_FULL || code == SQLITE_CANTOPEN) && reason != 0;
  return Fail(fmt::format("cannot {} {}: {}", doing, path_,
                          of_system ? std::strerror(reason) : sqlite3_errmsg(db_)));
}

Result<std::unique_ptr<SweepStore>> SweepStore::OpenToWrite(const std::string& path) {
  std::unique_ptr<SweepStore> store(new SweepStore(path));
  if (Result<void> open = store->Open(true); !open) return Fail(open.error().message);
  return store;
}

Result<std::unique_ptr<SweepStore>> SweepStore::OpenToRead(const std::string& path) {
  std::unique_ptr<SweepStore> store(new SweepStore(path));
  if (Result<void> open = store->Open(false); !open) return Fail(open.error().message);
  return store;
}

Result<void> SweepStore::Open(bool write) {
  std::error_code unknown;
  const std::filesystem::file_status status = std::filesystem::status(path_, unknown);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    return Fail(fmt::format("{} is no file", path_));
  }
  if (!write && !std::filesystem::exists(status)) {
    return Fail(fmt::format("there is no {}; morphbus sweep FILE.toml makes it", path_));
  }
  // SQLite's own locks are held for a transaction; this one keeps a second sweep out for the whole
  // of the first one. The kernel drops it with the process, however that ends.
  if (write) {
    lock_.emplace(open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
    if (lock_->get() < 0)
      return Fail(fmt::format("cannot write {}: {}", path_, std::strerror(errno)));
    if (flock(lock_->get(), LOCK_EX | LOCK_NB) != 0) {
      return Fail(
          fmt::format("another sweep is writing {}; wait for it, or give this one -o", path_));
    }
  }
  // A reader, too, may have to undo what a writer that was killed left half done.
  // SQLite itself opens what it must not write for reading.
  if (sqlite3_open_v2(path_.c_str(), &db_, SQLITE_OPEN_READWRITE, nullptr) != SQLITE_OK) {
    return Broken("open");
  }
  // A reader holds a writer up until it has read all, and a pager may be in no hurry.
  sqlite3_busy_handler(db_, WaitForOthers, nullptr);
  return CheckFormat(write);
}

Result<void> SweepStore::CheckFormat(bool write) {
  const auto number = [this](const char* pragma) -> Result<int64_t> {
    Statement statement(db_, pragma);
    bool failed = false;
    if (!statement.Step(&failed) || failed) return Broken("read");
    return statement.WholeAt(0);
  };
  // Half a transaction of a writer that was killed is undone by the first statement, and a file
  // that is shorter than its header says is found.
  const Result<int64_t> tables = number("SELECT count(*) FROM sqlite_schema");
  if (!tables) return Fail(tables.error().message);
  const Result<int64_t> application = number("PRAGMA application_id");
  const Result<int64_t> schema = number("PRAGMA user_version");
  if (!application || !schema) return Broken("read");
  // An empty file becomes a database of ours; what somebody else's database holds is left alone.
  if (*tables == 0 && *application == 0) {
    if (!write) return Fail(fmt::format("{} is empty: it holds no sweep", path_));
    Result<void> made = Run("BEGIN IMMEDIATE");
    if (made) made = Run(kTables);
    if (made)
      made =
          Run(fmt::format("PRAGMA application_id={};PRAGMA user_version={};", kApplication, kSchema)
                  .c_str());
    return made ? Run("COMMIT") : made;
  }
  if (*application != kApplication) {
    return Fail(
        fmt::format("{} is a database of something else: give another name with -o", path_));
  }
  if (*schema > kSchema) {
    return Fail(fmt::format(
        "{} was written by a newer morphbus (its tables are of version {}, this one knows {}): "
        "use that, or give another name with -o",
        path_, *schema, kSchema));
  }
  return {};
}

SweepStore::~SweepStore() {
  // What was not committed is undone.
  sqlite3_close(db_);
}

Result<void> SweepStore::Run(const char* sql) {
  if (sqlite3_exec(db_, sql, nullptr, nullptr, nullptr) == SQLITE_OK) return {};
  return Broken("write");
}

Result<void> SweepStore::SetPlan(const SweepPlan& plan, const SweepOrigin& origin) {
  Result<void> done = Run("BEGIN IMMEDIATE");
  if (!done) return done;
  const std::string words = JsonText(Json(origin.words));
  // Whoever looks at the database later has what the plan came from, and its rows by their numbers.
  for (const auto& [name, value] : {std::pair("folder", &origin.folder),
                                    std::pair("text", &origin.text), std::pair("words", &words)}) {
    Statement put(db_, "INSERT OR REPLACE INTO meta VALUES(?, ?)");
    bool failed = false;
    put.Text(name).Text(*value).Step(&failed);
    if (failed) return Broken("write");
  }
  done = Run("DELETE FROM plan");
  if (done) done = PutRows(plan, 1);
  if (done) done = DropUnused();
  return done ? Run("COMMIT") : done;
}

Result<void> SweepStore::Extend(const SweepPlan& more) {
  // Rows are numbered without gaps, so that their count is the number of the last one.
  const Result<RowCounts> counts = Counts();
  if (!counts) return Fail(counts.error().message);
  Result<void> done = Run("BEGIN IMMEDIATE");
  if (done) done = PutRows(more, counts->rows + 1);
  return done ? Run("COMMIT") : done;
}

Result<void> SweepStore::PutRows(const SweepPlan& plan, int64_t number) {
  // A part has the hash of its bytes for a name, so that one that is there is the same.
  Statement part(db_, "INSERT OR IGNORE INTO parts VALUES(?, ?)");
  Statement place(db_, "INSERT INTO plan VALUES(?, ?, ?)");
  // What a row takes to run may have been written by another version, or from other paths.
  Statement inputs(db_, "INSERT OR REPLACE INTO inputs VALUES(?, ?, ?)");
  bool failed = false;
  // Model, program and world are stored once, however many rows name them.
  for (const auto& [hash, bytes] : plan.parts) {
    part.Reset();
    part.Text(hash).Bytes(bytes).Step(&failed);
    if (failed) return Broken("write");
  }
  // Two rows of equal inputs have one key, and so one set of inputs and one result.
  for (const PlannedRow& row : plan.rows) {
    place.Reset();
    place.Whole(number++).Text(row.key).Text(JsonText(row.point)).Step(&failed);
    if (failed) return Broken("write");
    inputs.Reset();
    inputs.Text(row.key).Text(JsonText(Json(row.inputs.parts))).Bytes(row.inputs.own).Step(&failed);
    if (failed) return Broken("write");
  }
  return {};
}

Result<void> SweepStore::DropUnused() {
  // What rows of earlier plans would take to run goes if they have no result.
  return Run(
      "DELETE FROM inputs WHERE key NOT IN (SELECT key FROM plan) AND key NOT IN (SELECT key FROM "
      "results);"
      "DELETE FROM parts WHERE hash NOT IN (SELECT value FROM inputs, json_each(inputs.parts))");
}

Result<std::optional<std::string>> SweepStore::Meta(const char* name) {
  Statement statement(db_, "SELECT value FROM meta WHERE name = ?");
  bool failed = false;
  if (statement.Text(name).Step(&failed)) return std::optional(statement.TextAt(0));
  if (failed) return Broken("read");
  return std::optional<std::string>();
}

Result<SweepOrigin> SweepStore::Origin() {
  Result<std::optional<std::string>> folder = Meta("folder"), text = Meta("text"),
                                     words = Meta("words");
  for (const auto* one : {&folder, &text, &words}) {
    if (!*one) return Fail(one->error().message);
  }
  if (!*folder || !*text) return Fail(path_ + " holds no sweep yet");
  SweepOrigin origin = {std::move(**folder), std::move(**text), {}};
  // The first versions of these tables had the words in the text, as comments.
  for (const Json& word : Json::parse(words->value_or("[]"), nullptr, false)) {
    if (word.is_string()) origin.words.push_back(word.get<std::string>());
  }
  return origin;
}

Result<void> SweepStore::EachRow(const std::function<bool(const StoredRow&)>& each, int64_t from) {
  Statement statement(db_, std::string(kRows) + " WHERE plan.place >= ? ORDER BY plan.place");
  statement.Whole(from);
  bool failed = false;
  while (statement.Step(&failed)) {
    if (!each(statement.Row())) return {};
  }
  if (failed) return Broken("read");
  return {};
}

Result<std::optional<StoredRow>> SweepStore::RowAt(int64_t place) {
  Statement statement(db_, std::string(kRows) + " WHERE plan.place = ?");
  bool failed = false;
  if (statement.Whole(place).Step(&failed)) return std::optional(statement.Row());
  if (failed) return Broken("read");
  return std::optional<StoredRow>();
}

Result<RowCounts> SweepStore::Counts() {
  RowCounts counts;
  // Rows without a result have no status.
  Statement statement(
      db_,
      "SELECT results.status, count(*) FROM plan LEFT JOIN results ON results.key = plan.key"
      " GROUP BY results.status");
  bool failed = false;
  while (statement.Step(&failed)) {
    const int64_t count = statement.WholeAt(1);
    counts.rows += count;
    if (statement.NullAt(0)) continue;
    switch (StatusOfText(statement.TextAt(0))) {
      case RowResult::Status::kRan:
        counts.done += count;
        break;
      case RowResult::Status::kErred:
        counts.failed += count;
        break;
      case RowResult::Status::kCrashed:
        counts.crashed += count;
        break;
      case RowResult::Status::kTimeout:
        counts.timeout += count;
        break;
    }
  }
  Statement others(db_, "SELECT count(*) FROM results WHERE key NOT IN (SELECT key FROM plan)");
  if (failed || !others.Step(&failed)) return Broken("read");
  counts.others = others.WholeAt(0);
  return counts;
}

Result<RowInputs> SweepStore::InputsOf(const std::string& key) {
  Statement statement(db_, "SELECT parts, own FROM inputs WHERE key = ?");
  bool failed = false;
  if (!statement.Text(key).Step(&failed)) {
    return failed ? Result<RowInputs>(Broken("read"))
                  : Fail(fmt::format("{} lacks the inputs of a row", path_));
  }
  RowInputs inputs;
  // What is no list of texts, in a database that somebody has altered, names no part.
  const Json parts = Json::parse(statement.TextAt(0), nullptr, false);
  for (const Json& part : parts) {
    if (part.is_string()) inputs.parts.push_back(part.get<std::string>());
  }
  inputs.own = statement.TextAt(1);
  return inputs;
}

Result<std::string> SweepStore::Part(const std::string& hash) {
  Statement statement(db_, "SELECT bytes FROM parts WHERE hash = ?");
  bool failed = false;
  if (statement.Text(hash).Step(&failed)) return statement.TextAt(0);
  return failed ? Result<std::string>(Broken("read"))
                : Fail(fmt::format("{} lacks a part of a row", path_));
}

Result<std::string> SweepStore::DescriptionOf(const std::string& key) {
  // A message of protobuf in pieces is the message: the shared parts and what is the row's own.
  Result<RowInputs> inputs = InputsOf(key);
  if (!inputs) return Fail(inputs.error().message);
  std::string bytes;
  for (const std::string& hash : inputs->parts) {
    const Result<std::string> part = Part(hash);
    if (!part) return part;
    bytes += *part;
  }
  return bytes + inputs->own;
}

Result<void> SweepStore::Add(const std::string& key, const RowResult& result) {
  // Many results share a transaction, for the disk is waited for at the end of each.
  if (!in_transaction_) {
    if (Result<void> begun = Run("BEGIN IMMEDIATE"); !begun) return begun;
    in_transaction_ = true;
  }
  Statement put(db_, "INSERT OR REPLACE INTO results VALUES(?, ?, ?, ?, ?, ?, ?, ?)");
  bool failed = false;
  put.Text(key).Text(StatusText(result.status)).Text(result.hash).Text(result.figures);
  put.Text(result.error).Real(result.seconds).Text(result.version).Text(result.host).Step(&failed);
  if (failed) return Broken("write");
  return {};
}

Result<void> SweepStore::ForgetFailed() {
  // Without a result they are missing, and missing rows are run.
  return Run("DELETE FROM results WHERE status != 'done' AND key IN (SELECT key FROM plan)");
}

Result<void> SweepStore::Commit() {
  if (!in_transaction_) return {};
  // After a failure the transaction is still open, and may be tried again.
  Result<void> done = Run("COMMIT");
  in_transaction_ = !done;
  return done;
}

}  // namespace morphbus::tools
