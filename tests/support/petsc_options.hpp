#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/petsc.hpp"

namespace livetet::test {

/// Sets PETSc options ("-name", "value") while it lives.
class PetscOptions {
  public:
    explicit PetscOptions(std::vector<std::pair<std::string, std::string>> options)
        : options_(std::move(options)) {
        for (const auto& [name, value] : options_)
            LIVETET_PETSC(PetscOptionsSetValue(nullptr, name.c_str(),
                                               value.empty() ? nullptr : value.c_str()));
    }
    ~PetscOptions() {
        for (const auto& [name, value] : options_) PetscOptionsClearValue(nullptr, name.c_str());
    }
    PetscOptions(const PetscOptions&) = delete;
    PetscOptions& operator=(const PetscOptions&) = delete;

  private:
    std::vector<std::pair<std::string, std::string>> options_;
};

}  // namespace livetet::test
