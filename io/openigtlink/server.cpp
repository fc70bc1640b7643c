#include "io/openigtlink/server.hpp"

#include <algorithm>
#include <atomic>
#include <deque>
#include <mutex>
#include <thread>

#include "base/log.hpp"
#include "io/openigtlink/close_on_exec.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/parser.hpp"
#include "io/openigtlink/wire_names.hpp"

namespace livetet {

/// A message to send, encoded at most once for each header version.
class Outgoing {
  public:
    explicit Outgoing(igtl::Message message)
        : min_version_(message.version), message_(std::move(message)) {}
    bool is_for(std::uint16_t version) const { return version >= min_version_; }
    const igtl::Bytes& encoded(std::uint16_t version) {
        igtl::Bytes& bytes = encoded_.at(version - 1);
        if (bytes.empty()) {
            message_.version = version;
            bytes = encode(message_);
        }
        return bytes;
    }
    bool replaces(const Outgoing& other) const {
        return message_.type == other.message_.type && message_.device == other.message_.device;
    }

  private:
    std::uint16_t min_version_;
    igtl::Message message_;
    std::array<igtl::Bytes, 2> encoded_;
};
using OutgoingPointer = std::shared_ptr<Outgoing>;

namespace {

using asio::ip::tcp;
using Failure = std::error_code;

/// Waiting messages of different type or device for one client.
constexpr std::size_t max_messages_waiting = 64;
constexpr int max_publications = 16;  ///< publications not yet taken by the server's thread
// Small, because messages buffered by the system for a slow client are outdated when they arrive.
constexpr int socket_buffer_size = 1 << 18;

tcp::acceptor listen_on(asio::io_context& io, const OpenIgtLinkServerOptions& options) {
    Failure failure;
    const auto address = asio::ip::make_address(options.address, failure);
    if (failure)
        fail("OpenIGTLink server: '{}', expected an address such as 127.0.0.1 or 0.0.0.0",
             options.address);
    const tcp::endpoint endpoint(address, options.port);
    tcp::acceptor acceptor(io);
    open_close_on_exec(acceptor, endpoint.protocol(), failure);
    if (!failure) acceptor.set_option(tcp::acceptor::reuse_address(true), failure);
    if (!failure) acceptor.bind(endpoint, failure);
    if (!failure) acceptor.listen(asio::socket_base::max_listen_connections, failure);
    if (failure)
        fail("OpenIGTLink server: cannot listen on {} port {}: {}; expected a free port",
             options.address, options.port, failure.message());
    return acceptor;
}

}  // namespace

/// Implementation of the server. All member functions except `publish` and `statistics` run on the
/// server's thread.
class OpenIgtLinkServer::Listener {
  public:
    explicit Listener(const OpenIgtLinkServerOptions& options)
        : max_clients_(options.max_clients),
          acceptor_(listen_on(io_, options)),
          port_(acceptor_.local_endpoint().port()) {
        accept();
        thread_ = std::thread([this] { io_.run(); });
    }
    ~Listener() {
        io_.stop();
        thread_.join();
    }

    std::uint16_t port() const { return port_; }

    void publish(std::vector<igtl::Message> messages) {
        if (publications_.fetch_add(1) >= max_publications) {
            --publications_;
            const std::lock_guard lock(mutex_);
            ++statistics_.skipped;
            return;
        }
        asio::post(io_, [this, messages = std::move(messages)]() mutable {
            --publications_;
            for (igtl::Message& message : messages) {
                names_.assign(message);
                hand_out(std::make_shared<Outgoing>(std::move(message)));
            }
        });
    }

    OpenIgtLinkServerStatistics statistics() const {
        const std::lock_guard lock(mutex_);
        return statistics_;
    }

  private:
    struct Client {
        explicit Client(tcp::socket s) : socket(std::move(s)) {}
        tcp::socket socket;
        igtl::MessageParser parser;
        std::array<std::uint8_t, 4096> received;
        std::uint16_t version = 1;
        std::deque<OutgoingPointer> waiting;
        OutgoingPointer sending;
        bool asked = false;    ///< a query that must be answered
        std::string to_start;  ///< a received STT_TDATA or STT_QTDATA, to be answered with RTS_
    };
    using ClientPointer = std::shared_ptr<Client>;

    void accept() {
        acceptor_.async_accept([this](Failure failure, tcp::socket socket) {
            // For example out of file descriptors; some may be free later.
            if (failure) {
                note(failure.message());
                pause_.expires_after(std::chrono::milliseconds(100));
                return pause_.async_wait([this](Failure stopped) {
                    if (!stopped) accept();
                });
            }
            if (clients_.size() < max_clients_)
                welcome(std::move(socket));
            else
                change([](auto& s) { ++s.turned_away; });
            accept();
        });
    }

