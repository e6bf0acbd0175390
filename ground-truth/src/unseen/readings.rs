//! Readings: converters, periodic disturbances, single readings that are off.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

use crate::out_of_model::chain::{Chain, Now};
use crate::out_of_model::draw::Draw;
use crate::unforeseen::law::{Law, PLAIN};

/// Laws of the readings.
pub const LAWS: [Law; 10] = [
    Law {
        name: "ranges of a converter",
        first: &["quantisation"],
        law: "rounded to steps of 1.5 to 3 V up to R, which double at R, 2 R, 4 R, ...; R 60 to 100 V",
        source: "Kester (editor), The Data Conversion Handbook, 2005: auto-ranging and floating-point converters",
        build: ranges,
        ..PLAIN
    },
    Law {
        name: "period counter",
        first: &["quantisation"],
        law: "K/n - 200 V, n = round(K/(y + 200 V)), K 20 to 40 kV^2: steps of 1 to 2 V at 0 V and 12 to 25 V at 500 V",
        source: "Kalisz, Review of methods for time interval measurements with picosecond resolution, Metrologia 41, 2004",
        build: period_counter,
        ..PLAIN
    },
    Law {
        name: "dither",
        first: &["quantisation"],
        law: "step round(y/step + r), r uniform from -0.5 to 0.5, step 8 to 16 V",
        source: "Lipshitz, Wannamaker, Vanderkooy, Quantization and dither, J. Audio Eng. Soc. 40, 1992",
        build: dither,
        ..PLAIN
    },
    Law {
        name: "delta modulator",
        first: &["quantisation"],
        also: &["delay", "series-lag"],
        law: "the reading goes up or down by 4 to 8 V in every row, towards the response",
        source: "de Jager, Delta modulation, Philips Res. Rep. 7, 1952",
        build: delta_modulator,
        ..PLAIN
    },
    Law {
        name: "mains whose phase wanders",
        first: &["hum"],
        law: "y + a sin(2 pi f t + p), p a random walk of 0.03 to 0.12 in each row, a 5 to 10 V, f 0.3 Hz to 0.3 of the sampling rate",
        source: "Leeson, A simple model of feedback oscillator noise spectrum, Proc. IEEE 54, 1966",
        build: wandering_phase,
        ..PLAIN
    },
    Law {
        name: "ripple by the duty",
        first: &["hum"],
        law: "y + 4 a d (1 - d) sin(2 pi f t + p), d = y/full scale, a 6 to 14 V, f 0.3 Hz to 0.3 of the sampling rate",
        source: "Holmes, Lipo, Pulse Width Modulation for Power Converters, 2003",
        build: duty_ripple,
        ..PLAIN
    },
    Law {
        name: "pump that is switched on",
        first: &["hum"],
        law: "y + a sin(2 pi f t) in a stretch of 0.35 to 0.6 of the record, a 5 to 12 V, f 0.3 Hz to 0.3 of the sampling rate",
        source: "Randall, Vibration-based Condition Monitoring, 2011",
        build: pump,
        ..PLAIN
    },
    Law {
        name: "loose contact",
        // `stuck-sensor` became a cause after the first run.
        first: &["stuck-sensor", "outliers", "reading-offset"],
        law: "0 V in 4 to 9 stretches of 3 to 15 rows",
        source: "Slade, Electrical Contacts, 2014: intermittences",
        build: loose_contact,
        ..PLAIN
    },
    Law {
        name: "hits that decay",
        first: &["outliers"],
        law: "in 0.3 to 1 % of the rows a pulse of 20 to 60 V of one sign begins, which decays with 1 to 3 rows",
        source: "Rice, Mathematical analysis of random noise, Bell Syst. Tech. J. 23, 1944: shot effect",
        build: hits,
        ..PLAIN
    },
    Law {
        name: "glitch of a code",
        first: &["outliers"],
        law: "within 2 to 4 V of the levels b + k c, every other reading at random is off by 20 to 50 V; c 90 to 140 V, b below c",
        source: "Kester (editor), The Data Conversion Handbook, 2005: glitches at major carries",
        build: glitch,
        ..PLAIN
    },
];

/// The paper's spring with a sensor `f` of the noisy stiffness, mixed as (1 - size) y + size f(y), so that codes are exact at size 1.
pub(super) fn sensor(draw: &Draw, mut f: impl FnMut(f64, Now) -> f64 + 'static) -> Chain {
    let size = draw.size;
    Chain::reading(Box::new(move |y, now| (1.0 - size) * y + size * f(y, now)))
}

fn ranges(draw: &mut Draw) -> Chain {
    let (finest, range) = (draw.between(1.5, 3.0), draw.between(60.0, 100.0));
    sensor(draw, move |y, _| {
        let doublings = (y.abs() / range).max(0.5).log2().floor() + 1.0;
        let step = finest * doublings.exp2();
        (y / step).round() * step
    })
}

fn period_counter(draw: &mut Draw) -> Chain {
    const OFFSET_V: f64 = 200.0;
    let clock = draw.between(20e3, 40e3);
    sensor(draw, move |y, _| clock / (clock / (y + OFFSET_V)).round() - OFFSET_V)
}

