#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/openigtlink/message.hpp"

namespace livetet {

/// Options of an OpenIgtLinkServer.
struct OpenIgtLinkServerOptions {
    /// Address to listen on; "0.0.0.0" or "::" is every network interface.
    std::string address = "127.0.0.1";
    std::uint16_t port = 18944;  ///< 0: a free port, see `port()`
    std::size_t max_clients = 16;
};

/// Counters of an OpenIgtLinkServer.
struct OpenIgtLinkServerStatistics {
    std::size_t clients = 0;        ///< current connections
    std::uint64_t connections = 0;  ///< all connections so far
    std::uint64_t turned_away = 0;  ///< connections refused beyond `max_clients`
    std::uint64_t sent = 0;         ///< messages sent, summed over the clients
    /// Messages replaced by a newer one before a slow client received them.
    std::uint64_t dropped = 0;
    /// Publications dropped because the server's thread was too slow.
    std::uint64_t skipped = 0;
    std::uint64_t refused = 0;  ///< messages that could not be encoded; `last_error` says why
    std::string last_error;     ///< of a client's connection or of a message
};

/// Publishes OpenIGTLink messages to any number of clients, from its own thread. A client receives
/// header version 1 until it has sent a header of version 2 (3D Slicer sends a STATUS on
/// connecting), then version 2.
///
/// Device names that agree in their first 20 bytes are numbered in the header; version 2 has the
/// whole name in the metadata (`WireNames`).
///
/// A client that reads too slowly loses the oldest messages: a waiting message is replaced by a
/// newer one of the same type and device; a message being sent is completed. Messages from clients
/// are checked by their header and skipped. A query (GET_...) is answered with STATUS 4 (not
/// found), and STT_TDATA with RTS_TDATA 1 (refused). A client that sends an invalid header is
/// disconnected.
///
/// Thread safety: `publish` and `statistics` may be called from any thread.
class OpenIgtLinkServer {
  public:
    /// Throws Error if the address cannot be listened on: the port is in use, or it is not an
    /// address of this machine.
    explicit OpenIgtLinkServer(OpenIgtLinkServerOptions options = {});
    ~OpenIgtLinkServer();

    std::uint16_t port() const;

    /// Publishes messages that belong together, in this order. A message with header version 2 is
    /// sent to clients of version 2 only, as it is misleading without its metadata. Takes
    /// microseconds and never waits for a socket: the server's thread encodes the messages, and
    /// only if a client is connected.
    void publish(std::vector<igtl::Message> messages);

    OpenIgtLinkServerStatistics statistics() const;

  private:
    class Listener;
    std::unique_ptr<Listener> listener_;
};

}  // namespace livetet
