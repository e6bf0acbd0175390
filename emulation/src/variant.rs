//! What the image of a variant runs.

use std::ops::RangeInclusive;

use firmware::settings::{self, KILOVOLT};
use model::{Amplifier, Settings};
use xtask::variant::{Controller, Limit, Variant};

/// The settings of the controller in the image.
pub(crate) const fn settings(variant: Variant) -> Settings {
    let amplifier = match variant.limit_v {
        Limit::Paper => Amplifier::PAPER,
        Limit::Kilovolt => KILOVOLT,
    };
    match variant.controller {
        Controller::Paper => settings::paper(amplifier),
        Controller::Fast => settings::fast(amplifier),
        Controller::Robust => settings::robust(amplifier),
    }
}

/// The number of instructions that a control tick with voltage may need, at least and at most, supervisor included. The
/// ends are 5 % beyond those that were measured: 304 to 337 with the paper's controller, 374 to 404 with the fast and 430 to 478 with the
/// robust one, whatever the amplifier's limit.
pub(crate) const fn instructions(variant: Variant) -> RangeInclusive<u64> {
    match variant.controller {
        Controller::Paper => 289..=354,
        Controller::Fast => 355..=424,
        Controller::Robust => 409..=502,
    }
}

/// The controller, as logs and the link name it.
pub(crate) const fn controller(variant: Variant) -> link::Controller {
    link::Controller::of(&settings(variant).compensation)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image that is named after another amplifier but drives the same codes could be confused with it.
    #[test]
    fn each_variant_answers_a_target_with_other_codes() {
        let codes = |variant: Variant| {
            let config = settings(variant).validate().unwrap().quantize();
            let (lowest, highest) = config.range();
            let mut state = model::State::default();
            let target = model::Volts::new(200.0).unwrap();
            assert!(lowest < target && target < highest);
            let tick = |_| config.tick(&mut state, model::Input { target, measured: None }).code.0;
            // The amplifier of 700 V is at its limit for the first 1.3 s.
            (0..3000).map(tick).collect::<Vec<_>>()
        };
        let variant = Variant::of(Controller::Paper);
        let all: Vec<_> = [variant].into_iter().chain(variant.others()).collect();
        assert_eq!(all.len(), 6);
        for one in all {
            for other in one.others() {
                assert_ne!(codes(one), codes(other), "{one:?}, {other:?}");
            }
        }
    }
}
