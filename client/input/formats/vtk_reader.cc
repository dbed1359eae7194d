// One frame per file: legacy VTK (vtk_legacy.h), VTP and VTU through VTK. Only this file and
// vtk_legacy include VTK's headers.
#include <vtkAlgorithm.h>
#include <vtkDataArray.h>
#include <vtkDataObject.h>
#include <vtkFieldData.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkPointSet.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <algorithm>
#include <filesystem>
#include <new>
#include <system_error>
#include <utility>

#include "absl/strings/ascii.h"
#include "client/input/base/array_table.h"
#include "client/input/base/byte_source.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"
#include "client/input/formats/vtk_legacy.h"
#include "common/mutex.h"

namespace partiemc::client::input {
namespace {

// Number of bytes at the beginning of a file that are searched for declared counts. They usually
// contain all of the XML, or the POINTS line of a legacy file.
constexpr std::size_t kHeadBytes = 65536;

// Smallest number of bytes of a point in a file. A plain point needs at least three digits with
// separators. A compressed point needs three coordinates of four bytes at zlib's best ratio of
// about 1:1000.
constexpr double kLeastBytesPerPlainPoint = 6;
constexpr double kLeastBytesPerPackedPoint = 0.01;

// Larger counts become this one, so that they fit in 64 bits.
constexpr double kMostDeclared = 1e18;

// Stores VTK's first error and prints nothing.
class MessageCatcher final : public vtkOutputWindow {
 public:
  static MessageCatcher* New();

  void DisplayText(const char* /*text*/) override {}
  void DisplayErrorText(const char* text) override {
    if (error_.empty()) error_ = text;
  }
  void DisplayWarningText(const char* text) override { TakeWarning(text); }
  void DisplayGenericWarningText(const char* text) override { TakeWarning(text); }
  void DisplayDebugText(const char* /*text*/) override {}

  // Returns VTK's text "ERROR: In FILE, line N\nvtkThing (0x...): message\n\n" as "message", in one
  // line.
  std::string Message() const {
    std::string_view text = error_;
    const std::size_t object_end = text.find("): ");
    if (object_end != std::string_view::npos) text.remove_prefix(object_end + 3);
    std::string line(Strip(text));
    std::replace(line.begin(), line.end(), '\n', ' ');
    return line;
  }
  bool has_error() const { return !error_.empty(); }

 private:
  // The legacy reader reports a truncated file as a warning ("Error reading ascii data"). Other
  // warnings, for example about newer file versions, are harmless.
  void TakeWarning(std::string_view text) {
    if (error_.empty() && Contains(text, "Error reading")) error_ = text;
  }

  std::string error_;
};

vtkStandardNewMacro(MessageCatcher)

// Redirects VTK's messages, which are global to the process, to `catcher` during its lifetime.
class CatchMessages {
 public:
  CatchMessages()
      : lock_(GlobalMutex()),
        before_(vtkOutputWindow::GetInstance()),
        verbosity_before_(vtkLogger::GetCurrentVerbosityCutoff()) {
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
    vtkOutputWindow::SetInstance(catcher);
  }
  CatchMessages(const CatchMessages&) = delete;
  CatchMessages& operator=(const CatchMessages&) = delete;
  ~CatchMessages() {
    vtkOutputWindow::SetInstance(before_);
    vtkLogger::SetStderrVerbosity(verbosity_before_);
  }

  vtkNew<MessageCatcher> catcher;

 private:
  static Mutex& GlobalMutex() {
    static Mutex mutex;
    return mutex;
  }

  const MutexLock lock_;
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkLogger::Verbosity verbosity_before_;
};

std::optional<ElementType> TypeOf(int vtk_type) {
  switch (vtk_type) {
    case VTK_FLOAT:
      return ElementType::kFloat32;
    case VTK_DOUBLE:
      return ElementType::kFloat64;
    case VTK_CHAR:
    case VTK_SIGNED_CHAR:
      return ElementType::kInt8;
    case VTK_UNSIGNED_CHAR:
      return ElementType::kUInt8;
    case VTK_SHORT:
      return ElementType::kInt16;
    case VTK_UNSIGNED_SHORT:
      return ElementType::kUInt16;
    case VTK_INT:
      return ElementType::kInt32;
    case VTK_UNSIGNED_INT:
      return ElementType::kUInt32;
    case VTK_LONG:
      return sizeof(long) == 8 ? ElementType::kInt64 : ElementType::kInt32;
    case VTK_UNSIGNED_LONG:
      return sizeof(long) == 8 ? ElementType::kUInt64 : ElementType::kUInt32;
    case VTK_LONG_LONG:
      return ElementType::kInt64;
    case VTK_UNSIGNED_LONG_LONG:
      return ElementType::kUInt64;
    case VTK_ID_TYPE:
      return sizeof(vtkIdType) == 8 ? ElementType::kInt64 : ElementType::kInt32;
    default:
      return std::nullopt;
  }
}

// Adds the components of `array` as columns, if it has `rows` tuples of numbers.
void AddArray(vtkDataArray* array, const std::string& name, vtkIdType rows, ArrayTable& table) {
  if (array == nullptr || array->GetNumberOfTuples() != rows || !array->HasStandardMemoryLayout()) {
    return;
  }
  const auto type = TypeOf(array->GetDataType());
  const auto components = static_cast<std::size_t>(array->GetNumberOfComponents());
  if (!type || components > kMaxArrayComponents) return;
  table.Add(name, components,
            {*type, false, static_cast<const char*>(array->GetVoidPointer(0)),
             ElementBytes(*type) * components});
}

ArrayTable TableOf(vtkPointSet& points) {
  const vtkIdType rows = points.GetNumberOfPoints();
  ArrayTable table{.rows = static_cast<std::size_t>(rows)};
  AddArray(points.GetPoints()->GetData(), "Points", rows, table);
  vtkPointData* const arrays = points.GetPointData();
  for (int k = 0; k < arrays->GetNumberOfArrays(); ++k) {
    vtkDataArray* const array = arrays->GetArray(k);
    const char* const name = array != nullptr ? array->GetName() : nullptr;
    if (name != nullptr) AddArray(array, name, rows, table);
  }
  return table;
}

std::optional<double> TimeOf(vtkDataObject& data) {
  vtkFieldData* const fields = data.GetFieldData();
  for (int k = 0; fields != nullptr && k < fields->GetNumberOfArrays(); ++k) {
    vtkDataArray* const array = fields->GetArray(k);
    if (array == nullptr || array->GetName() == nullptr || array->GetNumberOfValues() != 1)
      continue;
    const std::string name = absl::AsciiStrToLower(array->GetName());
    if (name == "timevalue" || name == "time") return array->GetComponent(0, 0);
  }
  return std::nullopt;
}

// The largest number of points that the head of the file declares.
double DeclaredPoints(std::string_view head) {
  double declared = 0;
  for (const std::string_view key : {"NumberOfPoints=\"", "\nPOINTS "}) {
    for (std::size_t at = head.find(key); at != std::string_view::npos; at = head.find(key, at)) {
      at += key.size();
      const std::size_t end = std::min(head.find_first_not_of("0123456789", at), head.size());
      const double count = ParseNumber(head.substr(at, end - at)).value_or(0);
      declared = std::max(declared, std::min(count, kMostDeclared));
    }
  }
  return declared;
}

class VtkReader final : public OneFrameReader {
 public:
  VtkReader(std::string path, bool legacy, bool unstructured, const ColumnRequest& request)
      : path_(std::move(path)), legacy_(legacy), unstructured_(unstructured), request_(request) {}

