/* The whole tick in float64, as `tick` in rivals.py: `cargo xtask bench` compiles it with cc -O3 -march=native. */
#include <stdint.h>

/* Settings of the loop. */
typedef struct {
    double share, relaxation, proportional, reset, limit_v, step_v, dac_steps;
} settings;

void tick(const settings *it, const double *targets, int64_t samples, double *stiffness, uint16_t *codes) {
    const double g = 1 / (1 + it->proportional * it->share), error_gain = it->proportional * g;
    const double codes_per_volt = it->dac_steps / it->limit_v, volts_per_code = it->limit_v / it->dac_steps;
    double w = 0, z = 0, voltage = 0;
    for (int64_t k = 0; k < samples; ++k) {
        double target = targets[k];
        target = target < 0 ? 0 : target;
        target = target > it->limit_v ? it->limit_v : target;
        double wanted = z + (1 - g) * w + error_gain * (target - w);
        wanted = wanted < voltage - it->step_v ? voltage - it->step_v : wanted;
        wanted = wanted > voltage + it->step_v ? voltage + it->step_v : wanted;
        wanted = wanted < 0 ? 0 : wanted;
        voltage = wanted > it->limit_v ? it->limit_v : wanted;
        z += it->reset * (g * voltage - z);
        int32_t code = (int32_t)(voltage * codes_per_volt + 0.5);
        double applied = code * volts_per_code;
        codes[k] = (uint16_t)code;
        stiffness[k] = w + it->share * (applied - w);
        w += it->relaxation * (applied - w);
    }
}
