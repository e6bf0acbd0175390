//! Which image: who leads the spring, behind which amplifier; each has a name of its own.

use firmware::settings::{self, KILOVOLT};
use model::{Amplifier, Settings};

/// Who leads the spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Controller {
    /// The paper's
    Paper,
    /// The time-optimal one, in an image of its own
    Fast,
}

impl Controller {
    pub(crate) const ALL: [Self; 2] = [Self::Paper, Self::Fast];

    /// Of the firmware's, that it needs.
    pub(crate) const fn features(self) -> &'static [&'static str] {
        match self {
            Self::Paper => &[],
            Self::Fast => &["fast"],
        }
    }
}

/// How far the amplifier goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Limit {
    /// The report's range
    #[value(name = "700")]
    Paper,
    /// In an image of its own
    #[value(name = "1000")]
    Kilovolt,
}

impl Limit {
    const ALL: [Self; 2] = [Self::Paper, Self::Kilovolt];

    const fn features(self) -> &'static [&'static str] {
        match self {
            Self::Paper => &[],
            Self::Kilovolt => &["kilovolt"],
        }
    }

    const fn amplifier(self) -> Amplifier {
        match self {
            Self::Paper => Amplifier::PAPER,
            Self::Kilovolt => KILOVOLT,
        }
    }
}

/// One of the images; as the options of commands that are for one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::Args)]
pub(crate) struct Variant {
    /// Who leads the spring
    #[arg(long, value_enum, default_value = "paper")]
    pub(crate) controller: Controller,
    /// Highest voltage of the amplifier, in V
    #[arg(long, value_enum, default_value = "700", value_name = "V")]
    limit_v: Limit,
}

impl Variant {
    /// Two that between them have every controller and every amplifier.
    pub(crate) const BOOTED: [Self; 2] =
        [Self::of(Controller::Paper), Self { controller: Controller::Fast, limit_v: Limit::Kilovolt }];

    /// With the report's amplifier.
    pub(crate) const fn of(controller: Controller) -> Self {
        Self { controller, limit_v: Limit::Paper }
    }

    /// All that are not this one.
    pub(crate) fn others(self) -> impl Iterator<Item = Self> {
        let each = |controller| Limit::ALL.map(|limit_v| Self { controller, limit_v });
        Controller::ALL.into_iter().flat_map(each).filter(move |other| *other != self)
    }

    /// Of the firmware's, that it needs.
    pub(crate) fn features(self) -> Vec<&'static str> {
        [self.controller.features(), self.limit_v.features()].concat()
    }

    /// What such an image runs.
    pub(crate) const fn settings(self) -> Settings {
        let amplifier = self.limit_v.amplifier();
        match self.controller {
            Controller::Paper => settings::paper(amplifier),
            Controller::Fast => settings::fast(amplifier),
        }
    }

    /// The controller, as logs and the link name it.
    pub(crate) const fn leader(self) -> link::Controller {
        link::Controller::of(&self.settings().compensation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, FromArgMatches};

    fn parse(line: &str) -> Result<Variant, clap::Error> {
        let command = Variant::augment_args(clap::Command::new("image").no_binary_name(true));
        Variant::from_arg_matches(&command.try_get_matches_from(line.split_whitespace())?)
    }

    #[test]
    fn options_lead_to_features() {
        for (line, features) in [
            ("", &[][..]),
            ("--limit-v 700", &[]),
            ("--controller fast", &["fast"]),
            ("--controller fast --limit-v 1000", &["fast", "kilovolt"]),
        ] {
            assert_eq!(parse(line).unwrap().features(), features, "{line}");
        }
        let error = parse("--limit-v 850").unwrap_err().to_string();
        assert!(error.contains("850") && error.contains("[possible values: 700, 1000]"), "{error}");
    }

    #[test]
    fn no_choice_is_left_unbooted() {
        let booted = |choice: &dyn Fn(Variant) -> bool| Variant::BOOTED.into_iter().any(choice);
        assert!(Controller::ALL.into_iter().all(|controller| booted(&|it| it.controller == controller)));
        assert!(Limit::ALL.into_iter().all(|limit_v| booted(&|it| it.limit_v == limit_v)));
    }

    /// An image that is named for another amplifier and drives the same would be taken for it.
    #[test]
    fn each_image_answers_a_target_with_codes_of_its_own() {
        let codes = |variant: Variant| {
            let config = variant.settings().validate().unwrap().quantize();
            let (lowest, highest) = config.range();
            let mut state = model::State::default();
            let target = model::Volts::new(200.0).unwrap();
            assert!(lowest < target && target < highest);
            let tick = |_| config.tick(&mut state, model::Input { target, measured: None }).code.0;
            (0..1000).map(tick).collect::<Vec<_>>()
        };
        let variant = Variant::of(Controller::Paper);
        let all: Vec<_> = [variant].into_iter().chain(variant.others()).collect();
        assert_eq!(all.len(), 4);
        for one in all {
            for other in one.others() {
                assert_ne!(codes(one), codes(other), "{one:?}, {other:?}");
            }
        }
    }
}
