// The host's side of the serial link to the microcontroller: one header for C++17 and POSIX, without dependencies.
//
//     vsj::Link link("/dev/ttyACM0");                 // or "unix:PATH", "tcp:HOST:PORT"
//     link.arm();
//     link.set(300.0);                                // in V; vsj::Unit::pascal, vsj::Unit::newton_per_metre
//     for (const auto& sample : link.watch(100.0, std::chrono::seconds(2)))
//         std::printf("%f %f\n", sample.time_s, sample.estimate_v);
//     link.disarm();                                  // the destructor does it, too
//
// Heartbeats are sent by a thread, so that the microcontroller does not take the host for silent. All calls may come from any
// thread; each waits until the microcontroller has answered, and throws vsj::Error if it does not or refuses.
//
// The protocol is described in docs/link.md. Frames: version 5 of it.

#ifndef VSJ_LINK_HPP
#define VSJ_LINK_HPP

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

namespace vsj {

using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::uint8_t>;

/// A request that was refused or not answered, or a port that failed, as one line that names the port.
class Error : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The encoding of frames.
namespace wire {

/// Version of the protocol.
constexpr std::uint8_t version = 5;
constexpr std::uint8_t request_kind = 'Q';
constexpr std::uint8_t reply_kind = 'A';
/// What comes with the telemetry without a request.
constexpr std::uint8_t notice_kind = 'N';
/// Largest number of bytes between two delimiters.
constexpr std::size_t most_encoded = 130;

/// CRC-32C (Castagnoli).
inline std::uint32_t checksum(const Bytes& bytes) {
    std::uint32_t crc = 0xffffffffu;
    for (std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0x82f63b78u : crc >> 1;
    }
    return ~crc;
}

/// Encodes a packet of less than 254 bytes without zeros.
inline Bytes stuff(const Bytes& packet) {
    Bytes out{1};
    std::size_t start = 0;
    for (std::uint8_t byte : packet) {
        out.push_back(byte);
        if (byte == 0) start = out.size() - 1;
        out[start] = static_cast<std::uint8_t>(out.size() - start);
    }
    return out;
}

/// Decodes bytes that contain no zero; nothing if a block is incomplete.
inline std::optional<Bytes> unstuff(const Bytes& bytes) {
    Bytes out;
    for (std::size_t from = 0; from < bytes.size();) {
        const std::size_t end = from + bytes[from];
        if (end > bytes.size()) return std::nullopt;
        out.insert(out.end(), bytes.begin() + static_cast<std::ptrdiff_t>(from) + 1,
                   bytes.begin() + static_cast<std::ptrdiff_t>(end));
        from = end;
        if (from < bytes.size()) out.push_back(0);
    }
    return out;
}

/// A message to be sent: its bytes in postcard's format.
struct Writer {
    Bytes bytes;

    Writer& byte(std::uint8_t value) {
        bytes.push_back(value);
        return *this;
    }
    /// A number without sign: 7 bits a byte, the lowest first.
    Writer& number(std::uint64_t value) {
        for (; value >= 0x80; value >>= 7) byte(static_cast<std::uint8_t>(value | 0x80));
        return byte(static_cast<std::uint8_t>(value));
    }
    Writer& real(double value) {
        std::uint64_t bits;
        static_assert(sizeof bits == sizeof value, "doubles of 64 bits");
        std::memcpy(&bits, &value, sizeof bits);
        return fixed(bits, 8);
    }
    /// The low bytes of a number, the lowest first.
    Writer& fixed(std::uint64_t value, int count) {
        for (int i = 0; i < count; ++i) byte(static_cast<std::uint8_t>(value >> (8 * i)));
        return *this;
    }
};

/// A message that was received; reading past its end makes it invalid.
struct Reader {
    const std::uint8_t* at;
    const std::uint8_t* end;
    bool valid = true;

    explicit Reader(const Bytes& bytes) : at(bytes.data()), end(bytes.data() + bytes.size()) {}

