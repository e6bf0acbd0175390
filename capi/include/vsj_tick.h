/* The controller of a variable-stiffness spring: one tick, as the amplifier's microcontroller runs it, bit for bit.
 *
 * No heap, no global state, no floating point in a tick. Configuration and state are memory that you provide; both may be copied
 * by assignment. Different states may be used by different threads; a configuration is only read by a tick.
 *
 *     vsj_settings settings;
 *     vsj_config config;
 *     vsj_state state;
 *     vsj_error error;
 *     vsj_input input = {0};
 *     vsj_output output;
 *
 *     vsj_paper(&settings);                                    // or `vsj export c`, for another spring
 *     if (vsj_configure(&config, &settings, &error) != VSJ_OK) { ... error.field, error.lowest, error.highest ... }
 *     vsj_start(&config, &state);
 *     // in a timer's interrupt, settings.rate_hz times a second:
 *     vsj_from_volts(300.0, &input.target);
 *     vsj_tick(&config, &state, &input, &output);
 *     // write output.code to the DAC
 *
 * Voltages, and stiffness as the equivalent static voltage, are integers in steps of 2^-20 V (0.95 uV), within +-2048 V.
 */
#ifndef VSJ_TICK_H
#define VSJ_TICK_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What a function returns. With every status but VSJ_OK its outputs are as they were; a configuration that vsj_configure has
 * refused is not configured. */
typedef int32_t vsj_status;
enum {
    VSJ_OK = 0,
    VSJ_OUT_OF_RANGE = 1,   /* a setting or a voltage is outside of its range */
    VSJ_NULL = 2,           /* a pointer is null */
    VSJ_NOT_CONFIGURED = 3, /* vsj_configure has not succeeded on this configuration */
    VSJ_NOT_STARTED = 4     /* vsj_start has not succeeded on this state, or with the other kind of spring */
};

/* The pre-compensator. */
enum {
    VSJ_NONE = 0,  /* the target is the voltage */
    VSJ_PAPER = 1, /* proportional-integral, of the source report */
    VSJ_FAST = 2,  /* time-optimal */
    VSJ_ROBUST = 3 /* as fast as a spring allows that is known to within errors */
};

/* Bits of vsj_output.limits. */
enum {
    VSJ_LIMIT_UPPER = 1, /* the voltage was held at the upper end of the range */
    VSJ_LIMIT_LOWER = 2, /* the voltage was held at the lower end of the range */
    VSJ_LIMIT_SLEW = 4,  /* the change of the voltage was held to slew_v_per_s */
    VSJ_LIMIT_TARGET = 8 /* the target was outside the range and was moved to its end */
};

/* Lengths of lists. */
#define VSJ_MAX_LAGS 4
#define VSJ_MAX_PLAYS 8
#define VSJ_MAX_POINTS 9

/* The spring that the estimator runs, with the keys of a plant file. What is 0 is absent. */
typedef struct vsj_spring {
    double share;                         /* part of a change that is instantaneous, 0 to 0.9 (10 with other parts) */
    double tau_s[VSJ_MAX_LAGS];           /* time constants, two ticks to 10 000 s */
    double weights[VSJ_MAX_LAGS];         /* weight of each; 0 for a single one with the weight 1 - share */
    double tau_high_s;                    /* first time constant at 500 V, s; 0: constant */
    double direct;                        /* hysteresis: weight of the voltage itself */
    double thresholds_v[VSJ_MAX_PLAYS];   /* hysteresis: half the width of each play operator, 0 to 1000 V */
    double play_weights[VSJ_MAX_PLAYS];   /* hysteresis: weight of each play operator */
    double law_voltage_v[VSJ_MAX_POINTS]; /* static law: voltages of its points, the first 0 V, to 1000 V */
    double law_stiffness[VSJ_MAX_POINTS]; /* static law: stiffness at each, V; the first 0 */
    double leakage_share;                 /* leakage: part that is finally lost, 0 to 1 */
    double leakage_tau_s;                 /* leakage: time constant, 100 ticks to 1e5 s; 0: no leakage */
    uint32_t lags;                        /* number of time constants, 1 to 4 */
    uint32_t plays;                       /* number of play operators, 0 to 8; with direct 0: no hysteresis */
    uint32_t points;                      /* number of points, 2 to 9; 0: no law */
    uint32_t reserved;
} vsj_spring;

/* A stiffness sensor that corrects the estimate. */
typedef struct vsj_sensor {
    double noise_v;           /* standard deviation of a reading, 0.001 to 100 V; 0: no sensor */
    double model_uncertainty; /* wander of the model's error, 0.001 to 1000 V per root second */
    double fastest_s;         /* shortest time constant of the correction, 0 to 100 s */
    double interval_s;        /* time between two readings, one tick to 0.1 s */
    double oldest_s;          /* age above which a reading is stale, 0 to 31 ticks, s */
    double lowest_v;          /* lowest value that the sensor can give, -1000 to 990 V */
    double highest_v;         /* highest value, lowest_v + 1 V to 1000 V */
    double fade_s;            /* time constant with which the correction fades without trust, two ticks to 100 s */
} vsj_sensor;