fn dither(draw: &mut Draw) -> Chain {
    let (step, mut random) = (draw.between(8.0, 16.0), draw.fork());
    sensor(draw, move |y, _| step * (y / step + random.random_range(-0.5..0.5)).round())
}

fn delta_modulator(draw: &mut Draw) -> Chain {
    let (step, mut level) = (draw.between(4.0, 8.0), 0i32);
    sensor(draw, move |y, _| {
        level += if y > step * f64::from(level) { 1 } else { -1 };
        step * f64::from(level)
    })
}

/// A random frequency, in Hz: 0.3 Hz to 0.3 of the sampling rate.
fn frequency(draw: &mut Draw) -> f64 {
    let fastest = (0.3 / draw.every_s).max(0.6);
    draw.log_between(0.3, fastest)
}

fn wandering_phase(draw: &mut Draw) -> Chain {
    let (a, hertz, sigma) = (draw.between(5.0, 10.0), frequency(draw), draw.between(0.03, 0.12));
    let (mut phase, mut random) = (draw.between(0.0, TAU), draw.fork());
    sensor(draw, move |y, now| {
        let step: f64 = StandardNormal.sample(&mut random);
        phase += sigma * step;
        y + a * (TAU * hertz * now.t + phase).sin()
    })
}

fn duty_ripple(draw: &mut Draw) -> Chain {
    let (a, hertz, phase, full_v) = (draw.between(6.0, 14.0), frequency(draw), draw.between(0.0, TAU), draw.full_v);
    sensor(draw, move |y, now| {
        let duty = (y / full_v).clamp(0.0, 1.0);
        y + 4.0 * a * duty * (1.0 - duty) * (TAU * hertz * now.t + phase).sin()
    })
}

fn pump(draw: &mut Draw) -> Chain {
    let (a, hertz) = (draw.between(5.0, 12.0), frequency(draw));
    let length = draw.between(0.35, 0.6);
    let from = draw.between(0.05, 0.95 - length);
    let [from, to] = [from, from + length].map(|part| part * draw.duration_s);
    sensor(draw, move |y, now| if (from..to).contains(&now.t) { y + a * (TAU * hertz * now.t).sin() } else { y })
}

fn loose_contact(draw: &mut Draw) -> Chain {
    let count = draw.random.random_range(4..=9u32);
    let stretches: Vec<(f64, f64)> = (0..count)
        .map(|_| {
            let from = draw.duration_s * draw.between(0.05, 0.95);
            (from, from + draw.every_s * draw.between(3.0, 15.0))
        })
        .collect();
    sensor(draw, move |y, now| if stretches.iter().any(|&(from, to)| (from..to).contains(&now.t)) { 0.0 } else { y })
}

fn hits(draw: &mut Draw) -> Chain {
    let (part, rows, sign) = (draw.between(0.003, 0.01), draw.between(1.0, 3.0), draw.sign());
    let (mut random, mut pulse) = (draw.fork(), 0.0);
    sensor(draw, move |y, _| {
        pulse *= (-1.0 / rows).exp();
        if random.random_bool(part) {
            pulse += sign * random.random_range(20.0..60.0);
        }
        y + pulse
    })
}

fn glitch(draw: &mut Draw) -> Chain {
    let (near, apart) = (draw.between(2.0, 4.0), draw.between(90.0, 140.0));
    let (first, mut random) = (draw.between(0.0, apart), draw.fork());
    sensor(draw, move |y, _| {
        let off = (y - first).rem_euclid(apart);
        let is_close = off.min(apart - off) < near;
        let error = random.random_range(20.0..50.0) * if random.random_bool(0.5) { 1.0 } else { -1.0 };
        if is_close && random.random_bool(0.5) { y + error } else { y }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Schedule;
    use crate::unforeseen::tests::draw;

    /// Readings of the noiseless stiffness `y`, in V.
    fn read(build: fn(&mut Draw) -> Chain, y: &[f64]) -> Vec<f64> {
        let time_s = (0..y.len()).map(|k| 0.1 * k as f64).collect();
        let schedule = Schedule { time_s, voltage_v: vec![0.0; y.len()] };
        build(&mut draw(1.0)).read(&schedule, y.iter().copied())
    }

    #[test]
    fn steps_of_a_converter_and_of_a_counter_grow_with_the_level() {
        let rising: Vec<f64> = (0..5000).map(|k| 0.1 * f64::from(k)).collect();
        for (build, ratio) in [(ranges as fn(&mut Draw) -> Chain, 4.0..16.1), (period_counter, 6.0..14.0)] {
            let mut codes = read(build, &rising);
            codes.dedup();
            let steps: Vec<f64> = codes.windows(2).map(|pair| pair[1] - pair[0]).collect();
            // The last one of each range may be shorter.
            let (least, most) = (steps[1], steps.iter().copied().fold(0.0, f64::max));
            assert!(ratio.contains(&(most / least)), "{least} {most}");
        }
    }

    #[test]
    fn dither_is_right_on_average() {
        let held = [123.4; 20_000];
        let readings = read(dither, &held);
        let mean = readings.iter().sum::<f64>() / readings.len() as f64;
        assert!((mean - 123.4).abs() < 0.2, "{mean}");
    }
}
