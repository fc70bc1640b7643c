#pragma once

#include <fcntl.h>
#include <sys/socket.h>

#include <cerrno>
#include <system_error>

#define ASIO_STANDALONE
#include <asio.hpp>

// MPI starts a helper process. A socket that it inherited would keep a connection open that we have
// closed, and Asio opens sockets that are inherited.

namespace livetet {

/// Opens a socket that no other program inherits.
template <class Socket>
void open_close_on_exec(Socket& socket, const typename Socket::protocol_type& protocol,
                        std::error_code& failure) {
    const int descriptor =
        ::socket(protocol.family(), protocol.type() | SOCK_CLOEXEC, protocol.protocol());
    if (descriptor < 0)
        failure = std::error_code(errno, std::system_category());
    else
        socket.assign(protocol, descriptor, failure);
}

/// The same for a socket that is open.
template <class Socket>
void set_close_on_exec(Socket& socket) {
    ::fcntl(socket.native_handle(), F_SETFD, FD_CLOEXEC);
}

}  // namespace livetet