/* How well VSJ_ROBUST knows the spring; all are parts, both ways. */
typedef struct vsj_margin {
    double time_constant; /* error of all time constants, 0 to 0.25 */
    double share;         /* error of the share, 0 to 0.25 */
    double gain;          /* error of the gain, 0 to 0.25 */
    double overshoot;     /* overshoot that is allowed on any of these springs, as a part of the step, 0 to 0.2 */
    double fall_back;     /* part of a step that all springs may lose for a while, to be in the band earlier, 0 to 0.5 */
} vsj_margin;

/* Everything that a controller is built from. */
typedef struct vsj_settings {
    double rate_hz;      /* ticks per second, 100 to 10 000 */
    double full_scale_v; /* voltage at the DAC's highest code, 50 to 1000 V */
    double min_v;        /* lowest voltage, 0 V to 10 V below full_scale_v */
    double max_v;        /* highest voltage, min_v + 10 V to full_scale_v */
    double slew_v_per_s; /* fastest change of the voltage, 1 to 1e9 V/s; 0: not limited */
    double kp;           /* proportional gain of VSJ_PAPER, 0.001 to 100 */
    double ki;           /* integral gain of VSJ_PAPER, 1/s */
    double approach_s;   /* time constant of the approach of VSJ_FAST, 0 to 1 s */
    uint32_t dac_bits;   /* width of the DAC, 8 to 16 bits */
    uint32_t controller; /* VSJ_NONE, VSJ_PAPER, VSJ_FAST or VSJ_ROBUST */
    vsj_spring spring;
    vsj_sensor sensor;
    vsj_margin margin;
} vsj_settings;

/* A refused setting: field = value is not allowed, expected lowest to highest unit. */
typedef struct vsj_error {
    char field[32];
    double value;
    double lowest;
    double highest;
    char unit[64];
} vsj_error;

/* The settings in fixed point, made by vsj_configure. */
typedef struct vsj_config {
    uint64_t opaque[144];
} vsj_config;

/* What changes from tick to tick, made by vsj_start. */
typedef struct vsj_state {
    uint64_t opaque[64];
} vsj_state;

typedef struct vsj_input {
    int32_t target;       /* desired stiffness, 2^-20 V */
    int32_t reading;      /* latest reading of the sensor, 2^-20 V */
    uint16_t reading_age; /* whole ticks since the sensor sampled; 0: after the last tick */
    uint16_t has_reading; /* 0: no reading */
} vsj_input;

typedef struct vsj_output {
    int32_t target;    /* the target, moved into the range, 2^-20 V */
    int32_t voltage;   /* voltage before rounding to a code, 2^-20 V */
    int32_t applied;   /* voltage of the code, 2^-20 V */
    int32_t stiffness; /* estimated stiffness just after the voltage was applied, 2^-20 V */
    uint16_t code;     /* to be written to the DAC */
    uint8_t limits;    /* VSJ_LIMIT_... */
    uint8_t sensor;    /* 0: none, 1: trusted, 2: absent, 3: stale, 4: stuck, 5: jumping, 6: out of range */
} vsj_output;

/* Puts the report's spring, controller and range at 1 kHz into settings. */
vsj_status vsj_paper(vsj_settings *settings);

/* Checks settings and makes config of them, off the hot path: it computes in doubles. Fills error, which may be null, if a setting
 * is refused: VSJ_OUT_OF_RANGE. */
vsj_status vsj_configure(vsj_config *config, const vsj_settings *settings, vsj_error *error);

/* Puts a spring at rest at 0 V into state. */
vsj_status vsj_start(const vsj_config *config, vsj_state *state);

/* One tick, 1 / rate_hz after the last one. */
vsj_status vsj_tick(const vsj_config *config, vsj_state *state, const vsj_input *input, vsj_output *output);

/* One tick with the amplifier off: 0 V whatever slew and range are. Only the reading of input is used. Call vsj_transfer before the
 * next vsj_tick. */
vsj_status vsj_off(const vsj_config *config, vsj_state *state, const vsj_input *input, vsj_output *output);

/* Makes config take over a running state without moving the voltage, after a change of settings or after vsj_off; target is that
 * of the next tick. */
vsj_status vsj_transfer(const vsj_config *config, vsj_state *state, int32_t target);

/* The lowest and the highest voltage that is put out, 2^-20 V. */
vsj_status vsj_range(const vsj_config *config, int32_t *lowest, int32_t *highest);

/* Rounds volts, within +-2000 V, to steps of 2^-20 V. */
vsj_status vsj_from_volts(double volts, int32_t *steps);

/* Converts steps of 2^-20 V to V, exactly. */
double vsj_to_volts(int32_t steps);

/* A line of text. */
typedef struct vsj_text {
    char line[200];
} vsj_text;

/* Puts the error of settings into text, as `vsj` prints it; an empty line without one. Not in the library for a microcontroller. */
vsj_status vsj_explain(const vsj_settings *settings, vsj_text *text);

#ifdef __cplusplus
}
#endif

#endif
