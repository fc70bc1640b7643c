#pragma once

#include <filesystem>

namespace livetet {

/// Folder of the file that this process runs.
std::filesystem::path program_folder();

/// Runs another program in place of this one, in this process: with the same number, arguments
/// (the first one, the program's name, included), environment and open files. To be called before
/// threads are started and MPI is initialised. Throws Error if the program cannot be started.
[[noreturn]] void run_instead(const std::filesystem::path& program, char* const* arguments);

/// The same with the arguments that this process was started with.
[[noreturn]] void run_instead(const std::filesystem::path& program);

}  // namespace livetet