    std::uint8_t byte() {
        if (at == end) {
            valid = false;
            return 0;
        }
        return *at++;
    }
    std::uint64_t number() {
        std::uint64_t value = 0;
        for (int shift = 0; shift < 64; shift += 7) {
            const std::uint8_t next = byte();
            value |= static_cast<std::uint64_t>(next & 0x7f) << shift;
            if (next < 0x80) return value;
        }
        valid = false;
        return 0;
    }
    std::int64_t integer() {
        const std::uint64_t value = number();
        return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
    }
    double real() {
        std::uint64_t bits = 0;
        for (int i = 0; i < 8; ++i) bits |= static_cast<std::uint64_t>(byte()) << (8 * i);
        double value;
        std::memcpy(&value, &bits, sizeof value);
        return value;
    }
    /// Voltages are steps of 2^-20 V.
    double volts() { return static_cast<double>(integer()) / 1048576.0; }
    bool is_whole() const { return valid && at == end; }
};

/// The frame of a message.
inline Bytes frame(std::uint8_t kind, std::uint16_t sequence, const Bytes& message, std::uint32_t session) {
    Writer packet;
    packet.byte(version).byte(kind).fixed(sequence, 2);
    packet.bytes.insert(packet.bytes.end(), message.begin(), message.end());
    packet.fixed(session, 4);
    packet.fixed(checksum(packet.bytes), 4);
    Bytes out = stuff(packet.bytes);
    out.insert(out.begin(), 0);
    out.push_back(0);
    return out;
}

/// A packet whose checksum is right.
struct Packet {
    std::uint8_t version, kind;
    std::uint16_t sequence;
    std::uint32_t session;
    Bytes message;
};

/// Decodes the bytes between two delimiters; nothing if they are damaged.
inline std::optional<Packet> open(const Bytes& encoded) {
    const auto packet = unstuff(encoded);
    if (!packet || packet->size() < 12) return std::nullopt;
    const auto word = [&](std::size_t at) {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>((*packet)[at + i]) << (8 * i);
        return value;
    };
    const std::size_t size = packet->size();
    if (checksum(Bytes(packet->begin(), packet->end() - 4)) != word(size - 4)) return std::nullopt;
    Bytes message(packet->begin() + 4, packet->end() - 8);
    const auto sequence = static_cast<std::uint16_t>((*packet)[2] | (*packet)[3] << 8);
    return Packet{(*packet)[0], (*packet)[1], sequence, word(size - 8), std::move(message)};
}

}  // namespace wire

/// State of the output.
enum class State : std::uint8_t { disarmed, armed, ramping, faulted };

inline const char* name(State state) {
    static const char* const names[] = {"disarmed", "armed", "ramping", "faulted"};
    const auto code = static_cast<std::size_t>(state);
    return code < 4 ? names[code] : "unknown";
}

/// Name of a fault's code; 0 is none.
inline std::string fault_name(std::uint8_t code) {
    static const char* const names[] = {"none",   "panic",  "hard-fault", "overrun", "interlock", "watchdog",
                                        "monitor", "config", "supply",     "self-test", "isolation"};
    return std::string(code < 11 ? names[code] : "unknown") + " (" + std::to_string(code) + ")";
}

/// Name of the field of a model or of settings that a microcontroller refuses.
inline const char* field_name(std::uint8_t code) {
    static const char* const names[] = {
        "memory.direct", "memory.thresholds_v", "memory.weights", "law.voltage_v", "law.stiffness", "leakage.share",
        "leakage.tau_s", "relaxation.share", "relaxation.tau_s", "relaxation.weights", "relaxation.tau_high_s", "share",
        "time_constant_s", "min_v", "max_v", "slew_v_per_s", "proportional_gain", "integral_gain_per_s", "controller",
        "sensor", "rate_hz", "full_scale_v", "approach_s", "noise_v", "model_uncertainty", "fastest_s", "interval_s",
        "oldest_s", "lowest_v", "highest_v", "fade_s", "host_timeout_s", "ramp_v_per_s", "missed_ticks_allowed",
        "forget_missed_s", "monitor_tolerance_v", "max_current_a", "monitor_time_s", "discharge_time_s", "hang_ms",
        "stall_ms", "reset_ms", "trip_on_cause", "range_v", "plant.time_constant_s", "margin.time_constant", "margin.share",
        "margin.gain", "margin.overshoot", "adaptation.enabled", "adaptation.time_constant", "adaptation.share",
        "adaptation.gain", "adaptation.rate_per_s", "adaptation.precision", "adaptation.excitation",
        "tolerance.time_constant", "tolerance.share", "tolerance.gain", "margin.fall_back"};
    return code < sizeof names / sizeof *names ? names[code] : "another setting";
}

/// Unit of a desired stiffness: V of equivalent static voltage, Pa of Young's modulus, N/m at the tip.
enum class Unit : std::uint8_t { volt, pascal, newton_per_metre };

/// One sample of the control loop; stiffnesses as the equivalent static voltage, in V.
struct Sample {
    /// Number of the tick, and its time in s, since the start.
    std::uint64_t tick = 0;
    double time_s = 0;
    State state = State::disarmed;
    /// Target stiffness, voltage across the spring, estimated stiffness, in V.
    double target_v = 0, applied_v = 0, estimate_v = 0;
    /// Measured stiffness in V, if there is a new reading.
    std::optional<double> measured_v;
    std::uint16_t dac_code = 0;
    /// Limits that acted: 1 upper, 2 lower, 4 slew, 8 target.
    std::uint8_t limits = 0;
    /// What disagrees with the output, and the diagnosis of the sensor: codes of docs/link.md.
    std::uint8_t mismatch = 0, sensor = 0;

    static Sample read(wire::Reader& from, std::uint32_t rate_hz) {
        Sample sample;
        sample.tick = from.number();
        sample.time_s = static_cast<double>(sample.tick) / std::max(rate_hz, 1u);
        sample.state = static_cast<State>(from.number());
        sample.target_v = from.volts();
        sample.applied_v = from.volts();
        sample.estimate_v = from.volts();
        if (from.byte() != 0) sample.measured_v = from.volts();
        sample.dac_code = static_cast<std::uint16_t>(from.number());
        sample.limits = from.byte();
        sample.mismatch = from.byte();
        sample.sensor = from.byte();
        return sample;
    }
};

/// A fault that the microcontroller has reported.
struct Fault {
    /// Number of the report since the start, and the tick in which the fault was seen, with its time in s.
    std::uint32_t number = 0;
    std::uint64_t tick = 0;
    double time_s = 0;
    /// Its code, for `fault_name` and `Link::acknowledge`.
    std::uint8_t code = 0;
    /// All faults that stood when the report was sent: bit 0 for code 1.
    std::uint16_t standing = 0;
    /// What disagreed with the output: a code of docs/link.md.
    std::uint8_t mismatch = 0;

    static Fault read(wire::Reader& from, std::uint32_t rate_hz) {
        Fault fault;
        fault.number = static_cast<std::uint32_t>(from.number());
        fault.tick = from.number();
        fault.time_s = static_cast<double>(fault.tick) / std::max(rate_hz, 1u);
        fault.code = from.byte();
        fault.standing = static_cast<std::uint16_t>(from.number());
        fault.mismatch = from.byte();
        return fault;
    }
};

/// What the isolation bank says of the spring and its sensor; it comes with the telemetry.
struct Isolation {
    /// Number of the tick, and the one after which the fault has been there, 0 without an alarm; counted from the start.
    std::uint64_t tick = 0, since_tick = 0;
    /// Upper byte: 0 quiet, 1 alarm, 2 unknown, 3 named, 4 ambiguous, 5 off. Lower byte: numbers of the causes, or why it is off.
    std::uint16_t verdict = 0;
    /// Size of the cause and half the width of its 95 % interval, in the unit of docs/isolation.md; 0 without a cause.
    double size = 0, half_width = 0;
    /// Part of the residual's energy that the cause explains, 0 to 1.
    double explained = 0;
    /// Causes that are a fault once they are named: bit 0 for number 0.
    std::uint16_t trip_on_cause = 0;

