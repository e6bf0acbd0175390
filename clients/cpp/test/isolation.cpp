// The verdict of a running board with an isolation bank, whose port is the argument.
#include <cstdio>

#include <vsj_link.hpp>

int main(int argc, char** argv) try {
    if (argc != 2) return 2;
    vsj::Link link(argv[1], 115'200, std::chrono::seconds(5));
    const bool is_early = link.isolation().has_value();
    link.watch(50, std::chrono::milliseconds(1500));
    const auto first = link.isolation();
    link.watch(50, std::chrono::milliseconds(1500));
    const auto later = link.isolation();
    if (is_early || !first || !later) throw vsj::Error("expected: a verdict with the telemetry, and none before");
    // A board at rest gives the bank nothing to name.
    if (first->word() != std::string("quiet") || *first->cause() != 0 || first->since_tick != 0 || later->tick <= first->tick)
        throw vsj::Error("expected: quiet, again and again, not " + std::string(first->word()) + " at tick " +
                         std::to_string(first->tick) + " and " + std::to_string(later->tick));
    std::puts("a verdict with the telemetry");
} catch (const vsj::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
