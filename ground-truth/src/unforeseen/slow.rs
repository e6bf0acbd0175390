//! Changes over the record: softening, steps of gain and offset, temperature, clocks.

use std::f64::consts::TAU;

use super::law::{Clock, Law, PLAIN};
use crate::out_of_model::chain::{Chain, Stage, paper};
use crate::out_of_model::draw::Draw;

/// Laws of slow changes and of time stamps.
pub const LAWS: [Law; 7] = [
    Law {
        name: "softening by travel",
        first: &["drift"],
        also: &["gain-error"],
        law: "y (1 - a (1 - exp(-s/S))), s the sum of |du|, S 2 to 6 times full scale, a 0.1 to 0.25",
        source: "Mullins, Softening of rubber by deformation, Rubber Chem. Technol. 42, 1969",
        build: softening,
        ..PLAIN
    },
    Law {
        name: "gain that steps",
        first: &["drift", "gain-error"],
        law: "y, from t0 on y (1 + a), t0 0.25 to 0.75 of the record, a 0.05 to 0.15 either way",
        source: "Basseville, Nikiforov, Detection of Abrupt Changes, 1993",
        build: gain_step,
        ..PLAIN
    },
    Law {
        name: "offsets that step",
        first: &["reading-offset"],
        also: &["drift"],
        law: "y + b_i in the i-th of 4 to 6 stretches, b_i within 15 V, the first 0",
        source: "Basseville, Nikiforov, Detection of Abrupt Changes, 1993",
        build: offset_steps,
        ..PLAIN
    },
    Law {
        name: "temperature on the gain",
        first: &["drift", "hum"],
        law: "y (1 + a sin(2 pi t/P)), a 0.03 to 0.08, P 0.25 to 0.8 of the record",
        source: "Fraden, Handbook of Modern Sensors: thermal sensitivity shift",
        build: warm_gain,
        ..PLAIN
    },
    Law {
        name: "temperature on the zero",
        first: &["hum", "drift"],
        also: &["reading-offset"],
        law: "y + b sin(2 pi t/P), b 6 to 15 V, P 0.25 to 0.8 of the record",
        source: "Fraden, Handbook of Modern Sensors: thermal zero shift",
        build: warm_zero,
        ..PLAIN
    },
    Law {
        name: "clock that drifts",
        first: &["time-constant"],
        also: &["drift", "delay"],
        law: "time stamps t + e t^2/(2 T), T the record's length, e 0.2 to 0.5 either way",
        source: "Allan, Time and frequency characterization of clocks, IEEE Trans. UFFC 34, 1987",
        needs_steps: true,
        clock: Some(drifting),
        ..PLAIN
    },
    Law {
        name: "clock that jitters",
        first: &["delay", "outliers"],
        or_none: true,
        law: "time stamps off by up to 0.45 rows either way, independently",
        source: "Marvasti, Nonuniform Sampling: Theory and Practice, 2001",
        needs_steps: true,
        clock: Some(jittering),
        ..PLAIN
    },
];

fn softening(draw: &mut Draw) -> Chain {
    let (a, scale) = (draw.sized(0.1, 0.25), draw.full_v * draw.between(2.0, 6.0));
    let (mut paper, mut travel, mut last) = (paper(), 0.0, 0.0);
    Chain::of(Box::new(move |u: f64, now| {
        travel += (u - last).abs();
        last = u;
        paper(u, now) * (1.0 + a * (-travel / scale).exp_m1())
    }))
}

/// A stage that does not depend on the state: reading from response in V and time in s.
pub(crate) fn of_time(f: impl Fn(f64, f64) -> f64 + 'static) -> Stage {
    Box::new(move |y, now| f(y, now.t))
}

fn gain_step(draw: &mut Draw) -> Chain {
    let (start, a) = (draw.duration_s * draw.between(0.25, 0.75), draw.signed(0.05, 0.15));
    Chain::after(of_time(move |y, t| if t < start { y } else { y * (1.0 + a) }))
}

fn offset_steps(draw: &mut Draw) -> Chain {
    let ends: Vec<f64> = {
        let count = draw.between(3.0, 6.0) as usize;
        let mut ends: Vec<f64> = (0..count).map(|_| draw.duration_s * draw.between(0.08, 0.95)).collect();
        ends.sort_by(f64::total_cmp);
        ends
    };
    let offsets: Vec<f64> = ends.iter().map(|_| draw.signed(5.0, 15.0)).collect();
    Chain::reading(of_time(move |y, t| {
        let passed = ends.partition_point(|&end| end <= t);
        y + if passed == 0 { 0.0 } else { offsets[passed - 1] }
    }))
}

fn warm_gain(draw: &mut Draw) -> Chain {
    let (a, period, phase) =
        (draw.sized(0.03, 0.08), draw.duration_s * draw.between(0.25, 0.8), draw.between(0.0, TAU));
    Chain::after(of_time(move |y, t| y * (1.0 + a * (TAU * t / period + phase).sin())))
}

fn warm_zero(draw: &mut Draw) -> Chain {
    let (b, period, phase) = (draw.sized(6.0, 15.0), draw.duration_s * draw.between(0.25, 0.8), draw.between(0.0, TAU));
    Chain::reading(of_time(move |y, t| y + b * (TAU * t / period + phase).sin()))
}

fn drifting(draw: &mut Draw) -> Clock {
    let (e, length) = (draw.signed(0.2, 0.5), draw.duration_s);
    Box::new(move |t| t + 0.5 * e * t * t / length)
}

fn jittering(draw: &mut Draw) -> Clock {
    let (most, mut random) = (draw.size * 0.45 * draw.every_s, draw.fork());
    Box::new(move |t| t + most * rand::RngExt::random_range(&mut random, -1.0..1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unforeseen::tests::draw;

    #[test]
    fn time_stamps_increase_and_are_off_by_as_much_as_stated() {
        for clock in [drifting, jittering] {
            let mut source = draw(1.0);
            let (every, rows) = (source.every_s, (source.duration_s / source.every_s) as u32);
            let mut clock = clock(&mut source);
            let written: Vec<f64> = (0..rows).map(|k| clock(every * f64::from(k))).collect();
            assert!(written.is_sorted_by(|a, b| a < b));
            let off = written.iter().enumerate().map(|(k, t)| (t - every * k as f64).abs()).fold(0.0, f64::max);
            assert!(off > 0.4 * every, "{off}");
        }
        assert_eq!(drifting(&mut draw(0.0))(3.0), 3.0);
    }
}