    void welcome(tcp::socket socket) {
        Failure ignored;
        set_close_on_exec(socket);
        socket.set_option(tcp::no_delay(true), ignored);
        socket.set_option(asio::socket_base::keep_alive(true), ignored);
        socket.set_option(asio::socket_base::send_buffer_size(socket_buffer_size), ignored);
        const auto client = std::make_shared<Client>(std::move(socket));
        client->parser = igtl::MessageParser([raw = client.get()](const igtl::Header& header) {
            raw->version = std::max<std::uint16_t>(raw->version, header.version >= 2 ? 2 : 1);
            raw->asked |= header.type.starts_with("GET_");
            if (header.type == "STT_TDATA" || header.type == "STT_QTDATA")
                raw->to_start = header.type;
            return false;
        });
        clients_.push_back(client);
        change([this](auto& s) {
            s.clients = clients_.size();
            ++s.connections;
        });
        read(client);
    }

    void read(const ClientPointer& client) {
        client->socket.async_read_some(
            asio::buffer(client->received), [this, client](Failure failure, std::size_t n) {
                if (failure)
                    return dismiss(client, failure == asio::error::eof ? "" : failure.message());
                try {
                    client->parser.feed({client->received.data(), n}, {});
                } catch (const Error& error) {
                    return dismiss(client, error.what());
                }
                if (std::exchange(client->asked, false))
                    enqueue(client, std::make_shared<Outgoing>(igtl::status_message(
                                        "Livetet", 4, "queries are not answered here", 0)));
                if (const std::string start = std::exchange(client->to_start, {}); !start.empty()) {
                    igtl::Message no = igtl::dated_message("RTS_" + start.substr(4), "Livetet", 0);
                    no.content = igtl::Reply{1};  // poses are sent as TRANSFORM, to every client
                    enqueue(client, std::make_shared<Outgoing>(std::move(no)));
                }
                read(client);
            });
    }

    void hand_out(const OutgoingPointer& message) {
        const auto clients = clients_;  // a failure removes a client from the list
        for (const ClientPointer& client : clients)
            if (message->is_for(client->version)) enqueue(client, message);
    }

    void enqueue(const ClientPointer& client, const OutgoingPointer& message) {
        const auto older = std::ranges::find_if(
            client->waiting, [&](const auto& m) { return message->replaces(*m); });
        if (older != client->waiting.end()) {
            *older = message;
            change([](auto& s) { ++s.dropped; });
        } else {
            client->waiting.push_back(message);
        }
        if (client->waiting.size() > max_messages_waiting) {
            client->waiting.pop_front();
            change([](auto& s) { ++s.dropped; });
        }
        if (!client->sending) send_next(client);
    }

    void send_next(const ClientPointer& client) {
        while (!client->waiting.empty()) {
            client->sending = client->waiting.front();
            client->waiting.pop_front();
            try {
                const igtl::Bytes& bytes = client->sending->encoded(client->version);
                return asio::async_write(client->socket, asio::buffer(bytes),
                                         [this, client](Failure failure, std::size_t) {
                                             client->sending.reset();
                                             if (failure) return dismiss(client, failure.message());
                                             change([](auto& s) { ++s.sent; });
                                             send_next(client);
                                         });
            } catch (const Error& error) {
                client->sending.reset();
                change([&](auto& s) {
                    ++s.refused;
                    s.last_error = error.what();
                });
            }
        }
    }

    void dismiss(const ClientPointer& client, const std::string& problem) {
        if (std::erase(clients_, client) == 0) return;
        Failure ignored;
        client->socket.close(ignored);
        client->waiting.clear();
        change([this](auto& s) { s.clients = clients_.size(); });
        if (!problem.empty()) note(problem);
    }

    template <class F>
    void change(F&& f) {
        const std::lock_guard lock(mutex_);
        f(statistics_);
    }
    void note(const std::string& problem) {
        change([&](auto& s) { s.last_error = problem; });
    }

    const std::size_t max_clients_;
    mutable std::mutex mutex_;
    OpenIgtLinkServerStatistics statistics_;
    std::atomic<int> publications_{0};

    asio::io_context io_{1};
    tcp::acceptor acceptor_;
    const std::uint16_t port_;
    asio::steady_timer pause_{io_};
    std::vector<ClientPointer> clients_;
    WireNames names_{log_warning};
    std::thread thread_;
};

OpenIgtLinkServer::OpenIgtLinkServer(OpenIgtLinkServerOptions options)
    : listener_(std::make_unique<Listener>(options)) {}

OpenIgtLinkServer::~OpenIgtLinkServer() = default;

std::uint16_t OpenIgtLinkServer::port() const { return listener_->port(); }

void OpenIgtLinkServer::publish(std::vector<igtl::Message> messages) {
    listener_->publish(std::move(messages));
}

OpenIgtLinkServerStatistics OpenIgtLinkServer::statistics() const {
    return listener_->statistics();
}

}  // namespace livetet
