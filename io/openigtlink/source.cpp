#include "io/openigtlink/source.hpp"

#include <chrono>
#include <mutex>
#include <thread>

#include "io/openigtlink/close_on_exec.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/gatherer.hpp"
#include "io/openigtlink/parser.hpp"

namespace livetet {

namespace {

using asio::ip::tcp;
using State = OpenIgtLinkStatistics::State;
using Failure = std::error_code;

std::chrono::steady_clock::duration duration_of(double seconds) {
    return std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(seconds));
}

/// Enough for hundreds of tools with metadata; a larger message would occupy the source for too
/// long.
constexpr std::uint64_t max_tracking_body = 1 << 16;

bool is_tracking_data(const igtl::Header& header) {
    if (header.body_size > max_tracking_body) return false;
    for (const auto* type : {"TRANSFORM", "POSITION", "QTRANS", "TDATA", "QTDATA", "STATUS"})
        if (header.type == type) return true;
    return false;
}

void check_options(const OpenIgtLinkSourceOptions& o) {
    const std::pair<const char*, double> seconds[] = {{"gather_s", o.gather_s},
                                                      {"stale_after_s", o.stale_after_s},
                                                      {"silence_after_s", o.silence_after_s},
                                                      {"hang_up_after_s", o.hang_up_after_s},
                                                      {"first_retry_s", o.first_retry_s},
                                                      {"max_retry_s", o.max_retry_s},
                                                      {"connect_timeout_s", o.connect_timeout_s}};
    for (const auto& [name, value] : seconds)
        if (!(value > 0 && value < 1e6))
            fail("OpenIGTLink source: {} = {} s, expected more than 0", name, value);
}

}  // namespace

std::string_view to_text(State state) {
    switch (state) {
        case State::connecting:
            return "connecting";
        case State::receiving:
            return "receiving";
        case State::silent:
            return "silent";
        case State::waiting:
            return "waiting to connect again";
    }
    return "";
}

/// Implementation of the source. Everything but the public member functions runs on its thread;
/// `statistics_` is protected by `mutex_`.
class OpenIgtLinkSource::Connector {
  public:
    using Post = std::function<void(const StreamSample&)>;
    Connector(std::string host, std::uint16_t port, std::vector<std::string> tools,
              OpenIgtLinkSourceOptions options, Post hand_on)
        : host_(std::move(host)),
          port_(port),
          options_(options),
          hand_on_(std::move(hand_on)),
          retry_s_(options.first_retry_s),
          last_message_s_(steady_seconds()),
          gatherer_(
              tools, options, [this](const StreamSample& sample) { post(sample); }, last_message_s_,
              utc_seconds()) {
        check_options(options_);
        statistics_.never_came = gatherer_.never_came();
        connect();
        wait_for_due();
        watch();
        thread_ = std::thread([this] { io_.run(); });
    }
    ~Connector() {
        io_.stop();
        thread_.join();
    }

    /// Adds a tool. Throws Error if it cannot be distinguished from another.
    void add_tool(const std::string& tool, std::vector<std::string> all) {
        check_tools_differ(all);
        asio::post(io_, [this, tool] { gatherer_.add_tool(tool); });
    }

    OpenIgtLinkStatistics statistics() const {
        const std::lock_guard lock(mutex_);
        return statistics_;
    }

  private:
    /// One connection and its pending operations. Handlers of an older connection do nothing.
    struct Connection {
        explicit Connection(asio::io_context& io)
            : socket(io), timeout(io), parser(is_tracking_data) {}
        tcp::socket socket;
        asio::steady_timer timeout;
        igtl::MessageParser parser;
        igtl::Bytes greeting;
        std::array<std::uint8_t, 16384> buffer;
    };
    using ConnectionPointer = std::shared_ptr<Connection>;

    void connect() {
        connection_ = std::make_shared<Connection>(io_);
        set_state(State::connecting);
        connection_->timeout.expires_after(duration_of(options_.connect_timeout_s));
        connection_->timeout.async_wait([this, c = connection_](Failure failure) {
            if (!failure) give_up(c, "no answer");
        });
        resolver_.async_resolve(host_, std::to_string(port_),
                                [this, c = connection_](Failure failure, auto addresses) {
                                    if (c != connection_) return;
                                    if (failure) return give_up(c, failure.message());
                                    connect_to_next(c, addresses.begin());
                                });
    }

