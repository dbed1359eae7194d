#include "fuzz/readers.h"

#include "absl/strings/match.h"
#include "client/input/base/pickle.h"
#include "client/input/formats/formats.h"
#include "client/input/plane.h"
#include "fuzz/choices.h"
#include "fuzz/memory_file.h"
#include "fuzz/require.h"

namespace partiemc::fuzz {
namespace {

using client::RecordedFrame;
using client::input::ColumnRequest;
using client::input::FrameReader;
using client::input::ParticleRows;

// More frames than the bytes can hold in any format: a reader that exceeds this does not end.
constexpr std::size_t kMaxFrames = 1 << 16;

void RequireMessage(const absl::Status& status, const std::string& path) {
  Require(absl::StrContains(status.message(), path), "an error names the file");
  Require(status.code() != absl::StatusCode::kInternal, "input is never our own bug");
}

void RequireWhole(const ParticleRows& rows) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Require(rows.positions[axis].size() == (rows.has_position[axis] ? rows.count : 0),
            "positions are there for every particle");
    Require(rows.velocities[axis].size() == (rows.has_velocity[axis] ? rows.count : 0),
            "velocities are there for every particle");
  }
  Require(!rows.has_ids || rows.ids.size() == rows.count, "ids are there for every particle");
  Require(!rows.has_volumes || rows.volumes.size() == rows.count,
          "volumes are there for every particle");
}

// Reads to the end; skips the frames if `rows` is null.
void ReadAll(FrameReader& reader, const std::string& path, ParticleRows* rows) {
  client::input::PlaneProjection plane;
  std::vector<std::string> notices;
  RecordedFrame frame;
  for (std::size_t frames = 0;; ++frames) {
    Require(frames < kMaxFrames, "a file comes to its end");
    const auto more = reader.Next(rows);
    if (!more.ok()) RequireMessage(more.status(), path);
    if (!more.ok() || !*more) return;
    if (rows == nullptr) continue;
    RequireWhole(*rows);
    if (plane.Project(*rows, frame, notices).ok()) RequireSameCounts(frame);
  }
}

const ColumnRequest& RequestOf(std::uint8_t choice) {
  static const auto* const kRequests = [] {
    auto* requests = new std::vector<ColumnRequest>(3);
    for (const char* columns : {"", "2,1", "id,x,y,vx,vy"}) {
      requests->push_back(*client::input::ParseColumnRequest({"type=1"}, columns));
    }
    requests->push_back(*client::input::ParseColumnRequest({}, "1,3"));
    requests->push_back(*client::input::ParseColumnRequest({}, "2,3"));
    return requests;
  }();
  return (*kRequests)[choice % kRequests->size()];
}

void AttackFile(client::input::OpenReader& open, Bytes bytes) {
  Choices choices(bytes);
  const auto choice = choices.Take<std::uint8_t>();
  AttackReader(open, choice, choices.TakeRest());
}

}  // namespace

void AttackReader(client::input::OpenReader& open, std::uint8_t choice, std::string_view bytes) {
  const MemoryFile file(bytes);
  if (choice & 0x40) {
    const auto format = client::input::RecogniseFormat(file.path());
    if (!format.ok()) RequireMessage(format.status(), file.path());
  }
  const auto reader = open(file.path(), RequestOf(choice & 0x3f));
  if (!reader.ok()) {
    RequireMessage(reader.status(), file.path());
    return;
  }
  ParticleRows rows;
  ReadAll(**reader, file.path(), choice & 0x80 ? nullptr : &rows);
}

void AttackBgeo(Bytes bytes) { AttackFile(client::input::OpenBgeo, bytes); }
void AttackGsd(Bytes bytes) { AttackFile(client::input::OpenGsd, bytes); }
void AttackHdf5(Bytes bytes) { AttackFile(client::input::OpenHdf5, bytes); }
void AttackPly(Bytes bytes) { AttackFile(client::input::OpenPly, bytes); }

void AttackPickle(Bytes bytes) {
  const std::string path = "frame.npz";
  const auto pickle = client::input::Pickle::Parse({bytes.begin(), bytes.end()}, path);
  if (!pickle.ok()) {
    RequireMessage(pickle.status(), path);
    return;
  }
  client::input::ArrayColumn column;
  std::size_t rows = 0;
  if (!client::input::ColumnOf((*pickle)->root(), column, rows)) return;
  for (std::size_t row = 0; row < rows; ++row) column.Number(row);
}

void AttackLammpsDump(Bytes bytes) { AttackFile(client::input::OpenLammpsDump, bytes); }
void AttackNpy(Bytes bytes) { AttackFile(client::input::OpenNpy, bytes); }
void AttackTextTable(Bytes bytes) { AttackFile(client::input::OpenTextTable, bytes); }
void AttackVtk(Bytes bytes) { AttackFile(client::input::OpenVtk, bytes); }
void AttackXyz(Bytes bytes) { AttackFile(client::input::OpenXyz, bytes); }

}  // namespace partiemc::fuzz
