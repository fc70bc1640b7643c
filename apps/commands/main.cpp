#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <system_error>

#include "apps/commands/commands.hpp"
#include "apps/commands/option_text.hpp"
#include "apps/commands/version_text.hpp"
#include "base/error.hpp"
#include "base/petsc.hpp"
#include "base/run_program.hpp"
#include "base/temporary_files.hpp"
#include "config/yaml.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace {

/// Prints an error line and returns the exit status. Under mpirun all ranks are aborted; if rank 0
/// fails, too, it prints the line.
int give_up(const std::string& message, int status) {
    int initialised = 0, finalised = 0, rank = 0, ranks = 1;
    MPI_Initialized(&initialised);
    MPI_Finalized(&finalised);
    const bool running = initialised && !finalised;
    if (running) {
        MPI_Comm_rank(MPI_COMM_WORLD, &rank);
        MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    } else {  // set by the launchers of Open MPI, MPICH and Slurm
        for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "SLURM_PROCID"})
            if (const char* value = std::getenv(name)) rank = std::atoi(value);
        if (rank > 0) return status;
    }
    if (rank > 0) ::sleep(3);  // on a busy machine rank 0 takes time to abort the others
    std::fputs(fmt::format("livetet: {}\n", message).c_str(),
               stderr);  // fmt::print would throw if stderr is closed
    std::fflush(stderr);
    if (running && ranks > 1) MPI_Abort(MPI_COMM_WORLD, status);
    return status;
}

/// The parts of a text before, between and after the marks. Empty unless all marks occur in this
/// order.
std::vector<std::string> around(std::string_view text,
                                std::initializer_list<std::string_view> marks) {
    std::vector<std::string> parts;
    for (const std::string_view mark : marks) {
        const std::size_t at = text.find(mark);
        if (at == text.npos) return {};
        parts.emplace_back(text.substr(0, at));
        text.remove_prefix(at + mark.size());
    }
    parts.emplace_back(text);
    return parts;
}

/// Makes every option refuse an empty text, which a script passes whose variable is not set, and
/// each of type FLOAT refuse NaN, which passes range checks as all comparisons with it fail.
void refuse_no_values(CLI::App& app) {
    for (CLI::Option* option : app.get_options()) {
        option->check(CLI::Validator(
            [](std::string& text) {
                return text.empty() ? "found an empty text, expected a value" : std::string();
            },
            ""));
        if (option->get_type_name().find("FLOAT") != std::string::npos)
            option->check(CLI::Validator(
                [](std::string& text) {
                    return std::isnan(std::strtod(text.c_str(), nullptr))
                               ? "found " + text + ", expected a number"
                               : std::string();
                },
                ""));
    }
    for (CLI::App* command : app.get_subcommands({})) refuse_no_values(*command);
}

/// Rewrites an error of the parser as: option, found, expected.
std::string error_text(const CLI::ParseError& e, const CLI::App& app) {
    const std::string message = e.what();
    const auto type_of = [&](const std::string& name) {
        const CLI::App* command = &app;
        while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
        const CLI::Option* option = command->get_option_no_throw(name);
        return option ? option->get_type_name() : "";
    };
    const auto whole = [](const std::string& type) {
        return type.substr(0, type.find(':')).find("INT") != type.npos;
    };
    const auto short_form = [](const std::string& number) {  // 1 for 1.000000
        if (number.find('.') == number.npos) return number;
        const std::string kept = number.substr(0, number.find_last_not_of('0') + 1);
        return kept.substr(0, kept.find_last_not_of('.') + 1);
    };
    if (const auto part = around(message, {": Value ", " not in range ", " to "}); !part.empty()) {
        const std::string type = type_of(part[0]);
        const bool endless = part[3].size() > 40;  // the limit is the largest double
        std::string expected =
            type.find("NONNEGATIVE") == type.npos ? "a positive number" : "0 or a positive number";
        if (!endless)
            expected = fmt::format("{}{} to {}", whole(type) ? "a whole number from " : "",
                                   short_form(part[2]), short_form(part[3]));
        return fmt::format("{}: found {}, expected {}", part[0], part[1], expected);
    }
    if (const auto part = around(message, {": Check ", " value in {", "} OR {"});
        !part.empty()) {  // an enumeration of names
        std::string names;
        for (std::size_t at = 0; at < part[2].size();
             at = std::min(part[2].find(',', at), part[2].size() - 1) + 1)
            names += (names.empty() ? "" : ", ") + part[2].substr(at, part[2].find("->", at) - at);
        return fmt::format("{}: found {}, expected one of {}", part[0], part[1], names);
    }
    if (const auto part = around(message, {": ", " not in {", "}"}); !part.empty())
        return fmt::format("{}: found {}, expected one of {}", part[0], part[1], part[2]);
    if (const auto part = around(message, {"Could not convert: ", " = "}); !part.empty()) {
        const std::string type = type_of(part[1]);
        if (type.empty()) return fmt::format("{}: found {}, expected no value", part[1], part[2]);
        if (!whole(type)) return fmt::format("{}: found {}, expected a number", part[1], part[2]);
        return fmt::format("{}: found {}, expected a whole number{}", part[1], part[2],
                           livetet::range_missed_by(part[2]));
    }
    return message;
}