    /// `quiet`, `alarm`, `unknown`, `named`, `ambiguous`, `off`, or `unknown-code` for a verdict that this version does not know.
    const char* word() const {
        static const char* const words[] = {"quiet", "alarm", "unknown", "named", "ambiguous", "off"};
        return is_known() ? words[verdict >> 8] : "unknown-code";
    }
    /// Name of the cause that explains most; empty unless one is named or two are ambiguous.
    const char* cause() const { return has_cause() ? cause_name(verdict & 15) : ""; }
    /// Name of the other cause; empty unless two are ambiguous.
    const char* other() const { return has_cause() && verdict >> 8 == 4 ? cause_name(verdict >> 4 & 15) : ""; }

    static Isolation read(wire::Reader& from) {
        Isolation said;
        said.tick = from.number();
        said.verdict = static_cast<std::uint16_t>(from.number());
        said.since_tick = from.number();
        said.size = from.real();
        said.half_width = from.real();
        said.explained = from.real();
        said.trip_on_cause = static_cast<std::uint16_t>(from.number());
        return said;
    }

private:
    /// False for a code that this version does not know, as one with bits that its verdict has no use for.
    bool is_known() const {
        static const unsigned used[] = {0, 0, 0, 0x0f, 0xff, 0xff};
        return verdict >> 8 < 6 && (verdict & 0xff & ~used[verdict >> 8]) == 0;
    }
    bool has_cause() const { return is_known() && (verdict >> 8 == 3 || verdict >> 8 == 4); }
    static const char* cause_name(unsigned number) {
        static const char* const names[] = {
            "gain-error",        "instantaneous-share", "time-constant", "voltage-dependent-time-constant",
            "second-relaxation", "charge-leakage",      "hysteresis",    "static-nonlinearity",
            "amplifier-limit",   "amplifier-slew",      "delay",         "series-lag",
            "reading-offset",    "drift",               "sensor-saturation", "stuck-sensor"};
        return names[number];
    }
};

/// The status of the microcontroller.
struct Status {
    /// Version of the firmware: major, minor, patch.
    std::array<std::uint8_t, 3> firmware{};
    /// Git revision of the firmware, 0 if it is not known.
    std::uint32_t revision = 0;
    /// 0 none, 1 the paper's, 2 the fast one, 3 the robust one.
    std::uint8_t controller = 0;
    /// Ticks per second, in Hz.
    std::uint32_t rate_hz = 0;
    /// Longest silence of the host before the voltage ramps down, in s.
    double silence_limit_s = 0;
    /// Stiffness within reach, in V.
    double lowest_v = 0, highest_v = 0;
    /// Number of late ticks.
    std::uint32_t overruns = 0;
    /// Codes of the present fault and of the one that caused the last reset, 0 for none.
    std::uint8_t fault = 0, last_fault = 0;
    Sample sample;

    static Status read(wire::Reader& from) {
        Status status;
        for (auto& part : status.firmware) part = from.byte();
        status.revision = static_cast<std::uint32_t>(from.number());
        status.controller = static_cast<std::uint8_t>(from.number());
        status.rate_hz = static_cast<std::uint32_t>(from.number());
        status.silence_limit_s = static_cast<double>(from.number()) / std::max(status.rate_hz, 1u);
        status.lowest_v = from.volts();
        status.highest_v = from.volts();
        status.overruns = static_cast<std::uint32_t>(from.number());
        status.fault = from.byte();
        status.last_fault = from.byte();
        status.sample = Sample::read(from, status.rate_hz);
        for (int counter = 0; counter < 8; ++counter) from.number();
        return status;
    }
};

/// Identity of a model or of settings; number 0 is what is built in.
struct BlockId {
    std::uint32_t number = 0, format = 0, length = 0, checksum = 0;

    static BlockId read(wire::Reader& from) {
        BlockId id;
        for (auto* part : {&id.number, &id.format, &id.length, &id.checksum})
            *part = static_cast<std::uint32_t>(from.number());
        return id;
    }

    /// Format, length and checksum, as text.
    std::string content() const {
        char text[80];
        std::snprintf(text, sizeof text, "format %u, %u bytes, CRC %08x", unsigned{format}, unsigned{length}, unsigned{checksum});
        return text;
    }
    /// As `vsj link PORT model` prints it.
    std::string text() const {
        return number == 0 ? "the one that is built in" : "number " + std::to_string(number) + ", " + content();
    }
};

/// What runs, and what is stored for the next start.
struct Blocks {
    BlockId active, stored;
};

/// A row of a schedule: from this time in s on, until that of the next row, the target is this stiffness as the equivalent static
/// voltage, in V.
struct Step {
    double time_s, target_v;
};

/// A serial device or a socket.
class Port {
public:
    Port(std::string name, unsigned baud, Clock::duration timeout) : name_(std::move(name)) {
        const auto rest = [&](const char* prefix) -> std::optional<std::string> {
            const std::size_t length = std::strlen(prefix);
            if (name_.compare(0, length, prefix) != 0) return std::nullopt;
            return name_.substr(length);
        };
        if (const auto path = rest("unix:")) {
            unix_socket(*path, timeout);
        } else if (const auto address = rest("tcp:")) {
            tcp_socket(*address, timeout);
        } else {
            serial(baud);
        }
    }
    ~Port() {
        if (file_ >= 0) ::close(file_);
    }
    Port(const Port&) = delete;
    Port& operator=(const Port&) = delete;