    /// Tries one address after another until a server answers.
    void connect_to_next(const ConnectionPointer& c, tcp::resolver::results_type::iterator at) {
        Failure failure;
        open_close_on_exec(c->socket, at->endpoint().protocol(), failure);
        if (failure) return give_up(c, failure.message());
        c->socket.async_connect(*at, [this, c, at](Failure failed) {
            if (c != connection_) return;
            if (!failed) return begin(c);
            Failure ignored;
            c->socket.close(ignored);
            const auto next = std::next(at);
            if (next == tcp::resolver::results_type::iterator())
                return give_up(c, failed.message());
            connect_to_next(c, next);
        });
    }

    void begin(const ConnectionPointer& c) {
        c->timeout.cancel();
        Failure ignored;
        c->socket.set_option(tcp::no_delay(true), ignored);
        c->socket.set_option(asio::socket_base::keep_alive(true), ignored);
        last_message_s_ = steady_seconds();
        set_state(State::receiving);
        {
            const std::lock_guard lock(mutex_);
            ++statistics_.connections;
        }
        greet(c);
        read(c);
    }

    /// Sends a STATUS of version 2: PLUS sends metadata only to clients that have used version 2.
    void greet(const ConnectionPointer& c) {
        igtl::Message status = igtl::status_message("Livetet", 1, "", 0);
        status.version = 2;
        c->greeting = encode(status);
        if (options_.request_ms) {
            igtl::Message start = igtl::dated_message("STT_TDATA", "Livetet", 0);
            start.content = igtl::StartTracking{*options_.request_ms, ""};
            const igtl::Bytes bytes = encode(start);
            c->greeting.insert(c->greeting.end(), bytes.begin(), bytes.end());
        }
        asio::async_write(c->socket, asio::buffer(c->greeting),
                          [this, c](Failure failure, std::size_t) {
                              if (failure) give_up(c, failure.message());
                          });
    }

    void read(const ConnectionPointer& c) {
        c->socket.async_read_some(asio::buffer(c->buffer), [this, c](Failure failure,
                                                                     std::size_t size) {
            if (c != connection_) return;
            if (failure) {
                const std::string within = c->parser.inside_message() ? ", within a message" : "";
                return give_up(
                    c, (failure == asio::error::eof ? "closed by the server" : failure.message()) +
                           within);
            }
            try {
                c->parser.feed({c->buffer.data(), size}, [this](igtl::Message&& m) { take(m); });
            } catch (const Error& error) {
                return give_up(c, error.what());
            }
            count(c->parser.counts());
            read(c);
        });
    }

    void take(const igtl::Message& message) {
        last_message_s_ = steady_seconds();
        retry_s_ = options_.first_retry_s;
        set_state(State::receiving);
        gatherer_.take(message, last_message_s_);
        wait_for_due();
    }

    /// Wakes up when the gatherer must post a sample.
    void wait_for_due() {
        gathering_.expires_at(
            std::chrono::steady_clock::time_point(duration_of(gatherer_.due_s())));
        gathering_.async_wait([this](Failure failure) {
            if (failure) return;
            gatherer_.post_due(steady_seconds());
            wait_for_due();
        });
    }

    /// Detects a silent connection, and hangs up when it has been silent for too long: the server
    /// may be gone without a word, which the system would notice after hours.
    void watch() {
        const double shortest_s = std::min(options_.silence_after_s, options_.hang_up_after_s);
        watching_.expires_after(duration_of(shortest_s / 4));
        watching_.async_wait([this](Failure failure) {
            if (failure) return;
            const double quiet_s = steady_seconds() - last_message_s_;
            if (quiet_s > options_.silence_after_s && state_ == State::receiving)
                set_state(State::silent);
            const bool is_connected = state_ == State::receiving || state_ == State::silent;
            if (quiet_s > options_.hang_up_after_s && is_connected)
                give_up(connection_,
                        fmt::format("no message for {:g} s", options_.hang_up_after_s));
            watch();
        });
    }

