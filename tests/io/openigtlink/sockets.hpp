#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "io/openigtlink/codec.hpp"

namespace livetet::igtl::testing_sockets {

// Generous, for a busy machine: the awaited events take milliseconds.
constexpr int patience_ms = 30000;

/// Waits until `happens` is true; false at the time limit.
inline bool eventually(const std::function<bool()>& happens) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(patience_ms);
    while (!happens()) {
        if (std::chrono::steady_clock::now() > end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return true;
}

inline void wait_for(int socket, short event) {
    pollfd waiting{socket, event, 0};
    if (poll(&waiting, 1, patience_ms) != 1)
        throw std::runtime_error("nothing happened on a socket");
}

/// One end of a connection, by plain system calls: the peer of the code under test.
class Peer {
  public:
    explicit Peer(int socket) : socket_(socket) {}
    Peer(Peer&& other) noexcept : socket_(std::exchange(other.socket_, -1)) {}
    ~Peer() { close(); }
    void close() {
        if (socket_ >= 0) ::close(std::exchange(socket_, -1));
    }

    void send(ByteView bytes) {
        while (!bytes.empty()) {
            wait_for(socket_, POLLOUT);
            const auto sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
            if (sent <= 0) throw std::runtime_error("the peer has closed");
            bytes = bytes.subspan(static_cast<std::size_t>(sent));
        }
    }
    void send(const Message& message) { send(encode(message)); }

    /// The next `size` bytes; fewer if the other end closes.
    Bytes receive(std::size_t size) {
        Bytes bytes(size);
        std::size_t have = 0;
        while (have < size) {
            wait_for(socket_, POLLIN);
            const auto got = ::recv(socket_, bytes.data() + have, size - have, 0);
            if (got <= 0) break;
            have += static_cast<std::size_t>(got);
        }
        bytes.resize(have);
        return bytes;
    }
    Message receive_message() {
        const Bytes head = receive(header_size);
        const Header header = decode_header(head);
        return decode_body(header, receive(header.body_size));
    }

  private:
    int socket_;
};

inline sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
}

inline Peer connect_to(std::uint16_t port) {
    const int s = ::socket(AF_INET, SOCK_STREAM, 0);
    const sockaddr_in address = loopback(port);
    if (::connect(s, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
        throw std::runtime_error("cannot connect");
    return Peer(s);
}

class ListeningPeer {
  public:
    ListeningPeer() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address = loopback(0);
        socklen_t size = sizeof address;
        if (::bind(socket_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
            ::listen(socket_, 8) != 0 ||
            ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
            throw std::runtime_error("cannot listen");
        port_ = ntohs(address.sin_port);
    }
    ~ListeningPeer() { ::close(socket_); }
    std::uint16_t port() const { return port_; }
    Peer accept() {
        wait_for(socket_, POLLIN);
        return Peer(::accept(socket_, nullptr, nullptr));
    }

  private:
    int socket_;
    std::uint16_t port_ = 0;
};

}  // namespace livetet::igtl::testing_sockets
