#pragma once

#include <vtkAlgorithm.h>
#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkErrorCode.h>
#include <vtkExecutive.h>
#include <vtkNew.h>
#include <vtkXMLReader.h>

#include <exception>
#include <filesystem>
#include <string>

#include "base/error.hpp"
#include "io/text.hpp"

namespace livetet {

/// Captures the errors and warnings of a VTK object, which VTK would print.
class VtkMessages {
  public:
    explicit VtkMessages(vtkAlgorithm* object) {
        command_->SetClientData(this);
        command_->SetCallback([](vtkObject*, unsigned long, void* self, void* text) {
            auto& first = static_cast<VtkMessages*>(self)->first_;
            if (first.empty()) first = text ? static_cast<const char*>(text) : "no text";
        });
        for (vtkObject* speaker :
             {static_cast<vtkObject*>(object), static_cast<vtkObject*>(object->GetExecutive())}) {
            speaker->AddObserver(vtkCommand::ErrorEvent, command_);
            speaker->AddObserver(vtkCommand::WarningEvent, command_);
        }
        if (auto* xml = vtkXMLReader::SafeDownCast(object)) xml->SetParserErrorObserver(command_);
    }
    VtkMessages(const VtkMessages&) = delete;
    VtkMessages& operator=(const VtkMessages&) = delete;

    /// The last line of the first message; VTK's source location precedes it.
    std::string text() const {
        std::string last;
        for (const auto line : split_lines(first_))
            if (!trim(line).empty()) last = trim(line);
        return without_addresses(last);
    }

  private:
    vtkNew<vtkCallbackCommand> command_;
    std::string first_;
};

/// Reads `path` with a VTK reader; call it within `parse_in_child`. Throws Error with the first
/// message of the reader.
template <class Reader>
void update_reader(Reader* reader, const std::filesystem::path& path) {
    const VtkMessages messages(reader);
    reader->SetFileName(path.c_str());
    try {
        reader->Update();
    } catch (const std::exception& e) {  // such as std::bad_alloc for a damaged file's size
        fail("{}: cannot be read: {}", path.string(), e.what());
    }
    if (!messages.text().empty()) fail("{}: cannot be read: {}", path.string(), messages.text());
    if (reader->GetErrorCode() != vtkErrorCode::NoError)
        fail("{}: cannot be read: {}", path.string(),
             vtkErrorCode::GetStringFromErrorCode(reader->GetErrorCode()));
}

/// Throws Error unless each cell is a valid range of the index list and each index is below
/// `points`.
inline void check_cells(vtkCellArray* cells, vtkIdType points, const std::string& where) {
    if (cells->GetNumberOfCells() == 0) return;
    if (!cells->IsValid()) fail("{}: its cells' offsets do not fit their list of points", where);
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    for (cells->InitTraversal(); cells->GetNextCell(count, ids);)
        for (vtkIdType k = 0; k < count; ++k)
            if (ids[k] < 0 || ids[k] >= points)
                fail("{}: a cell names point {}, expected 0 to {}", where, ids[k], points - 1);
}

}  // namespace livetet
