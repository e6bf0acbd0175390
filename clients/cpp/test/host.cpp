// The client and an MCU within this program, which does what no healthy board does.
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <functional>
#include <iostream>
#include <optional>
#include <tuple>

#include <sys/time.h>

#include <vsj_link.hpp>

#include "expect.hpp"

namespace {

using vsj::Bytes;
using vsj::wire::Writer;

constexpr std::uint8_t hello = 0, ask_status = 1, set = 2, disarm = 4, heartbeat = 6, stream = 7, ask_model = 8, model_part = 9,
                       model_end = 10, restart = 11, heard = 12;

Writer& sample(Writer& message, std::uint64_t tick) {
    message.number(tick);
    for (int field = 0; field < 9; ++field) message.byte(0);
    return message;
}

Bytes status(std::uint32_t silence_limit_ticks) {
    Writer message;
    message.byte(2).byte(0).byte(1).byte(0);
    for (const std::uint32_t number : {0u, 0u, 1000u, silence_limit_ticks, 0u, 0u, 0u, 0u, 0u}) message.number(number);
    sample(message, 0);
    for (int counter = 0; counter < 8; ++counter) message.byte(0);
    return message.bytes;
}

/// Answers what comes on a file until the other side closes it, after what `before` sends ahead of the answer.
class Mcu {
public:
    /// Number of requests by their code.
    std::array<std::atomic<unsigned>, 32> asked{};
    /// True if each request but a Hello is refused, as of another session.
    std::atomic<bool> is_of_another_session{false};
    /// True if nothing is answered.
    std::atomic<bool> is_mute{false};
    /// The reply to a request in place of the usual one, none if it is empty.
    std::function<std::optional<Bytes>(const Bytes&)> instead;

    explicit Mcu(std::function<Bytes(const Bytes&)> before = {}) : before_(std::move(before)) {}
    ~Mcu() { thread_.join(); }

    void serve(int file) {
        thread_ = std::thread([this, file] {
            Bytes encoded, bytes(1024);
            for (ssize_t count; (count = ::read(file, bytes.data(), bytes.size())) > 0;) {
                for (ssize_t at = 0; at < count; ++at) {
                    const std::uint8_t byte = bytes[static_cast<std::size_t>(at)];
                    if (byte != 0) encoded.push_back(byte);
                    if (byte == 0 && !encoded.empty()) answer(file, *vsj::wire::open(std::exchange(encoded, {})));
                }
            }
            ::close(file);
        });
    }

    void accept(int listener) {
        const int file = ::accept(listener, nullptr, nullptr);
        ::close(listener);
        serve(file);
    }

private:
    std::function<Bytes(const Bytes&)> before_;
    Bytes last_;
    std::uint32_t nonce_ = 0;
    std::thread thread_;

