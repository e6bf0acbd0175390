//! Random springs in the range of identified ones: each block alone and all together.

use model::Plant;
use proptest::prelude::*;
use simulation::plant_file::{Law, Leakage, Memory, PlantFile, Relaxation};

/// The blocks that a spring has.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Blocks {
    pub(crate) memory: bool,
    pub(crate) law: bool,
    pub(crate) leakage: bool,
    pub(crate) several: bool,
    pub(crate) varying: bool,
}

pub(crate) const NONE: Blocks = Blocks { memory: false, law: false, leakage: false, several: false, varying: false };
pub(crate) const ALL: Blocks = Blocks { memory: true, law: true, leakage: true, several: true, varying: true };
pub(crate) const SETS: [(&str, Blocks); 7] = [
    ("no block", NONE),
    ("memory", Blocks { memory: true, ..NONE }),
    ("law", Blocks { law: true, ..NONE }),
    ("leakage", Blocks { leakage: true, ..NONE }),
    ("several lags", Blocks { several: true, ..NONE }),
    ("varying lag", Blocks { varying: true, ..NONE }),
    ("all together", ALL),
];

prop_compose! {
    fn memory()(plays in prop::collection::vec((0.0..80.0f64, 0.01..1.0f64), 1..=8), direct in 0.3..0.99f64) -> Memory {
        let all: f64 = plays.iter().map(|play| play.1).sum::<f64>() / (1.0 - direct);
        let (thresholds_v, weights) = plays.iter().map(|&(threshold, weight)| (threshold, weight / all)).unzip();
        Memory { direct, thresholds_v, weights }
    }
}

prop_compose! {
    fn law()(lines in prop::collection::vec((20.0..150.0f64, 0.4..1.6f64), 1..=8)) -> Law {
        let (mut voltage_v, mut stiffness, mut at) = (vec![0.0], vec![0.0], (0.0, 0.0));
        for (width, slope) in lines {
            at = (f64::min(at.0 + width, 1000.0), at.1 + width * slope);
            voltage_v.push(at.0);
            stiffness.push(at.1);
        }
        Law { voltage_v, stiffness }
    }
}

prop_compose! {
    fn relaxation(several: bool, varying: bool)(
        share in 0.0..0.4f64,
        lags in prop::collection::vec((-0.3..1.7f64, 0.1..1.0f64), if several { 2..=4 } else { 1..=1 }),
        gain in 0.8..1.2f64,
        ratio in -0.5..0.5f64,
    ) -> Relaxation {
        let all: f64 = lags.iter().map(|lag| lag.1).sum::<f64>() / (gain - share);
        let tau_s: Vec<f64> = lags.iter().map(|lag| 10f64.powf(lag.0)).collect();
        let weights = if several { lags.iter().map(|lag| lag.1 / all).collect() } else { Vec::new() };
        let tau_high_s = varying.then_some(tau_s[0] * 10f64.powf(ratio));
        Relaxation { share, tau_s, weights, tau_high_s, tau_high_at_v: None }
    }
}

prop_compose! {
    pub(crate) fn plant(blocks: Blocks)(
        memory in memory(),
        law in law(),
        (share, tau) in (0.0..0.4f64, 0.7..2.3f64),
        relaxation in relaxation(blocks.several, blocks.varying),
    ) -> PlantFile {
        PlantFile {
            memory: blocks.memory.then_some(memory),
            law: blocks.law.then_some(law),
            leakage: blocks.leakage.then_some(Leakage { share, tau_s: 10f64.powf(tau) }),
            relaxation,
            ..Plant::PAPER.into()
        }
    }
}
