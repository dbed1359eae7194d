// The table of formats. To add a format, add a row here and its OpenReader in a new file.
#include "client/input/formats/formats.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include "absl/strings/ascii.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/base/text_table.h"
#include "client/input/formats/npy.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kHeadBytes = 4096;

// The properties of a file that recognition uses. The extension is in lower case, without the dot
// and without the extension of the compression (.gz, .zst).
struct FileHead {
  const std::string& path;
  std::string name;
  std::string extension;
  std::string_view bytes;
  bool text = false;

  bool Begins(std::string_view mark) const { return bytes.starts_with(mark); }
  bool Holds(std::string_view mark) const { return Contains(bytes, mark); }
  std::string_view Line(std::size_t number) const {
    std::string_view rest = bytes;
    for (; number > 0; --number) {
      rest.remove_prefix(std::min(rest.find('\n'), rest.size() - 1) + 1);
      if (rest.empty()) return rest;
    }
    return Strip(rest.substr(0, rest.find('\n')));
  }
};

// Whether an NPY array has several frames. Opens the file, because the header of the array can be
// longer than the head of the file.
bool HasFramesInNpy(const FileHead& head) {
  if (!head.Begins("\x93NUMPY")) return false;
  const auto stream = InputStream::Open(head.path);
  if (!stream.ok()) return false;
  const auto header = ReadNpyHeader(**stream, head.path);
  return header.ok() && header->holds_frames();
}

bool IsXyz(const FileHead& head) {
  if (!head.text || !ParseCount(head.Line(0))) return false;
  return head.extension == "xyz" || head.Line(1).starts_with("Atoms. Timestep:");
}

// Whether a line begins with a command that is typical of LAMMPS scripts.
bool IsLammpsScript(const FileHead& head) {
  if (!head.text) return false;
  constexpr std::string_view kCommands[] = {"\nunits ", "\natom_style ", "\npair_style ",
                                            "\ndimension ", "\nread_data "};
  const std::string with_start = Concat("\n", head.bytes);
  return std::any_of(std::begin(kCommands), std::end(kCommands),
                     [&](std::string_view command) { return Contains(with_start, command); });
}

bool IsLammpsData(const FileHead& head) {
  return head.text && head.Holds(" atoms\n") && head.Holds(" xlo xhi");
}

bool IsProgram(const FileHead& head) {
  constexpr std::string_view kExtensions[] = {"py", "sh", "cpp", "cc",   "c",
                                              "h",  "m",  "jl",  "ipynb"};
  return head.Begins("#!") || std::find(std::begin(kExtensions), std::end(kExtensions),
                                        head.extension) != std::end(kExtensions);
}

bool IsDocument(const FileHead& head) {
  constexpr std::string_view kExtensions[] = {"json", "xml", "html", "md",  "pvd", "yaml",
                                              "yml",  "log", "svg",  "obj", "stl"};
  return head.text && std::find(std::begin(kExtensions), std::end(kExtensions), head.extension) !=
                          std::end(kExtensions);
}

bool IsPickle(const FileHead& head) {
  return head.extension == "pkl" || head.extension == "pickle" || head.Begins("\x80\x04\x95");
}

// A row of the table of formats: a supported format, or an unsupported one with a remedy in
// `refusal`.
struct Entry {
  bool (*matches)(const FileHead&);
  Format format;
  std::string_view refusal;
};

