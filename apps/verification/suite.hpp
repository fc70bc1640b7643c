#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace livetet::verification {

/// Result of a case on one mesh, or with one step length.
struct Run {
    std::string size;  ///< "1,331 nodes", "dt = T/100"
    double h = 0;      ///< size against which the order is measured; 0: none
    double value = 0;
    double error = 0;  ///< relative to the reference, unless the case says otherwise
    double seconds = 0;
};

/// A checked number: a sequence of runs, of which the last is judged.
struct Outcome {
    std::string name;      ///< "thick sphere, nu = 0.4999, P1 mixed: u_r(a)"
    std::string source;    ///< source of the reference
    double reference = 0;  ///< reference value, in `unit`
    std::string unit;
    double tolerance = 0;  ///< limit of the last run's error; 0: reported, not judged
    std::vector<Run> runs;
    double expected_order = 0;  ///< 0: no order is claimed
    double order_tolerance = 0.2;

    const Run& last() const { return runs.back(); }
    /// Slope of log(error) against log(h) between the last two runs; 0 for fewer runs.
    double observed_order() const;
    bool passed() const;
};

/// A verification case: computes one or more outcomes.
struct Case {
    /// `test`: also a unit test. `report`: it takes minutes or judges nothing, so that `bench
    /// verification` alone runs it.
    enum class Role { test, report };
    std::string name;
    std::function<std::vector<Outcome>()> run;
    Role role = Role::test;
};

/// All cases, in the order of the table.
std::span<const Case> cases();

// Cases by subject; cases() joins them.
/// Patch tests, uniaxial stretch, shear, bending, torsion.
std::vector<Case> homogeneous_cases();
/// Thick sphere and cylinder, Cook's membrane, iterations against nu.
std::vector<Case> incompressible_cases();
/// LE10, elastica, Cook's membrane at finite strain, order study.
std::vector<Case> structural_cases();
/// Mooney-Rivlin, Holzapfel-Gasser-Ogden.
std::vector<Case> material_cases();
/// Frequencies, time schemes, spin, energy.
std::vector<Case> dynamic_cases();
/// Flat, everted and random starts.
std::vector<Case> recovery_cases();
/// Fine bodies of ten-node tets under deep presses.
std::vector<Case> press_cases();

}  // namespace livetet::verification
