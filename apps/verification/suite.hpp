#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace livetet::verification {

/// What one mesh, or step, of a case came to.
struct Run {
    std::string size;  ///< "1,331 nodes", "dt = T/100"
    double h = 0;      ///< what the order is measured against; 0: none
    double value = 0;
    double error = 0;  ///< relative to the reference, or as the case says
    double seconds = 0;
};

/// One checked number: a sequence of runs, the last of which is judged.
struct Outcome {
    std::string name;      ///< "thick sphere, nu = 0.4999, P1 mixed: u_r(a)"
    std::string source;    ///< of the reference
    double reference = 0;  ///< in `unit`
    std::string unit;
    double tolerance = 0;  ///< on the last run's error; 0: told, not judged
    std::vector<Run> runs;
    double expected_order = 0;  ///< 0: none is claimed
    double order_tolerance = 0.2;

    const Run& last() const { return runs.back(); }
    /// The slope of log(error) against log(h) between the last two runs; 0 with fewer.
    double observed_order() const;
    bool passed() const;
};

/// A case of verification: a body, its reference, what came out.
struct Case {
    std::string name;
    std::function<std::vector<Outcome>()> run;
};

/// All cases, in the order of the table.
std::span<const Case> cases();

// One list for each field; cases() joins them.
std::vector<Case> homogeneous_cases();  ///< patch tests, uniaxial, shear, bending, torsion
std::vector<Case>
incompressible_cases();                ///< thick sphere and cylinder, Cook, iterations against nu
std::vector<Case> structural_cases();  ///< LE10, elastica, Cook at finite strain, order study
std::vector<Case> material_cases();    ///< Mooney-Rivlin, Holzapfel-Gasser-Ogden
std::vector<Case> dynamic_cases();     ///< frequencies, time schemes, spin, energy
std::vector<Case> recovery_cases();    ///< flat, everted and random starts

}  // namespace livetet::verification
