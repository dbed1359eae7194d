#include "client/input/formats/vtk_legacy.h"

#include <vtkAbstractArray.h>
#include <vtkDataReader.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

namespace partiemc::client::input {
namespace {

// Fewest bytes of a number in a file: a digit and a separator.
constexpr std::int64_t kLeastBytes = 2;

// Keywords of cell lists: each cell is a count of points and their indices.
bool IsCells(std::string_view keyword) {
  return keyword == "vertices" || keyword == "lines" || keyword == "polygons" ||
         keyword == "triangle_strips" || keyword == "cells";
}

class ParticlesReader final : public vtkDataReader {
 public:
  static ParticlesReader* New();
  vtkTypeMacro(ParticlesReader, vtkDataReader)

  vtkSmartPointer<vtkPolyData> ReadParticles(const std::string& path) {
    std::error_code error;
    const auto bytes = std::filesystem::file_size(path, error);
    most_numbers_ = error ? 0 : static_cast<std::int64_t>(bytes) / kLeastBytes;
    auto particles = vtkSmartPointer<vtkPolyData>::New();
    if (!OpenVTKFile(path.c_str()) || !ReadHeader(path.c_str())) return particles;
    if (Keyword() != "dataset") {
      vtkErrorMacro(<< "the header is not followed by DATASET");
      return particles;
    }
    const std::string_view kind = Keyword();
    if (kind != "polydata" && kind != "unstructured_grid") return nullptr;
    while (ReadSection(*particles)) {
    }
    CloseVTKFile();
    return particles;
  }

 private:
  // The next word in lower case; empty at the end of the file.
  std::string_view Keyword() {
    if (!ReadString(word_)) return {};
    return LowerCase(word_);
  }

  // Reads a count and checks it against the size of the file.
  bool ReadCount(std::int64_t& count) {
    long long value = 0;
    if (vtkDataReader::Read(&value) && value >= 0 && value <= most_numbers_) {
      count = value;
      return true;
    }
    vtkErrorMacro(<< "Error reading a count: " << value << ", more than the file can hold or none");
    return false;
  }

  // Reads the next section. Returns false at the end of the file and after an error.
  bool ReadSection(vtkPolyData& particles) {
    const std::string keyword(Keyword());
    std::int64_t count = 0;
    if (keyword.empty()) return false;
    if (keyword == "field") {
      const auto fields = vtkSmartPointer<vtkFieldData>::Take(ReadFieldData());
      if (fields != nullptr) particles.SetFieldData(fields);
      return fields != nullptr;
    }
    if (keyword == "points") return ReadCount(count) && ReadPointCoordinates(&particles, count);
    if (IsCells(keyword)) return SkipCells();
    if (keyword == "cell_types") return ReadCount(count) && SkipIntegers(count);
    if (keyword == "cell_data") return ReadCount(count) && ReadCellData(&particles, count);
    if (keyword == "point_data") {
      if (!ReadCount(count)) return false;
      if (count != particles.GetNumberOfPoints()) {
        vtkErrorMacro(<< "POINT_DATA " << count << " for " << particles.GetNumberOfPoints()
                      << " points");
        return false;
      }
      return ReadPointData(&particles, count) != 0;
    }
    if (keyword == "metadata") return SkipMetaData();
    vtkErrorMacro(<< "unknown keyword " << keyword);
    return false;
  }

  bool SkipIntegers(std::int64_t count) {
    std::vector<int> skipped(static_cast<std::size_t>(count));
    return count == 0 || ReadCellsLegacy(count, skipped.data());
  }

  // Skips cells. Files up to version 4.2 have the number of cells, the number of integers, and the
  // integers. Files from version 5.0 on have the number of offsets, the number of indices, and both
  // as typed arrays.
  bool SkipCells() {
    std::int64_t first = 0, second = 0;
    if (!ReadCount(first) || !ReadCount(second)) return false;
    if (FileMajorVersion < 5) return SkipIntegers(second);
    return first == 0 || (SkipArray("offsets", first) && SkipArray("connectivity", second));
  }

  bool SkipArray(const char* name, std::int64_t count) {
    if (Keyword() != name) {
      vtkErrorMacro(<< "cells without " << name);
      return false;
    }
    const std::string type(Keyword());
    return vtkSmartPointer<vtkAbstractArray>::Take(ReadArray(type.c_str(), count, 1)) != nullptr;
  }

  // Skips to an empty line.
  bool SkipMetaData() {
    char line[256];
    while (ReadLine(line)) {
      if (std::string_view(line).empty()) return true;
    }
    return false;
  }

  char word_[256];
  std::int64_t most_numbers_ = 0;
};

vtkStandardNewMacro(ParticlesReader)

}  // namespace

vtkSmartPointer<vtkPolyData> ReadLegacyParticles(const std::string& path) {
  const vtkNew<ParticlesReader> reader;
  return reader->ReadParticles(path);
}

}  // namespace partiemc::client::input