// The rows are tried in this order, and the first match decides: signatures in the content, then
// names, then any text.
constexpr Entry kEntries[] = {
    {HasFramesInNpy, {"NPY", OpenNpy, false}, ""},
    {[](const FileHead& head) { return head.Begins("\x93NUMPY"); }, {"NPY", OpenNpy, true}, ""},
    {[](const FileHead& head) { return head.Begins("PK\x03\x04") || head.Begins("PK\x05\x06"); },
     {"NPZ", OpenNpz, true},
     ""},
    {[](const FileHead& head) { return head.Begins("# vtk DataFile"); },
     {"legacy VTK", OpenVtk, true},
     ""},
    {[](const FileHead& head) {
       return head.Holds("<VTKFile") &&
              (head.Holds("\"PolyData\"") || head.Holds("\"UnstructuredGrid\""));
     },
     {"VTK", OpenVtk, true},
     ""},
    {[](const FileHead& head) { return head.text && head.Begins("ITEM:"); },
     {"LAMMPS dump", OpenLammpsDump, false},
     ""},
    {IsXyz, {"xyz", OpenXyz, false}, ""},
    {[](const FileHead& head) { return head.extension == "pvd" || head.extension == "series"; },
     {},
     "a collection of files; name it alone"},
    {[](const FileHead& head) { return head.Holds("<VTKFile"); },
     {},
     "a VTK file of a kind that holds no particles itself (a grid); name .vtp or .vtu files"},
    {[](const FileHead& head) { return head.Begins("ply\n") || head.Begins("ply\r"); },
     {"PLY", OpenPly, true},
     ""},
    {[](const FileHead& head) { return head.Begins("BgeoV"); }, {"BGEO", OpenBgeo, true}, ""},
    {[](const FileHead& head) { return head.Begins("\x7fNSJ") || head.extension == "bgeo"; },
     {},
     "a BGEO file of another version than 5, which is not read; write .bhclassic, VTP or CSV"},
    {[](const FileHead& head) { return head.Begins("\x89HDF\r\n\x1a\n"); },
     {"HDF5", OpenHdf5, false},
     ""},
    {[](const FileHead& head) { return head.Begins("\xDF\x65\xDF\x65\xDF\x65\xDF\x65"); },
     {"GSD", OpenGsd, false},
     ""},
    {[](const FileHead& head) { return head.extension == "pdb"; },
     {},
     "a PDB file, which is not read; write the particles as VTP, NPY or CSV"},
    {[](const FileHead& head) { return head.extension == "xyz" && !head.text; },
     {},
     "raw binary xyz (splashsurf's float32 triples), which has neither a count nor a byte order "
     "and "
     "is not read; convert it with NumPy: numpy.save('frame.npy', numpy.fromfile('frame.xyz', "
     "'<f4').reshape(-1, 3))"},
    {IsPickle, {}, "a Python pickle, which is not read; save plain arrays with numpy.savez"},
    {IsLammpsScript,
     {},
     "a LAMMPS input script, not a recording; run it and name the dump that it writes"},
    {IsLammpsData, {}, "a LAMMPS data file, not a recording; write a dump with the command 'dump'"},
    {IsProgram, {}, "a program, not a recording; name what it writes"},
    {IsDocument, {}, "not a table of particles; name CSV, VTK, NPY, NPZ or LAMMPS dump files"},
    {[](const FileHead& head) { return head.text; }, {"CSV", OpenTextTable, true}, ""},
};

// Whether `bytes` have no control characters except white space. UTF-8 is not checked, because the
// head may end inside a sequence.
bool IsText(std::string_view bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 32 || (byte >= 9 && byte <= 13);
  });
}

std::string Extension(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(dot + 1);
}

}  // namespace

absl::StatusOr<const Format*> RecogniseFormat(const std::string& path) {
  const auto stream = InputStream::Open(path);
  if (!stream.ok()) return stream.status();
  const auto bytes = (*stream)->Peek(kHeadBytes);
  if (!bytes.ok()) return bytes.status();
  if (bytes->empty()) {
    return absl::DataLossError(
        Concat(path, ": is empty; a frame without particles is a header without rows"));
  }
  FileHead head{.path = path};
  head.name = absl::AsciiStrToLower(std::filesystem::path(path).filename().string());
  for (const std::string_view packing : {".gz", ".zst"}) {
    if (head.name.ends_with(packing)) head.name.resize(head.name.size() - packing.size());
  }
  head.extension = Extension(head.name);
  head.bytes = *bytes;
  head.text = IsText(*bytes);
  for (const Entry& entry : kEntries) {
    if (!entry.matches(head)) continue;
    if (entry.format.open != nullptr) return &entry.format;
    return absl::UnimplementedError(Concat(path, ": is ", entry.refusal));
  }
  return absl::UnimplementedError(
      Concat(path,
             ": is binary data of no known kind; PartiEMC reads CSV, LAMMPS text dumps, xyz, PLY, "
             "NPY, NPZ, VTK, VTP, VTU, HDF5, GSD and BGEO"));
}

}  // namespace partiemc::client::input
