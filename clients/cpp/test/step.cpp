// A first step: 300 V for two seconds.
#include <cstdio>

#include <vsj_link.hpp>

int main(int argc, char** argv) try {
    vsj::Link link(argc > 1 ? argv[1] : "/dev/ttyACM0");
    link.arm();
    link.set(300.0);
    for (const auto& sample : link.watch(100.0, std::chrono::seconds(2)))
        std::printf("%f %f %f\n", sample.time_s, sample.applied_v, sample.estimate_v);
    link.disarm();
} catch (const vsj::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
