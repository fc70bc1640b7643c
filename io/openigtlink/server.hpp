#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/openigtlink/message.hpp"

namespace livetet {

struct OpenIgtLinkServerOptions {
    std::string address =
        "127.0.0.1";             ///< "0.0.0.0" or "::" listens on every network of the machine
    std::uint16_t port = 18944;  ///< 0 takes a free one: see `port()`
    std::size_t max_clients = 16;
};

struct OpenIgtLinkServerStatistics {
    std::size_t clients = 0;        ///< connected now
    std::uint64_t connections = 0;  ///< ever
    std::uint64_t turned_away = 0;  ///< beyond `max_clients`
    std::uint64_t sent = 0;         ///< messages, to all clients
    std::uint64_t dropped =
        0;  ///< messages that a newer one replaced before a slow client took them
    std::uint64_t skipped =
        0;  ///< whole publications, where even the server's thread did not keep up
    std::uint64_t refused = 0;  ///< messages that cannot be encoded; `last_error` says why
    std::string last_error;     ///< of a client's connection or a message
};

/// Publishes messages by OpenIGTLink to any number of clients, from a thread of its own. Each
/// client is spoken to in header version 1 until it has sent a header of version 2 (3D Slicer sends
/// a STATUS on connecting), then in 2.
///
/// A client that reads too slowly loses messages, oldest first: one of the same type and device
/// that still waits is replaced by its newer one, in its place; what is being sent is sent to its
/// end. What clients send is read, checked by its header and passed over without being kept; a
/// query (GET_...) is answered by STATUS 4, not found, and STT_TDATA by an RTS_TDATA of 1, no. Who
/// sends what cannot be a header is disconnected.
class OpenIgtLinkServer {
  public:
    /// Throws Error where the address cannot be listened on: another program has the port, or it is
    /// no address of this machine.
    explicit OpenIgtLinkServer(OpenIgtLinkServerOptions options = {});
    ~OpenIgtLinkServer();

    std::uint16_t port() const;

    /// Hands messages over that belong together and are sent in this order. One whose header's
    /// version is 2 goes to those clients alone who speak 2: what it says is in its metadata,
    /// without which it would mislead. Takes microseconds and never waits for a socket: they are
    /// encoded, only if someone listens, by the server's thread.
    void publish(std::vector<igtl::Message> messages);

    OpenIgtLinkServerStatistics statistics() const;

  private:
    class Listener;
    std::unique_ptr<Listener> listener_;
};

}  // namespace livetet