/// "livetet calibrate pivot", as far as it was parsed.
std::string command_of(const CLI::App& app) {
    std::string name = "livetet";
    for (const CLI::App* command = &app; !command->get_subcommands().empty();) {
        command = command->get_subcommands().front();
        name += " " + command->get_name();
    }
    return name;
}

constexpr int our_fault = 70;  // EX_SOFTWARE of sysexits.h

/// What has to be set before anything is printed, opened or started.
void prepare_process() {
    // Open MPI would ask each X server of the machine for graphics cards, and print what servers of
    // other users answer.
    ::setenv("HWLOC_COMPONENTS", "-gl", 0);
    // The next file opened would get the number of a closed standard stream, and receive what is
    // printed.
    for (int stream = 0; stream < 3; ++stream)
        if (::fcntl(stream, F_GETFD) < 0) (void)::open("/dev/null", O_RDWR);
    livetet::remove_temporary_files_at_signals();
    // A file over the user's limit becomes an error of the write, which has its own message.
    std::signal(SIGXFSZ, SIG_IGN);
}

void add_commands(CLI::App& app, livetet::ExitStatus& status) {
    using namespace livetet;
#ifdef LIVETET_IMAGES
    add_phantom_command(app);
#endif
    add_mesh_command(app);
    add_calibrate_command(app);
    add_fiducials_command(app, status);
    add_register_command(app, status);
    add_track_command(app, status);
    add_record_command(app);
    add_serve_command(app);
    add_report_command(app);
    add_warp_command(app);
#ifdef LIVETET_IMAGES
    add_view_command(app, status);
#endif
    add_solve_command(app, status);
    add_study_command(app, status);
    add_explain_command(app);
    add_tune_command(app, status);
    add_bench_command(app, status);
    add_scene_command(app);
    add_reference_command(app);
}

/// Parses the command line and runs the command. Throws what the command throws.
void run_command(CLI::App& app, int argc, char** argv) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    if (argc > 1 && argv[1][0] != '-' &&
        std::find(names.begin(), names.end(), argv[1]) == names.end()) {
        const std::string nearest = livetet::nearest_name(argv[1], names);
        livetet::fail("unknown command {}, {}", argv[1],
                      nearest.empty() ? fmt::format("expected one of {}", fmt::join(names, ", "))
                                      : fmt::format("did you mean {}?", nearest));
    }
    app.parse(argc, argv);
    if (std::fflush(stdout) != 0)
        throw std::system_error(errno, std::generic_category(), "standard output");
    if (std::ferror(stdout) != 0)  // an earlier write of a library failed
        livetet::fail(
            "standard output: not all could be written; is the disk full, or its reader gone?");
}

}  // namespace

int main(int argc, char** argv) {
    using namespace livetet;
    prepare_process();
    CLI::App app{
        "Livetet: an organ's image follows the organ. A segmented image becomes a finite element "
        "model that tracked\n"
        "sensors move, each frame."};
    app.set_version_flag("--version", version_text());
    app.require_subcommand(1);
    app.footer(
        "Help of a command: livetet COMMAND --help. Exit status: 0 success, 1 a benchmark missed a "
        "target, 2 bad input, 3 not converged or a replay that differs, 4 some of a study not "
        "solved, 70 internal error; "
        "128 plus the signal's number if a signal ended it.");
    app.formatter(help_formatter());
    ExitStatus status;
    add_commands(app, status);
    refuse_no_values(app);
    try {
        run_command(app, argc, argv);
    } catch (const Interrupted& by) {
        return give_up("stopped", 128 + by.signal);
    } catch (const CLI::ParseError& e) {
        return e.get_exit_code() == 0 ? app.exit(e)
                                      : give_up(fmt::format("{} ({} --help explains)",
                                                            error_text(e, app), command_of(app)),
                                                2);
    } catch (const Error& e) {
        return give_up(e.what(), 2);
    } catch (const std::system_error& e) {
        // The machine has run out of something: files, processes, room for standard output.
        return give_up(e.what(), 2);
    } catch (const PetscFailure& e) {
        if (PetscSession::any_options() && e.may_be_an_option())
            return give_up(
                fmt::format(
                    "PETSc cannot do this, expected options that it has for this solver: {}",
                    e.what()),
                2);
        return give_up(e.what(), our_fault);
    } catch (const std::bad_alloc&) {
        return give_up("out of memory", our_fault);
    } catch (const std::exception& e) {
        return give_up(e.what(), our_fault);
    }
    return status.value;
}