    void give_up(const ConnectionPointer& c, const std::string& problem) {
        if (c != connection_) return;
        count(c->parser.counts());
        add_finished(c->parser.counts());
        Failure ignored;
        c->socket.close(ignored);
        c->timeout.cancel();
        connection_.reset();
        {
            const std::lock_guard lock(mutex_);
            statistics_.problem = fmt::format("{}:{}: {}", host_, port_, problem);
        }
        set_state(State::waiting);
        retry_.expires_after(duration_of(retry_s_));
        retry_s_ = std::min(2 * retry_s_, options_.max_retry_s);
        retry_.async_wait([this](Failure failure) {
            if (!failure) connect();
        });
    }

    /// Counts first: whoever holds the sample finds its messages in the statistics.
    void post(const StreamSample& sample) {
        count(connection_ ? connection_->parser.counts() : igtl::MessageParser::Counts{});
        hand_on_(sample);
    }

    void set_state(State state) {
        if (state == state_) return;
        state_ = state;
        const std::lock_guard lock(mutex_);
        statistics_.state = state;
    }

    /// Adds this connection's counts to those of earlier connections.
    void count(const igtl::MessageParser::Counts& counts) {
        const std::lock_guard lock(mutex_);
        statistics_.messages = finished_.messages + counts.messages;
        statistics_.bad_crc = finished_.bad_crc + counts.bad_crc;
        statistics_.malformed = finished_.malformed + counts.malformed;
        statistics_.passed_over = finished_.passed_over + counts.passed_over;
        if (!counts.last_error.empty()) statistics_.last_error = counts.last_error;
        statistics_.ambiguous = gatherer_.ambiguous();
        if (statistics_.ambiguous > 0) statistics_.last_error = gatherer_.ambiguity();
        statistics_.names = gatherer_.names();
        statistics_.never_came = gatherer_.never_came();
        statistics_.samples = gatherer_.samples();
        if (statistics_.messages > 0) statistics_.last_arrival_s = last_message_s_;
    }
    void add_finished(const igtl::MessageParser::Counts& counts) {
        finished_.messages += counts.messages;
        finished_.bad_crc += counts.bad_crc;
        finished_.malformed += counts.malformed;
        finished_.passed_over += counts.passed_over;
    }

    const std::string host_;
    const std::uint16_t port_;
    const OpenIgtLinkSourceOptions options_;
    const Post hand_on_;
    double retry_s_;
    double last_message_s_;
    State state_ = State::connecting;
    PoseGatherer gatherer_;
    igtl::MessageParser::Counts finished_;
    mutable std::mutex mutex_;
    OpenIgtLinkStatistics statistics_;

    asio::io_context io_{1};
    tcp::resolver resolver_{io_};
    asio::steady_timer retry_{io_}, gathering_{io_}, watching_{io_};
    ConnectionPointer connection_;
    std::thread thread_;
};

OpenIgtLinkSource::OpenIgtLinkSource(std::string host, std::uint16_t port,
                                     std::vector<std::string> tools,
                                     OpenIgtLinkSourceOptions options)
    : tools_(tools) {
    listener_ = options.listener;
    connector_ = std::make_unique<Connector>(std::move(host), port, std::move(tools), options,
                                             [this](const StreamSample& sample) { post(sample); });
}

OpenIgtLinkSource::~OpenIgtLinkSource() = default;

OpenIgtLinkStatistics OpenIgtLinkSource::statistics() const { return connector_->statistics(); }

SourceStatus OpenIgtLinkSource::status() const {
    const OpenIgtLinkStatistics s = connector_->statistics();
    return {std::string(to_text(s.state)),
            s.problem,
            s.samples,
            s.bad_crc + s.malformed + s.ambiguous,
            s.names,
            s.never_came,
            s.last_error};
}

std::size_t OpenIgtLinkSource::index_of(const std::string& tool) {
    const auto found = std::ranges::find(tools_, tool);
    if (found != tools_.end()) return static_cast<std::size_t>(found - tools_.begin());
    std::vector<std::string> all = tools_;
    all.push_back(tool);
    connector_->add_tool(tool, all);
    tools_ = std::move(all);
    return tools_.size() - 1;
}

}  // namespace livetet