    const std::string& name() const { return name_; }

    /// Sends all bytes, within a second.
    void write(const Bytes& bytes) {
        const auto until = Clock::now() + std::chrono::seconds(1);
        for (std::size_t sent = 0; sent < bytes.size();) {
            if (!wait(POLLOUT, until)) throw Error(name_ + ": the port failed: it takes no bytes");
            // No signal when the other side has gone.
            const auto count = is_socket_ ? ::send(file_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL)
                                          : ::write(file_, bytes.data() + sent, bytes.size() - sent);
            if (count < 0 && errno != EAGAIN && errno != EINTR) fail("the port failed");
            if (count > 0) sent += static_cast<std::size_t>(count);
        }
    }

    /// Received bytes; none if none arrive before `until`.
    Bytes read(Clock::time_point until) {
        if (!wait(POLLIN, until)) return {};
        Bytes bytes(1024);
        const auto count = ::read(file_, bytes.data(), bytes.size());
        if (count == 0) throw Error(name_ + ": the other side closed the connection");
        if (count < 0 && errno != EAGAIN && errno != EINTR) fail("the port failed");
        bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
        return bytes;
    }

private:
    std::string name_;
    int file_ = -1;
    bool is_socket_ = false;

    [[noreturn]] void fail(const std::string& what) const { throw Error(name_ + ": " + what + ": " + std::strerror(errno)); }

    [[noreturn]] void cannot_open(const std::string& why) {
        if (file_ >= 0) ::close(file_);
        file_ = -1;
        throw Error(name_ + ": cannot be opened: " + why + "; expected a serial device, unix:PATH or tcp:HOST:PORT");
    }

