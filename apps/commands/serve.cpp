#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdint>

#include "apps/commands/commands.hpp"
#include "apps/live/tracker_server.hpp"
#include "apps/live/tracker_source.hpp"
#include "base/error.hpp"
#include "base/stop_signals.hpp"

namespace livetet {

namespace {

struct ServeArguments {
    std::string source;
    OpenIgtLinkServerOptions server;
    bool loop = false;
};

void serve_file(const ServeArguments& a) {
    if (is_stream(a.source)) fail("{}: expected a recording or a script (.yaml) to play", a.source);
    const DelayedRecording played = read_stored(a.source);
    OpenIgtLinkServer server(a.server);
    const bool colons = a.server.address.find(':') != std::string::npos;
    fmt::print("openigtlink://{}:{} sends {}\n",
               colons ? "[" + a.server.address + "]" : a.server.address, server.port(),
               fmt::join(played.recording.tools, ", "));
    std::fflush(stdout);
    const StopSignals signals;
    const Repeat repeat = a.loop ? Repeat::until_stopped : Repeat::once;
    ProgressLine line("serve");
    with_context(a.source, [&] { serve(server, played, repeat, signals.token(), line.status()); });
}

}  // namespace

void add_serve_command(CLI::App& app) {
    CLI::App* command =
        app.add_subcommand("serve",
                           "Acts as a tracker server (OpenIGTLink) that plays a recording or a "
                           "simulated tracker, for trials without hardware");
    auto a = std::make_shared<ServeArguments>();
    command
        ->add_option("source", a->source,
                     "a recording (PLUS sequence), or a simulated tracker's script (.yaml; livetet "
                     "scene --script)")
        ->required();
    command->add_option("--port", a->server.port, "TCP port; 0: any free port")
        ->capture_default_str()
        ->check(CLI::Range(0, 65535));
    command
        ->add_option(
            "--address", a->server.address,
            "address to listen on: 127.0.0.1 for this machine only, 0.0.0.0 for all its networks")
        ->capture_default_str();
    command->add_flag("--loop", a->loop, "repeat until Ctrl-C");
    command->callback([a] { serve_file(*a); });
}

}  // namespace livetet