    void answer(int file, const vsj::wire::Packet& request) {
        const std::uint8_t code = request.message[0];
        ++asked[code];
        if (is_mute) return;
        if (code == hello) ++nonce_;
        Bytes reply{0, 0, 0};
        if (code == hello || code == ask_status) reply = status(60'000);
        if (code != hello && is_of_another_session) reply = {1, 18};
        if (instead) reply = instead(request.message).value_or(reply);
        if (reply.empty()) return;
        Bytes out = before_ ? before_(request.message) : Bytes{};
        const Bytes frame = vsj::wire::frame(vsj::wire::reply_kind, request.sequence, reply, nonce_);
        out.insert(out.end(), frame.begin(), frame.end());
        for (std::size_t sent = 0; sent < out.size();) {
            const auto count = ::write(file, out.data() + sent, out.size() - sent);
            if (count <= 0) return;
            sent += static_cast<std::size_t>(count);
        }
    }
};

/// Ports of the two addresses that every name has, see `getaddrinfo`.
std::uint16_t ports[2];

/// A TCP socket that listens on a free port, which is written to `port`.
int listening(std::uint16_t& port) {
    const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    ::bind(listener, reinterpret_cast<const sockaddr*>(&address), length);
    ::listen(listener, 1);
    ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
    port = ntohs(address.sin_port);
    return listener;
}

/// Runs `work` with a client of this MCU.
void with_link(Mcu& mcu, const std::function<void(vsj::Link&)>& work) {
    const int listener = listening(ports[1]);
    std::thread accepting([&] { mcu.accept(listener); });
    vsj::Link link("tcp:mcu:1", 0, std::chrono::seconds(20));
    accepting.join();
    work(link);
}

/// Heartbeats go on receiving what a program has asked for and does not take.
void samples_that_nobody_takes() {
    constexpr std::size_t beyond = 3;
    bool is_sent = false;
    Mcu mcu([&](const Bytes& request) {
        Bytes out;
        if (request[0] != disarm || std::exchange(is_sent, true)) return out;
        const auto add = [&](const Bytes& message) {
            const Bytes frame = vsj::wire::frame(vsj::wire::reply_kind, 0, message, 1);
            out.insert(out.end(), frame.begin(), frame.end());
        };
        add(Writer().byte(5).number(1).number(7).byte(4).number(8).byte(0).bytes);
        for (std::uint64_t tick = 0; tick < vsj::Link::most_samples + beyond; ++tick) {
            Writer message;
            add(sample(message.byte(3), tick).bytes);
        }
        return out;
    });
    with_link(mcu, [](vsj::Link& link) {
        link.disarm();
        const auto samples = link.samples({});
        expect(samples.size() == vsj::Link::most_samples && samples.front().tick == beyond, "the newest samples");
        expect(link.dropped_samples() == beyond, "the others counted");
        const auto faults = link.faults();
        expect(faults.size() == 1 && faults[0].code == 4 && faults[0].tick == 7 && faults[0].standing == 8, "a fault kept");
        expect(link.faults().empty(), "a fault reported once");
    });
    expect(mcu.asked[heard] == 1, "a report whose receipt the MCU knows of");
}

/// A disarm is carried out whoever sends it.
void output_of_another_program() {
    Mcu mcu;
    with_link(mcu, [&](vsj::Link&) { mcu.is_of_another_session = true; });
    expect(mcu.asked[disarm] == 0, "no disarm of another program's output");
}

/// The end waits for no answer as long as a call does, not even while a heartbeat waits for one.
void end_while_nothing_is_answered() {
    for (const bool is_heartbeat : {false, true}) {
        std::chrono::steady_clock::time_point end;
        Mcu mcu;
        with_link(mcu, [&](vsj::Link&) {
            mcu.is_mute = true;
            while (is_heartbeat && mcu.asked[heartbeat] == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
            end = std::chrono::steady_clock::now();
        });
        expect(std::chrono::steady_clock::now() - end < std::chrono::seconds(5), "an end within seconds");
        expect(mcu.asked[disarm] == 5, "a disarm that is repeated");
    }
}

/// A session has 65 536 numbers; refusals as of another session use none.
void numbers_that_run_out() {
    Mcu mcu;
    with_link(mcu, [&](vsj::Link& link) {
        link.stream(100);
        mcu.is_of_another_session = true;
        for (int count = 0; count < 60'000; ++count)
            expect(contains(error_of([&] { link.disarm(); }), "in a session with another program"), "a refusal");
        expect(mcu.asked[hello] == 1 && mcu.asked[stream] == 1, "no session begun by refusals");
        mcu.is_of_another_session = false;
        for (int count = 0; count < 60'000; ++count) link.disarm();
        expect(mcu.asked[hello] == 2 && mcu.asked[stream] == 2, "another session with the telemetry of the first");
    });
}

/// What an earlier program has left: flow control, and two stop bits.
void flags_of_a_serial_device() {
    const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
    expect(master >= 0 && ::grantpt(master) == 0 && ::unlockpt(master) == 0, "a pseudo-terminal");
    const std::string name = ::ptsname(master);
    // A terminal that nobody holds open hangs up.
    const int slave = ::open(name.c_str(), O_RDWR | O_NOCTTY);
    termios left{};
    ::tcgetattr(slave, &left);
    left.c_iflag |= IXON | IXOFF | IXANY;
    left.c_cflag |= CSTOPB | CRTSCTS;
    ::tcsetattr(slave, TCSANOW, &left);
    expect(contains(error_of([&] { vsj::Port port(name, 115'201, {}); }), "a baud rate of 115201 is not usual"), "a refusal");
    {
        Mcu mcu;
        mcu.serve(::dup(master));
        {
            vsj::Link link(name, 57'600, std::chrono::seconds(20));
            termios line{};
            ::tcgetattr(slave, &line);
            expect(::cfgetospeed(&line) == B57600 && ::cfgetispeed(&line) == B57600, "the rate asked for");
            expect((line.c_iflag & (IXON | IXOFF | IXANY | ICRNL)) == 0, "no flow control by bytes, and no byte changed");
            expect((line.c_cflag & (CSTOPB | CRTSCTS | PARENB)) == 0 && (line.c_cflag & CSIZE) == CS8, "8N1 without flow control");
            expect((line.c_lflag & (ICANON | ECHO)) == 0, "bytes, no lines");
        }
        ::close(slave);
    }
    ::close(master);
}

/// The first address of a name refuses the connection.
void all_addresses_of_a_name() {
    ::close(listening(ports[0]));
    Mcu mcu;
    with_link(mcu, [](vsj::Link& link) { link.status(); });
    expect(mcu.asked[disarm] == 1, "a disarm at the end");
    expect(contains(error_of([] { vsj::Link link("tcp:mcu:1"); }), "cannot be opened: Connection refused"), "nobody there");
}

/// Runs `work` while a signal interrupts this thread every millisecond, and `other` meanwhile in a thread that has none.
void interrupted(const std::function<void()>& work, const std::function<void()>& other) {
    struct sigaction ignored{};
    ignored.sa_handler = [](int) {};
    ::sigaction(SIGALRM, &ignored, nullptr);
    sigset_t alarm;
    sigemptyset(&alarm);
    sigaddset(&alarm, SIGALRM);
    ::pthread_sigmask(SIG_BLOCK, &alarm, nullptr);
    std::thread thread(other);
    ::pthread_sigmask(SIG_UNBLOCK, &alarm, nullptr);
    const itimerval every{{0, 1000}, {0, 1000}}, never{};
    ::setitimer(ITIMER_REAL, &every, nullptr);
    work();
    ::setitimer(ITIMER_REAL, &never, nullptr);
    thread.join();
}

/// Times that `poll` ends before its time, as one that is longer than the longest wait of a call does.
std::atomic<int> early_ends{0};

/// Signals end no wait, and no wait ends before its time.
void waits_that_are_interrupted() {
    const int listener = listening(ports[0]);
    ports[1] = ports[0];
    sockaddr_in address{};
    socklen_t length = sizeof address;
    ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
    // Others wait to be accepted, so that a connection takes a second.
    int others[4];
    for (int& file : others) {
        file = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        ::connect(file, reinterpret_cast<const sockaddr*>(&address), length);
    }
    const Bytes many(8 << 20, 7);
    std::atomic<bool> is_connected{false};
    std::size_t received = 0;
    const auto other_side = [&] {
        const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(100)); };
        pause();
        std::vector<pollfd> files{{listener, POLLIN, 0}};
        while (!is_connected) {
            pollfd waiting{listener, POLLIN, 0};
            const timespec turn{0, 10'000'000};
            if (::ppoll(&waiting, 1, &turn, nullptr) > 0) files.push_back({::accept(listener, nullptr, nullptr), POLLIN, 0});
        }
        // The buffers fill meanwhile.
        pause();
        Bytes bytes(1 << 16);
        while (received < many.size() && ::ppoll(files.data() + 1, files.size() - 1, nullptr, nullptr) > 0) {
            for (auto& file : files) {
                if (file.fd == listener || file.revents == 0) continue;
                const auto count = ::read(file.fd, bytes.data(), bytes.size());
                received += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
            }
        }
        for (auto& file : files) ::close(file.fd);
    };
    early_ends = 3;
    interrupted(
        [&] {
            const auto failure = error_of([&] {
                vsj::Port port("tcp:mcu:1", 0, std::chrono::seconds(20));
                is_connected = true;
                port.write(many);
            });
            if (!failure.empty()) std::cerr << failure << '\n';
            expect(failure.empty(), "a connection and bytes in spite of signals");
        },
        other_side);
    expect(received == many.size() && early_ends == 0, "all bytes");
    for (const int file : others) ::close(file);
}

/// A file of this program that is removed at its end.
struct File {
    std::string path = "/tmp/vsj-host-" + std::to_string(::getpid());

    explicit File(const Bytes& content) {
        std::FILE* file = std::fopen(path.c_str(), "wb");
        std::fwrite(content.data(), 1, content.size(), file);
        std::fclose(file);
    }
    ~File() { std::remove(path.c_str()); }
};

/// An MCU that takes models, with the replies of a healthy one.
struct Store {
    Bytes received, stored, active;
    std::uint32_t number = 0;

    std::optional<Bytes> reply(const Bytes& request) {
        if (request[0] == model_part) {
            if (request.size() != 34) return Bytes{1, 7};
            if (request[1] == 0) received.clear();
            if (received.size() != 32u * request[1]) return Bytes{1, 12, 0};
            received.insert(received.end(), request.begin() + 2, request.end());
        } else if (request[0] == model_end) {
            vsj::wire::Reader from(request);
            from.byte();
            const std::uint64_t length = from.number(), checksum = from.number();
            const bool is_padded = length <= received.size() && received.size() < length + 32 &&
                                   std::all_of(received.begin() + static_cast<std::ptrdiff_t>(length), received.end(),
                                               [](std::uint8_t byte) { return byte == 0; });
            if (!is_padded) return Bytes{1, 13};
            received.resize(length);
            if (vsj::wire::checksum(received) != checksum) return Bytes{1, 13};
            stored = received;
            ++number;
        } else if (request[0] == restart) {
            active = stored;
        } else if (request[0] == ask_model) {
            Writer message;
            message.byte(4);
            for (const Bytes& block : {active, stored}) {
                message.number(block.empty() ? 0 : number).byte(block.empty() ? 0 : block[0]).number(block.size());
                message.number(block.empty() ? 0 : vsj::wire::checksum(block));
            }
            return message.bytes;
        }
        return std::nullopt;
    }
};

Bytes model_of(std::size_t length) {
    Bytes model{1};
    while (model.size() < length) model.push_back(static_cast<std::uint8_t>(model.size()));
    return model;
}

/// All bytes arrive, however many parts they take, and also if the answer to the restart is lost.
void models_of_every_length() {
    for (const std::size_t length : {1u, 31u, 32u, 33u, 416u}) {
        const File file(model_of(length));
        Store store;
        Mcu mcu;
        mcu.instead = [&](const Bytes& request) -> std::optional<Bytes> {
            if (request[0] == restart && std::exchange(store.active, store.stored) != store.stored) return Bytes{};
            if (request[0] == restart) return Bytes{1, 4};
            return store.reply(request);
        };
        with_link(mcu, [&](vsj::Link& link) {
            expect(link.model().active.number == 0, "what is built in");
            const vsj::Blocks blocks = link.model(file.path);
            expect(blocks.active.number == 1 && blocks.active.length == length, "a model that runs");
        });
        expect(store.active == model_of(length), "the bytes of the file");
        expect(mcu.asked[hello] == 2 && mcu.asked[model_part] == (length + 31) / 32, "a session after the restart");
    }
}

/// What is refused changes nothing, and another model that runs is an error.
void models_that_do_not_run() {
    const File file(model_of(70));
    Store store;
    Mcu mcu;
    Bytes refusal;
    std::uint8_t refused = 255;
    mcu.instead = [&](const Bytes& request) { return request[0] == refused ? refusal : store.reply(request); };
    with_link(mcu, [&](vsj::Link& link) {
        const auto error = [&](std::uint8_t code, const Bytes& answer) {
            refused = code;
            refusal = answer;
            return error_of([&] { link.model(file.path); });
        };
        Bytes bounds = Writer().byte(1).byte(14).byte(5).real(0).real(1).bytes;
        expect(contains(error(model_end, bounds), "refused: the model cannot be run: leakage.share has to lie within 0 to 1"), "a field");
        bounds[2] = 200;
        expect(contains(error(model_end, bounds), "cannot be run: another setting has to lie within 0 to 1"), "a newer field");
        expect(contains(error(model_part, {1, 11}), "refused: armed; disarm it first"), "an armed MCU");
        expect(contains(error(model_part, {1, 12, 3}), "expected part 3"), "another part");
        expect(contains(error(model_end, {1, 13}), "arrived damaged"), "damage");
        expect(contains(error(model_end, {1, 15}), "flash could not be written"), "a flash that fails");
        expect(mcu.asked[restart] == 0, "no restart");
        expect(contains(error(restart, {1, 18}), "in a session with another program"), "a session of another program");
        const auto forgotten = error(restart, {0, 0, 0});
        expect(contains(forgotten, "does not run what was sent as model (format 1, 70 bytes, CRC ") &&
                   contains(forgotten, "it runs the one that is built in, and has stored number 2, format 1, 70 bytes, CRC "),
               "an MCU that forgets: " + forgotten);
        const unsigned parts = mcu.asked[model_part];
        for (const Bytes& other : {Bytes{}, Bytes{'#'}, model_of(417)}) {
            const File wrong(other);
            expect(contains(error_of([&] { link.model(wrong.path); }), "not a model of format 1; expected a file of"), "no model");
        }
        expect(contains(error_of([&] { link.model("/nonexistent"); }), "/nonexistent: cannot be read: No such file"), "no file");
        expect(contains(error_of([&] { link.model("/tmp"); }), "/tmp: cannot be read: Is a directory"), "a folder");
        expect(mcu.asked[model_part] == parts, "nothing sent");
    });
}

/// What is no recording is refused before the file is made, and one that breaks off leaves none.
void recordings_that_break_off() {
    const std::string path = "/tmp/vsj-host-" + std::to_string(::getpid()) + ".csv";
    std::vector<std::uint64_t> ticks;
    Mcu mcu([&](const Bytes& request) {
        Bytes out;
        for (const auto tick : request[0] == stream && request[1] != 0 ? ticks : std::vector<std::uint64_t>()) {
            Writer message;
            const Bytes frame = vsj::wire::frame(vsj::wire::reply_kind, 0, sample(message.byte(3), tick).bytes, 1);
            out.insert(out.end(), frame.begin(), frame.end());
        }
        return out;
    });
    with_link(mcu, [&](vsj::Link& link) {
        using Schedule = std::vector<vsj::Step>;
        for (const auto& [schedule, seconds, words] : {
                 std::tuple(Schedule(), std::optional<double>(), "neither seconds nor a schedule; expected one of them"),
                 std::tuple(Schedule(), std::optional(-1.0), "seconds -1: expected a positive number of seconds"),
                 std::tuple(Schedule(), std::optional<double>(NAN), "nan: expected a positive number of seconds"),
                 std::tuple(Schedule{{0, 0}, {0, 0}}, std::optional<double>(), "times that do not increase"),
                 std::tuple(Schedule{{0, 0}, {1, NAN}}, std::optional<double>(), "not finite"),
                 std::tuple(Schedule{{0, 0}, {1, 300}}, std::optional<double>(), "300 V; expected 0 to 0 V, what is in reach"),
             })
            expect(contains(error_of([&] { link.record(path, 100, schedule, seconds); }), words), words);
        expect(contains(error_of([&] { link.record(path, 0, std::chrono::seconds(1)); }), "a rate of 0 Hz; expected 0.02"), "a rate");
        expect(contains(error_of([&] { link.watch(0, std::chrono::seconds(1)); }), "a rate of 0 Hz; expected 0.02"), "a rate");
        expect(mcu.asked[stream] == 0 && mcu.asked[set] == 0, "nothing asked for");
        ticks = {100, 110};
        expect(link.record(path, 100, std::chrono::milliseconds(50)) == 2 && std::remove(path.c_str()) == 0, "a recording");
        ticks = {100, 3};
        expect(contains(error_of([&] { link.record(path, 100, std::chrono::seconds(20)); }), "restarted during the recording"), "a restart");
        ticks = {100};
        const auto failure = error_of([&] { link.record(path, 100, {{0, 0}, {20, 0}}); });
        expect(contains(failure, "no longer armed: the MCU is disarmed at 0.1 s"), "a disarmed MCU: " + failure);
        expect(mcu.asked[set] == 1 && mcu.asked[stream] == 6, "a target, and telemetry ended each time");
        expect(std::remove(path.c_str()) != 0, "no file");
        ticks = {};
        const auto begin = std::chrono::steady_clock::now();
        expect(link.record(path, 100, {{7, 0}, {7.1, 0}, {7.2, 0}}, 0.3) == 0 && std::remove(path.c_str()) == 0, "no rows");
        expect(std::chrono::steady_clock::now() - begin >= std::chrono::milliseconds(300), "the longer of both");
        expect(mcu.asked[set] == 4, "the last row is a target if something follows");
    });
}

/// What is no number does not reach the microcontroller.
void targets_that_are_no_numbers() {
    Mcu mcu;
    with_link(mcu, [&](vsj::Link& link) {
        for (const auto& [value, name] : {std::pair(NAN, "NaN"), std::pair(INFINITY, "inf"), std::pair(-INFINITY, "-inf")})
            expect(error_of([&] { link.set(value); }) == std::string(name) + " is not a stiffness; expected a finite number", name);
        expect(mcu.asked[set] == 0, "no request");
    });
}

}  // namespace

/// In place of the library's: it may end early.
extern "C" int poll(pollfd* files, nfds_t count, int timeout_ms) {
    if (timeout_ms > 0 && early_ends > 0) return --early_ends, 0;
    const timespec timeout{timeout_ms / 1000, timeout_ms % 1000 * 1'000'000};
    return ::ppoll(files, count, timeout_ms < 0 ? nullptr : &timeout, nullptr);
}

/// In place of the library's: every name has two addresses.
extern "C" int getaddrinfo(const char*, const char*, const addrinfo*, addrinfo** found) {
    static sockaddr_in addresses[2];
    static addrinfo infos[2];
    for (std::size_t at = 0; at < 2; ++at) {
        addresses[at] = {};
        addresses[at].sin_family = AF_INET;
        addresses[at].sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        addresses[at].sin_port = htons(ports[at]);
        infos[at] = {};
        infos[at].ai_family = AF_INET;
        infos[at].ai_socktype = SOCK_STREAM;
        infos[at].ai_addr = reinterpret_cast<sockaddr*>(&addresses[at]);
        infos[at].ai_addrlen = sizeof addresses[at];
    }
    infos[0].ai_next = &infos[1];
    *found = infos;
    return 0;
}

extern "C" void freeaddrinfo(addrinfo*) noexcept {}

int main() {
    all_addresses_of_a_name();
    waits_that_are_interrupted();
    targets_that_are_no_numbers();
    flags_of_a_serial_device();
    samples_that_nobody_takes();
    output_of_another_program();
    end_while_nothing_is_answered();
    models_of_every_length();
    models_that_do_not_run();
    recordings_that_break_off();
    numbers_that_run_out();
    std::puts("models sent, recordings ended, waits ended by no signal, targets that are no numbers refused, dropped samples counted, another program's output left, an end without answers, a session renewed, a serial device set, every address tried");
}