    /// Whether an event comes before `until`; signals and the longest wait of a call end no wait before that.
    bool wait(short event, Clock::time_point until) const {
        for (;;) {
            const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
            pollfd polled{file_, event, 0};
            const int ready = ::poll(&polled, 1, static_cast<int>(std::clamp<long long>(left, 0, 60'000)));
            if (ready < 0 && errno != EINTR) fail("the port failed");
            if (ready > 0 || Clock::now() >= until) return ready > 0;
        }
    }

    void connect(const sockaddr* address, socklen_t length, Clock::duration timeout) {
        is_socket_ = true;
        ::fcntl(file_, F_SETFL, ::fcntl(file_, F_GETFL) | O_NONBLOCK);
        if (::connect(file_, address, length) == 0) return;
        if (errno != EINPROGRESS) cannot_open(std::strerror(errno));
        if (!wait(POLLOUT, Clock::now() + timeout)) cannot_open("no connection in time");
        int error = 0;
        socklen_t size = sizeof error;
        ::getsockopt(file_, SOL_SOCKET, SO_ERROR, &error, &size);
        if (error != 0) cannot_open(std::strerror(error));
    }

    void unix_socket(const std::string& path, Clock::duration timeout) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        if (path.size() >= sizeof address.sun_path) cannot_open("the path is too long for a socket");
        std::copy(path.begin(), path.end(), address.sun_path);
        file_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
        if (file_ < 0) cannot_open(std::strerror(errno));
        connect(reinterpret_cast<const sockaddr*>(&address), sizeof address, timeout);
    }

    void tcp_socket(const std::string& address, Clock::duration timeout) {
        const std::size_t colon = address.rfind(':');
        if (colon == std::string::npos) cannot_open("no port in the address");
        std::string host = address.substr(0, colon);
        if (host.size() > 1 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
        addrinfo wanted{};
        wanted.ai_socktype = SOCK_STREAM;
        addrinfo* found = nullptr;
        const int error = ::getaddrinfo(host.c_str(), address.substr(colon + 1).c_str(), &wanted, &found);
        if (error != 0) cannot_open(::gai_strerror(error));
        const std::unique_ptr<addrinfo, void (*)(addrinfo*)> all(found, ::freeaddrinfo);
        // A name may stand for several addresses, of which not all are listened on.
        const auto until = Clock::now() + timeout;
        for (const addrinfo* at = found; at != nullptr; at = at->ai_next) {
            try {
                file_ = ::socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
                if (file_ < 0) cannot_open(std::strerror(errno));
                const int now = 1;
                ::setsockopt(file_, IPPROTO_TCP, TCP_NODELAY, &now, sizeof now);
                return connect(at->ai_addr, at->ai_addrlen, std::max(until - Clock::now(), Clock::duration::zero()));
            } catch (const Error&) {
                if (file_ >= 0) ::close(file_);
                file_ = -1;
                if (at->ai_next == nullptr) throw;
            }
        }
    }

    void serial(unsigned baud) {
        file_ = ::open(name_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
        if (file_ < 0) cannot_open(std::strerror(errno));
        termios line{};
        if (::tcgetattr(file_, &line) != 0) cannot_open("not a serial device");
        static const std::pair<unsigned, speed_t> rates[] = {
            {9600, B9600},     {19200, B19200},   {38400, B38400},   {57600, B57600},
            {115200, B115200}, {230400, B230400},
        };
        const auto* rate = std::find_if(std::begin(rates), std::end(rates), [&](auto& it) { return it.first == baud; });
        if (rate == std::end(rates)) cannot_open("a baud rate of " + std::to_string(baud) + " is not usual");
        ::cfmakeraw(&line);
        line.c_cflag |= CLOCAL | CREAD;
        // An earlier program may have left its flow control and stop bits.
        line.c_cflag &= ~(CSTOPB | CRTSCTS);
        line.c_iflag &= ~(IXON | IXOFF | IXANY);
        ::cfsetspeed(&line, rate->second);
        if (::tcsetattr(file_, TCSANOW, &line) != 0) cannot_open(std::strerror(errno));
        // Other programs would interfere.
        ::ioctl(file_, TIOCEXCL);
    }
};

/// A connection to a running microcontroller.
class Link {
public:
    /// Opens the port and begins a session; `timeout` is the longest wait for that and for each answer.
    explicit Link(const std::string& port, unsigned baud = 115'200,
                  std::chrono::milliseconds timeout = std::chrono::seconds(1))
        : port_(port, baud, timeout), tries_(std::max<int>(1, static_cast<int>(timeout / each))) {
        const auto now = std::chrono::system_clock::now().time_since_epoch();
        // An answer to an earlier program may still be on its way.
        sequence_ = static_cast<std::uint16_t>(std::chrono::duration_cast<std::chrono::microseconds>(now).count());
        begin();
        status();
        // Telemetry sent before the greeting belongs to an earlier program.
        samples_.clear();
        isolation_.reset();
        beating_ = std::thread([this] { heartbeats(); });
    }

    /// Disarms the microcontroller and closes the port; not one that another program commands by now. Waits about a second for answers, a
    /// shorter timeout if there is one.
    ~Link() {
        // Also of a heartbeat that waits for its answer.
        tries_ = std::min(tries_.load(), last_tries);
        {
            const std::lock_guard<std::mutex> guard(closing_lock_);
            closing_ = true;
        }
        wake_.notify_all();
        beating_.join();
        try {
            // A disarm is carried out whoever sends it.
            order({6});
        } catch (const NoSession&) {
            return;
        } catch (const Error&) {
        }
        try {
            disarm();
        } catch (const Error&) {
            // Without its host the microcontroller ramps down by itself.
        }
    }
    Link(const Link&) = delete;
    Link& operator=(const Link&) = delete;

    Status status() {
        const Lock lock(mutex_);
        const Bytes reply = ask({1});
        status_ = read_status(reply);
        return status_;
    }

    /// Enables the output; the target starts at 0 V.
    State arm() { return order({3}).first; }

    /// Disables the output immediately.
    State disarm() { return order({4}).first; }

    /// Sets the desired stiffness of an armed microcontroller; returns the target in V.
    double set(double value, Unit unit = Unit::volt) {
        if (!std::isfinite(value)) {
            const char* name = std::isnan(value) ? "NaN" : value < 0 ? "-inf" : "inf";
            throw Error(std::string(name) + " is not a stiffness; expected a finite number");
        }
        return order(wire::Writer().byte(2).byte(static_cast<std::uint8_t>(unit)).real(value).bytes).second;
    }

    /// Acknowledges a fault by its code; after the last one the microcontroller is disarmed.
    State acknowledge(std::uint8_t fault) { return order({5, fault}).first; }

    /// The faults that the microcontroller has reported since the last call, in their order; each is reported once.
    std::vector<Fault> faults() {
        const Lock lock(mutex_);
        return std::exchange(reported_, {});
    }

    /// The model that runs, and the one stored for the next start.
    Blocks model() { return blocks(8, 4); }

    /// Sends the model in a file of `vsj export model` to be checked and stored, restarts the microcontroller, begins a session, and checks
    /// that this model runs. Returns what runs and is stored then.
    ///
    /// A file with anything else is not sent. A microcontroller that is armed or has a fault, or rejects the model, keeps the old one and
    /// does not restart. After its restart it takes its spring to be at rest: leave it disarmed until the spring has settled at 0 V.
    /// Telemetry ends.
    Blocks model(const std::string& path) {
        const Bytes payload = read_model(path);
        const Lock lock(mutex_);
        std::uint8_t number = 0;
        for (auto at = payload.begin(); at != payload.end();) {
            Bytes part(at, at + std::min<std::ptrdiff_t>(part_bytes, payload.end() - at));
            at += static_cast<std::ptrdiff_t>(part.size());
            part.resize(part_bytes);
            wire::Writer request;
            request.byte(9).byte(number++).bytes.insert(request.bytes.end(), part.begin(), part.end());
            order(request.bytes);
        }
        BlockId sent;
        sent.format = payload[0];
        sent.length = static_cast<std::uint32_t>(payload.size());
        sent.checksum = wire::checksum(payload);
        order(wire::Writer().byte(10).number(sent.length).number(sent.checksum).bytes);
        restart();
        const Blocks blocks = model();
        if (blocks.active.content() != sent.content())
            throw Error(port_.name() + ": the MCU has restarted and does not run what was sent as model (" + sent.content() +
                        "): it runs " + blocks.active.text() + ", and has stored " + blocks.stored.text());
        return blocks;
    }

    /// The settings that run, and those stored for the next start. `vsj link PORT settings` shows and sends them.
    Blocks settings() { return blocks(13, 6); }

    /// Asks for telemetry at a rate in Hz, 0 for none; `samples` returns it.
    void stream(double rate_hz) {
        if (rate_hz != 0) check_rate(rate_hz);
        const Lock lock(mutex_);
        double ticks = 0;
        if (rate_hz != 0) ticks = std::clamp(std::round(status_.rate_hz / rate_hz), 1.0, 65535.0);
        samples_.clear();
        if (ticks != 0) isolation_.reset();
        every_ticks_ = static_cast<std::uint16_t>(ticks);
        order(wire::Writer().byte(7).number(every_ticks_).bytes);
    }

    /// What the isolation bank has said last with the telemetry asked for last: after the request, when its verdict changes, and
    /// once per second. Nothing before the first of these, and from a program that does not send it.
    std::optional<Isolation> isolation() {
        const Lock lock(mutex_);
        return isolation_;
    }

    /// Telemetry since the last call, of which at most the newest `most_samples` are kept, and all that arrives within `wait`.
    std::vector<Sample> samples(Clock::duration wait) {
        const auto until = Clock::now() + wait;
        std::vector<Sample> all;
        for (;; std::this_thread::yield()) {
            const Lock lock(mutex_);
            // In short turns, between which other threads have theirs.
            const auto turn = std::min(until, Clock::now() + std::chrono::milliseconds(5));
            while (next_answer(turn)) {
            }
            beat_if_due();
            all.insert(all.end(), samples_.begin(), samples_.end());
            samples_.clear();
            if (Clock::now() >= until) return all;
        }
    }

    /// Number of samples that this program has dropped because it did not take them.
    std::uint64_t dropped_samples() {
        const Lock lock(mutex_);
        return dropped_samples_;
    }

    /// Largest number of samples that are kept until they are taken: those of four minutes at 115 200 bit/s.
    static constexpr std::size_t most_samples = 65'536;

    /// All samples of a time; for endless ones use `stream` and `samples`.
    std::vector<Sample> watch(double rate_hz, Clock::duration length) {
        check_rate(rate_hz);
        stream(rate_hz);
        std::vector<Sample> all = samples(length);
        stream(0);
        return all;
    }

    /// Records to a new CSV file for `vsj diagnose`; returns the number of rows. An error while recording removes it, such as a restart of
    /// the microcontroller.
    std::size_t record(const std::string& path, double rate_hz, Clock::duration length) {
        return record(path, rate_hz, {}, std::chrono::duration<double>(length).count());
    }

    /// Records while an armed microcontroller is commanded the targets of a schedule, whose times increase; the first row is due at the
    /// start. The time of the last row is the end, unless `seconds` is longer. A recording in which the microcontroller is disarmed or has a
    /// fault ends with an error.
    std::size_t record(const std::string& path, double rate_hz, const std::vector<Step>& schedule,
                       std::optional<double> seconds = std::nullopt) {
        check_rate(rate_hz);
        const double end_s = check_schedule(schedule);
        if (schedule.empty() && !seconds) throw Error("record: neither seconds nor a schedule; expected one of them");
        if (seconds && !(std::isfinite(*seconds) && *seconds > 0)) throw Error("seconds " + text(*seconds) + ": expected a positive number of seconds");
        const Status before = status();
        for (const Step& step : schedule)
            if (!(step.target_v >= before.lowest_v && step.target_v <= before.highest_v))
                throw Error("schedule: " + text(step.target_v) + " V; expected " + text(before.lowest_v) + " to " +
                            text(before.highest_v) + " V, what is in reach");
        std::FILE* file = std::fopen(path.c_str(), "wx");
        if (file == nullptr) throw Error(path + ": cannot be created: " + std::strerror(errno));
        std::vector<Sample> rows;
        try {
            rows = follow(rate_hz, schedule, std::max(seconds.value_or(end_s), end_s));
        } catch (...) {
            std::fclose(file);
            std::remove(path.c_str());
            throw;
        }
        const bool has_sensor =
            before.sample.measured_v.has_value() ||
            std::any_of(rows.begin(), rows.end(), [](auto& row) { return row.measured_v.has_value(); });
        std::fprintf(file, "# recorded over the serial link; stiffness %s\ntime_s,voltage_v,%s\n",
                     has_sensor ? "as measured by the sensor" : "as estimated by the controller: no measurement",
                     has_sensor ? "stiffness" : "estimate");
        for (const auto& row : rows) {
            std::fprintf(file, "%.9g,%.6f,", row.time_s - rows.front().time_s, row.applied_v);
            const auto reading = has_sensor ? row.measured_v : row.estimate_v;
            reading ? std::fprintf(file, "%.6f\n", *reading) : std::fprintf(file, "-\n");
        }
        const bool is_whole = std::ferror(file) == 0;
        if (std::fclose(file) != 0 || !is_whole) {
            const int error = errno;
            std::remove(path.c_str());
            throw Error(path + ": cannot be written: " + std::strerror(error));
        }
        return rows.size();
    }

private:
    using Lock = std::lock_guard<std::recursive_mutex>;
    /// A request that was refused because it belongs to no session, or to another one.
    struct NoSession : Error {
        using Error::Error;
    };
    /// One that was refused because the microcontroller has restarted.
    struct Restarted : NoSession {
        using NoSession::NoSession;
    };
    /// Format of a model, the most bytes of one, and the bytes in each part in which it is sent.
    static constexpr std::uint8_t model_format = 1;
    static constexpr std::size_t most_model_bytes = 416, part_bytes = 32;
    /// A request is repeated after this time.
    static constexpr std::chrono::milliseconds each{100};
    /// Number of times that a request at the end is sent at most.
    static constexpr int last_tries = 5;
    /// Requests after which a new session begins: a session has 65 536 numbers.
    static constexpr unsigned most_requests = 60'000;

    Port port_;
    std::atomic<int> tries_;
    std::recursive_mutex mutex_;
    std::uint16_t sequence_ = 0;
    std::uint32_t session_ = 0;
    unsigned requests_ = 0;
    std::uint16_t every_ticks_ = 0;
    Status status_;
    /// Bytes since the last delimiter.
    Bytes encoded_;
    std::deque<std::uint8_t> received_;
    std::deque<Sample> samples_;
    std::uint64_t dropped_samples_ = 0;
    std::optional<Isolation> isolation_;
    /// Numbers of the reports of faults whose receipt the microcontroller does not know of yet.
    std::set<std::uint32_t> unheard_;
    std::vector<Fault> reported_;
    /// When the last request was begun.
    Clock::time_point heard_ = Clock::now();
    std::mutex closing_lock_;
    std::condition_variable wake_;
    bool closing_ = false;
    std::thread beating_;

    void heartbeats() {
        std::unique_lock<std::mutex> guard(closing_lock_);
        Clock::duration pause{};
        while (!wake_.wait_for(guard, pause, [this] { return closing_; })) {
            guard.unlock();
            try {
                const Lock lock(mutex_);
                pause = beat() / 4;
                beat_if_due();
            } catch (const Error&) {
                // The next call meets the same.
            }
            guard.lock();
        }
    }

    /// Time from the beginning of one heartbeat to that of the next.
    Clock::duration beat() const {
        const std::chrono::duration<double> beat_s(std::clamp(status_.silence_limit_s / 5.0, 0.001, 1.0));
        return std::chrono::duration_cast<Clock::duration>(beat_s);
    }

    void beat_if_due() {
        if (Clock::now() - heard_ >= beat()) order({6});
    }

    /// A request that is answered with the state and the target.
    std::pair<State, double> order(const Bytes& message) {
        const Lock lock(mutex_);
        const Bytes reply = ask(message);
        wire::Reader from(reply);
        const auto code = from.number();
        const auto state = static_cast<State>(from.number());
        const double target_v = from.volts();
        if (code != 0 || !from.is_whole()) throw Error(port_.name() + ": unexpected answer");
        return {state, target_v};
    }

    Blocks blocks(std::uint8_t request, std::uint8_t reply_code) {
        const Lock lock(mutex_);
        const Bytes reply = ask({request});
        wire::Reader from(reply);
        const auto code = from.number();
        const BlockId active = BlockId::read(from), stored = BlockId::read(from);
        if (code != reply_code || !from.is_whole()) throw Error(port_.name() + ": unexpected answer");
        return {active, stored};
    }

    Status read_status(const Bytes& reply) const {
        wire::Reader from(reply);
        const auto code = from.number();
        const Status status = Status::read(from);
        if (code != 2 || !from.is_whole()) throw Error(port_.name() + ": unexpected answer");
        return status;
    }

    /// Asks for a new session, which the next request begins.
    void begin() {
        session_ = 0;
        status_ = read_status(exchange({0}));
        requests_ = 0;
        // One that came before the answer belongs to the session before.
        isolation_.reset();
    }

    /// Restarts the microcontroller and asks it for a new session. It then numbers its reports of faults from 1 again, so that those
    /// received before are not confirmed to it any more.
    void restart() {
        try {
            exchange({11});
        } catch (const Restarted&) {
            // The answer was lost, so that the request came again, to a microcontroller that has restarted.
        }
        every_ticks_ = 0;
        samples_.clear();
        begin();
        unheard_.clear();
    }

    /// The bytes of a model.
    static Bytes read_model(const std::string& path) {
        Bytes payload(most_model_bytes + 1);
        std::FILE* file = std::fopen(path.c_str(), "rb");
        if (file != nullptr) payload.resize(std::fread(payload.data(), 1, payload.size(), file));
        const bool is_read = file != nullptr && std::ferror(file) == 0;
        const int error = errno;
        if (file != nullptr) std::fclose(file);
        if (!is_read) throw Error(path + ": cannot be read: " + std::strerror(error));
        if (payload.empty() || payload.size() > most_model_bytes || payload[0] != model_format)
            throw Error(path + ": not a model of format " + std::to_string(model_format) + "; expected a file of `vsj export model`");
        return payload;
    }

    static std::string text(double number) {
        char digits[40];
        std::snprintf(digits, sizeof digits, "%g", number);
        return digits;
    }

    void check_rate(double rate_hz) const {
        if (!(rate_hz >= 0.02 && rate_hz <= 10'000))
            throw Error(port_.name() + ": a rate of " + text(rate_hz) + " Hz; expected 0.02 to 10000");
    }

    /// Checks a schedule; returns its length in s.
    static double check_schedule(const std::vector<Step>& schedule) {
        for (std::size_t at = 0; at < schedule.size(); ++at) {
            if (!(std::isfinite(schedule[at].time_s) && std::isfinite(schedule[at].target_v)))
                throw Error("schedule: a number that is not finite; expected times in s and voltages in V");
            if (at > 0 && !(schedule[at].time_s > schedule[at - 1].time_s))
                throw Error("schedule: times that do not increase; expected increasing times in s");
        }
        return schedule.empty() ? 0 : schedule.back().time_s - schedule.front().time_s;
    }

    /// The samples of a time in s, in which the targets of a schedule are commanded.
    std::vector<Sample> follow(double rate_hz, const std::vector<Step>& schedule, double length_s) {
        std::vector<Sample> rows;
        auto next = schedule.begin();
        stream(rate_hz);
        try {
            const auto start = Clock::now();
            const auto elapsed_s = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
            for (double now_s = 0; now_s < length_s; now_s = elapsed_s()) {
                const Step* due = nullptr;
                for (; next != schedule.end() && now_s >= next->time_s - schedule.front().time_s; ++next) due = &*next;
                if (due != nullptr) set(due->target_v);
                const auto arrived = samples(std::chrono::milliseconds(5));
                if (arrived.empty()) continue;
                rows.insert(rows.end(), arrived.begin(), arrived.end());
                const Sample& last = rows.back();
                if (!schedule.empty() && last.state != State::armed && last.state != State::ramping)
                    throw Error(port_.name() + ": no longer armed: the MCU is " + name(last.state) + " at " + text(last.time_s) + " s");
                if (last.tick < rows.front().tick) throw Error(port_.name() + ": the MCU restarted during the recording");
            }
        } catch (...) {
            try {
                stream(0);
            } catch (const Error&) {
                // What went wrong before is reported.
            }
            throw;
        }
        stream(0);
        return rows;
    }

    /// A request of the session, after what it needs.
    Bytes ask(const Bytes& message) {
        if (requests_ >= most_requests) {
            begin();
            if (every_ticks_ > 0) exchange(wire::Writer().byte(7).number(every_ticks_).bytes);
        }
        const Bytes reply = exchange(message);
        // One that arrives meanwhile is for the next request.
        for (const auto number : std::set<std::uint32_t>(unheard_)) {
            exchange(wire::Writer().byte(12).number(number).bytes);
            // Only now: until then the microcontroller may have repeated it.
            unheard_.erase(number);
        }
        return reply;
    }

    /// Whether a reply refuses a request because it belongs to no session, or to another one.
    static bool is_of_no_session(const Bytes& reply) {
        return reply.size() > 1 && reply[0] == 1 && (reply[1] == 4 || reply[1] == 18);
    }

    /// Sends a request and repeats it until it is answered.
    Bytes exchange(const Bytes& message) {
        const bool is_hello = message[0] == 0;
        ++sequence_;
        ++requests_;
        heard_ = Clock::now();
        const Bytes frame = wire::frame(wire::request_kind, sequence_, message, session_);
        for (int turn = 0; turn < tries_; ++turn) {
            port_.write(frame);
            const auto until = Clock::now() + each;
            while (auto answer = next_answer(until)) {
                if (answer->sequence != sequence_) continue;
                if (answer->version != wire::version) refuse({3, answer->version});
                if (is_hello) session_ = answer->session;
                // No number of the session was used: the microcontroller knows another one, or none.
                if (is_of_no_session(answer->message)) --requests_;
                if (answer->message[0] == 1) refuse(Bytes(answer->message.begin() + 1, answer->message.end()));
                return std::move(answer->message);
            }
        }
        throw Error(port_.name() + ": no answer to " + std::to_string(tries_.load()) +
                    " requests; is the MCU running on this port?");
    }

    /// The next answer that arrives before `until`. Telemetry and reports of faults are kept.
    std::optional<wire::Packet> next_answer(Clock::time_point until) {
        for (;;) {
            while (!received_.empty()) {
                const std::uint8_t byte = received_.front();
                received_.pop_front();
                if (byte != 0) {
                    if (encoded_.size() <= wire::most_encoded) encoded_.push_back(byte);
                    continue;
                }
                auto packet = encoded_.size() <= wire::most_encoded ? wire::open(encoded_) : std::nullopt;
                encoded_.clear();
                if (!packet || packet->message.empty()) continue;
                if (packet->kind == wire::notice_kind && packet->version == wire::version && packet->session == session_)
                    notice(packet->message);
                if (packet->kind != wire::reply_kind) continue;
                if (packet->version != wire::version) return packet;
                wire::Reader from(packet->message);
                const auto code = from.number();
                if (code == 3) {
                    const Sample sample = Sample::read(from, status_.rate_hz);
                    if (from.is_whole()) keep(sample);
                } else if (code == 5) {
                    const Fault fault = Fault::read(from, status_.rate_hz);
                    if (from.is_whole() && unheard_.insert(fault.number).second) reported_.push_back(fault);
                } else {
                    return packet;
                }
            }
            if (Clock::now() >= until) return std::nullopt;
            const Bytes bytes = port_.read(until);
            received_.insert(received_.end(), bytes.begin(), bytes.end());
        }
    }

    void keep(const Sample& sample) {
        if (samples_.size() == most_samples) {
            samples_.pop_front();
            ++dropped_samples_;
        }
        samples_.push_back(sample);
    }

    void notice(const Bytes& message) {
        wire::Reader from(message);
        const bool is_isolation = from.number() == 0;
        const Isolation said = Isolation::read(from);
        if (is_isolation && from.is_whole()) isolation_ = said;
    }

    [[noreturn]] void refuse(const Bytes& reason) const {
        wire::Reader from(reason);
        const auto code = from.number();
        const auto range = [&] {
            const double lowest = from.real(), highest = from.real();
            return text(lowest) + " to " + text(highest);
        };
        std::string why;
        switch (code) {
            case 0: why = "out of range: expected " + range(); break;
            case 1: why = "not armed"; break;
            case 2: why = "faulted: " + fault_name(from.byte()) + "; acknowledge it first"; break;
            case 3:
                why = "the MCU speaks version " + std::to_string(from.byte()) + " of the protocol, this program " +
                      std::to_string(wire::version);
                break;
            case 4: why = "the MCU has restarted and waits for a Hello"; break;
            case 5: why = "too late: request " + std::to_string(from.number()) + " is already accepted"; break;
            case 6: why = "a different request has the same sequence number"; break;
            case 7: why = "the MCU does not know this request"; break;
            case 8: why = "the interlock is open"; break;
            case 9: why = "a different fault is present: " + fault_name(from.byte()); break;
            case 10: why = "the host was silent for too long"; break;
            case 11: why = "armed; disarm it first"; break;
            case 12: why = "a part is missing; expected part " + std::to_string(from.byte()); break;
            case 13: why = "it arrived damaged, or the MCU does not know its format"; break;
            case 14: {
                const std::string field = field_name(from.byte());
                why = "the model cannot be run: " + field + " has to lie within " + range();
                break;
            }
            case 15: why = "the flash could not be written; what it held before stays"; break;
            case 16: why = "the amplifier is off, and its monitors still show a voltage or a current"; break;
            case 17: why = "the cause of the fault is still there: " + fault_name(from.byte()); break;
            case 18: why = "the MCU is in a session with another program"; break;
            case 19: why = "the supply of the MCU's converters is out of its range"; break;
            default: why = "reason " + std::to_string(code) + " of docs/link.md"; break;
        }
        const std::string refusal = port_.name() + ": refused: " + why;
        if (code == 4) throw Restarted(refusal);
        if (code == 18) throw NoSession(refusal);
        throw Error(refusal);
    }
};

}  // namespace vsj

#endif
