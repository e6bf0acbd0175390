//! Sensor and converter laws: saturation and quantisation.

use rand::RngExt;

use super::chain::Chain;
use super::draw::Draw;
use super::form::Form;
use crate::cause::Cause;

/// Forms of sensor saturation and quantisation.
pub const FORMS: [Form; 6] = [
    Form {
        cause: Cause::SensorSaturation,
        name: "soft",
        or: &[],
        also: &[Cause::StaticNonlinearity],
        law: "y/(1 + (y/L)^p)^(1/p) of the noisy reading, p 10 to 20",
        source: "Rapp, Effects of HPA-nonlinearity on a 4-DPSK/OFDM signal, 1991: the same law for any stage",
        build: soft,
    },
    Form {
        cause: Cause::SensorSaturation,
        name: "noise behind the bound",
        or: &[],
        also: &[],
        law: "min(y, L) + noise: the preamplifier clips, the converter adds its noise",
        source: "Horowitz, Hill, The Art of Electronics: a clipping preamplifier",
        build: clipped_first,
    },
    Form {
        cause: Cause::SensorSaturation,
        name: "floor",
        or: &[],
        also: &[],
        law: "max(y, L), L 0.12 to 0.3 of the largest stiffness: below its preload the cell reads nothing",
        source: "Fraden, Handbook of Modern Sensors: dead band and span",
        build: floor,
    },
    Form {
        cause: Cause::Quantisation,
        name: "uneven codes",
        or: &[],
        also: &[],
        law: "codes k step, their thresholds off by up to 0.4 steps (differential nonlinearity)",
        source: "IEEE Std 1241: terminology and test methods for analog-to-digital converters",
        build: uneven,
    },
    Form {
        cause: Cause::Quantisation,
        name: "missing codes",
        or: &[],
        also: &[],
        law: "round(y/step) step with steps of 6 to 12 V, every fourth code is read as the one below",
        source: "IEEE Std 1241: missing codes of a successive-approximation converter",
        build: missing,
    },
    Form {
        cause: Cause::Quantisation,
        name: "send on delta",
        or: &[],
        also: &[],
        law: "the last reading is repeated until the stiffness is 8 to 20 V from it",
        source: "Miskowicz, Send-on-delta concept, Sensors 6, 2006",
        build: send_on_delta,
    },
];

fn bound(draw: &mut Draw) -> f64 {
    draw.top_v * draw.between(0.6, 0.92)
}

fn soft(draw: &mut Draw) -> Chain {
    let (limit, p) = (bound(draw), draw.between(10.0, 20.0));
    Chain::reading(Box::new(move |y, _| if y > 0.0 { y / (1.0 + (y / limit).powf(p)).powf(1.0 / p) } else { y }))
}

fn clipped_first(draw: &mut Draw) -> Chain {
    let limit = bound(draw);
    Chain::after(Box::new(move |y, _| y.min(limit)))
}

fn floor(draw: &mut Draw) -> Chain {
    let limit = draw.top_v * draw.between(0.12, 0.3);
    Chain::reading(Box::new(move |y, _| y.max(limit)))
}

fn uneven(draw: &mut Draw) -> Chain {
    let step = draw.between(7.0, 20.0);
    let codes = (1.5 * draw.full_v / step) as usize;
    // Thresholds start below 0 V; code `first` is at 0 V.
    let first = 20;
    let thresholds: Vec<f64> = (0..codes + first)
        .map(|k| step * (k as f64 - first as f64 + 0.5 + draw.random.random_range(-0.4..0.4)))
        .collect();
    Chain::reading(Box::new(move |y, _| {
        (thresholds.partition_point(|&threshold| threshold <= y) as f64 - first as f64) * step
    }))
}

fn missing(draw: &mut Draw) -> Chain {
    let step = draw.between(6.0, 12.0);
    Chain::reading(Box::new(move |y, _| {
        let code = (y / step).round();
        step * if code.rem_euclid(4.0) == 3.0 { code - 1.0 } else { code }
    }))
}

fn send_on_delta(draw: &mut Draw) -> Chain {
    let delta = draw.between(8.0, 20.0);
    let mut sent: Option<f64> = None;
    Chain::reading(Box::new(move |y, _| {
        let keep = sent.filter(|sent| (y - sent).abs() < delta).unwrap_or(y);
        sent = Some(keep);
        keep
    }))
}
