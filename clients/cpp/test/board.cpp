// The client and a running board, whose port is the argument.
#include <cmath>
#include <cstdio>
#include <iostream>

#include <vsj_link.hpp>

#include "expect.hpp"

int main(int argc, char** argv) {
    if (argc != 4) return 2;
    const std::string port = argv[1], file = argv[2], model = argv[3];
    const auto patience = std::chrono::seconds(5);
    expect(contains(error_of([] { vsj::Link link("unix:/nonexistent"); }), "cannot be opened"), "an error of the port");
    {
        vsj::Link link(port, 115'200, patience);
        expect(link.status().sample.state == vsj::State::disarmed, "disarmed");
        expect(contains(error_of([&] { link.set(10); }), port + ": refused: not armed"), "a refusal before arming");
        expect(link.arm() == vsj::State::armed && link.set(300) == 300.0, "armed at 300 V");
        // Longer than the MCU allows its host to be silent.
        std::this_thread::sleep_for(std::chrono::duration<double>(1.2 * link.status().silence_limit_s));
        expect(link.status().sample.state == vsj::State::armed, "armed by heartbeats");
        const auto samples = link.watch(50, std::chrono::milliseconds(500));
        expect(samples.size() >= 20, std::to_string(samples.size()) + " samples to be 25");
        // By the board's clock: the emulator's may run ahead of the host's for a while.
        const double periods = double(samples.back().tick - samples.front().tick) / 20;
        expect(std::abs(periods + 1 - double(samples.size())) <= 1, "a sample every 20 ticks");
        for (std::size_t at = 1; at < samples.size(); ++at)
            // Up to half a period is jitter, not a loss.
            expect(samples[at].tick <= samples[at - 1].tick + 30, "no sample lost");
        expect(samples.back().target_v == 300.0 && samples.back().applied_v > 300.0, "an overshooting voltage");
        expect(link.faults().empty(), "no fault");
        expect(contains(error_of([&] { link.set(5000); }), "out of range: expected 0 to 700"), "a bound");
        expect(link.model().active.number == 0 && link.settings().active.number == 0, "what is built in");
        expect(contains(error_of([&] { link.record(file, -1, patience); }), "expected 0.02 to 10000"), "a rate refused");
        expect(link.record(file, 100, std::chrono::milliseconds(300)) > 20, "rows of a recording, after an error without a file");
        expect(contains(error_of([&] { link.record(file, 100, patience); }), "cannot be created"), "an existing file kept");
    }
    vsj::Link link(port, 115'200, patience);
    expect(link.status().sample.state == vsj::State::disarmed, "disarmed by the destructor");
    const std::vector<vsj::Step> schedule{{0, 200}, {0.2, 0}, {0.4, 0}};
    expect(contains(error_of([&] { link.record(file + ".new", 100, schedule); }), "refused: not armed"), "a schedule without arming");
    expect(contains(error_of([&] { link.record(file + ".new", 100, {{0, 100}, {1, 5000}}); }), "5000 V; expected 0 to 700 V"), "a bound");
    link.arm();
    expect(link.record(file + ".new", 100, schedule) > 30, "rows of a schedule, after errors without a file");
    expect(link.status().sample.target_v == 0.0, "the targets of the schedule");
    std::thread disarming([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        link.disarm();
    });
    const auto disarmed = error_of([&] { link.record(file + ".other", 100, {{0, 100}, {60, 0}}); });
    disarming.join();
    expect(contains(disarmed, "no longer armed: the MCU is disarmed"), "a recording that ends with the output");
    link.arm();
    expect(contains(error_of([&] { link.model(model); }), "refused: armed; disarm it first"), "no model while armed");
    link.disarm();
    expect(link.model().stored.number == 0, "the old model after a refusal");
    const vsj::Blocks models = link.model(model);
    expect(models.active.number == 1 && models.stored.text() == models.active.text(), "the model that was sent");
    expect(link.arm() == vsj::State::armed && link.set(300) == 300.0, "armed with the model");
    std::puts("armed, set, kept, watched, recorded, with a schedule too, disarmed, another model run");
}