 private:
  absl::Status Read(ParticleRows& rows) override {
    try {
      return ReadParticles(rows);
    } catch (const std::bad_alloc&) {
      return Error(absl::StatusCode::kDataLoss, "declares more data than there is memory for");
    }
  }

  absl::Status Error(absl::StatusCode code, std::string_view message) const {
    return absl::Status(code, Concat(path_, ": ", message));
  }

  vtkSmartPointer<vtkDataObject> ReadData() const {
    if (legacy_) return ReadLegacyParticles(path_);
    vtkSmartPointer<vtkXMLReader> reader;
    if (unstructured_) {
      reader = vtkSmartPointer<vtkXMLUnstructuredGridReader>::New();
    } else {
      reader = vtkSmartPointer<vtkXMLPolyDataReader>::New();
    }
    reader->SetFileName(path_.c_str());
    reader->Update();
    return reader->GetOutputDataObject(0);
  }

  absl::Status ReadParticles(ParticleRows& rows) const {
    const CatchMessages catch_messages;
    const vtkSmartPointer<vtkDataObject> data = ReadData();
    if (catch_messages.catcher->has_error()) {
      return Error(absl::StatusCode::kDataLoss,
                   Concat("VTK cannot read it: ", catch_messages.catcher->Message()));
    }
    auto* const points = vtkPointSet::SafeDownCast(data);
    if (points == nullptr) {
      return Error(absl::StatusCode::kFailedPrecondition,
                   "holds no particles; PartiEMC reads POLYDATA and UNSTRUCTURED_GRID");
    }
    ArrayTable table;
    if (points->GetPoints() != nullptr && points->GetNumberOfPoints() > 0) {
      table = TableOf(*points);
    } else {
      // Files omit the arrays of a frame without particles, so the requested names are added here.
      table.names = {"Points:0", "Points:1", "Points:2"};
      for (const Condition& condition : request_.conditions) {
        table.names.push_back(condition.column);
      }
      table.names.insert(table.names.end(), request_.attributes.begin(), request_.attributes.end());
      table.columns.resize(table.names.size());
    }
    const absl::Status status = FillRows(table, request_, path_, rows);
    rows.time = TimeOf(*data);
    return status;
  }

  std::string path_;
  bool legacy_;
  bool unstructured_;
  const ColumnRequest& request_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenVtk(const std::string& path,
                                                     const ColumnRequest& request) {
  if (!request.columns.empty()) {
    return absl::InvalidArgumentError(Concat(
        path, ": --columns does not apply to VTK files, which know where their positions are"));
  }
  const auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  const auto head = (*stream)->Peek(kHeadBytes);
  if (!head.ok()) return head.status();
  if ((*stream)->compressed()) {
    return absl::UnimplementedError(
        Concat(path, ": VTK files are not read packed; unpack it first"));
  }
  const bool packed = Contains(*head, "compressor=");
  const double declared = DeclaredPoints(*head);
  std::error_code error;
  const double least = declared * (packed ? kLeastBytesPerPackedPoint : kLeastBytesPerPlainPoint);
  if (declared > static_cast<double>(kMaxParticles) ||
      least > static_cast<double>(std::filesystem::file_size(path, error))) {
    return absl::DataLossError(Concat(path, ": declares ", static_cast<std::uint64_t>(declared),
                                      " points, more than its bytes can hold; the file is "
                                      "truncated or damaged"));
  }
  const bool legacy = head->starts_with("# vtk DataFile");
  // Arrays may have any name, so only the type in <VTKFile ...> decides.
  const std::string_view element = head->substr(std::min(head->find("<VTKFile"), head->size()));
  const bool unstructured = Contains(element.substr(0, element.find('>')), "UnstructuredGrid");
  return std::make_unique<VtkReader>(path, legacy, unstructured, request);
}

}  // namespace partiemc::client::input
