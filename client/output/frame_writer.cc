#include "client/output/frame_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <system_error>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_format.h"
#include "client/output/atomic_file.h"
#include "client/output/formats/formats.h"
#include "client/output/text.h"
#include "common/text.h"

namespace partiemc::client {
namespace {

constexpr std::array kFormats = {
    FrameFormat::kGeoJson, FrameFormat::kSvg, FrameFormat::kObj,
#ifdef PARTIEMC_HAVE_VTK
    FrameFormat::kVtp,
#endif
    FrameFormat::kCsv,     FrameFormat::kPly, FrameFormat::kStl, FrameFormat::kGlb,
};

// Digits of the index in the name of a file, with leading zeros.
constexpr int kIndexDigits = 6;

// Whether coordinates and their differences stay finite as 32-bit floats.
bool AreFloats(std::span<const double> points) {
  return std::ranges::all_of(
      points, [](double x) { return std::abs(x) < std::numeric_limits<float>::max() / 2; });
}

// Whether the rounding to 32-bit floats moves no coordinate by more than a thousandth of `spacing`.
// With spacing 0 (unknown) the longest side of the points' box replaces it.
bool AreFineFloats(std::span<const double> points, std::size_t components, double spacing) {
  double scale = spacing;
  for (std::size_t c = 0; !(spacing > 0) && c < components && c < points.size(); ++c) {
    double low = points[c], high = points[c];
    for (std::size_t k = c; k < points.size(); k += components) {
      low = std::min(low, points[k]);
      high = std::max(high, points[k]);
    }
    scale = std::max(scale, high - low);
  }
  return std::ranges::all_of(points, [scale](double x) {
    return std::abs(static_cast<double>(static_cast<float>(x)) - x) <= 1e-3 * scale;
  });
}

bool AllFinite(std::span<const double> values) {
  return std::all_of(values.begin(), values.end(),
                     [](double value) { return std::isfinite(value); });
}

}  // namespace

std::span<const FrameFormat> AllFrameFormats() { return kFormats; }

std::string_view Name(FrameFormat format) {
  switch (format) {
    case FrameFormat::kGeoJson:
      return "geojson";
    case FrameFormat::kSvg:
      return "svg";
    case FrameFormat::kObj:
      return "obj";
    case FrameFormat::kVtp:
      return "vtp";
    case FrameFormat::kCsv:
      return "csv";
    case FrameFormat::kPly:
      return "ply";
    case FrameFormat::kStl:
      return "stl";
    case FrameFormat::kGlb:
      return "glb";
  }
  return "";
}

std::string Names(std::span<const FrameFormat> formats) {
  std::string names;
  for (const FrameFormat format : formats) {
    AppendAll(names, names.empty() ? "" : ",", Name(format));
  }
  return names;
}

absl::StatusOr<std::vector<FrameFormat>> ParseFrameFormats(std::string_view names) {
  std::vector<FrameFormat> formats;
  for (const std::string_view part : Split(names, ',', /*blanks=*/"")) {
    const std::string word(part);
    const auto format = std::find_if(kFormats.begin(), kFormats.end(),
                                     [&](FrameFormat known) { return Name(known) == word; });
    if (format == kFormats.end()) {
      const bool needs_vtk = word == Name(FrameFormat::kVtp);
      return absl::InvalidArgumentError(Concat("format: '", absl::Utf8SafeCHexEscape(word), "'",
                                               needs_vtk ? " requires a build with VTK" : "",
                                               "; must be some of ", Names(kFormats)));
    }
    if (std::find(formats.begin(), formats.end(), *format) == formats.end()) {
      formats.push_back(*format);
    }
  }
  return formats;
}

bool HoldsSurfaces(FrameFormat format) {
  return format != FrameFormat::kGeoJson && format != FrameFormat::kCsv;
}

absl::Status CheckHoldsSurfaces(FrameFormat format) {
  if (HoldsSurfaces(format)) return absl::OkStatus();
  std::vector<FrameFormat> others;
  std::ranges::copy_if(kFormats, std::back_inserter(others), HoldsSurfaces);
  return absl::InvalidArgumentError(Concat("format: '", Name(format),
                                           "' cannot hold surfaces in space; must be some of ",
                                           Names(others)));
}

absl::StatusOr<std::string> EncodeFrame(FrameFormat format, const FrameRecord& frame,
                                        const FrameWriterOptions& options) {
  if (frame.surface) {
    if (absl::Status status = CheckHoldsSurfaces(format); !status.ok()) return status;
  }
  const std::span<const double> points =
      frame.surface ? frame.surface->points : frame.result.rings.points;
  if (!AllFinite(points) || (!frame.surface && !AllFinite(frame.result.mesh.points))) {
    return absl::DataLossError(Concat("frame ", frame.index,
                                      ": a coordinate of the result is not finite; "
                                      "reconstruct it again with --check"));
  }
  const bool has_floats = format == FrameFormat::kStl || format == FrameFormat::kGlb;
  if (has_floats && !AreFloats(points)) {
    return absl::OutOfRangeError(Concat("frame ", frame.index, ": coordinates above 3.4e38; ",
                                        Name(format), " has 32-bit floats"));
  }
  // Only STL is checked: coordinates in GLB are relative to the centre of the frame.
  const std::span<const double> vertices = frame.surface ? points : frame.result.mesh.points;
  if (format == FrameFormat::kStl &&
      !AreFineFloats(vertices, frame.surface ? 3 : 2, frame.result.statistics.spacing)) {
    return absl::OutOfRangeError(Concat(
        "frame ", frame.index,
        ": its coordinates are too far from the origin for the 32-bit floats of stl; choose ",
        "ply, obj, vtp or glb, or move the origin"));
  }
  switch (format) {
    case FrameFormat::kGeoJson:
      return EncodeGeoJson(frame);
    case FrameFormat::kSvg:
      return frame.surface ? EncodeSurfaceSvg(frame, options) : EncodeSvg(frame, options);
    case FrameFormat::kObj:
      return EncodeObj(frame);
    case FrameFormat::kCsv:
      return EncodeCsv(frame);
    case FrameFormat::kPly:
      return EncodePly(frame);
    case FrameFormat::kStl:
      return EncodeStl(frame);
    case FrameFormat::kGlb:
      return EncodeGlb(frame, options.compress_glb);
    case FrameFormat::kVtp:
#ifdef PARTIEMC_HAVE_VTK
      return EncodeVtp(frame);
#else
      break;
#endif
  }
  return absl::InvalidArgumentError(
      Concat("format: '", Name(format), "' is not part of this build; build it with VTK"));
}

bool IsFrameFile(std::string_view name, FrameFormat format) {
  const bool is_list = ConsumePrefix(name, "frames");
  if (!is_list) {
    if (!ConsumePrefix(name, "frame_")) return false;
    const std::size_t size = name.size();
    if (!ConsumeNumber<std::uint64_t>(name) || size < name.size() + kIndexDigits) return false;
  }
  if (ConsumePrefix(name, "_section_") && !ConsumeNumber<std::uint64_t>(name)) return false;
  if (is_list) return format == FrameFormat::kVtp && (name == ".pvd" || name == ".vtp.series");
  return name == Concat(".", Name(format));
}

absl::StatusOr<FrameWriter> FrameWriter::Create(FrameWriterOptions options) {
  std::error_code error;
  std::filesystem::create_directories(options.directory, error);
  if (error) {
    return absl::Status(
        absl::ErrnoToStatusCode(error.value()),
        Concat(absl::Utf8SafeCHexEscape(options.directory.native()),
               ": the directory cannot be created: ", error.message(), "; choose another one"));
  }
  return FrameWriter(std::move(options));
}

absl::Status FrameWriter::Write(const FrameRecord& frame) {
  absl::Status status = WriteOutline(frame);
  for (std::size_t k = 0; status.ok() && k < frame.result.sections.size(); ++k) {
    status = WriteOutline(SectionOf(frame, k));
  }
  return status;
}

absl::Status FrameWriter::WriteOutline(const FrameRecord& frame) {
  for (const FrameFormat format : options_.formats) {
    absl::StatusOr<std::string> bytes = EncodeFrame(format, frame, options_);
    if (!bytes.ok()) return bytes.status();
    const std::filesystem::path path = PathOf(frame, format);
    absl::Status status = WriteFileAtomically(path, *bytes);
    if (!status.ok()) return status;
    if (format == FrameFormat::kVtp) {
      const double time = std::isfinite(frame.time) ? frame.time : static_cast<double>(frame.index);
      listed_[frame.section].push_back({path.filename().string(), time});
    }
  }
  return absl::OkStatus();
}

absl::Status FrameWriter::Finish() const {
  for (const auto& [section, files] : listed_) {
    std::string pvd =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
    std::string series = "{\"file-series-version\":\"1.0\",\"files\":[";
    for (std::size_t k = 0; k < files.size(); ++k) {
      AppendAll(pvd, "<DataSet timestep=\"", files[k].time, "\" part=\"0\" file=\"", files[k].file,
                "\"/>\n");
      AppendAll(series, k == 0 ? "\n" : ",\n", "{\"name\":\"", files[k].file,
                "\",\"time\":", files[k].time, "}");
    }
    pvd += "</Collection>\n</VTKFile>\n";
    series += "\n]}\n";
    const std::string stem = section > 0 ? Concat("frames_section_", section) : "frames";
    absl::Status status = WriteFileAtomically(options_.directory / Concat(stem, ".pvd"), pvd);
    if (status.ok()) {
      status = WriteFileAtomically(options_.directory / Concat(stem, ".vtp.series"), series);
    }
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

std::filesystem::path FrameWriter::PathOf(const FrameRecord& frame, FrameFormat format) const {
  const std::string section = frame.section > 0 ? Concat("_section_", frame.section) : "";
  return options_.directory /
         absl::StrFormat("frame_%0*d%s.%s", kIndexDigits, frame.index, section, Name(format));
}

}  // namespace partiemc::client
