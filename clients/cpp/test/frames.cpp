// Every message of the protocol, byte by byte: the files that the tests of the crate `link` write.
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>

#include <vsj_link.hpp>

namespace {

int failures = 0;

void expect(bool is_so, const std::string& what) {
    if (is_so) return;
    std::cerr << what << '\n';
    ++failures;
}

vsj::Bytes bytes(const std::string& hex) {
    vsj::Bytes out;
    for (std::size_t at = 0; at + 1 < hex.size(); at += 2)
        out.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(at, 2), nullptr, 16)));
    return out;
}

constexpr std::uint16_t sequence = 0x0102;
constexpr std::uint32_t session = 0x03040506;

/// Lines of a message and its frame.
int check(const std::string& path, std::uint8_t kind) {
    std::ifstream file(path);
    int count = 0;
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string message, frame;
        words >> message >> frame;
        const vsj::Bytes whole = bytes(frame);
        expect(vsj::wire::frame(kind, sequence, bytes(message), session) == whole, "not encoded: " + line);
        const auto packet = vsj::wire::open(vsj::Bytes(whole.begin() + 1, whole.end() - 1));
        expect(packet && packet->message == bytes(message) && packet->kind == kind && packet->sequence == sequence &&
                   packet->session == session && packet->version == vsj::wire::version,
               "not decoded: " + line);
        for (std::size_t at = 1; at + 1 < whole.size(); ++at) {
            vsj::Bytes damaged(whole.begin() + 1, whole.end() - 1);
            damaged[at - 1] ^= 0x10;
            if (damaged[at - 1] != 0) expect(!vsj::wire::open(damaged), "damage not detected: " + line);
        }
        if (kind == vsj::wire::reply_kind && message.substr(0, 2) == "02") {
            const vsj::Bytes content = bytes(message);
            vsj::wire::Reader from(content);
            from.byte();
            const auto status = vsj::Status::read(from);
            expect(from.is_whole() && status.revision == 0x12345678 && status.rate_hz == 1000 &&
                       status.silence_limit_s == 0.5 && status.sample.tick == 70'000 && status.sample.target_v == 300.0 &&
                       status.sample.dac_code == 4095 && status.sample.limits == 9 && !status.sample.measured_v &&
                       status.fault == 1 && status.last_fault == 5,
                   "another status: " + line);
        }
        if (kind == vsj::wire::reply_kind && message.substr(0, 2) == "03") {
            const vsj::Bytes content = bytes(message);
            vsj::wire::Reader from(content);
            from.byte();
            const auto sample = vsj::Sample::read(from, 1000);
            expect(from.is_whole() && sample.time_s == 70.0 && sample.applied_v == -1.0 / 1048576 && sample.sensor == 4,
                   "another sample: " + line);
        }
        if (kind == vsj::wire::reply_kind && message.substr(0, 2) == "05") {
            const vsj::Bytes content = bytes(message);
            vsj::wire::Reader from(content);
            from.byte();
            const auto fault = vsj::Fault::read(from, 1000);
            expect(from.is_whole() && fault.number == 300 && fault.time_s == 70.0 && fault.code == 6 &&
                       fault.standing == 0x24 && fault.mismatch == 3,
                   "another fault: " + line);
        }
        if (kind == vsj::wire::notice_kind) {
            const vsj::Bytes content = bytes(message);
            vsj::wire::Reader from(content);
            expect(from.byte() == 0, "another notice: " + line);
            const auto said = vsj::Isolation::read(from);
            expect(from.is_whole() && said.tick == 70'000 && said.since_tick == 300 && said.size == 0.25 &&
                       said.half_width == 1.0 && said.explained == 0.0 && said.trip_on_cause == 0x8001 &&
                       said.word() == std::string("ambiguous") && said.cause() == std::string("gain-error") &&
                       said.other() == std::string("delay"),
                   "another verdict: " + line);
        }
        ++count;
    }
    return count;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    const std::string folder = argv[1];
    const int requests = check(folder + "/requests.txt", vsj::wire::request_kind);
    const int replies = check(folder + "/replies.txt", vsj::wire::reply_kind);
    const int notices = check(folder + "/notices.txt", vsj::wire::notice_kind);
    expect(requests >= 20 && replies >= 20 && notices >= 1, "files without frames");
    const vsj::Bytes set = vsj::wire::Writer().byte(2).byte(0).real(300.0).bytes;
    expect(set == bytes("02000000000000c07240"), "another request to set");
    std::printf("%d requests, %d replies, %d notices\n", requests, replies, notices);
    return failures == 0 ? 0 : 1;
}
