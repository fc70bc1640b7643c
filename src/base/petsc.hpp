#pragma once

#include <petscksp.h>

#include <algorithm>
#include <exception>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace livetet {

/// A PETSc call failed: the call, its place in the source, and PETSc's own message. An internal
/// error unless the message says otherwise.
class PetscFailure : public std::runtime_error {
  public:
    PetscFailure(PetscErrorCode code, const std::string& message)
        : std::runtime_error(message), code_(code) {}
    /// Whether PETSc returns this code for unknown options or invalid option values.
    bool may_be_an_option() const {
        constexpr int of_options[] = {PETSC_ERR_SUP,
                                      PETSC_ERR_ARG_WRONG,
                                      PETSC_ERR_ARG_OUTOFRANGE,
                                      PETSC_ERR_ARG_INCOMP,
                                      PETSC_ERR_ARG_WRONGSTATE,
                                      PETSC_ERR_ARG_SIZ,
                                      PETSC_ERR_ARG_UNKNOWN_TYPE,
                                      PETSC_ERR_FILE_OPEN,
                                      PETSC_ERR_FILE_WRITE,
                                      PETSC_ERR_FILE_READ,
                                      PETSC_ERR_USER_INPUT,
                                      PETSC_ERR_USER,
                                      PETSC_ERR_MISSING_FACTOR,
                                      PETSC_ERR_CONV_FAILED,
                                      PETSC_ERR_NOT_CONVERGED};
        return std::find(std::begin(of_options), std::end(of_options), static_cast<int>(code_)) !=
               std::end(of_options);
    }

  private:
    PetscErrorCode code_;
};

/// The exception that a callback caught because it must not pass through PETSc's C code; null if
/// there is none.
inline std::exception_ptr& kept_exception() {
    thread_local std::exception_ptr kept;
    return kept;
}

/// Wraps the body of a PETSc callback: runs work() and returns 0, or stores its exception and
/// returns an error code. The LIVETET_PETSC around the outer PETSc call rethrows it.
template <class Work>
PetscErrorCode in_callback(Work&& work) noexcept {
    try {
        work();
        return 0;
    } catch (...) {
        kept_exception() = std::current_exception();
        return PETSC_ERR_LIB;
    }
}

/// Throws the stored exception of a callback, else PetscFailure.
[[noreturn]] inline void throw_petsc_failure(PetscErrorCode code, const char* call,
                                             const char* file, int line) {
    if (const auto kept = std::exchange(kept_exception(), nullptr)) std::rethrow_exception(kept);
    const char* kind = nullptr;
    char* words = nullptr;  // PETSc's latest error text; may belong to an earlier error
    PetscErrorMessage(code, &kind, &words);
    throw PetscFailure(
        code, fmt::format("PETSc: {}{}{} ({} failed with code {} at {}:{})", kind ? kind : "",
                          kind && words && *words ? ": " : "", words ? words : "", call,
                          static_cast<int>(code), file, line));
}

/// Calls PETSc and throws PetscFailure if it returns an error.
#define LIVETET_PETSC(call)                                                           \
    do {                                                                              \
        if (const PetscErrorCode livetet_code_ = (call))                              \
            ::livetet::throw_petsc_failure(livetet_code_, #call, __FILE__, __LINE__); \
    } while (false)

/// Owns one reference to a PETSc object. `adopt` takes over the reference returned by a Create
/// call. A moved-from handle is empty.
template <class T>
class PetscHandle {
  public:
    PetscHandle() = default;
    static PetscHandle adopt(T object) { return PetscHandle(object); }
    PetscHandle(PetscHandle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
    PetscHandle& operator=(PetscHandle&& other) noexcept {
        std::swap(object_, other.object_);
        return *this;
    }
    ~PetscHandle() { reset(); }

    T get() const { return object_; }
    explicit operator bool() const { return object_ != nullptr; }
    /// For Create calls: releases the held object and returns the address for the new one.
    T* out() {
        reset();
        return &object_;
    }
    void reset() {
        if (object_) PetscObjectDereference(reinterpret_cast<PetscObject>(object_));
        object_ = nullptr;
    }

  private:
    explicit PetscHandle(T object) : object_(object) {}
    T object_ = nullptr;
};

/// Read access to the local values of a vector, until the guard is destroyed.
class ReadArray {
  public:
    explicit ReadArray(Vec v) : vec_(v) {
        PetscInt n = 0;
        LIVETET_PETSC(VecGetLocalSize(v, &n));
        LIVETET_PETSC(VecGetArrayRead(v, &data_));
        size_ = static_cast<std::size_t>(n);
    }
    ~ReadArray() { VecRestoreArrayRead(vec_, &data_); }
    ReadArray(const ReadArray&) = delete;
    ReadArray& operator=(const ReadArray&) = delete;
    std::span<const double> span() const { return {data_, size_}; }
    double operator[](std::size_t i) const { return data_[i]; }

  private:
    Vec vec_;
    const PetscScalar* data_ = nullptr;
    std::size_t size_ = 0;
};

/// Write access to the local values of a vector, until the guard is destroyed.
class WriteArray {
  public:
    explicit WriteArray(Vec v) : vec_(v) {
        PetscInt n = 0;
        LIVETET_PETSC(VecGetLocalSize(v, &n));
        LIVETET_PETSC(VecGetArray(v, &data_));
        size_ = static_cast<std::size_t>(n);
    }
    ~WriteArray() { VecRestoreArray(vec_, &data_); }
    WriteArray(const WriteArray&) = delete;
    WriteArray& operator=(const WriteArray&) = delete;
    std::span<double> span() const { return {data_, size_}; }
    double& operator[](std::size_t i) { return data_[i]; }

  private:
    Vec vec_;
    PetscScalar* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace livetet
